#include <algorithm>
#include <cmath>

#include "contacts/reduced_newton.hpp"
#include "contacts/tolerances.hpp"
#include "linear/elementary.hpp"

namespace spook {

using namespace tolerances::reduced_newton;

namespace {

constexpr signed char entered = 2;  // of pinned_: in the set, although the row still is at its bound

}  // namespace

/// u = W z + q.
void ReducedNewton::measure() {
    const std::size_t n = static_cast<std::size_t>(rows_);
    u_ = q_;
    for (std::size_t j = 0; j < n; ++j) {
        if (z_[j] == 0.0) continue;
        const double* column = w_.data() + n * j;
        for (std::size_t i = 0; i < n; ++i) u_[i] += column[i] * z_[j];
    }
}

/// How far a unit is from where a step of projection puts it, as a velocity.
double ReducedNewton::residual_of(const Unit& unit, const double* z, const double* u) const {
    if (!(unit.own > 0.0)) return 0.0;
    const int at = unit.at;
    if (unit.size == 1) {
        const double bound = unit.normal < 0 ? 0.0 : unit.coefficient * std::max(0.0, z[unit.normal]);
        const double lower = unit.normal < 0 ? unit.lower : -bound,
                     upper = unit.normal < 0 ? unit.upper : bound;
        return unit.own * std::abs(z[at] - std::clamp(z[at] - u[at] / unit.own, lower, upper));
    }
    const double bound = unit.coefficient * std::max(0.0, z[unit.normal]);
    double t1 = z[at] - u[at] / unit.own, t2 = z[at + 1] - u[at + 1] / unit.own;
    const double size = length(t1, t2);
    if (size > bound) t1 *= bound / size, t2 *= bound / size;
    return unit.own * length(z[at] - t1, z[at + 1] - t2);
}

double ReducedNewton::residual() const {
    double worst = 0.0;
    for (const Unit& unit : units_) {
        const double own = residual_of(unit, z_.data(), u_.data());
        if (!(own <= worst)) worst = own;
    }
    return worst;
}

double ReducedNewton::keep_best() {
    const double now = residual();
    if (now < best_residual_) best_residual_ = now, best_ = z_;
    return now;
}

/// Whether a row is at a bound that it pushes against.
bool ReducedNewton::rests_at_bound(const Unit& unit) const {
    const double z = z_[unit.at], u = u_[unit.at];
    return (z <= unit.lower && u >= 0.0) || (z >= unit.upper && u <= 0.0);
}

/// Of rows between bounds, those that are pinned, or at a bound that they push against, stay; friction of an open contact is none.
void ReducedNewton::choose_rows() {
    active_.clear();
    place_.assign(static_cast<std::size_t>(rows_), -1);
    const auto free = [&](int at) {
        place_[at] = static_cast<int>(active_.size());
        active_.push_back(at);
    };
    for (const Unit& unit : units_) {
        const int at = unit.at;
        if (!(unit.own > 0.0)) continue;
        if (unit.normal < 0) {
            if (pinned_[at] == entered || (pinned_[at] == 0 && !rests_at_bound(unit))) free(at);
        } else if (place_[unit.normal] >= 0) {
            for (int i = 0; i < unit.size; ++i) free(at + i);
        }
    }
}

/// The laws to first order over the working set, solved for the steps of all rows; friction that is pinned slides on the edge of
/// its disc. `worst`: of the laws in the set but the driver's, m/s; drive_: how they follow a driver. False if there is no factor.
bool ReducedNewton::find_step(double& worst) {
    const std::size_t n = static_cast<std::size_t>(rows_);
    choose_rows();
    step_.assign(n, 0.0);
    drive_.assign(n, 0.0);
    worst = 0.0;
    const std::size_t m = active_.size(), wide = m + 2;
    // The last columns are the right sides: what is left, and the driver's own row.
    dense_.assign(m * wide, 0.0);
    std::size_t row = 0;
    const auto stay = [&](int at) {  // u = 0
        double* out = dense_.data() + wide * row++;
        for (std::size_t j = 0; j < m; ++j) out[j] = w_[n * at + active_[j]];
        out[place_[at]] += relief_ * w_[(n + 1) * at];
        out[m] = -u_[at];
        if (driver_ && at == driver_->at) out[m + 1] = w_[(n + 1) * at];
        else worst = std::max(worst, std::abs(u_[at]));
    };
    for (const Unit& unit : units_) {
        const int at = unit.at;
        if (place_[at] < 0) continue;
        if (unit.normal < 0) {
            stay(at);
            continue;
        }
        double d[2] = {z_[at] - u_[at] / unit.own, 0.0};
        if (unit.size == 2) d[1] = z_[at + 1] - u_[at + 1] / unit.own;
        const double size = length(d[0], d[1]);
        const bool within = size <= unit.coefficient * std::max(0.0, z_[unit.normal]);
        if ((within && pinned_[at] == 0) || !(size > 0.0))
            for (int i = 0; i < unit.size; ++i) stay(at + i);
        else lay_slide(unit, d, size, row, worst);
    }
    return eliminate(m);
}

/// Rows of friction on the edge of its disc: own (δt − mu e δν − share P (δt − δu/own)) = own (mu ν e − t), e along d.
void ReducedNewton::lay_slide(const Unit& unit, const double* d, double size, std::size_t& row,
                              double& worst) {
    const std::size_t n = static_cast<std::size_t>(rows_), m = active_.size(), wide = m + 2;
    const int at = unit.at;
    const double bound = unit.coefficient * std::max(0.0, z_[unit.normal]);
    const double e[2] = {d[0] / size, d[1] / size}, share = bound / size;
    for (int i = 0; i < unit.size; ++i) {
        double* out = dense_.data() + wide * row++;
        for (int k = 0; k < unit.size; ++k) {
            const double p = unit.size == 1 ? 0.0 : (i == k ? 1.0 : 0.0) - e[i] * e[k];
            out[place_[at + k]] += unit.own * ((i == k ? 1.0 : 0.0) - share * p);
            if (p == 0.0) continue;
            for (std::size_t j = 0; j < m; ++j) out[j] += share * p * w_[n * (at + k) + active_[j]];
        }
        out[place_[unit.normal]] -= unit.own * unit.coefficient * e[i];
        out[m] = unit.own * (bound * e[i] - z_[at + i]);
        worst = std::max(worst, std::abs(out[m]));
    }
}

/// Gauss' elimination with row pivots of dense_, and the steps of active rows from it.
bool ReducedNewton::eliminate(std::size_t m) {
    const std::size_t wide = m + 2;
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
            for (std::size_t j = k + 1; j < wide; ++j) out[j] -= by * own[j];
        }
    }
    for (std::size_t k = m; k-- > 0;) {
        const double* own = dense_.data() + wide * k;
        double value = own[m], driven = own[m + 1];
        for (std::size_t j = k + 1; j < m; ++j)
            value -= own[j] * step_[active_[j]], driven -= own[j] * drive_[active_[j]];
        step_[active_[k]] = value / own[k];
        drive_[active_[k]] = driven / own[k];
    }
    return true;
}

