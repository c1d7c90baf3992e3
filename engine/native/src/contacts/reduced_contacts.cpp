#include "contacts/reduced_contacts.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/tolerances.hpp"
#include "linear/elementary.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

using namespace tolerances::reduced_contacts;

/// Calls part(body, jacobian) for each body of a row.
template <class Part> void each_body(const RowBlock& block, int row, const Part& part) {
    if (block.first >= 0) part(block.first, block.first_jacobian[row]);
    if (block.second >= 0) part(block.second, block.second_jacobian[row]);
    for (const FurtherBody& other : block.further) part(other.body, other.jacobian);
}

/// G v of one row.
double along(const RowBlock& block, int row, const double* v) {
    double sum = 0.0;
    each_body(block, row, [&](int body, const Vec6& g) {
        const double* x = v + 6 * static_cast<std::size_t>(body);
        sum += g[0] * x[0] + g[1] * x[1] + g[2] * x[2] + g[3] * x[3] + g[4] * x[4] + g[5] * x[5];
    });
    return sum;
}

/// p += Gᵀ z of one row.
void put(const RowBlock& block, int row, double z, double* p) {
    each_body(block, row, [&](int body, const Vec6& g) {
        for (int a = 0; a < 6; ++a) p[6 * static_cast<std::size_t>(body) + a] += g[a] * z;
    });
}

}  // namespace

bool ReducedContacts::takes(const MixedSystem& system, const std::vector<FrictionPoint>& points) {
    int bounded = 0, touching = 0;
    const bool turning = std::any_of(points.begin(), points.end(), turns);
    bool jointed = false;
    for (const RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i)
            if (BilateralRows::is_bilateral(block, i)) jointed = true;
            else ++bounded, touching += block.is_contact ? 1 : 0;
    if (bounded == 0 || !(jointed || turning)) return false;
    if (!jointed) return bounded <= most_turning_rows;
    return bounded <= most_bounded_rows && (turning || touching <= most_rows);
}

void ReducedContacts::leave_open(MixedSystem& system) noexcept {
    for (RowBlock& block : system.rows) {
        block.multiplier = {};
        if (block.leads) block.right = {};
    }
}

void ReducedContacts::analyse(const MixedSystem& system) {
    std::vector<Pattern> pattern;
    std::vector<std::pair<int, int>> further;
    joints_.clear();
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        Joint joint;
        joint.block = static_cast<int>(k);
        for (int i = 0; i < block.size; ++i)
            if (BilateralRows::is_bilateral(block, i)) joint.row[joint.count++] = i;
        if (joint.count == 0) continue;
        for (const FurtherBody& other : block.further)
            further.emplace_back(static_cast<int>(joints_.size()), other.body);
        joints_.push_back(joint);
        pattern.push_back({block.first, block.second, joint.count});
    }
    const int bodies = static_cast<int>(system.mass.size());
    std::vector<BlockEdge> edges;
    std::size_t beyond = 0;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
        const int node = bodies + static_cast<int>(k);
        Joint& joint = joints_[k];
        const auto tie = [&](int body) {
            if (body < 0) return -1;
            edges.push_back({body, node});
            return static_cast<int>(edges.size()) - 1;
        };
        joint.first_edge = tie(pattern[k].first);
        joint.second_edge = tie(pattern[k].second);
        for (; beyond < further.size() && further[beyond].first == static_cast<int>(k); ++beyond) {
            const int edge = tie(further[beyond].second);
            if (joint.further_edge < 0) joint.further_edge = edge;
        }
    }
    if (bodies == bodies_ && pattern == pattern_ && further == further_) return;
    bodies_ = -1;  // until the analysis is whole
    std::vector<int> sizes(bodies, 6);
    std::vector<std::uint8_t> is_constraint(bodies, 0);
    for (const Joint& joint : joints_) sizes.push_back(joint.count), is_constraint.push_back(1);
    matrix_.analyse(sizes, edges, is_constraint);
    pattern_ = std::move(pattern);
    further_ = std::move(further);
    bodies_ = bodies;
}

bool ReducedContacts::factor(const MixedSystem& system) {
    for (int b = 0; b < bodies_; ++b) std::copy_n(system.mass[b].data(), 36, matrix_.diagonal(b));
    for (std::size_t k = 0; k < joints_.size(); ++k) {
        const Joint& joint = joints_[k];
        const RowBlock& block = system.rows[joint.block];
        const int n = joint.count;
        double* diagonal = matrix_.diagonal(bodies_ + static_cast<int>(k));
        std::fill_n(diagonal, n * n, 0.0);
        for (int i = 0; i < n; ++i) diagonal[(n + 1) * i] = -block.softness[joint.row[i]];
        const auto couple = [&](int edge, const Vec6* rows) {
            double* coupling = matrix_.coupling(edge);
            for (int a = 0; a < 6; ++a)
                for (int i = 0; i < n; ++i) coupling[a * n + i] = rows[joint.row[i]][a];
        };
        if (joint.first_edge >= 0) couple(joint.first_edge, block.first_jacobian.data());
        if (joint.second_edge >= 0) couple(joint.second_edge, block.second_jacobian.data());
        for (std::size_t o = 0; o < block.further.size(); ++o)
            couple(joint.further_edge + static_cast<int>(o), &block.further[o].jacobian);
    }
    const std::uint64_t before = matrix_.counters().floored_pivots;
    if (!matrix_.factor(floor_of_pivots)) return false;
    floored_ = matrix_.counters().floored_pivots > before;
    return true;
}

