// Newton's method over contacts alone, on a working set of rows; see reduced_contacts.hpp.
#include <algorithm>
#include <cmath>

#include "contacts/reduced_contacts.hpp"
#include "contacts/tolerances.hpp"
#include "linear/elementary.hpp"

namespace spook {

using namespace tolerances::reduced_newton;

/// Whether a row is at a bound that it pushes against.
bool ReducedContacts::rests_at_bound(const Unit& unit) const {
    const double z = z_[unit.at], u = u_[unit.at];
    return (z <= unit.lower && u >= 0.0) || (z >= unit.upper && u <= 0.0);
}

/// The laws to first order over the working set, solved for the steps of all rows. Of rows between bounds, those that are
/// pinned, or at a bound that they push against, stay; friction that is pinned slides on the edge of its disc. `worst`: of the laws
/// in the set, m/s. False if there is no factor.
bool ReducedContacts::find_step(double& worst) {
    const std::size_t n = static_cast<std::size_t>(rows_);
    active_.clear();
    std::vector<int>& place = place_;
    place.assign(n, -1);
    step_.assign(n, 0.0);
    worst = 0.0;
    const auto free = [&](int at) {
        place[at] = static_cast<int>(active_.size());
        active_.push_back(at);
    };
    for (const Unit& unit : units_) {
        const int at = unit.at;
        if (!(unit.own > 0.0)) continue;
        if (unit.normal < 0) {
            if (pinned_[at] == 0 && !rests_at_bound(unit)) free(at);
        } else if (place[unit.normal] >= 0) {
            for (int i = 0; i < unit.size; ++i) free(at + i);
        }  // else an open contact, whose friction is none
    }
    const std::size_t m = active_.size(), wide = m + 1;
    dense_.assign(m * wide, 0.0);  // the last column is the right side
    std::size_t row = 0;
    const auto stay = [&](int at) {  // u = 0
        double* out = dense_.data() + wide * row++;
        for (std::size_t j = 0; j < m; ++j) out[j] = w_[n * at + active_[j]];
        out[place[at]] += relief * w_[(n + 1) * at];
        out[m] = -u_[at];
        worst = std::max(worst, std::abs(u_[at]));
    };
    for (const Unit& unit : units_) {
        const int at = unit.at;
        if (place[at] < 0) continue;
        if (unit.normal < 0) {
            stay(at);
            continue;
        }
        const double bound = unit.coefficient * std::max(0.0, z_[unit.normal]);
        double d[2] = {z_[at] - u_[at] / unit.own, 0.0};
        if (unit.size == 2) d[1] = z_[at + 1] - u_[at + 1] / unit.own;
        const double size = length(d[0], d[1]);
        if ((size <= bound && pinned_[at] == 0) || !(size > 0.0)) {
            for (int i = 0; i < unit.size; ++i) stay(at + i);
            continue;
        }
        const double e[2] = {d[0] / size, d[1] / size}, share = bound / size;
        for (int i = 0; i < unit.size; ++i) {
            // own (δt − mu e δν − share P (δt − δu/own)) = own (mu ν e − t)
            double* out = dense_.data() + wide * row++;
            for (int k = 0; k < unit.size; ++k) {
                const double p = unit.size == 1 ? 0.0 : (i == k ? 1.0 : 0.0) - e[i] * e[k];
                out[place[at + k]] += unit.own * ((i == k ? 1.0 : 0.0) - share * p);
                if (p == 0.0) continue;
                for (std::size_t j = 0; j < m; ++j) out[j] += share * p * w_[n * (at + k) + active_[j]];
            }
            out[place[unit.normal]] -= unit.own * unit.coefficient * e[i];
            out[m] = unit.own * (bound * e[i] - z_[at + i]);
            worst = std::max(worst, std::abs(out[m]));
        }
    }
    return eliminate(m);
}

/// Gauss' elimination with row pivots of dense_, and the steps of active rows from it.
bool ReducedContacts::eliminate(std::size_t m) {
    const std::size_t wide = m + 1;
    for (std::size_t k = 0; k < m; ++k) {
        std::size_t best = k;
        for (std::size_t i = k + 1; i < m; ++i)
            if (std::abs(dense_[wide * i + k]) > std::abs(dense_[wide * best + k])) best = i;
        double* own = dense_.data() + wide * k;
        if (best != k) std::swap_ranges(own + k, own + wide, dense_.data() + wide * best + k);
        if (!(std::abs(own[k]) > 0.0) || !std::isfinite(own[k])) return false;
        const double over = 1.0 / own[k];
        for (std::size_t i = k + 1; i < m; ++i) {
            double* out = dense_.data() + wide * i;
            if (out[k] == 0.0) continue;
            const double by = out[k] * over;
            for (std::size_t j = k + 1; j <= m; ++j) out[j] -= by * own[j];
        }
    }
    for (std::size_t k = m; k-- > 0;) {
        const double* own = dense_.data() + wide * k;
        double value = own[m];
        for (std::size_t j = k + 1; j < m; ++j) value -= own[j] * step_[active_[j]];
        step_[active_[k]] = value / own[k];
    }
    return true;
}

/// The part of the step, 1 at most, after which friction that sticks reaches the edge of its disc, |t| = mu nu; 1 if none.
double ReducedContacts::share_to_edge(const Unit& unit) const {
    const int at = unit.at;
    if (place_[at] < 0 || pinned_[at] != 0) return 1.0;
    const double mu = unit.coefficient, nu = z_[unit.normal], by = step_[unit.normal];
    double ahead = 0.0, a = -mu * mu * by * by, b = -mu * mu * nu * by, c = -mu * mu * nu * nu;
    for (int i = at; i < at + unit.size; ++i) {
        const double aim = z_[i] - u_[i] / unit.own;
        ahead += aim * aim;
        a += step_[i] * step_[i], b += z_[i] * step_[i], c += z_[i] * z_[i];
    }
    if (ahead > mu * mu * nu * nu) return 1.0;  // it slides
    c = std::min(0.0, c);                       // a s² + 2 b s + c = 0
    const double root = b * b - a * c;
    if (!(root >= 0.0)) return 1.0;
    const double over = b + std::sqrt(root);
    return over > 0.0 ? std::min(1.0, -c / over) : 1.0;
}

/// Takes the step as far as the first row between bounds that reaches one, or friction that sticks the edge of its disc: that
/// is pinned there.
void ReducedContacts::take_step() {
    double length_of = 1.0;
    const Unit* hit = nullptr;
    bool low = true;
    for (const Unit& unit : units_) {
        if (unit.normal >= 0) {
            if (const double share = share_to_edge(unit); share < length_of) length_of = share, hit = &unit;
            continue;
        }
        if (place_[unit.at] < 0) continue;
        const double z = z_[unit.at], by = step_[unit.at];
        for (const bool down : {true, false}) {
            const double end = down ? unit.lower : unit.upper;
            if (down ? z + by >= end : z + by <= end) continue;
            const double share = std::max(0.0, (end - z) / by);
            if (share < length_of) length_of = share, hit = &unit, low = down;
        }
    }
    for (const int at : active_) z_[at] += length_of * step_[at];
    if (hit && hit->normal >= 0) pinned_[hit->at] = 1;
    else if (hit) z_[hit->at] = low ? hit->lower : hit->upper, pinned_[hit->at] = low ? -1 : 1;
    for (const Unit& unit : units_) {
        const int at = unit.at;
        if (unit.normal < 0) {
            z_[at] = std::clamp(z_[at], unit.lower, unit.upper);
            continue;
        }
        const double bound = unit.own > 0.0 ? unit.coefficient * z_[unit.normal] : 0.0;
        const double size = unit.size == 2 ? length(z_[at], z_[at + 1]) : std::abs(z_[at]);
        for (int i = 0; size > bound && i < unit.size; ++i) z_[at + i] *= bound / size;
    }
    measure();
}

/// How fast a pinned unit moves the way that would let it go, m/s: off its bound, or along the friction on it.
double ReducedContacts::leaves(const Unit& unit) const {
    const int at = unit.at;
    if (pinned_[at] == 0) return 0.0;
    if (unit.normal < 0) return pinned_[at] * u_[at];
    double along = 0.0, size = 0.0;
    for (int i = at; i < at + unit.size; ++i) along += u_[i] * z_[i], size += z_[i] * z_[i];
    return size > 0.0 ? along / std::sqrt(size) : 0.0;
}

/// Newton's method on a working set of rows, from where iterations have left it. Where points are redundant a step is
/// long: load goes from one to another until that carries all, or more than friction bears, which then slides, be it by
/// 1e-6 m/s. Keeps the best point in best_; ends on the last.
void ReducedContacts::polish(Report& report, double goal) {
    pinned_.assign(static_cast<std::size_t>(rows_), 0);
    int stalled = 0;
    for (int k = 0; k < polish_steps; ++k) {
        const double best = best_residual_;
        if (keep_best() <= goal) return;
        stalled = best_residual_ < 0.5 * best ? 0 : stalled + 1;
        if (stalled > patience) return;
        double worst = 0.0;
        ++report.newton_steps;
        if (!find_step(worst)) return;
        // Of those pinned, the one that would leave its bound most.
        double most = 0.0;
        int of = -1;
        for (const Unit& unit : units_) {
            if (unit.normal >= 0 && !(z_[unit.normal] > 0.0)) pinned_[unit.at] = 0;
            if (const double off = leaves(unit); off > most) most = off, of = unit.at;
        }
        if (worst <= std::max(goal, 1e-2 * most)) {
            if (most <= goal) return;
            pinned_[of] = 0;
            continue;
        }
        take_step();
    }
    keep_best();
}

}  // namespace spook
