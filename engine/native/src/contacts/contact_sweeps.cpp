#include "contacts/contact_sweeps.hpp"

#include <algorithm>
#include <bit>
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
constexpr double glance = 1.0 / 16.0;  // of what sweeping a contact costs: to see that it is cold
constexpr double measuring = 0.5;      // the same: to see how far off it is
constexpr std::size_t bodies_ahead = 6, contacts_ahead = 12;  // asked for while others are swept
constexpr std::size_t narrow = 32;  // contacts of a level for each thread: fewer are not worth to wait for
constexpr std::size_t narrow_due = 96;      // the same where only some of them are due
constexpr std::size_t worth_threads = 512;  // contacts, where nothing is waited for
constexpr double few_off = 1.0 / 16.0;      // of the contacts are further off than the next sweeps care for
constexpr double nearly = 0.9;              // of what is allowed: then they care for what is that far off
constexpr double few_left = 0.75;           // of the contacts in the list: a shorter one is made
constexpr int plain_sweeps = 2;             // the last ones, which are not over-relaxed

Vec3 add_turn(const Vec6& v, Vec3 arm) noexcept { return linear(v) + cross(angular(v), arm); }

}  // namespace

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
            single::Single{contacts_[contact], slips_.empty() ? no_slip_ : slips_[contact],
                           rests_.empty() ? nullptr : &rests_[contact], joints_.bodies().data(),
                           round_ ? nullptr : inertia_.data(), bodies_},
            law, box);
    };
    if (boxes_.empty()) return by(single::Disc{}, false);
    const Box& box = boxes_[contact];
    if (model_ != FrictionModel::cone) return by(Square{box.own}, model_ == FrictionModel::box);
    return box.stretched ? by(Stretched{box.own}, false) : by(single::Disc{}, false);
}

/// Asks for what the contacts behind this one will read: in large heaps they come from far away.
void ContactSweeps::fetch(const Due& later, const Due& soon) const noexcept {
    ask_for(contacts_[later.item - joint_count_]);
    if (!slips_.empty()) ask_for(slips_[later.item - joint_count_]);
    for (const int at : {soon.first, soon.second}) {
        ask_for(body(at));
        if (!round_) ask_for(inertia_[at]);
    }
}

void ContactSweeps::heat(int first, int second) noexcept {
    if (marked_ && !marking_) marked_ = false;  // threads only read it
    for (const int body : {first, second}) {
        if (body == bodies_ || (hot_[body] & now_hot) != 0) continue;
        hot_[body] |= now_hot;
        if (marking_) mark(body);
    }
}

void ContactSweeps::touch(Part& part, int body) noexcept {
    if (body == bodies_ || touched_[body] != 0) return;
    touched_[body] = 1;
    part.touched.push_back(body);  // has room for all
}

void ContactSweeps::note(Part& part, const Due& due, double change, double focus) noexcept {
    part.change[due.island] = larger(part.change[due.island], change);
    if (!spent_[due.island] || change == 0.0) return;
    touch(part, due.first);
    touch(part, due.second);
    if (!(change <= focus)) heat(due.first, due.second);
}

