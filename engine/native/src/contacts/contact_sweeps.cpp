#include "contacts/contact_sweeps.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "contacts/contact_geometry.hpp"
#include "contacts/disc.hpp"
#include "run/watch.hpp"

#define SPOOK_ISA single
#include "contacts/contact_update.inl"

namespace spook {

namespace {

constexpr int late_rounds = 3;         // of sweeps for contacts found after the last one
constexpr unsigned char now_hot = 2;   // and 1 in the sweep after
constexpr double glance = 1.0 / 16.0;  // of what sweeping a contact costs: to see that it is cold
constexpr double measuring = 0.5;      // the same: to see how far off it is
constexpr std::size_t bodies_ahead = 6, contacts_ahead = 12;  // asked for while others are swept
constexpr std::size_t narrow = 32;  // contacts of a level for each thread: fewer are not worth to wait for
constexpr std::size_t narrow_due = 96;      // the same where only some of them are due
constexpr std::size_t worth_threads = 512;  // contacts, where nothing is waited for
constexpr double few_left = 0.75;           // of the contacts in the list: a shorter one is made

Vec3 add_turn(const Vec6& v, Vec3 arm) noexcept { return linear(v) + cross(angular(v), arm); }

SweptBody swept_body(const Mat6& mass) noexcept {
    const double one = 1.0 / mass[0];
    const double a = mass[21], b = mass[22], c = mass[23], d = mass[28], e = mass[29], f = mass[35];
    if (b == 0.0 && c == 0.0 && e == 0.0) return {one, 1.0 / a, 0.0, 0.0, 1.0 / d, 0.0, 1.0 / f};
    const double A = d * f - e * e, B = c * e - b * f, C = b * e - c * d;
    const double s = 1.0 / (a * A + b * B + c * C);
    const double D = a * f - c * c, E = b * c - a * e, F = a * d - b * b;
    return {one, s * A, s * B, s * C, s * D, s * E, s * F};
}

}  // namespace

void ContactSweeps::start(MixedSystem& system, FrictionModel model) {
    bodies_ = static_cast<int>(system.mass.size());
    inertia_.resize(bodies_ + 1);
    for (int b = 0; b < bodies_; ++b) inertia_[b] = swept_body(system.mass[b]);
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
            const Vec3 v = inertia_[b].inverse_mass * linear(p), w = inertia_[b].turn(angular(p));
            velocity[b] = {v.x, v.y, v.z, w.x, w.y, w.z};
        }
        velocity[bodies_] = Vec6{};
    }
    contacts_.clear();
    rests_.clear();
    slips_.clear();
    parent_.resize(bodies_ + 1);
    std::iota(parent_.begin(), parent_.end(), 0);
    active_.assign(bodies_ + 1, 0);
    spent_.assign(bodies_ + 1, 0);
    left_.assign(bodies_ + 1, 0.0);
    parts_.resize(team_ != nullptr ? static_cast<std::size_t>(team_->size()) : 1);
    for (Part& part : parts_) {
        part.change.assign(bodies_ + 1, 0.0);
        part.none.first = part.none.second = bodies_;
        part.none.step = 1.0;
    }
    bodies_of_.clear();
    roots_.clear();
    known_.assign(bodies_ + 1, 0);
    scheduled_ = 0;
    order_.clear();
    level_end_.clear();
    swept_ = stretched_ = joined_ = false;
    plain_ = true;
    done_ = 0.0;
    hot_.assign(bodies_ + 1, 0);
    touched_.assign(bodies_ + 1, 0);
    all_touched_ = true;
    for (int k = 0; k < joint_count_; ++k) {
        const RowBlock& rows = system.rows[k];
        int anchor = std::max(rows.first, rows.second);
        for (const Beyond& other : rows.beyond) {
            if (anchor < 0) anchor = other.body;
            else if (other.body >= 0) join(anchor, other.body);
        }
        link(anchor, anchor == rows.first ? rows.second : rows.first);
    }
}