void ReducedContacts::list_units(const MixedSystem& system, const std::vector<FrictionPoint>& points) {
    units_.clear();
    rows_ = 0;
    std::size_t next = 0;
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        const bool rubs = next < points.size() && points[next].block == static_cast<int>(k);
        const int normal = rows_;
        for (int i = 0; i < (rubs ? 1 : block.size); ++i) {
            if (BilateralRows::is_bilateral(block, i)) continue;
            Unit unit;
            unit.block = static_cast<int>(k), unit.row = i, unit.at = rows_++;
            unit.lower = block.lower[i], unit.upper = block.upper[i];
            units_.push_back(unit);
        }
        for (; next < points.size() && points[next].block == static_cast<int>(k); ++next) {
            Unit unit;
            unit.block = static_cast<int>(k), unit.row = points[next].row, unit.size = points[next].size;
            unit.at = rows_;
            unit.normal = normal, unit.coefficient = points[next].coefficient;
            rows_ += unit.size;
            units_.push_back(unit);
        }
    }
}

/// What acts without the bounded rows.
void ReducedContacts::fill_right(const MixedSystem& system) {
    right_.assign(static_cast<std::size_t>(matrix_.unknowns()), 0.0);
    for (int b = 0; b < bodies_; ++b) std::copy_n(system.momentum[b].data(), 6, right_.data() + 6 * b);
    for (std::size_t k = 0; k < joints_.size(); ++k)
        for (int i = 0; i < joints_[k].count; ++i)
            right_[matrix_.offset(bodies_ + static_cast<int>(k)) + i] =
                system.rows[joints_[k].block].right[joints_[k].row[i]];
}

/// W and q. With A = Uᵀ D U, W is Yᵀ D⁻¹ Y for Y = U⁻ᵀ Gᵀ: half of a solve per row, and only along its bodies' ways to
/// the root. A floored pivot is in the factor only: then W is taken from solutions refined against A.
void ReducedContacts::reduce(const MixedSystem& system) {
    const std::size_t all = static_cast<std::size_t>(matrix_.unknowns()), n = static_cast<std::size_t>(rows_);
    fill_right(system);
    free_.resize(all);
    matrix_.solve_refined(right_.data(), free_.data(), 1);
    mass_.find(system.mass);
    response_.assign(all * n, 0.0);
    w_.assign(n * n, 0.0);
    q_.resize(n), z_.resize(n), u_.resize(n);
    speed_ = 0.0;
    for (int b = 0; b < bodies_; ++b)
        for (int a = 0; a < 3; ++a) speed_ = std::max(speed_, std::abs(free_[6 * b + a]));
    for (const Unit& unit : units_) {
        const RowBlock& block = system.rows[unit.block];
        touched_.clear();
        each_body(block, unit.row, [&](int body, const Vec6&) { touched_.push_back(body); });
        matrix_.reach(touched_, reached_);
        for (int i = 0; i < unit.size; ++i) {
            const int row = unit.row + i;
            const auto at = static_cast<std::size_t>(unit.at) + static_cast<std::size_t>(i);
            double* column = response_.data() + all * at;
            put(block, row, 1.0, column);
            if (!floored_) matrix_.forward(reached_, column);
            q_[at] = along(block, row, free_.data()) - block.right[row];
            z_[at] = block.multiplier[row];
            speed_ = std::max(speed_, std::abs(block.right[row]));
        }
    }
    floored_ ? couple_refined(system) : couple();
    for (Unit& unit : units_) {
        const RowBlock& block = system.rows[unit.block];
        double apart = 0.0;
        unit.own = 0.0;
        for (int row = unit.row; row < unit.row + unit.size; ++row) {
            double& own = w_[(n + 1) * static_cast<std::size_t>(unit.at + row - unit.row)];
            own += block.softness[row];
            unit.own += own;
            apart += own_inertia(mass_, block, row);
        }
        if (!(unit.own > held * apart)) unit.own = 0.0;
    }
}