/// Up to four contacts that share no moving body.
void ContactSweeps::solve(Part& part, const Due* const group[4], int size, double focus) noexcept {
    const auto contact = [&](int k) { return static_cast<std::size_t>(group[k]->item - joint_count_); };
    if (size > 1 && boxes_.empty()) {
        SweptContact* four[4] = {&part.none, &part.none, &part.none, &part.none};
        const SweptSlip* slips[4] = {&no_slip_, &no_slip_, &no_slip_, &no_slip_};
        const SweptRest* rests[4] = {&no_rest_, &no_rest_, &no_rest_, &no_rest_};
        double change[4];
        for (int k = 0; k < size; ++k) {
            four[k] = &contacts_[contact(k)];
            if (!slips_.empty()) slips[k] = &slips_[contact(k)];
            if (!rests_.empty()) rests[k] = &rests_[contact(k)];
        }
        sweep_four()({four, slips_.empty() ? nullptr : slips, rests_.empty() ? nullptr : rests,
                      joints_.bodies().data(), round_ ? nullptr : inertia_.data(), bodies_, change});
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
    solve_picked(part, picked, focus);
}

/// Those that were picked from a level, four at once.
void ContactSweeps::solve_picked(Part& part, std::size_t picked, double focus) noexcept {
    for (std::size_t k = 0; k < std::min(picked, contacts_ahead); ++k)
        fetch(*part.picked[k], *part.picked[k]);
    for (std::size_t k = 0; k < picked; k += 4) {
        const std::size_t size = std::min<std::size_t>(4, picked - k);
        for (std::size_t ahead = k + contacts_ahead; ahead < std::min(picked, k + contacts_ahead + 4);
             ++ahead)
            fetch(*part.picked[ahead], *part.picked[ahead]);
        solve(part, &part.picked[k], static_cast<int>(size), focus);
    }
}

/// The contacts of hot bodies, found without a look at the others: everybody who is active is spent.
void ContactSweeps::sweep_hot(double focus) {
    if (!marked_) mark_hot();
    else due_now_.swap(due_next_), std::fill(due_next_.begin(), due_next_.end(), 0);
    Part& part = parts_[0];
    for (const int island : roots_) part.seen += active_[island] ? size_[island] : 0;
    marking_ = true;
    std::size_t begin = 0;
    for (const std::size_t end : level_end_) {
        part.picked.resize(end - begin + 1);
        std::size_t picked = 0;
        for (std::size_t word = begin / 64; 64 * word < end; ++word) {
            std::uint64_t bits = due_now_[word];
            if (64 * word < begin) bits &= ~std::uint64_t{0} << (begin % 64);
            if (end - 64 * word < 64) bits &= ~(~std::uint64_t{0} << (end % 64));
            for (; bits != 0; bits &= bits - 1) {
                const Due& due = order_[64 * word + static_cast<std::size_t>(std::countr_zero(bits))];
                part.picked[picked] = &due;
                picked += active_[due.island] != 0;
            }
        }
        part.hot += picked;
        solve_picked(part, picked, focus);
        begin = end;
    }
    marking_ = false;
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
    const bool all_spent = std::all_of(roots_.begin(), roots_.end(),
                                       [this](int island) { return !active_[island] || spent_[island]; });
    for (const int island : roots_) all_touched_ = all_touched_ || (active_[island] && !spent_[island]);
    const auto piece = [&](Part& part, std::size_t begin, std::size_t end) {
        if (plain) solve_all(part, begin, end, focus);
        else solve_due(part, begin, end, focus);
    };
    const std::size_t wide = parts_.size() * (any_spent ? narrow_due : narrow);
    const bool worth = parts_.size() > 1 && due().size() > 2 * wide * due_end().size() / 3;
    if (!worth && all_spent) {
        sweep_hot(focus);
    } else if (!worth) {
        marked_ = false;
        std::size_t place = 0;
        for (const std::size_t end : due_end()) piece(parts_[0], std::exchange(place, end), end);
    } else {
        marked_ = false;
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
        if (round > iterations - plain_sweeps) relax_no_more();
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

void ContactSweeps::relax_no_more() {
    if (std::exchange(relaxation_, 1.0) == 1.0) return;
    for (SweptContact& c : contacts_) c.own_inverse = c.own > 0.0 ? 1.0 / c.own : 0.0;
}

void ContactSweeps::write(MixedSystem& system) const {
    if (joint_count_ > 0) joints_.write(system);
    else joints_.write_velocities(system);
}

RowsResidual ContactSweeps::worst(double focus, double allowed) {
    done_ += measuring * static_cast<double>(bodies_of_.size());
    all_touched_ = all_touched_ || joint_count_ > 0;  // whose rows may have moved others
    find_residuals();
    for (Part& part : parts_) {
        for (const int body : part.touched) touched_[body] = 0;
        part.touched.clear();
    }
    all_touched_ = false;
    RowsResidual worst{0.0, -1};
    off_.clear();
    const auto is_off = [&](double residual) { return !(residual <= focus); };
    const auto is_worse = [&](double residual) {
        return !(residual <= worst.residual) && !std::isnan(worst.residual);
    };
    constexpr std::size_t some = 16;  // are looked at together: nearly always nothing is to be told
    for (std::size_t begin = 0; begin < residual_.size(); begin += some) {
        const std::size_t end = std::min(begin + some, residual_.size());
        const double least = std::min(focus, worst.residual);
        bool any = std::isnan(worst.residual);
        for (std::size_t k = begin; k < end; ++k) any |= !(residual_[k] <= least);
        for (std::size_t k = begin; any && k < end; ++k) {
            if (is_off(residual_[k])) off_.push_back(static_cast<int>(k));
            if (is_worse(residual_[k])) worst = {residual_[k], static_cast<int>(k)};
        }
    }
    // Where many are off, what nearly is would be next. In a large heap a few always are, and ask for more than they bring.
    const bool few = static_cast<double>(off_.size()) <= few_off * static_cast<double>(contacts_.size());
    const double least = few ? larger(focus, nearly * allowed) : focus;
    for (const int place : off_)
        if (!(residual_[place] <= least)) heat(contacts_[place].first, contacts_[place].second);
    if (worst.row >= 0)
        worst.row = static_cast<int>(std::find(place_.begin(), place_.end(), worst.row) - place_.begin());
    return worst;
}

/// Brings residual_ up to date.
void ContactSweeps::find_residuals() {
    residual_.resize(contacts_.size());
    if (all_touched_) {
        share_out(team_, contacts_.size(), worth_threads, [this](int, std::size_t begin, std::size_t end) {
            for (std::size_t k = begin; k < end; ++k) residual_[k] = residual_of(k);
        });
    } else {
        share_out(team_, order_.size(), worth_threads, [this](int, std::size_t begin, std::size_t end) {
            for (std::size_t k = begin; k < end; ++k) {
                const Due& due = order_[k];
                const auto contact = static_cast<std::size_t>(due.item - joint_count_);
                if (touched_[due.first] != 0 || touched_[due.second] != 0)
                    residual_[contact] = residual_of(contact);
            }
        });
    }
}

/// How far a contact is from its law, as rows_residual() measures it, m/s.
double ContactSweeps::residual_of(std::size_t k) const noexcept {
    const SweptContact& c = contacts_[k];
    const SweptRest& rest = rests_.empty() ? no_rest_ : rests_[k];
    const Vec3 u = add_turn(velocity(c.first), c.first_arm) - add_turn(velocity(c.second), c.second_arm);
    const double w = dot(c.normal, u) + rest.softness * c.impulse[0] - c.right;
    const double residual = w > 0.0 ? std::min(w, c.own * c.impulse[0]) : -w;
    const SweptSlip& slip = slips_.empty() ? no_slip_ : slips_[k];
    if (!(slip.friction > 0.0)) return residual;
    const Vec3 across = rests_.empty() ? cross(c.normal, slip.tangent) : rest.across;
    const double b1 = c.impulse[1], b2 = c.impulse[2];
    const double s1 = dot(slip.tangent, u) + rest.slip_softness * b1 - rest.right_along;
    const double s2 = dot(across, u) + rest.slip_softness * b2 - rest.right_across;
    const double bound = slip.friction * (model_ == FrictionModel::box ? rest.normal_before : c.impulse[0]);
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
