// What iterations read, laid out as they read it: bodies in a line each, contacts one behind the other.
#include <cmath>

#include "contacts/contact_geometry.hpp"
#include "contacts/pgs_solver.hpp"

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

}  // namespace

void PgsSolver::start(MixedSystem& system, FrictionModel model) {
    bodies_ = static_cast<int>(system.mass.size());
    inertia_.resize(bodies_ + 1);
    round_ = true;
    for (int b = 0; b < bodies_; ++b) {
        inertia_[b] = inverse_inertia(system.mass[b]);
        round_ = round_ && inertia_[b].is_round();
    }
    inertia_[bodies_] = {};
    if (!system.rows.empty()) joints_.prepare(system, {}, model);
    joints_.bodies().resize(bodies_ + 1);
    for (int b = 0; b < bodies_; ++b) {
        body(b).inverse_mass = 1.0 / system.mass[b][0];
        body(b).round = inertia_[b].xx;
    }
    relaxation_ = 1.0;
    begin(system, model);
}

void PgsSolver::start_beside(const PgsSolver& other, MixedSystem& system, FrictionModel model,
                             double relaxation) {
    relaxation_ = relaxation;
    bodies_ = other.bodies_;
    round_ = other.round_;
    if (!round_) inertia_ = other.inertia_;
    if (!system.rows.empty()) joints_.prepare(system, {}, model);
    joints_.bodies().resize(bodies_ + 1);
    for (int b = 0; b < bodies_; ++b) {
        body(b).inverse_mass = other.body(b).inverse_mass;
        body(b).round = other.body(b).round;
    }
    begin(system, model);
}

Vec3 PgsSolver::turned(int b, Vec3 moment) const noexcept {
    return round_ ? body(b).round * moment : inertia_[b].turn(moment);
}

void PgsSolver::begin(MixedSystem& system, FrictionModel model) {
    model_ = model;
    joint_count_ = static_cast<int>(system.rows.size());
    for (int b = 0; b < bodies_ && joint_count_ == 0; ++b) {
        const Vec6& p = system.momentum[b];
        const Vec3 v = body(b).inverse_mass * linear(p), w = turned(b, angular(p));
        body(b).velocity = {v.x, v.y, v.z, w.x, w.y, w.z};
    }
    body(bodies_) = {};
    contacts_.clear();
    slips_.clear();
    extras_.clear();
    boxes_.clear();
    place_.clear();
    added_ = 0;
    sets_.begin(static_cast<std::size_t>(bodies_) + 1);
    active_.assign(bodies_ + 1, 0);
    limit_reached_.assign(bodies_ + 1, 0);
    last_change_.assign(bodies_ + 1, 0.0);
    now_.change.assign(bodies_ + 1, 0.0);
    now_.moved.clear();
    now_.moved.reserve(bodies_);
    now_.none.first = now_.none.second = bodies_;
    bodies_of_.clear();
    roots_.clear();
    known_.assign(bodies_ + 1, 0);
    scheduled_ = listed_ = sized_ = 0;
    order_.clear();
    level_end_.clear();
    started_ = joined_ = false;
    done_ = 0.0;
    active_bodies_.assign(bodies_ + 1, 0);
    touched_.assign(bodies_ + 1, 0);
    all_touched_ = true;
    for (int k = 0; k < joint_count_; ++k) {
        const RowBlock& rows = system.rows[k];
        int anchor = std::max(rows.first, rows.second);
        for (const FurtherBody& other : rows.further) {
            if (anchor < 0) anchor = other.body;
            else if (other.body >= 0) join(anchor, other.body);
        }
        link(anchor, anchor == rows.first ? rows.second : rows.first);
    }
}

int PgsSolver::add(const PgsContact& given) {
    const int contact = added_++;
    if (bodies_of_.size() == static_cast<std::size_t>(joint_count_) + static_cast<std::size_t>(contact)) {
        link(given.first, given.second);
        place_.push_back(contact);
        contacts_.emplace_back();
    }
    const int place = place_[contact];
    PackedContact& c = contacts_[place];
    c.first = given.first >= 0 ? given.first : bodies_;
    c.second = given.second >= 0 ? given.second : bodies_;
    c.normal = given.normal;
    c.first_arm = given.first_arm;
    c.second_arm = given.second_arm;
    c.right = given.right[0];
    const Vec3 first = cross(c.first_arm, c.normal), second = cross(c.second_arm, c.normal);
    c.own = body(c.first).inverse_mass + body(c.second).inverse_mass +
            (dot(first, turned(c.first, first)) + dot(second, turned(c.second, second))) + given.softness;
    c.own_inverse = c.own > 0.0 ? relaxation_ / c.own : 0.0;
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
    activate(c.first, c.second);
    touch(c.first);
    touch(c.second);
    return contact;
}

void PgsSolver::arrange() {
    if (scheduled_ < bodies_of_.size()) schedule();
    contacts_.resize(place_.size());
}

/// What else a contact has, and for the others that they have none of it.
void PgsSolver::add_slip(const PgsContact& given, int place) {
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
    box.own[0] = inverse_mass * along + part(1, 1) + given.slip_softness;
    box.own[1] = part(1, 2);
    box.own[2] = inverse_mass * across + part(2, 2) + given.slip_softness;
    box.anisotropic = given.anisotropic;
    const double largest =
        0.5 * (box.own[0] + box.own[2]) + length(0.5 * (box.own[0] - box.own[2]), box.own[1]);
    slip.step = largest > 0.0 ? 1.0 / largest : 0.0;

    const bool boxed = model_ != FrictionModel::cone || given.anisotropic || !boxes_.empty();
    const Vec3 third = cross(c.normal, given.tangent);
    const bool plain = given.right[1] == 0.0 && given.right[2] == 0.0 && given.softness == 0.0 &&
                       given.slip_softness == 0.0 && third.x == given.across.x && third.y == given.across.y &&
                       third.z == given.across.z;
    if (plain && !boxed && extras_.empty()) return;
    if (extras_.empty())
        for (std::size_t k = 0; k < slips_.size(); ++k)
            extras_.push_back({.across = cross(contacts_[k].normal, slips_[k].tangent)});
    extras_.resize(contacts_.size());
    extras_[place] = {
        given.across,        given.right[1],
        given.right[2],      given.softness,
        given.slip_softness, given.normal_before >= 0.0 ? given.normal_before : given.impulse[0]};
    if (!boxed) return;
    boxes_.resize(contacts_.size());
    boxes_[place] = box;
}

void PgsSolver::push(const PackedContact& c, Vec3 impulse) noexcept {
    PgsBody &one = body(c.first), &two = body(c.second);
    Vec6 &v = one.velocity, &w = two.velocity;
    const Vec3 turn = turned(c.first, cross(c.first_arm, impulse)),
               back = turned(c.second, cross(c.second_arm, impulse));
    v[0] += one.inverse_mass * impulse.x;
    v[1] += one.inverse_mass * impulse.y;
    v[2] += one.inverse_mass * impulse.z;
    v[3] += turn.x;
    v[4] += turn.y;
    v[5] += turn.z;
    w[0] -= two.inverse_mass * impulse.x;
    w[1] -= two.inverse_mass * impulse.y;
    w[2] -= two.inverse_mass * impulse.z;
    w[3] -= back.x;
    w[4] -= back.y;
    w[5] -= back.z;
}

}  // namespace spook
