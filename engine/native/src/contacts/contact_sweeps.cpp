#include "contacts/contact_sweeps.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "contacts/contact_geometry.hpp"
#include "contacts/disc.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

constexpr int late_rounds = 3;         // of sweeps for contacts found after the last one
constexpr int cold = -2;               // before every sweep
constexpr double glance = 1.0 / 16.0;  // of what sweeping a contact costs: to see that it is cold
constexpr double measuring = 0.5;      // the same: to see how far off it is
constexpr int bodies_ahead = 2, contacts_ahead = 4;  // asked for while others are swept

Vec3 add_turn(const Vec6& v, Vec3 arm) noexcept { return linear(v) + cross(angular(v), arm); }

Mat3 symmetric_inverse(const Mat6& mass) noexcept {
    const double a = mass[21], b = mass[22], c = mass[23], d = mass[28], e = mass[29], f = mass[35];
    if (b == 0.0 && c == 0.0 && e == 0.0) return Mat3::diagonal({1.0 / a, 1.0 / d, 1.0 / f});
    const double A = d * f - e * e, B = c * e - b * f, C = b * e - c * d;
    const double s = 1.0 / (a * A + b * B + c * C);
    const double D = a * f - c * c, E = b * c - a * e, F = a * d - b * b;
    return {{s * A, s * B, s * C, s * B, s * D, s * E, s * C, s * E, s * F}};
}

}  // namespace

void ContactSweeps::start(MixedSystem& system, FrictionModel model) {
    bodies_ = static_cast<int>(system.mass.size());
    inertia_.resize(bodies_ + 1);
    for (int b = 0; b < bodies_; ++b)
        inertia_[b] = {1.0 / system.mass[b][0], symmetric_inverse(system.mass[b])};
    inertia_[bodies_] = {};
    begin(system, model);
}

void ContactSweeps::start_beside(const ContactSweeps& other, MixedSystem& system, FrictionModel model) {
    bodies_ = other.bodies_;
    inertia_ = other.inertia_;
    begin(system, model);
}

void ContactSweeps::begin(MixedSystem& system, FrictionModel model) {
    model_ = model;
    joint_count_ = static_cast<int>(system.rows.size());
    if (joint_count_ > 0) {
        joints_.prepare(system, {}, model);
    } else {
        std::vector<Vec6>& velocity = joints_.velocity();
        velocity.resize(bodies_ + 1);
        for (int b = 0; b < bodies_; ++b) {
            const Vec6& p = system.momentum[b];
            const Vec3 v = inertia_[b].inverse_mass * linear(p), w = inertia_[b].inverse * angular(p);
            velocity[b] = {v.x, v.y, v.z, w.x, w.y, w.z};
        }
        velocity[bodies_] = Vec6{};
    }
    contacts_.clear();
    slips_.clear();
    parent_.resize(bodies_ + 1);
    std::iota(parent_.begin(), parent_.end(), 0);
    head_.assign(bodies_ + 1, -1);
    tail_.assign(bodies_ + 1, -1);
    active_.assign(bodies_ + 1, 0);
    spent_.assign(bodies_ + 1, 0);
    left_.assign(bodies_ + 1, 0.0);
    next_.clear();
    bodies_of_.clear();
    roots_.clear();
    chained_ = false;
    stamp_ = 0;
    done_ = 0.0;
    hot_.assign(bodies_ + 1, cold);
    for (int k = 0; k < joint_count_; ++k) {
        const RowBlock& rows = system.rows[k];
        int anchor = std::max(rows.first, rows.second);
        for (const Beyond& other : rows.beyond) {
            if (anchor < 0) anchor = other.body;
            else if (other.body >= 0) join(anchor, other.body);
        }
        link(k, anchor, anchor == rows.first ? rows.second : rows.first);
    }
}