int ContactSweeps::add(const SweepContact& given) {
    SweptContact& c = contacts_.emplace_back();
    c.first = given.first >= 0 ? given.first : bodies_;
    c.second = given.second >= 0 ? given.second : bodies_;
    SweptRest& rest = rests_.emplace_back();
    c.normal = given.normal;
    c.tangent = given.tangent;
    rest.across = given.across;
    stretched_ = stretched_ || given.stretched;
    c.first_arm = given.first_arm;
    c.second_arm = given.second_arm;
    c.right = given.right[0], rest.right_along = given.right[1], rest.right_across = given.right[2];
    std::copy_n(given.impulse, 3, c.impulse);
    rest.softness = given.softness;
    rest.slip_softness = given.slip_softness;
    c.friction = given.friction;
    rest.normal_before = given.normal_before >= 0.0 ? given.normal_before : given.impulse[0];
    const Vec3 third = cross(c.normal, c.tangent);
    plain_ = plain_ && rest.right_along == 0.0 && rest.right_across == 0.0 && rest.softness == 0.0 &&
             rest.slip_softness == 0.0 && third.x == rest.across.x && third.y == rest.across.y &&
             third.z == rest.across.z;
    const SweptBody &one = inertia_[c.first], &two = inertia_[c.second];
    const double inverse_mass = one.inverse_mass + two.inverse_mass;
    const Vec3 direction[3] = {c.normal, c.tangent, rest.across};
    Vec3 first[3], second[3], first_push[3], second_push[3];
    for (int i = 0; i < 3; ++i) {
        first[i] = cross(c.first_arm, direction[i]);
        second[i] = cross(c.second_arm, direction[i]);
        first_push[i] = one.turn(first[i]);
        second_push[i] = two.turn(second[i]);
    }
    const auto part = [&](int i, int j) {
        return dot(first[i], first_push[j]) + dot(second[i], second_push[j]);
    };
    c.own = inverse_mass + part(0, 0) + rest.softness;
    c.own_inverse = c.own > 0.0 ? 1.0 / c.own : 0.0;
    c.coupling[0] = part(1, 0);
    c.coupling[1] = part(2, 0);
    const double along = given.stretched ? dot(c.tangent, c.tangent) : 1.0,
                 across = given.stretched ? dot(rest.across, rest.across) : 1.0;
    slips_.emplace_back().stretched = given.stretched;
    double* const slip = slips_.back().own;
    slip[0] = inverse_mass * along + part(1, 1) + rest.slip_softness;
    slip[1] = part(1, 2);
    slip[2] = inverse_mass * across + part(2, 2) + rest.slip_softness;
    const double largest = 0.5 * (slip[0] + slip[2]) + length(0.5 * (slip[0] - slip[2]), slip[1]);
    c.step = largest > 0.0 ? 1.0 / largest : 0.0;
    if (!(c.friction > 0.0)) c.impulse[1] = c.impulse[2] = 0.0;
    if (c.impulse[0] != 0.0 || c.impulse[1] != 0.0 || c.impulse[2] != 0.0)
        push(c, c.impulse[0] * c.normal + c.impulse[1] * c.tangent + c.impulse[2] * rest.across);
    heat(c.first, c.second);
    if (c.first < bodies_) touched_[c.first] = 1;
    if (c.second < bodies_) touched_[c.second] = 1;
    link(given.first, given.second);
    return static_cast<int>(contacts_.size()) - 1;
}