/// The part of the step, 1 at most, after which friction that sticks reaches the edge of its disc, |t| = mu nu; 1 if none.
double ReducedNewton::share_to_edge(const Unit& unit) const {
    const int at = unit.at;
    if (place_[at] < 0 || pinned_[at] != 0) return unbounded;
    const double mu = unit.coefficient, nu = z_[unit.normal], by = step_[unit.normal];
    double ahead = 0.0, a = -mu * mu * by * by, b = -mu * mu * nu * by, c = -mu * mu * nu * nu;
    for (int i = at; i < at + unit.size; ++i) {
        const double aim = z_[i] - u_[i] / unit.own;
        ahead += aim * aim;
        a += step_[i] * step_[i], b += z_[i] * step_[i], c += z_[i] * z_[i];
    }
    if (ahead > mu * mu * nu * nu) return unbounded;  // it slides
    c = std::min(0.0, c);                             // a s² + 2 b s + c = 0
    const double root = b * b - a * c;
    if (!(root >= 0.0)) return unbounded;
    const double over = b + std::sqrt(root);
    return over > 0.0 ? -c / over : unbounded;
}

/// The part of the step after which a row between bounds that is in the set reaches one; `low`: which.
double ReducedNewton::share_to_bound(const Unit& unit, bool& low) const {
    const double z = z_[unit.at], by = step_[unit.at];
    low = by < 0.0;
    if (by == 0.0 || place_[unit.at] < 0) return unbounded;
    const double end = low ? unit.lower : unit.upper;
    return std::abs(end) == unbounded ? unbounded : std::max(0.0, (end - z) / by);
}

/// image_ = W × the step.
void ReducedNewton::find_image() {
    const std::size_t n = static_cast<std::size_t>(rows_);
    image_.assign(n, 0.0);
    for (const int j : active_) {
        const double* w = w_.data() + n * static_cast<std::size_t>(j);
        for (std::size_t i = 0; i < n; ++i) image_[i] += w[i] * step_[j];
    }
}

/// The part of the step after which a row that rests at its bound would leave it.
double ReducedNewton::share_to_leaving(const Unit& unit) const {
    const int at = unit.at;
    if (place_[at] >= 0 || !(unit.own > 0.0) || unit.lower == unit.upper) return unbounded;
    const double side = z_[at] <= unit.lower ? 1.0 : -1.0, u = side * u_[at], by = side * image_[at];
    return by < 0.0 && u >= 0.0 ? u / -by : unbounded;
}