int ContactSweeps::add(const SweepContact& given) {
    Contact& c = contacts_.emplace_back();
    c.first = given.first >= 0 ? given.first : bodies_;
    c.second = given.second >= 0 ? given.second : bodies_;
    c.normal = given.normal;
    c.tangent = given.tangent;
    c.across = given.across;
    c.stretched = given.stretched;
    c.first_arm = given.first_arm;
    c.second_arm = given.second_arm;
    std::copy_n(given.right, 3, c.right);
    std::copy_n(given.impulse, 3, c.impulse);
    c.softness = given.softness;
    c.slip_softness = given.slip_softness;
    c.friction = given.friction;
    c.normal_before = given.normal_before >= 0.0 ? given.normal_before : given.impulse[0];
    const Inertia &one = inertia_[c.first], &two = inertia_[c.second];
    const double inverse_mass = one.inverse_mass + two.inverse_mass;
    const Vec3 direction[3] = {c.normal, c.tangent, c.across};
    Vec3 first[3], second[3], first_push[3], second_push[3];
    for (int i = 0; i < 3; ++i) {
        first[i] = cross(c.first_arm, direction[i]);
        second[i] = cross(c.second_arm, direction[i]);
        first_push[i] = one.inverse * first[i];
        second_push[i] = two.inverse * second[i];
    }
    const auto part = [&](int i, int j) {
        return dot(first[i], first_push[j]) + dot(second[i], second_push[j]);
    };
    c.own = inverse_mass + part(0, 0) + c.softness;
    c.own_inverse = c.own > 0.0 ? 1.0 / c.own : 0.0;
    c.coupling[0] = part(1, 0);
    c.coupling[1] = part(2, 0);
    const double along = c.stretched ? dot(c.tangent, c.tangent) : 1.0,
                 across = c.stretched ? dot(c.across, c.across) : 1.0;
    double* const slip = slips_.emplace_back().own;
    slip[0] = inverse_mass * along + part(1, 1) + c.slip_softness;
    slip[1] = part(1, 2);
    slip[2] = inverse_mass * across + part(2, 2) + c.slip_softness;
    const double largest = 0.5 * (slip[0] + slip[2]) + length(0.5 * (slip[0] - slip[2]), slip[1]);
    c.step = largest > 0.0 ? 1.0 / largest : 0.0;
    if (!(c.friction > 0.0)) c.impulse[1] = c.impulse[2] = 0.0;
    if (c.impulse[0] != 0.0 || c.impulse[1] != 0.0 || c.impulse[2] != 0.0)
        push(c, c.impulse[0] * c.normal + c.impulse[1] * c.tangent + c.impulse[2] * c.across);
    heat({c.first, c.second});
    const int index = static_cast<int>(contacts_.size()) - 1;
    link(joint_count_ + index, given.first, given.second);
    return index;
}

int ContactSweeps::root(int body) noexcept {
    while (parent_[body] != body) body = parent_[body] = parent_[parent_[body]];
    return body;
}

/// Joins the islands of both bodies, and once sweeping has begun their chains, too.
void ContactSweeps::link(int item, int first, int second) {
    next_.push_back(-1);
    bodies_of_.push_back({first >= 0 ? first : bodies_, second >= 0 ? second : bodies_});
    if (first < 0 && second < 0) return;
    if (first >= 0 && second >= 0) join(first, second);
    if (chained_) chain(item);
}

void ContactSweeps::join(int first, int second) {
    int a = root(first), b = root(second);
    if (a == b) return;
    if (a > b) std::swap(a, b);
    parent_[b] = a;
    left_[a] = larger(left_[a], left_[b]);
    spent_[a] = spent_[a] || spent_[b];
    if (!chained_ || head_[b] < 0) return;
    if (head_[a] >= 0) {
        next_[tail_[a]] = head_[b];
        roots_.erase(std::find(roots_.begin(), roots_.end(), b));
    } else {
        head_[a] = head_[b];
        *std::find(roots_.begin(), roots_.end(), b) = a;
    }
    tail_[a] = tail_[b];
    head_[b] = -1;
}

void ContactSweeps::chain(int item) {
    const int body = std::min(bodies_of_[item].first, bodies_of_[item].second);
    if (body == bodies_) return;
    const int island = root(body);
    if (head_[island] < 0) {
        head_[island] = item;
        roots_.push_back(island);
    } else {
        next_[tail_[island]] = item;
    }
    tail_[island] = item;
    active_[island] = 1;
}

