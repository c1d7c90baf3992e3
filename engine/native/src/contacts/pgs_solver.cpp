#include "contacts/pgs_solver.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

#include "contacts/contact_geometry.hpp"
#include "contacts/disc.hpp"
#include "run/watch.hpp"

#define SPOOK_ISA single
#include "contacts/pgs_contact.inl"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::pgs_solver;

Vec3 add_turn(const Vec6& v, Vec3 arm) noexcept { return linear(v) + cross(angular(v), arm); }

}  // namespace

namespace {

/// Friction whose two directions differ in scale, solved exactly.
struct AnisotropicDisc {
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
double PgsSolver::update(std::size_t contact) noexcept {
    const auto by = [&](const auto& law, bool box) {
        return single::solve_contact<double>(
            single::Single{contacts_[contact], slips_.empty() ? no_slip_ : slips_[contact],
                           extras_.empty() ? nullptr : &extras_[contact], joints_.bodies().data(),
                           round_ ? nullptr : inertia_.data(), bodies_},
            law, box);
    };
    if (boxes_.empty()) return by(single::Disc{}, false);
    const Box& box = boxes_[contact];
    if (model_ != FrictionModel::cone) return by(Square{box.own}, model_ == FrictionModel::box);
    return box.anisotropic ? by(AnisotropicDisc{box.own}, false) : by(single::Disc{}, false);
}

/// Asks for what the contacts behind this one will read: in large heaps they come from far away.
void PgsSolver::fetch(const Scheduled& later, const Scheduled& soon) const noexcept {
    prefetch(contacts_[later.item - joint_count_]);
    if (!slips_.empty()) prefetch(slips_[later.item - joint_count_]);
    for (const int at : {soon.first, soon.second}) {
        prefetch(body(at));
        if (!round_) prefetch(inertia_[at]);
    }
}

void PgsSolver::activate(int first, int second) noexcept {
    if (!marking_) marked_ = false;
    for (const int body : {first, second}) {
        if (body == bodies_ || (active_bodies_[body] & active_now) != 0) continue;
        active_bodies_[body] |= active_now;
        if (marking_) mark(body);
    }
}

void PgsSolver::touch(int body) noexcept {
    if (body == bodies_ || touched_[body] != 0) return;
    touched_[body] = 1;
    now_.moved.push_back(body);  // has room for all
}

inline void PgsSolver::note(const Scheduled& scheduled, double change, double focus) noexcept {
    now_.change[scheduled.island] = larger(now_.change[scheduled.island], change);
    if (!limit_reached_[scheduled.island] || change == 0.0) return;
    touch(scheduled.first);
    touch(scheduled.second);
    if (!(change <= focus)) activate(scheduled.first, scheduled.second);
}

/// Up to four contacts that share no moving body.
void PgsSolver::solve(const Scheduled* const group[4], int size, double focus) noexcept {
    const auto contact = [&](int k) { return static_cast<std::size_t>(group[k]->item - joint_count_); };
    if (size > 1 && boxes_.empty()) {
        PackedContact* four[4] = {&now_.none, &now_.none, &now_.none, &now_.none};
        const PackedFriction* slips[4] = {&no_slip_, &no_slip_, &no_slip_, &no_slip_};
        const PackedExtras* extras[4] = {&no_extras_, &no_extras_, &no_extras_, &no_extras_};
        double change[4];
        for (int k = 0; k < size; ++k) {
            four[k] = &contacts_[contact(k)];
            if (!slips_.empty()) slips[k] = &slips_[contact(k)];
            if (!extras_.empty()) extras[k] = &extras_[contact(k)];
        }
        solve_four()({four, slips_.empty() ? nullptr : slips, extras_.empty() ? nullptr : extras,
                      joints_.bodies().data(), round_ ? nullptr : inertia_.data(), bodies_, change});
        for (int k = 0; k < size; ++k) note(*group[k], change[k], focus);
    } else {
        for (int k = 0; k < size; ++k) note(*group[k], update(contact(k)), focus);
    }
}

/// A piece of a level whose contacts are all due.
void PgsSolver::solve_all(std::size_t begin, std::size_t end, double focus) noexcept {
    const std::size_t last = scheduled().size();
    for (std::size_t place = begin; place < end; place += 4) {
        const int size = static_cast<int>(std::min<std::size_t>(4, end - place));
        const Scheduled* group[4];
        for (int k = 0; k < size; ++k) {
            group[k] = &scheduled()[place + k];
            if (place + k + contacts_ahead < last)
                fetch(scheduled()[place + k + contacts_ahead], scheduled()[place + k + bodies_ahead]);
        }
        solve(group, size, focus);
    }
    now_.updated += end - begin;
}

/// A piece of a level some of whose contacts are scheduled: those of active islands, of those at their limit those of active bodies.
void PgsSolver::solve_scheduled(std::size_t begin, std::size_t end, double focus) noexcept {
    now_.picked.resize(end - begin + 1);
    std::size_t picked = 0;
    for (std::size_t place = begin; place < end; ++place) {
        const Scheduled& scheduled = this->scheduled()[place];
        const bool active = active_[scheduled.island] != 0,
                   limit_reached = limit_reached_[scheduled.island] != 0;
        const bool asked =
            active &&
            (!limit_reached || (active_bodies_[scheduled.first] | active_bodies_[scheduled.second]) != 0);
        now_.picked[picked] = &scheduled;
        picked += asked;
        now_.seen += active && limit_reached;
        now_.active_done += asked && limit_reached;
        now_.updated += asked && !limit_reached;
    }
    solve_picked(picked, focus);
}

/// Those that were picked from a level, four at once.
void PgsSolver::solve_picked(std::size_t picked, double focus) noexcept {
    for (std::size_t k = 0; k < std::min(picked, contacts_ahead); ++k)
        fetch(*now_.picked[k], *now_.picked[k]);
    for (std::size_t k = 0; k < picked; k += 4) {
        const std::size_t size = std::min<std::size_t>(4, picked - k);
        for (std::size_t ahead = k + contacts_ahead; ahead < std::min(picked, k + contacts_ahead + 4);
             ++ahead)
            fetch(*now_.picked[ahead], *now_.picked[ahead]);
        solve(&now_.picked[k], static_cast<int>(size), focus);
    }
}

/// The contacts of active bodies, found without a look at the others: every active island has reached its limit.
void PgsSolver::iterate_active(double focus) {
    if (!marked_) mark_active();
    else marked_now_.swap(marked_next_), std::fill(marked_next_.begin(), marked_next_.end(), 0);
    for (const int island : roots_) now_.seen += active_[island] ? size_[island] : 0;
    marking_ = true;
    std::size_t begin = 0;
    for (const std::size_t end : level_end_) {
        now_.picked.resize(end - begin + 1);
        std::size_t picked = 0;
        for (std::size_t word = begin / 64; 64 * word < end; ++word) {
            std::uint64_t bits = marked_now_[word];
            if (64 * word < begin) bits &= ~std::uint64_t{0} << (begin % 64);
            if (end - 64 * word < 64) bits &= ~(~std::uint64_t{0} << (end % 64));
            for (; bits != 0; bits &= bits - 1) {
                const Scheduled& scheduled =
                    order_[64 * word + static_cast<std::size_t>(std::countr_zero(bits))];
                now_.picked[picked] = &scheduled;
                picked += active_[scheduled.island] != 0;
            }
        }
        now_.active_done += picked;
        solve_picked(picked, focus);
        begin = end;
    }
    marking_ = false;
}

/// Once over what is active: joints, then contacts level by level.
void PgsSolver::iterate(double focus) noexcept {
    for (unsigned char& body : active_bodies_) body >>= 1;
    bool all = whole_, any_at_limit = false;
    for (const int island : roots_) {
        all = all && active_[island];
        any_at_limit = any_at_limit || (active_[island] && limit_reached_[island]);
    }
    now_.updated = now_.seen = now_.active_done = 0;
    for (const int island : roots_) now_.change[island] = 0.0;
    for (int item = 0; item < joint_count_; ++item) {
        const auto [first, second] = bodies_of_[item];
        if (std::min(first, second) == bodies_) continue;
        const int island = root(std::min(first, second));
        if (!active_[island]) continue;
        ++(limit_reached_[island] ? now_.seen : now_.updated);
        now_.active_done += limit_reached_[island] != 0;
        note({item, first, second, island}, joints_.update_joint(static_cast<std::size_t>(item)), focus);
    }
    const bool plain = all && !any_at_limit;
    const bool all_at_limit = std::all_of(roots_.begin(), roots_.end(), [this](int island) {
        return !active_[island] || limit_reached_[island];
    });
    for (const int island : roots_)
        all_touched_ = all_touched_ || (active_[island] && !limit_reached_[island]);
    if (all_at_limit) {
        iterate_active(focus);
    } else {
        marked_ = false;
        std::size_t begin = 0;
        for (const std::size_t end : scheduled_end()) {
            if (plain) solve_all(begin, end, focus);
            else solve_scheduled(begin, end, focus);
            begin = end;
        }
    }
    const std::size_t updated = now_.updated, seen = now_.seen;
    done_ += static_cast<double>(updated + now_.active_done) +
             skip_cost * static_cast<double>(seen - now_.active_done);
    // Lists of what has settled are not read for long.
    if (static_cast<double>(updated + seen) < few_left * static_cast<double>(scheduled().size())) select();
}

FrictionReport PgsSolver::run(int iterations, double tolerance, double focus,
                              const std::function<bool(bool)>& more) {
    FrictionReport report;
    const bool goes_on = started_;
    if (!started_) std::fill(active_.begin(), active_.end(), 1);
    started_ = true;
    if (scheduled_ < bodies_of_.size()) schedule();
    for (const int island : roots_) active_[island] = active_[island] || limit_reached_[island];
    select();
    int look = goes_on ? iterations : 2, late = 0;
    for (int round = 1, until = iterations;; ++round) {
        Watch::look();
        bool any = false;
        if (round > iterations - plain_iterations && std::exchange(relaxation_, 1.0) != 1.0)
            for (PackedContact& c : contacts_) c.own_inverse = c.own > 0.0 ? 1.0 / c.own : 0.0;
        iterate(focus);
        for (const int island : roots_) {
            if (!active_[island]) continue;
            const bool limit_reached = limit_reached_[island] != 0;
            const double change = now_.change[island];
            last_change_[island] = limit_reached ? larger(last_change_[island], change) : change;
            ++report.pgs_iterations;
            active_[island] = !(change <= (limit_reached ? focus : tolerance));
            any = any || active_[island];
        }
        const bool over = !any || round >= until;
        if (!over && round < look) continue;
        look = 2 * round;
        if (round >= until)
            for (const int island : roots_)
                limit_reached_[island] = limit_reached_[island] || active_[island];
        const bool grown = more && more(over);
        if (scheduled_ < bodies_of_.size()) schedule();
        if (!over) continue;
        if (!grown || late == late_rounds) break;
        ++late;
        until = round + iterations;
        look = round + 2;
    }
    for (const int island : roots_) {
        report.residual = larger(report.residual, last_change_[island]);
        report.converged = report.converged && !active_[island];
    }
    report.converged = report.converged && report.residual <= tolerance;
    report.finite = !std::isnan(report.residual);
    return report;
}

void PgsSolver::write(MixedSystem& system) const {
    if (joint_count_ > 0) joints_.write(system);
    else joints_.write_velocities(system);
}

RowsResidual PgsSolver::worst(double focus, double allowed) {
    done_ += residual_cost * static_cast<double>(bodies_of_.size());
    all_touched_ = all_touched_ || joint_count_ > 0;  // whose rows may have moved others
    find_residuals();
    for (const int body : now_.moved) touched_[body] = 0;
    now_.moved.clear();
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
        if (!(residual_[place] <= least)) activate(contacts_[place].first, contacts_[place].second);
    if (worst.row >= 0)
        worst.row = static_cast<int>(std::find(place_.begin(), place_.end(), worst.row) - place_.begin());
    return worst;
}

/// Brings residual_ up to date.
void PgsSolver::find_residuals() {
    residual_.resize(contacts_.size());
    if (all_touched_) {
        for (std::size_t k = 0; k < contacts_.size(); ++k) residual_[k] = residual_of(k);
    } else {
        for (const Scheduled& scheduled : order_) {
            const auto contact = static_cast<std::size_t>(scheduled.item - joint_count_);
            if (touched_[scheduled.first] != 0 || touched_[scheduled.second] != 0)
                residual_[contact] = residual_of(contact);
        }
    }
}

/// How far a contact is from its law, as rows_residual() measures it, m/s.
double PgsSolver::residual_of(std::size_t k) const noexcept {
    const PackedContact& c = contacts_[k];
    const PackedExtras& extras = extras_.empty() ? no_extras_ : extras_[k];
    const Vec3 u = add_turn(velocity(c.first), c.first_arm) - add_turn(velocity(c.second), c.second_arm);
    const double w = dot(c.normal, u) + extras.softness * c.impulse[0] - c.right;
    const double residual = w > 0.0 ? std::min(w, c.own * c.impulse[0]) : -w;
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