/// W unknown by unknown: what one adds is the product of the few rows that reach it.
void ReducedContacts::couple() {
    const std::size_t all = static_cast<std::size_t>(matrix_.unknowns()), n = static_cast<std::size_t>(rows_);
    line_.resize(n);
    for (int k = 0; k < matrix_.block_count(); ++k) {
        const auto [offset, inverse] = matrix_.pivots(k);
        for (std::size_t a = 0; a < inverse.size(); ++a) {
            const double* y = response_.data() + static_cast<std::size_t>(offset) + a;
            for (std::size_t i = 0; i < n; ++i) line_[i] = y[all * i];
            for (std::size_t i = 0; i < n; ++i) {
                if (line_[i] == 0.0) continue;
                const double scaled = inverse[a] * line_[i];
                double* w = w_.data() + n * i;
                for (std::size_t j = 0; j <= i; ++j) w[j] += scaled * line_[j];
            }
        }
    }
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < i; ++j) w_[n * j + i] = w_[n * i + j];
}

void ReducedContacts::couple_refined(const MixedSystem& system) {
    const std::size_t all = static_cast<std::size_t>(matrix_.unknowns()), n = static_cast<std::size_t>(rows_);
    for (std::size_t at = 0; at < n; ++at) {
        double* column = response_.data() + all * at;
        right_.assign(column, column + all);
        matrix_.solve_refined(right_.data(), column, refinements_of_floored);
        for (const Unit& other : units_)
            for (int j = 0; j < other.size; ++j) {
                const auto to = static_cast<std::size_t>(other.at) + static_cast<std::size_t>(j);
                if (to > at) continue;
                w_[n * at + to] = w_[n * to + at] = along(system.rows[other.block], other.row + j, column);
            }
    }
}

void ReducedContacts::change(int at, double by) {
    if (by == 0.0) return;
    z_[at] += by;
    const std::size_t n = static_cast<std::size_t>(rows_);
    const double* column = w_.data() + n * static_cast<std::size_t>(at);
    double* u = u_.data();
    for (std::size_t i = 0; i < n; ++i) u[i] += column[i] * by;
}

void ReducedContacts::find_row(const Unit& unit) {
    const double z = z_[unit.at];
    if (!(unit.own > 0.0)) return change(unit.at, std::clamp(0.0, unit.lower, unit.upper) - z);
    change(unit.at, std::clamp(z - u_[unit.at] / unit.own, unit.lower, unit.upper) - z);
}

/// The two rows' own problem exactly: free within the disc, or on its edge, (W + λ) t = −b with |t| the radius.
void ReducedContacts::find_disc(const Unit& unit) {
    const std::size_t n = static_cast<std::size_t>(rows_), at = static_cast<std::size_t>(unit.at);
    const double bound = unit.own > 0.0 ? unit.coefficient * std::max(0.0, z_[unit.normal]) : 0.0;
    if (unit.size == 1) {
        if (!(unit.own > 0.0)) return change(unit.at, -z_[unit.at]);
        change(unit.at, std::clamp(z_[at] - u_[at] / unit.own, -bound, bound) - z_[at]);
        return;
    }
    const double a = w_[(n + 1) * at], c = w_[(n + 1) * (at + 1)], b = w_[n * at + at + 1];
    const double r1 = a * z_[at] + b * z_[at + 1] - u_[at], r2 = b * z_[at] + c * z_[at + 1] - u_[at + 1];
    double t1 = 0.0, t2 = 0.0, more = 0.0;
    for (int k = 0; k < 20 && bound > 0.0; ++k) {
        const double d1 = a + more, d2 = c + more, det = d1 * d2 - b * b;
        if (!(det > 1e-14 * (a + c) * (a + c))) {  // a row that moves nothing
            more += 1e-7 * (a + c);
            continue;
        }
        t1 = (d2 * r1 - b * r2) / det, t2 = (d1 * r2 - b * r1) / det;
        const double size = length(t1, t2);
        if (size <= bound * (1.0 + 1e-14)) break;
        // Newton's step of 1/|t| = 1/bound, which is nearly linear in λ.
        const double s1 = (d2 * t1 - b * t2) / det, s2 = (d1 * t2 - b * t1) / det;
        more += (size / bound - 1.0) * size * size / (t1 * s1 + t2 * s2);
    }
    const double size = length(t1, t2);
    if (size > bound) t1 *= bound / size, t2 *= bound / size;
    change(unit.at, t1 - z_[at]);
    change(unit.at + 1, t2 - z_[at + 1]);
}

void ReducedContacts::iterate() {
    for (const Unit& unit : units_)
        if (unit.normal < 0) find_row(unit);
        else find_disc(unit);
}