void ContactSweeps::push(const Contact& c, Vec3 impulse) noexcept {
    const Inertia &one = inertia_[c.first], &two = inertia_[c.second];
    Vec6 &v = joints_.velocity()[c.first], &w = joints_.velocity()[c.second];
    const Vec3 turn = one.inverse * cross(c.first_arm, impulse),
               back = two.inverse * cross(c.second_arm, impulse);
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

/// One contact; the largest change of a row, as a velocity.
double ContactSweeps::update(Contact& c) noexcept {
    const Vec3 u = add_turn(joints_.velocity()[c.first], c.first_arm) -
                   add_turn(joints_.velocity()[c.second], c.second_arm);
    const double old = c.impulse[0];
    const double asked = old - (dot(c.normal, u) + c.softness * old - c.right[0]) * c.own_inverse;
    const double nu = asked <= 0.0 ? 0.0 : asked;  // what is not a number stays
    const double dn = nu - old;
    c.impulse[0] = nu;
    double change = std::abs(dn) * c.own, d1 = 0.0, d2 = 0.0;
    const double bound = c.friction * (model_ == FrictionModel::box ? c.normal_before : nu);
    const double b1 = c.impulse[1], b2 = c.impulse[2];
    if (bound > 0.0 || b1 != 0.0 || b2 != 0.0) {
        const double s1 = dot(c.tangent, u) + c.coupling[0] * dn + c.slip_softness * b1 - c.right[1];
        const double s2 = dot(c.across, u) + c.coupling[1] * dn + c.slip_softness * b2 - c.right[2];
        if (model_ == FrictionModel::cone) {
            double z1 = b1 - c.step * s1, z2 = b2 - c.step * s2;
            const double reach = length(z1, z2);
            if (c.stretched) least_on_disc(slip(c), b1, b2, s1, s2, bound, z1, z2);
            else if (reach > bound) z1 *= bound / reach, z2 *= bound / reach;
            d1 = z1 - b1, d2 = z2 - b2;
            change = larger(change, length(d1, d2) / c.step);
        } else {
            const double* const own = slip(c);
            d1 = std::clamp(b1 - s1 / own[0], -bound, bound) - b1;
            d2 = std::clamp(b2 - (s2 + own[1] * d1) / own[2], -bound, bound) - b2;
            change = larger(change, larger(std::abs(d1) * own[0], std::abs(d2) * own[2]));
        }
        c.impulse[1] = b1 + d1;
        c.impulse[2] = b2 + d2;
    }
    if (dn != 0.0 || d1 != 0.0 || d2 != 0.0) push(c, dn * c.normal + d1 * c.tangent + d2 * c.across);
    return change;
}

/// Asks for what the items behind this one will read: in large heaps bodies come from far away.
void ContactSweeps::fetch(int item) const noexcept {
    const auto ask = [](const auto& what) {
        constexpr std::size_t line = 64;
        const char* const at = reinterpret_cast<const char*>(&what);
        for (std::size_t byte = 0; byte < sizeof(what); byte += line) __builtin_prefetch(at + byte);
    };
    // Items follow each other, but where islands grew together: a guess that costs nothing where it is wrong.
    const int items = static_cast<int>(bodies_of_.size());
    if (const int soon = item + bodies_ahead; soon >= joint_count_ && soon < items)
        for (const int body : {bodies_of_[soon].first, bodies_of_[soon].second}) {
            ask(joints_.velocity()[body]);
            ask(inertia_[body]);
        }
    if (const int later = item + contacts_ahead; later >= joint_count_ && later < items)
        ask(contacts_[later - joint_count_]);
}

double ContactSweeps::sweep_island(int island) noexcept {
    double change = 0.0;
    int swept = 0;
    for (int item = head_[island]; item >= 0; item = next_[item], ++swept) {
        fetch(item);
        const double own = item < joint_count_ ? joints_.update_joint(static_cast<std::size_t>(item))
                                               : update(contacts_[item - joint_count_]);
        change = larger(change, own);
    }
    done_ += swept;
    return change;
}

void ContactSweeps::heat(Both bodies) noexcept {
    if (bodies.first < bodies_) hot_[bodies.first] = stamp_;
    if (bodies.second < bodies_) hot_[bodies.second] = stamp_;
}

/// As sweep_island(), but of the contacts only those of hot bodies.
double ContactSweeps::sweep_hot(int island, double focus) noexcept {
    double change = 0.0;
    int seen = 0, swept = 0;
    for (int item = head_[island]; item >= 0; item = next_[item], ++seen) {
        const Both bodies = bodies_of_[item];
        const bool joint = item < joint_count_;
        if (!joint && hot_[bodies.first] < stamp_ - 1 && hot_[bodies.second] < stamp_ - 1) continue;
        ++swept;
        const double own = joint ? joints_.update_joint(static_cast<std::size_t>(item))
                                 : update(contacts_[item - joint_count_]);
        change = larger(change, own);
        if (!(own <= focus)) heat(bodies);
    }
    done_ += swept + glance * (seen - swept);
    return change;
}

FrictionReport ContactSweeps::run(int iterations, double tolerance, double focus,
                                  const std::function<bool()>& more) {
    FrictionReport report;
    if (!chained_) {
        for (int item = 0; item < static_cast<int>(next_.size()); ++item) chain(item);
        chained_ = true;
    }
    for (const int island : roots_) active_[island] = active_[island] || spent_[island];
    int look = 2, late = 0;
    for (int sweep = 1, until = iterations;; ++sweep) {
        Watch::look();
        ++stamp_;
        bool any = false;
        for (std::size_t k = 0; k < roots_.size(); ++k) {
            const int island = roots_[k];
            if (!active_[island]) continue;
            const bool spent = spent_[island] != 0;
            const double change = spent ? sweep_hot(island, focus) : sweep_island(island);
            left_[island] = spent ? larger(left_[island], change) : change;
            ++report.sweeps;
            active_[island] = !(change <= (spent ? focus : tolerance));
            any = any || active_[island];
        }
        const bool over = !any || sweep >= until;
        if (!over && sweep < look) continue;
        look = 2 * sweep;
        if (sweep >= until)
            for (const int island : roots_) spent_[island] = spent_[island] || active_[island];
        const bool grown = more && more();
        if (!over) continue;
        if (!grown || late == late_rounds) break;
        ++late;
        until = sweep + iterations;
        look = sweep + 2;
    }
    for (const int island : roots_) {
        report.residual = larger(report.residual, left_[island]);
        report.converged = report.converged && !active_[island];
    }
    report.converged = report.converged && report.residual <= tolerance;
    report.finite = !std::isnan(report.residual);
    return report;
}

void ContactSweeps::write(MixedSystem& system) const {
    if (joint_count_ > 0) joints_.write(system);
    else system.velocity.assign(joints_.velocity().begin(), joints_.velocity().end() - 1);
}

RowsResidual ContactSweeps::worst(double focus) {
    RowsResidual worst{0.0, -1};
    done_ += measuring * static_cast<double>(next_.size());
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& c = contacts_[k];
        const Vec3 u = add_turn(joints_.velocity()[c.first], c.first_arm) -
                       add_turn(joints_.velocity()[c.second], c.second_arm);
        const double w = dot(c.normal, u) + c.softness * c.impulse[0] - c.right[0];
        double residual = w > 0.0 ? std::min(w, c.own * c.impulse[0]) : -w;
        const double b1 = c.impulse[1], b2 = c.impulse[2];
        const double s1 = dot(c.tangent, u) + c.slip_softness * b1 - c.right[1];
        const double s2 = dot(c.across, u) + c.slip_softness * b2 - c.right[2];
        const double bound = c.friction * (model_ == FrictionModel::box ? c.normal_before : c.impulse[0]);
        double z1 = b1 - c.step * s1, z2 = b2 - c.step * s2;
        bool sticks = true;
        if (model_ == FrictionModel::cone) {
            const double reach = length(z1, z2);
            sticks = reach <= bound;
            if (!sticks) z1 *= bound / reach, z2 *= bound / reach;
        } else {
            sticks = std::abs(z1) <= bound && std::abs(z2) <= bound;
            z1 = std::clamp(z1, -bound, bound), z2 = std::clamp(z2, -bound, bound);
        }
        if (c.friction > 0.0)
            residual = std::max(residual, sticks ? length(s1, s2) : length(b1 - z1, b2 - z2) / c.step);
        if (!(residual <= focus)) heat({c.first, c.second});
        const bool worse = !(residual <= worst.residual) && !std::isnan(worst.residual);
        if (worse) worst = {residual, static_cast<int>(k)};
    }
    return worst;
}

}  // namespace spook