/// Takes the step as far as the first row between bounds that reaches one, or friction that sticks the edge of its disc, which
/// is pinned there; where a row drives, or the first that would leave its bound, which enters the set. Whether all of it was taken.
bool ReducedNewton::take_step(double most) {
    double length_of = most;
    const Unit* hit = nullptr;
    bool low = true, enters = false;
    if (driver_) find_image();
    for (const Unit& unit : units_) {
        bool down = true;
        double share = unit.normal >= 0 ? share_to_edge(unit) : share_to_bound(unit, down);
        if (share < length_of) length_of = share, hit = &unit, low = down, enters = false;
        if (!driver_ || unit.normal >= 0) continue;
        share = share_to_leaving(unit);
        if (share < length_of) length_of = share, hit = &unit, enters = true;
    }
    if (length_of == unbounded) {  // squeezed without a way out
        ended_ = true;
        return false;
    }
    for (const int at : active_) z_[at] += length_of * step_[at];
    if (hit && enters) pinned_[hit->at] = entered;
    else if (hit && hit->normal >= 0) pinned_[hit->at] = 1;
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
    return !hit;
}

/// How fast a pinned unit moves the way that would let it go, m/s: off its bound, or along the friction on it.
double ReducedNewton::leaves(const Unit& unit) const {
    const int at = unit.at;
    if (pinned_[at] == 0 || pinned_[at] == entered) return 0.0;
    if (unit.normal < 0) return pinned_[at] * u_[at];
    double along = 0.0, size = 0.0;
    for (int i = at; i < at + unit.size; ++i) along += u_[i] * z_[i], size += z_[i] * z_[i];
    return size > 0.0 ? along / std::sqrt(size) : 0.0;
}

/// A row that has been let go leaves its bound by Newton's step, unless that leads back: where points are redundant and slide, the
/// laws of the others can all hold only the other way. There they are followed, whatever the driver's own law says, until a row
/// reaches its bound or leaves it, and so on (Lemke 1965). False once there is no driver any more, or no way to go.
bool ReducedNewton::drive(double worst, double goal) {
    const int at = driver_->at;
    const double off = -way_ * u_[at];
    if (!(off > goal) || place_[at] < 0) return false;
    if (way_ * step_[at] > 0.0) {
        if (take_step(1.0)) driver_ = nullptr;
        return true;
    }
    const double response = drive_[at];
    const bool corrects = worst > off;  // the others first, for the driver as it stands
    const double share = corrects ? step_[at] / response : 0.0;
    for (const int i : active_)
        step_[i] = corrects ? step_[i] - share * drive_[i] : way_ * drive_[i] / response;
    step_[at] = corrects ? 0.0 : way_;
    take_step(corrects ? 1.0 : unbounded);
    return true;
}

/// The one of those pinned that would leave its bound most, at `most` m/s; null if none would.
const ReducedNewton::Unit* ReducedNewton::most_held(double& most) {
    most = 0.0;
    const Unit* of = nullptr;
    for (const Unit& unit : units_) {
        if (unit.normal >= 0 && !(z_[unit.normal] > 0.0)) pinned_[unit.at] = 0;
        if (const double off = leaves(unit); off > most) most = off, of = &unit;
    }
    return of;
}

/// Newton's method on a working set of rows, from where iterations have left it. Where points are redundant a step is
/// long: load goes from one to another until that carries all, or more than friction bears, which then slides, be it by
/// 1e-6 m/s. Keeps the best point in best_; ends on the last.
int ReducedNewton::polish(double goal, bool tight) {
    pinned_.assign(static_cast<std::size_t>(rows_), 0);
    driver_ = nullptr, ended_ = false;
    // Without friction the laws are symmetric: no step leads back.
    const bool rubs =
        std::any_of(units_.begin(), units_.end(), [](const Unit& unit) { return unit.normal >= 0; });
    int stalled = 0, taken = 0;
    for (int k = 0; k < polish_steps && !ended_; ++k) {
        const double best = best_residual_, now = keep_best();
        if (now <= goal) return taken;
        stalled = best_residual_ < 0.5 * best ? 0 : stalled + 1;
        if ((rows_ > many_rows || !rubs) && stalled > patience) return taken;
        relief_ = tight || !rubs ? relief : std::clamp(relief_share * now / speed_, relief, most_relief);
        double worst = 0.0, most = 0.0;
        ++taken;
        if (!find_step(worst)) return taken;
        const Unit* held = most_held(most);
        if (driver_ && drive(worst, goal)) continue;
        driver_ = nullptr;
        if (!(worst <= std::max(goal, 1e-2 * most))) {
            take_step(1.0);
            continue;
        }
        if (most <= goal) return taken;
        const bool drives = rubs && held->normal < 0;
        if (drives) driver_ = held, way_ = -pinned_[held->at];
        pinned_[held->at] = drives ? entered : 0;
    }
    keep_best();
    return taken;
}

}  // namespace spook