/// Iterations load one point alone of several that share a load, and what slides is turned by it. Rough points of a pair of which
/// none is known to push start from where they push alike, and from friction that is found for all at once.
void ReducedContacts::share_new_loads(const MixedSystem& system) {
    new_pairs_.clear();
    for (std::size_t k = 0, next = 0; k < units_.size(); k = next) {
        const RowBlock& first = system.rows[units_[k].block];
        NewPair pair;
        bool known = false;
        for (; next < units_.size(); ++next) {
            const Unit& unit = units_[next];
            const RowBlock& block = system.rows[unit.block];
            if (block.first != first.first || block.second != first.second) break;
            if (!block.is_contact || block.state[0] != RowState::free || !(unit.own > 0.0)) continue;
            if (unit.normal >= 0) pair.slips.push_back(static_cast<int>(next));
            else pair.normals.push_back(unit.at), known = known || z_[unit.at] > 0.0;
        }
        if (!known && pair.slips.size() > 1) new_pairs_.push_back(std::move(pair));
    }
    for (int k = 0; k < sharing_iterations; ++k)
        for (const NewPair& pair : new_pairs_) share(pair);
}

void ReducedContacts::share(const NewPair& pair) {
    const std::size_t n = static_cast<std::size_t>(rows_);
    double u = 0.0, own = 0.0;
    for (const int i : pair.normals) {
        u += u_[i];
        for (const int j : pair.normals)
            own += w_[n * static_cast<std::size_t>(i) + static_cast<std::size_t>(j)];
    }
    const double by = std::max(-u / own, -z_[pair.normals.front()]);
    for (const int i : pair.normals) change(i, by);
    slip_ = u_;  // all slips before any is met
    const double points = static_cast<double>(pair.normals.size());
    for (const int k : pair.slips) {
        const Unit& unit = units_[k];
        const double bound = unit.coefficient * z_[unit.normal];
        double t[2] = {};
        for (int i = 0; i < unit.size; ++i) t[i] = z_[unit.at + i] - slip_[unit.at + i] / (points * unit.own);
        const double size = length(t[0], t[1]), share = size > bound ? bound / size : 1.0;
        for (int i = 0; i < unit.size; ++i) change(unit.at + i, share * t[i] - z_[unit.at + i]);
    }
}

/// Iterations find which rows push and which slide, Newton's method the answer; where it does not, both again from its end.
void ReducedContacts::settle(Report& report, double goal, int iterations) {
    best_residual_ = unbounded;
    best_ = z_;
    if (!(keep_best() <= goal))
        for (int round = 0; round < rounds; ++round) {
            Watch::look();
            for (int k = 0; k < iterations; ++k, ++report.iterations) iterate();
            report.newton_steps += polish(goal, round % 2 == 1);
            if (best_residual_ <= std::max(goal, good * speed_)) break;
        }
    z_ = best_;
    measure();
}

/// All unknowns from z; M v = p + Gᵀ z and the joints' rows hold to rounding.
void ReducedContacts::deliver(MixedSystem& system) {
    fill_right(system);
    for (const Unit& unit : units_) {
        RowBlock& block = system.rows[unit.block];
        for (int i = 0; i < unit.size; ++i) {
            block.multiplier[unit.row + i] = z_[unit.at + i];
            put(block, unit.row + i, z_[unit.at + i], right_.data());
        }
    }
    whole_.resize(right_.size());
    matrix_.solve_refined(right_.data(), whole_.data(), floored_ ? 2 * refinements_of_floored : 2);
    system.velocity.resize(system.mass.size());
    for (int b = 0; b < bodies_; ++b) std::copy_n(whole_.data() + 6 * b, 6, system.velocity[b].data());
    for (std::size_t k = 0; k < joints_.size(); ++k)
        for (int i = 0; i < joints_[k].count; ++i)
            system.rows[joints_[k].block].multiplier[joints_[k].row[i]] =
                -whole_[matrix_.offset(bodies_ + static_cast<int>(k)) + i];
}

ReducedContacts::Report ReducedContacts::solve(MixedSystem& system, const std::vector<FrictionPoint>& points,
                                               int iterations) {
    Report report;
    analyse(system);
    if (!factor(system)) return report;
    list_units(system, points);
    reduce(system);
    for (const Unit& unit : units_)
        if (unit.normal < 0) z_[unit.at] = std::clamp(z_[unit.at], unit.lower, unit.upper);
    measure();
    share_new_loads(system);
    for (int pass = 0; pass < passes; ++pass) {
        measure();
        settle(report, exact * speed_, iterations);
        deliver(system);
        // What the factor lacks shows in the true equations, and goes into q.
        measure();
        for (const Unit& unit : units_)
            for (int i = 0; i < unit.size; ++i) {
                const double u = row_residual(system.rows[unit.block], unit.row + i, system.velocity);
                q_[unit.at + i] += u - u_[unit.at + i];
                u_[unit.at + i] = u;
            }
        const double left = residual();
        report.residual = speed_ > 0.0 ? left / speed_ : left;
        if (!(report.residual > good) || report.iterations >= rounds * iterations) break;
    }
    return report;
}

}  // namespace spook
