#include "contacts/pgs_solver.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "contacts/tolerances.hpp"
#include "run/watch.hpp"

namespace spook {

using namespace tolerances::pgs_solver;

void PgsSolver::start(MixedSystem& system, FrictionModel model) {
    contacts_.begin(system, model);
    begin(system);
}

void PgsSolver::start_beside(const PgsSolver& other, MixedSystem& system, FrictionModel model,
                             double relaxation) {
    contacts_.begin_beside(other.contacts_, system, model, relaxation);
    begin(system);
}

void PgsSolver::begin(const MixedSystem& system) {
    const int bodies = contacts_.bodies();
    schedule_.begin(bodies);
    active_.begin(bodies);
    added_ = 0;
    now_.change.assign(bodies + 1, 0.0);
    now_.moved.clear();
    now_.moved.reserve(bodies);
    started_ = false;
    done_ = 0.0;
    touched_.assign(bodies + 1, 0);
    all_touched_ = true;
    for (const RowBlock& rows : system.rows) {
        int anchor = std::max(rows.first, rows.second);
        for (const FurtherBody& other : rows.further) {
            if (anchor < 0) anchor = other.body;
            else if (other.body >= 0) schedule_.join(anchor, other.body);
        }
        schedule_.link(anchor, anchor == rows.first ? rows.second : rows.first, false);
    }
    schedule_.end_joints();
}

int PgsSolver::add(const PgsContact& given) {
    const int contact = added_++;
    if (schedule_.items.size() ==
        static_cast<std::size_t>(schedule_.joints) + static_cast<std::size_t>(contact)) {
        announce(given.first, given.second);
        schedule_.place.push_back(contact);
        contacts_.resize(contacts_.size() + 1);
    }
    const auto place = static_cast<std::size_t>(schedule_.place[contact]);
    contacts_.put(given, schedule_.place[contact]);
    const auto [first, second] = std::pair{contacts_[place].first, contacts_[place].second};
    active_.activate(first, second);
    touch(first);
    touch(second);
    return contact;
}

void PgsSolver::arrange() {
    complete_order();
    contacts_.resize(schedule_.place.size());
}

void PgsSolver::complete_order() {
    if (!schedule_.complete()) active_.reorder(schedule_.complete_order());
}

void PgsSolver::fetch(const Scheduled& later, const Scheduled& soon) const noexcept {
    contacts_.fetch(static_cast<std::size_t>(later.item - schedule_.joints), soon.first, soon.second);
}

void PgsSolver::touch(int body) noexcept {
    if (body == contacts_.bodies() || touched_[body] != 0) return;
    touched_[body] = 1;
    now_.moved.push_back(body);  // has room for all
}

inline void PgsSolver::note(const Scheduled& scheduled, double change, double focus) noexcept {
    now_.change[scheduled.island] = larger(now_.change[scheduled.island], change);
    if (!schedule_.limit_reached[scheduled.island] || change == 0.0) return;
    touch(scheduled.first);
    touch(scheduled.second);
    if (!(change <= focus)) active_.activate(scheduled.first, scheduled.second);
}

/// Up to four contacts that share no moving body.
void PgsSolver::solve(const Scheduled* const group[4], int size, double focus) noexcept {
    double change[4];
    const auto place = [&](int k) { return static_cast<std::size_t>(group[k]->item - schedule_.joints); };
    contacts_.update(size, place, change);
    for (int k = 0; k < size; ++k) note(*group[k], change[k], focus);
}

/// A piece of a level whose contacts are all due.
void PgsSolver::solve_all(std::size_t begin, std::size_t end, double focus) noexcept {
    const std::size_t last = schedule_.scheduled().size();
    for (std::size_t place = begin; place < end; place += 4) {
        const int size = static_cast<int>(std::min<std::size_t>(4, end - place));
        const Scheduled* group[4];
        for (int k = 0; k < size; ++k) {
            group[k] = &schedule_.scheduled()[place + k];
            if (place + k + contacts_ahead < last)
                fetch(schedule_.scheduled()[place + k + contacts_ahead],
                      schedule_.scheduled()[place + k + bodies_ahead]);
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
        const Scheduled& scheduled = schedule_.scheduled()[place];
        const bool active = schedule_.active[scheduled.island] != 0,
                   limit_reached = schedule_.limit_reached[scheduled.island] != 0;
        const bool asked = active && (!limit_reached || active_.any(scheduled.first, scheduled.second));
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
    active_.begin_marks(schedule_.order);
    for (const int island : schedule_.roots)
        now_.seen += schedule_.active[island] ? schedule_.size[island] : 0;
    std::size_t begin = 0;
    for (const std::size_t end : schedule_.level_end) {
        now_.picked.resize(end - begin + 1);
        std::size_t picked = 0;
        for (std::size_t word = begin / 64; 64 * word < end; ++word) {
            std::uint64_t bits = active_.marks()[word];
            if (64 * word < begin) bits &= ~std::uint64_t{0} << (begin % 64);
            if (end - 64 * word < 64) bits &= ~(~std::uint64_t{0} << (end % 64));
            for (; bits != 0; bits &= bits - 1) {
                const Scheduled& scheduled =
                    schedule_.order[64 * word + static_cast<std::size_t>(std::countr_zero(bits))];
                now_.picked[picked] = &scheduled;
                picked += schedule_.active[scheduled.island] != 0;
            }
        }
        now_.active_done += picked;
        solve_picked(picked, focus);
        begin = end;
    }
    active_.end_marks();
}

/// Once over what is active: joints, then contacts level by level.
void PgsSolver::iterate(double focus) noexcept {
    active_.next_iteration();
    bool all = schedule_.whole, any_at_limit = false;
    for (const int island : schedule_.roots) {
        all = all && schedule_.active[island];
        any_at_limit = any_at_limit || (schedule_.active[island] && schedule_.limit_reached[island]);
    }
    now_.updated = now_.seen = now_.active_done = 0;
    for (const int island : schedule_.roots) now_.change[island] = 0.0;
    for (int item = 0; item < schedule_.joints; ++item) {
        const auto [first, second] = schedule_.items[item];
        if (std::min(first, second) == contacts_.bodies()) continue;
        const int island = schedule_.root(std::min(first, second));
        if (!schedule_.active[island]) continue;
        ++(schedule_.limit_reached[island] ? now_.seen : now_.updated);
        now_.active_done += schedule_.limit_reached[island] != 0;
        note({item, first, second, island}, contacts_.update_joint(static_cast<std::size_t>(item)), focus);
    }
    const bool plain = all && !any_at_limit;
    const bool all_at_limit = std::all_of(schedule_.roots.begin(), schedule_.roots.end(), [this](int island) {
        return !schedule_.active[island] || schedule_.limit_reached[island];
    });
    for (const int island : schedule_.roots)
        all_touched_ = all_touched_ || (schedule_.active[island] && !schedule_.limit_reached[island]);
    if (all_at_limit) {
        iterate_active(focus);
    } else {
        active_.forget_marks();
        std::size_t begin = 0;
        for (const std::size_t end : schedule_.scheduled_end()) {
            if (plain) solve_all(begin, end, focus);
            else solve_scheduled(begin, end, focus);
            begin = end;
        }
    }
    const std::size_t updated = now_.updated, seen = now_.seen;
    done_ += static_cast<double>(updated + now_.active_done) +
             skip_cost * static_cast<double>(seen - now_.active_done);
    // Lists of what has settled are not read for long.
    if (static_cast<double>(updated + seen) < few_left * static_cast<double>(schedule_.scheduled().size()))
        schedule_.select();
}

FrictionReport PgsSolver::run(int iterations, double tolerance, double focus,
                              const std::function<bool(bool)>& more) {
    FrictionReport report;
    const bool goes_on = started_;
    if (!started_) std::fill(schedule_.active.begin(), schedule_.active.end(), 1);
    started_ = true;
    complete_order();
    for (const int island : schedule_.roots)
        schedule_.active[island] = schedule_.active[island] || schedule_.limit_reached[island];
    schedule_.select();
    int look = goes_on ? iterations : 2, late = 0;
    for (int round = 1, until = iterations;; ++round) {
        Watch::look();
        bool any = false;
        if (round > iterations - plain_iterations) contacts_.relax_no_more();
        iterate(focus);
        for (const int island : schedule_.roots) {
            if (!schedule_.active[island]) continue;
            const bool limit_reached = schedule_.limit_reached[island] != 0;
            const double change = now_.change[island];
            schedule_.last_change[island] =
                limit_reached ? larger(schedule_.last_change[island], change) : change;
            ++report.pgs_iterations;
            schedule_.active[island] = !(change <= (limit_reached ? focus : tolerance));
            any = any || schedule_.active[island];
        }
        const bool over = !any || round >= until;
        if (!over && round < look) continue;
        look = 2 * round;
        if (round >= until)
            for (const int island : schedule_.roots)
                schedule_.limit_reached[island] = schedule_.limit_reached[island] || schedule_.active[island];
        const bool grown = more && more(over);
        complete_order();
        if (!over) continue;
        if (!grown || late == late_rounds) break;
        ++late;
        until = round + iterations;
        look = round + 2;
    }
    for (const int island : schedule_.roots) {
        report.residual = larger(report.residual, schedule_.last_change[island]);
        report.converged = report.converged && !schedule_.active[island];
    }
    report.converged = report.converged && report.residual <= tolerance;
    report.finite = !std::isnan(report.residual);
    return report;
}

RowsResidual PgsSolver::worst(double focus, double allowed) {
    done_ += residual_cost * static_cast<double>(schedule_.items.size());
    all_touched_ = all_touched_ || schedule_.joints > 0;  // whose rows may have moved others
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
        if (!(residual_[place] <= least)) active_.activate(contacts_[place].first, contacts_[place].second);
    if (worst.row >= 0)
        worst.row = static_cast<int>(std::find(schedule_.place.begin(), schedule_.place.end(), worst.row) -
                                     schedule_.place.begin());
    return worst;
}

/// Brings residual_ up to date.
void PgsSolver::find_residuals() {
    residual_.resize(contacts_.size());
    if (all_touched_) {
        for (std::size_t k = 0; k < contacts_.size(); ++k) residual_[k] = contacts_.residual(k);
    } else {
        for (const Scheduled& scheduled : schedule_.order) {
            const auto contact = static_cast<std::size_t>(scheduled.item - schedule_.joints);
            if (touched_[scheduled.first] != 0 || touched_[scheduled.second] != 0)
                residual_[contact] = contacts_.residual(contact);
        }
    }
}

}  // namespace spook