void ContactSweeps::push(const SweptContact& c, Vec3 impulse) noexcept {
    const SweptBody &one = inertia_[c.first], &two = inertia_[c.second];
    Vec6 &v = joints_.velocity()[c.first], &w = joints_.velocity()[c.second];
    const Vec3 turn = one.turn(cross(c.first_arm, impulse)), back = two.turn(cross(c.second_arm, impulse));
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

namespace {

/// Friction whose two directions differ in scale, solved exactly.
struct Stretched {
    const double* own;
    double operator()(double step, double b1, double b2, double s1, double s2, double bound, double& d1,
                      double& d2) const {
        double z1 = b1 - step * s1, z2 = b2 - step * s2;
        least_on_disc(own, b1, b2, s1, s2, bound, z1, z2);
        d1 = z1 - b1, d2 = z2 - b2;
        return length(d1, d2) / step;
    }
};

/// Each direction by itself.
struct Square {
    const double* own;
    double operator()(double, double b1, double b2, double s1, double s2, double bound, double& d1,
                      double& d2) const {
        d1 = std::clamp(b1 - s1 / own[0], -bound, bound) - b1;
        d2 = std::clamp(b2 - (s2 + own[1] * d1) / own[2], -bound, bound) - b2;
        return larger(std::abs(d1) * own[0], std::abs(d2) * own[2]);
    }
};

}  // namespace

/// One contact; the largest change of a row, as a velocity.
double ContactSweeps::update(std::size_t contact) noexcept {
    const auto by = [&](const auto& law, bool box) {
        return single::solve_contact<double>(
            single::Single{contacts_[contact], rests_[contact], joints_.velocity().data(), inertia_.data(),
                           bodies_},
            law, box);
    };
    const Slip& slip = slips_[contact];
    if (model_ != FrictionModel::cone) return by(Square{slip.own}, model_ == FrictionModel::box);
    return slip.stretched ? by(Stretched{slip.own}, false) : by(single::Disc{}, false);
}

/// Asks for what the contacts behind this one will read: in large heaps they come from far away.
void ContactSweeps::fetch(const Due& later, const Due& soon) const noexcept {
    const auto ask = [](const auto& what) {
        constexpr std::size_t line = 64;
        const char* const at = reinterpret_cast<const char*>(&what);
        for (std::size_t byte = 0; byte < sizeof(what); byte += line) __builtin_prefetch(at + byte);
        __builtin_prefetch(at + sizeof(what) - 1);  // a velocity may lie across two lines
    };
    ask(contacts_[later.item - joint_count_]);
    for (const int body : {soon.first, soon.second}) {
        ask(joints_.velocity()[body]);
        ask(inertia_[body]);
    }
}

void ContactSweeps::heat(int first, int second) noexcept {
    if (first < bodies_) hot_[first] |= now_hot;
    if (second < bodies_) hot_[second] |= now_hot;
}

void ContactSweeps::note(Part& part, const Due& due, double change, double focus) noexcept {
    part.change[due.island] = larger(part.change[due.island], change);
    if (!spent_[due.island] || change == 0.0) return;
    if (due.first < bodies_) touched_[due.first] = 1;
    if (due.second < bodies_) touched_[due.second] = 1;
    if (!(change <= focus)) heat(due.first, due.second);
}

/// Up to four contacts that share no moving body.
void ContactSweeps::solve(Part& part, const Due* const group[4], int size, double focus) noexcept {
    const auto contact = [&](int k) { return static_cast<std::size_t>(group[k]->item - joint_count_); };
    if (size > 1 && model_ == FrictionModel::cone && !stretched_) {
        SweptContact* four[4] = {&part.none, &part.none, &part.none, &part.none};
        const SweptRest* rests[4] = {&no_rest_, &no_rest_, &no_rest_, &no_rest_};
        double change[4];
        for (int k = 0; k < size; ++k) four[k] = &contacts_[contact(k)], rests[k] = &rests_[contact(k)];
        sweep_four()(
            {four, plain_ ? nullptr : rests, joints_.velocity().data(), inertia_.data(), bodies_, change});
        for (int k = 0; k < size; ++k) note(part, *group[k], change[k], focus);
    } else {
        for (int k = 0; k < size; ++k) note(part, *group[k], update(contact(k)), focus);
    }
}

/// A piece of a level whose contacts are all due.
void ContactSweeps::solve_all(Part& part, std::size_t begin, std::size_t end, double focus) noexcept {
    const std::size_t last = due().size();
    for (std::size_t place = begin; place < end; place += 4) {
        const int size = static_cast<int>(std::min<std::size_t>(4, end - place));
        const Due* group[4];
        for (int k = 0; k < size; ++k) {
            group[k] = &due()[place + k];
            if (place + k + contacts_ahead < last)
                fetch(due()[place + k + contacts_ahead], due()[place + k + bodies_ahead]);
        }
        solve(part, group, size, focus);
    }
    part.swept += end - begin;
}

/// A piece of a level some of whose contacts are due: those of active islands, of spent ones those of hot bodies.
void ContactSweeps::solve_due(Part& part, std::size_t begin, std::size_t end, double focus) noexcept {
    part.picked.resize(end - begin + 1);
    std::size_t picked = 0;
    for (std::size_t place = begin; place < end; ++place) {
        const Due& due = this->due()[place];
        const bool active = active_[due.island] != 0, spent = spent_[due.island] != 0;
        const bool asked = active && (!spent || (hot_[due.first] | hot_[due.second]) != 0);
        part.picked[picked] = &due;
        picked += asked;
        part.seen += active && spent;
        part.hot += asked && spent;
        part.swept += asked && !spent;
    }
    for (std::size_t k = 0; k < picked; ++k) fetch(*part.picked[k], *part.picked[k]);
    for (std::size_t k = 0; k < picked; k += 4)
        solve(part, &part.picked[k], static_cast<int>(std::min<std::size_t>(4, picked - k)), focus);
}

/// Once over what is active: joints, then contacts level by level.
void ContactSweeps::sweep(double focus) noexcept {
    for (unsigned char& hot : hot_) hot >>= 1;
    bool all = whole_, any_spent = false;
    for (const int island : roots_) {
        all = all && active_[island];
        any_spent = any_spent || (active_[island] && spent_[island]);
    }
    for (Part& part : parts_) {
        part.swept = part.seen = part.hot = 0;
        for (const int island : roots_) part.change[island] = 0.0;
    }
    for (int item = 0; item < joint_count_; ++item) {
        const auto [first, second] = bodies_of_[item];
        if (std::min(first, second) == bodies_) continue;
        const int island = root(std::min(first, second));
        if (!active_[island]) continue;
        ++(spent_[island] ? parts_[0].seen : parts_[0].swept);
        parts_[0].hot += spent_[island] != 0;
        note(parts_[0], {item, first, second, island}, joints_.update_joint(static_cast<std::size_t>(item)),
             focus);
    }
    const bool plain = all && !any_spent;
    for (const int island : roots_) all_touched_ = all_touched_ || (active_[island] && !spent_[island]);
    const auto piece = [&](Part& part, std::size_t begin, std::size_t end) {
        if (plain) solve_all(part, begin, end, focus);
        else solve_due(part, begin, end, focus);
    };
    const std::size_t wide = parts_.size() * (any_spent ? narrow_due : narrow);
    const bool worth = parts_.size() > 1 && due().size() > 2 * wide * due_end().size() / 3;
    if (!worth) {
        std::size_t place = 0;
        for (const std::size_t end : due_end()) piece(parts_[0], std::exchange(place, end), end);
    } else {
        // Narrow levels are the first thread's; the others wait for it where a wide one comes next.
        team_->each([&](int index) {
            Part& part = parts_[index];
            const std::vector<std::size_t>& ends = due_end();
            for (std::size_t level = 0; level < ends.size(); ++level) {
                const std::size_t begin = level == 0 ? 0 : ends[level - 1], end = ends[level];
                const bool shared = end - begin >= wide;
                const auto [from, to] = shared ? team_->share(index, begin, end, 4) : std::pair{begin, end};
                if (shared || index == 0) piece(part, from, to);
                if (shared || (level + 1 < ends.size() && ends[level + 1] - end >= wide)) team_->meet();
            }
        });
    }
    std::size_t swept = 0, seen = 0, hot = 0;
    for (const Part& part : parts_) swept += part.swept, seen += part.seen, hot += part.hot;
    done_ += static_cast<double>(swept + hot) + glance * static_cast<double>(seen - hot);
    // Lists of what has settled are not read for long.
    if (static_cast<double>(swept + seen) < few_left * static_cast<double>(due().size())) select();
}

FrictionReport ContactSweeps::run(int iterations, double tolerance, double focus,
                                  const std::function<bool(bool)>& more) {
    FrictionReport report;
    const bool goes_on = swept_;
    if (!swept_) std::fill(active_.begin(), active_.end(), 1);
    swept_ = true;
    if (scheduled_ < bodies_of_.size()) schedule();
    for (const int island : roots_) active_[island] = active_[island] || spent_[island];
    select();
    int look = goes_on ? iterations : 2, late = 0;
    for (int round = 1, until = iterations;; ++round) {
        Watch::look();
        bool any = false;
        sweep(focus);
        for (const int island : roots_) {
            if (!active_[island]) continue;
            const bool spent = spent_[island] != 0;
            double change = 0.0;
            for (const Part& part : parts_) change = larger(change, part.change[island]);
            left_[island] = spent ? larger(left_[island], change) : change;
            ++report.sweeps;
            active_[island] = !(change <= (spent ? focus : tolerance));
            any = any || active_[island];
        }
        const bool over = !any || round >= until;
        if (!over && round < look) continue;
        look = 2 * round;
        if (round >= until)
            for (const int island : roots_) spent_[island] = spent_[island] || active_[island];
        const bool grown = more && more(over);
        if (scheduled_ < bodies_of_.size()) schedule();
        if (!over) continue;
        if (!grown || late == late_rounds) break;
        ++late;
        until = round + iterations;
        look = round + 2;
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
    done_ += measuring * static_cast<double>(bodies_of_.size());
    all_touched_ = all_touched_ || joint_count_ > 0;  // whose rows may have moved others
    residual_.resize(contacts_.size());
    for (Part& part : parts_) part.worst = {0.0, -1};
    share_out(team_, contacts_.size(), worth_threads, [&](int part, std::size_t begin, std::size_t end) {
        parts_[part].worst = worst_of(parts_[part], begin, end, focus);
    });
    std::fill(touched_.begin(), touched_.end(), 0);
    all_touched_ = false;
    RowsResidual worst{0.0, -1};
    for (std::size_t k = 0; k < parts_.size(); ++k) {
        for (const int contact : parts_[k].off) heat(contacts_[contact].first, contacts_[contact].second);
        parts_[k].off.clear();
        const RowsResidual& found = parts_[k].worst;
        if (!(found.residual <= worst.residual) && !std::isnan(worst.residual)) worst = found;
    }
    return worst;
}

RowsResidual ContactSweeps::worst_of(Part& part, std::size_t begin, std::size_t end, double focus) {
    RowsResidual worst{0.0, -1};
    for (std::size_t k = begin; k < end; ++k) {
        const Both bodies = bodies_of_[joint_count_ + k];
        if (all_touched_ || touched_[bodies.first] || touched_[bodies.second]) residual_[k] = residual_of(k);
        const double residual = residual_[k];
        if (!(residual <= focus)) part.off.push_back(static_cast<int>(k));
        const bool worse = !(residual <= worst.residual) && !std::isnan(worst.residual);
        if (worse) worst = {residual, static_cast<int>(k)};
    }
    return worst;
}

/// How far a contact is from its law, as rows_residual() measures it, m/s.
double ContactSweeps::residual_of(std::size_t k) const noexcept {
    const SweptContact& c = contacts_[k];
    const SweptRest& rest = rests_[k];
    const Vec3 u = add_turn(joints_.velocity()[c.first], c.first_arm) -
                   add_turn(joints_.velocity()[c.second], c.second_arm);
    const double w = dot(c.normal, u) + rest.softness * c.impulse[0] - c.right;
    double residual = w > 0.0 ? std::min(w, c.own * c.impulse[0]) : -w;
    const double b1 = c.impulse[1], b2 = c.impulse[2];
    const double s1 = dot(c.tangent, u) + rest.slip_softness * b1 - rest.right_along;
    const double s2 = dot(rest.across, u) + rest.slip_softness * b2 - rest.right_across;
    const double bound = c.friction * (model_ == FrictionModel::box ? rest.normal_before : c.impulse[0]);
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
    return residual;
}

}  // namespace spook
