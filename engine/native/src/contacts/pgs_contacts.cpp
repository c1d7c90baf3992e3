#include "contacts/pgs_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "contacts/contact_geometry.hpp"
#include "contacts/disc.hpp"

#define SPOOK_ISA single
#include "contacts/pgs_contact.inl"

namespace spook {

namespace {

PgsInertia inverse_inertia(const Mat6& mass) noexcept {
    const double a = mass[21], b = mass[22], c = mass[23], d = mass[28], e = mass[29], f = mass[35];
    if (b == 0.0 && c == 0.0 && e == 0.0) return {1.0 / a, 0.0, 0.0, 1.0 / d, 0.0, 1.0 / f};
    const double A = d * f - e * e, B = c * e - b * f, C = b * e - c * d;
    const double s = 1.0 / (a * A + b * B + c * C);
    const double D = a * f - c * c, E = b * c - a * e, F = a * d - b * b;
    return {s * A, s * B, s * C, s * D, s * E, s * F};
}

Vec3 add_turn(const Vec6& v, Vec3 arm) noexcept { return linear(v) + cross(angular(v), arm); }

/// Friction whose two directions differ in scale, solved exactly.
struct AnisotropicDisc {
    const double* tangents;
    double operator()(double step, double b1, double b2, double s1, double s2, double bound, double& d1,
                      double& d2) const {
        double z1 = b1 - step * s1, z2 = b2 - step * s2;
        least_on_disc(tangents, b1, b2, s1, s2, bound, z1, z2);
        d1 = z1 - b1, d2 = z2 - b2;
        return length(d1, d2) / step;
    }
};

/// Each direction by itself.
struct Square {
    const double* tangents;
    double operator()(double, double b1, double b2, double s1, double s2, double bound, double& d1,
                      double& d2) const {
        d1 = std::clamp(b1 - s1 / tangents[0], -bound, bound) - b1;
        d2 = std::clamp(b2 - (s2 + tangents[1] * d1) / tangents[2], -bound, bound) - b2;
        return larger(std::abs(d1) * tangents[0], std::abs(d2) * tangents[2]);
    }
};

}  // namespace

void PgsContacts::begin(MixedSystem& system, FrictionModel model) {
    bodies_ = static_cast<int>(system.mass.size());
    inertia_.resize(bodies_ + 1);
    isotropic_ = true;
    for (int b = 0; b < bodies_; ++b) {
        inertia_[b] = inverse_inertia(system.mass[b]);
        isotropic_ = isotropic_ && inertia_[b].is_isotropic();
    }
    inertia_[bodies_] = {};
    if (!system.rows.empty()) joints_.prepare(system, {}, model);
    joints_.bodies().resize(bodies_ + 1);
    for (int b = 0; b < bodies_; ++b) {
        body(b).inverse_mass = 1.0 / system.mass[b][0];
        body(b).inverse_inertia = inertia_[b].xx;
    }
    relaxation_ = 1.0;
    take_momenta(system, model);
}

void PgsContacts::begin_beside(const PgsContacts& other, MixedSystem& system, FrictionModel model,
                               double relaxation) {
    relaxation_ = relaxation;
    bodies_ = other.bodies_;
    isotropic_ = other.isotropic_;
    if (!isotropic_) inertia_ = other.inertia_;
    if (!system.rows.empty()) joints_.prepare(system, {}, model);
    joints_.bodies().resize(bodies_ + 1);
    for (int b = 0; b < bodies_; ++b) {
        body(b).inverse_mass = other.body(b).inverse_mass;
        body(b).inverse_inertia = other.body(b).inverse_inertia;
    }
    take_momenta(system, model);
}

Vec3 PgsContacts::turned(int b, Vec3 moment) const noexcept {
    return isotropic_ ? body(b).inverse_inertia * moment : inertia_[b].turn(moment);
}

void PgsContacts::take_momenta(MixedSystem& system, FrictionModel model) {
    model_ = model;
    for (int b = 0; b < bodies_ && system.rows.empty(); ++b) {
        const Vec6& p = system.momentum[b];
        const Vec3 v = body(b).inverse_mass * linear(p), w = turned(b, angular(p));
        body(b).velocity = {v.x, v.y, v.z, w.x, w.y, w.z};
    }
    body(bodies_) = {};
    contacts_.clear();
    slips_.clear();
    extras_.clear();
    boxes_.clear();
    none_.first = none_.second = bodies_;
}

void PgsContacts::put(const PgsContact& given, int place) {
    PackedContact& c = contacts_[place];
    c.first = given.first >= 0 ? given.first : bodies_;
    c.second = given.second >= 0 ? given.second : bodies_;
    c.normal = given.normal;
    c.first_arm = given.first_arm;
    c.second_arm = given.second_arm;
    c.right = given.right[0];
    const Vec3 first = cross(c.first_arm, c.normal), second = cross(c.second_arm, c.normal);
    c.diagonal = body(c.first).inverse_mass + body(c.second).inverse_mass +
                 (dot(first, turned(c.first, first)) + dot(second, turned(c.second, second))) +
                 given.softness;
    c.inverse_diagonal = c.diagonal > 0.0 ? relaxation_ / c.diagonal : 0.0;
    Vec3 impulse = (c.impulse[0] = given.impulse[0]) * c.normal;
    if (given.friction > 0.0) {
        c.impulse[1] = given.impulse[1], c.impulse[2] = given.impulse[2];
        impulse = impulse + c.impulse[1] * given.tangent + c.impulse[2] * given.across;
    } else {
        c.impulse[1] = c.impulse[2] = 0.0;
    }
    if (given.friction > 0.0 || given.softness != 0.0 || !slips_.empty() || model_ != FrictionModel::cone)
        add_slip(given, place);
    if (c.impulse[0] != 0.0 || c.impulse[1] != 0.0 || c.impulse[2] != 0.0) push(c, impulse);
}

/// What else a contact has, and for the others that they have none of it.
void PgsContacts::add_slip(const PgsContact& given, int place) {
    const PackedContact& c = contacts_[place];
    slips_.resize(contacts_.size());
    PackedFriction& slip = slips_[place];
    slip.tangent = given.tangent;
    slip.friction = given.friction;
    const Vec3 direction[3] = {c.normal, given.tangent, given.across};
    Vec3 first[3], second[3], first_push[3], second_push[3];
    for (int i = 0; i < 3; ++i) {
        first[i] = cross(c.first_arm, direction[i]);
        second[i] = cross(c.second_arm, direction[i]);
        first_push[i] = turned(c.first, first[i]);
        second_push[i] = turned(c.second, second[i]);
    }
    const auto part = [&](int i, int j) {
        return dot(first[i], first_push[j]) + dot(second[i], second_push[j]);
    };
    slip.coupling[0] = part(1, 0);
    slip.coupling[1] = part(2, 0);
    const double inverse_mass = body(c.first).inverse_mass + body(c.second).inverse_mass,
                 along = given.anisotropic ? dot(given.tangent, given.tangent) : 1.0,
                 across = given.anisotropic ? dot(given.across, given.across) : 1.0;
    Box box;
    box.tangents[0] = inverse_mass * along + part(1, 1) + given.slip_softness;
    box.tangents[1] = part(1, 2);
    box.tangents[2] = inverse_mass * across + part(2, 2) + given.slip_softness;
    box.anisotropic = given.anisotropic;
    const double largest = 0.5 * (box.tangents[0] + box.tangents[2]) +
                           length(0.5 * (box.tangents[0] - box.tangents[2]), box.tangents[1]);
    slip.step = largest > 0.0 ? 1.0 / largest : 0.0;

    const bool boxed = model_ != FrictionModel::cone || given.anisotropic || !boxes_.empty();
    const Vec3 third = cross(c.normal, given.tangent);
    const bool plain = given.right[1] == 0.0 && given.right[2] == 0.0 && given.softness == 0.0 &&
                       given.slip_softness == 0.0 && third.x == given.across.x && third.y == given.across.y &&
                       third.z == given.across.z;
    if (plain && !boxed && extras_.empty()) return;
    if (extras_.empty())
        for (std::size_t k = 0; k < slips_.size(); ++k)
            extras_.emplace_back().across = cross(contacts_[k].normal, slips_[k].tangent);
    extras_.resize(contacts_.size());
    extras_[place] = {
        given.across,        given.right[1],
        given.right[2],      given.softness,
        given.slip_softness, given.normal_before >= 0.0 ? given.normal_before : given.impulse[0]};
    if (!boxed) return;
    boxes_.resize(contacts_.size());
    boxes_[place] = box;
}

void PgsContacts::push(const PackedContact& c, Vec3 impulse) noexcept {
    const auto act = [this](int at, Vec3 arm, Vec3 pushed) {
        const Vec3 moved = body(at).inverse_mass * pushed, turn = turned(at, cross(arm, pushed));
        const double change[6] = {moved.x, moved.y, moved.z, turn.x, turn.y, turn.z};
        for (int i = 0; i < 6; ++i) body(at).velocity[i] += change[i];
    };
    act(c.first, c.first_arm, impulse);
    act(c.second, c.second_arm, -impulse);
}

double PgsContacts::update(std::size_t place) noexcept {
    const auto by = [&](const auto& law, bool box) {
        return single::solve_contact<double>(
            single::Single{contacts_[place], slips_.empty() ? no_slip_ : slips_[place],
                           extras_.empty() ? nullptr : &extras_[place], joints_.bodies().data(),
                           isotropic_ ? nullptr : inertia_.data(), bodies_},
            law, box);
    };
    if (boxes_.empty()) return by(single::Disc{}, false);
    const Box& box = boxes_[place];
    if (model_ != FrictionModel::cone) return by(Square{box.tangents}, model_ == FrictionModel::box);
    return box.anisotropic ? by(AnisotropicDisc{box.tangents}, false) : by(single::Disc{}, false);
}

void PgsContacts::relax_no_more() {
    if (std::exchange(relaxation_, 1.0) == 1.0) return;
    for (PackedContact& c : contacts_) c.inverse_diagonal = c.diagonal > 0.0 ? 1.0 / c.diagonal : 0.0;
}

double PgsContacts::residual(std::size_t k) const noexcept {
    const PackedContact& c = contacts_[k];
    const PackedExtras& extras = extras_.empty() ? no_extras_ : extras_[k];
    const Vec3 u = add_turn(velocity(c.first), c.first_arm) - add_turn(velocity(c.second), c.second_arm);
    const double w = dot(c.normal, u) + extras.softness * c.impulse[0] - c.right;
    const double residual = w > 0.0 ? std::min(w, c.diagonal * c.impulse[0]) : -w;
    const PackedFriction& slip = slips_.empty() ? no_slip_ : slips_[k];
    if (!(slip.friction > 0.0)) return residual;
    const Vec3 across = extras_.empty() ? cross(c.normal, slip.tangent) : extras.across;
    const double b1 = c.impulse[1], b2 = c.impulse[2];
    const double s1 = dot(slip.tangent, u) + extras.slip_softness * b1 - extras.right_along;
    const double s2 = dot(across, u) + extras.slip_softness * b2 - extras.right_across;
    const double bound = slip.friction * (model_ == FrictionModel::box ? extras.normal_before : c.impulse[0]);
    double z1 = b1 - slip.step * s1, z2 = b2 - slip.step * s2;
    bool sticks = true;
    if (model_ == FrictionModel::cone) {
        const double reach = length(z1, z2);
        sticks = reach <= bound;
        if (!sticks) z1 *= bound / reach, z2 *= bound / reach;
    } else {
        sticks = std::abs(z1) <= bound && std::abs(z2) <= bound;
        z1 = std::clamp(z1, -bound, bound), z2 = std::clamp(z2, -bound, bound);
    }
    return std::max(residual, sticks ? length(s1, s2) : length(b1 - z1, b2 - z2) / slip.step);
}

}  // namespace spook
