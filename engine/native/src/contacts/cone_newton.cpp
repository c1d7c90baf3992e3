#include "contacts/cone_newton.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/pivot_solver.hpp"
#include "contacts/unit_products.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

constexpr double tightest = 1e-14, loosest = 1e-9;  // residuals, of the speeds in the system
constexpr double known = 1e-13;                     // of a start that is an answer already
constexpr double refined = 1e-16;                   // of the square of what Newton's direction is to answer
constexpr double roughly = 1e-6;    // the same along the path, which only leads to the next point
constexpr double start_blur = 0.2;  // of the largest natural map
constexpr double nearest = 1.0;     // of the blur: how far units may be from the path, in the mean
constexpr double narrow = 0.03;     // a step so short has lost the path
// Of a unit's own inverse mass: dz/dv is at most its mass over hold. The loosest leaves the matrix well conditioned
// however redundant the points; with the tightest, what holding leaves is rounding soon after.
constexpr double loosest_hold = 3e-4, tightest_hold = 1e-10;
constexpr double behind = 10.0, slow = 0.1;      // of the blur, and of itself: what holding back leaves
constexpr double far = 1e-3;                     // a residual, of the speeds, from which the path may crawl
constexpr int patience = 3, long_patience = 12;  // iterations without half the residual, or much less blur
constexpr int max_jumps = 3;                     // without half the least they met
constexpr int max_losses = 3;                    // of the path, sought again,
constexpr double back = 10.0;                    //   so many blurs away
constexpr double nearer = 0.1;                   //   and kept so much nearer to

}  // namespace

/// Reads one unit: `size` rows of a block from `row` on; `friction` is its point's, null if it has none.
void ConeNewton::read(const RowBlock& given, int row, const FrictionPoint* friction, ConeUnit& unit) const {
    unit.row = row;
    unit.first = given.first;
    unit.second = given.second;
    double own = 0.0;
    for (int i = 0; i < unit.size; ++i) {
        unit.first_row[i] = given.first_jacobian[row + i];
        unit.second_row[i] = given.second_jacobian[row + i];
        for (const bool end : {true, false}) {
            const int body = end ? given.first : given.second;
            if (body < 0) continue;
            const Vec6& jacobian = end ? unit.first_row[i] : unit.second_row[i];
            Vec6 x = jacobian;
            solve_six(mass_factor_[body], x);
            own += dot(jacobian, x);
        }
        unit.softness[i] = i > 0 ? friction->slip_softness : given.softness[row + i];
        unit.right[i] = given.right[row + i];
        unit.z[i] = given.multiplier[row + i];
    }
    unit.soft = unit.softness[0] > 0.0 || unit.softness[1] > 0.0;
    unit.root = own > 0.0 ? std::sqrt(unit.size / own) : 1.0;
    unit.over = 1.0 / unit.root;
    unit.lower = given.lower[row] / unit.root;
    unit.upper = given.upper[row] / unit.root;
    unit.z[0] = std::clamp(unit.z[0], given.lower[row], given.upper[row]);
    if (unit.size == 3) {
        unit.friction = friction->coefficient;
        unit.along = unit.over / unit.friction;
    }
}

void ConeNewton::prepare(MixedSystem& system, const std::vector<FrictionPoint>& points) {
    const std::size_t bodies = system.mass.size();
    mass_factor_.resize(bodies);
    mass_inverse_.resize(bodies);
    for (std::size_t b = 0; b < bodies; ++b) {
        mass_factor_[b] = factor_six(system.mass[b]);
        mass_inverse_[b] = inverse_six(mass_factor_[b]);
    }
    std::vector<const FrictionPoint*>& friction = friction_;
    friction.assign(system.rows.size(), nullptr);
    for (const FrictionPoint& point : points) friction[point.block] = &point;
    units_.clear();
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        RowBlock& given = system.rows[k];
        const bool rough = friction[k] && friction[k]->coefficient > 0.0;
        int rows = given.size;
        if (friction[k] && !rough) {  // smooth: its tangents carry nothing
            given.multiplier[1] = given.multiplier[2] = 0.0;
            rows = 1;
        }
        for (int row = 0; row < rows; row += rough ? 3 : 1) {
            ConeUnit& unit = units_.emplace_back();
            unit.block = static_cast<int>(k);
            unit.size = rough ? 3 : 1;
            read(given, row, friction[k], unit);
        }
    }
}

/// Finds which pairs of bodies are coupled; a pattern analysed before that contains them is used again.
void ConeNewton::connect() {
    needed_.clear();
    for (const ConeUnit& unit : units_)
        if (unit.first >= 0 && unit.second >= 0) needed_.emplace_back(std::minmax(unit.first, unit.second));
    std::sort(needed_.begin(), needed_.end());
    needed_.erase(std::unique(needed_.begin(), needed_.end()), needed_.end());
    const int bodies = static_cast<int>(mass_factor_.size());
    // The order of elimination follows from this system alone: a run that goes back must round as it did.
    if (bodies != bodies_ || pairs_ != needed_) {
        edges_.clear();
        for (const auto& [a, b] : needed_) edges_.push_back({a, b});
        bodies_ = -1;  // until the analysis is whole
        matrix_.analyse(bodies, edges_);
        pairs_ = needed_;
        bodies_ = bodies;
    }
    for (ConeUnit& unit : units_) {
        unit.edge = -1;
        if (unit.first < 0 || unit.second < 0) continue;
        const std::pair<int, int> pair = std::minmax(unit.first, unit.second);
        unit.edge = static_cast<int>(std::lower_bound(pairs_.begin(), pairs_.end(), pair) - pairs_.begin());
        unit.turned = unit.first > unit.second;
    }
}

/// The square of the smoothed map a part of the way along Newton's direction and the path; past `enough` a part of it.
double ConeNewton::merit(double blur, double length, double along, double enough) const {
    double sum = 0.0, map[3];
    for (const ConeUnit& unit : units_) {
        ConeUnit::Vec z = unit.z, u = unit.u;
        for (int i = 0; i < unit.size; ++i) {
            z[i] += length * unit.dz[i] + along * unit.tz[i];
            u[i] += length * unit.du[i] + along * unit.tu[i];
        }
        sum += unit.natural(z, u, {blur, hold_}, map);
        if (sum > enough) break;
    }
    return sum;
}

/// The largest natural map, and as a velocity.
ConeNewton::Left ConeNewton::worst() const {
    Left largest;
    double map[3];
    for (const ConeUnit& unit : units_) {
        const double size = std::sqrt(unit.natural(unit.z, unit.u, {}, map));
        if (!(size <= largest.map)) largest.map = size;
        if (!(size / unit.root <= largest.speed)) largest.speed = size / unit.root;
    }
    return largest;
}

double* ConeNewton::block(const ConeUnit& unit, bool row_first, bool column_first) {
    if (row_first == column_first) return matrix_.diagonal(row_first ? unit.first : unit.second);
    return row_first != unit.turned ? matrix_.forth(unit.edge) : matrix_.back(unit.edge);
}

/// The matrix gets what a unit of N rows adds: Gᵀ K G.
template <int N> void ConeNewton::add(const ConeUnit& unit) {
    Six image[N];
    for (const bool column : {true, false}) {
        if ((column ? unit.first : unit.second) < 0) continue;
        stiffen<N>(unit.k, column ? unit.first_row : unit.second_row, image);
        for (const bool row : {true, false}) {
            if ((row ? unit.first : unit.second) < 0) continue;
            add_stiffness<N>(row ? unit.first_row : unit.second_row, image, block(unit, row, column));
        }
    }
}

/// Newton's direction, by a factor of M + Σ Gᵀ K G.
bool ConeNewton::step(const MixedSystem& system, double blur) {
    matrix_.clear();
    for (int b = 0; b < bodies_; ++b) std::copy_n(system.mass[b].data(), 36, matrix_.diagonal(b));
    for (ConeUnit& unit : units_) {
        unit.linearise({blur, hold_});
        if (unit.size == 3) add<3>(unit);
        else add<1>(unit);
    }
    ++factorisations_;
    block_operations_ += static_cast<std::uint64_t>(matrix_.operations());
    if (!matrix_.factor()) return false;
    return find_directions(blur);
}

/// Newton's direction, and the path's for the whole blur. False if nothing finite was found.
bool ConeNewton::find_directions(double blur) {
    for (ConeUnit& unit : units_) unit.lack = {-unit.map[0], -unit.map[1], -unit.map[2]};
    if (!answer(&ConeUnit::dz, &ConeUnit::du, refined)) return false;
    if (blur == 0.0) {  // a jump: there is no path
        for (ConeUnit& unit : units_) unit.tz = unit.tu = {};
        return true;
    }
    for (ConeUnit& unit : units_) unit.lack = {blur * unit.bend[0], blur * unit.bend[1], blur * unit.bend[2]};
    return answer(&ConeUnit::tz, &ConeUnit::tu, roughly);
}

/// The dz and du that answer what the units' laws lack, refined while that helps and more than `enough` is left.
bool ConeNewton::answer(ConeUnit::Vec ConeUnit::* dz, ConeUnit::Vec ConeUnit::* du, double enough) {
    double asked = 0.0;
    for (ConeUnit& unit : units_) {
        unit.*dz = unit.*du = {};
        asked += unit.square(unit.lack);
    }
    double before = asked;
    for (int round = 0; round < 3; ++round) {
        image_.assign(mass_factor_.size(), Vec6{});
        for (ConeUnit& unit : units_) {
            unit.respond(unit.lack);
            push(unit, unit.c, image_);
        }
        matrix_.solve(image_[0].data());
        change_.assign(mass_factor_.size(), Vec6{});
        for (ConeUnit& unit : units_) {
            const ConeUnit::Vec turn = along(unit, image_);
            for (int i = 0; i < unit.size; ++i)
                for (int j = 0; j < unit.size; ++j) unit.c[i] -= unit.k[unit.size * i + j] * turn[j];
            push(unit, unit.c, change_);
        }
        for (std::size_t b = 0; b < change_.size(); ++b)
            image(mass_inverse_[b].data(), Six::load(change_[b].data())).store(change_[b].data());
        double left = 0.0;
        for (ConeUnit& unit : units_) {
            unit.turn = speed_along(unit, change_, unit.c);
            const ConeUnit::Vec change = unit.law(unit.c, unit.turn);
            for (int i = 0; i < unit.size; ++i) unit.lack[i] -= change[i];
            left += unit.square(unit.lack);
        }
        if (!std::isfinite(left)) return false;
        if (round > 0 && !(left < before)) break;
        for (ConeUnit& unit : units_)
            for (int i = 0; i < unit.size; ++i) (unit.*dz)[i] += unit.c[i], (unit.*du)[i] += unit.turn[i];
        if (left <= enough * asked) break;
        before = left;
    }
    return true;
}

/// to += Gᵀ z of one unit.
void ConeNewton::push(const ConeUnit& unit, const ConeUnit::Vec& z, std::vector<Vec6>& to) {
    for (const bool first : {true, false}) {
        const int body = first ? unit.first : unit.second;
        if (body < 0) continue;
        const Vec6* rows = first ? unit.first_row : unit.second_row;
        if (unit.size == 3) add_push<3>(rows, z.data(), to[body].data());
        else add_push<1>(rows, z.data(), to[body].data());
    }
}

/// G v of one unit.
ConeUnit::Vec ConeNewton::along(const ConeUnit& unit, const std::vector<Vec6>& v) {
    ConeUnit::Vec sum{};
    for (const bool first : {true, false}) {
        const int body = first ? unit.first : unit.second;
        if (body < 0) continue;
        const Vec6* rows = first ? unit.first_row : unit.second_row;
        const Six speed = Six::load(v[body].data());
        for (int i = 0; i < unit.size; ++i) sum[i] += speed.dot(Six::load(rows[i].data()));
    }
    return sum;
}

/// G v + Sig z of one unit.
ConeUnit::Vec ConeNewton::speed_along(const ConeUnit& unit, const std::vector<Vec6>& v,
                                      const ConeUnit::Vec& z) {
    ConeUnit::Vec sum = along(unit, v);
    for (int i = 0; i < unit.size; ++i) sum[i] += unit.softness[i] * z[i];
    return sum;
}

/// M v = p + Gᵀ z, and u of every unit.
void ConeNewton::measure(const MixedSystem& system) {
    velocity_ = system.momentum;
    for (const ConeUnit& unit : units_) push(unit, unit.z, velocity_);
    for (std::size_t b = 0; b < velocity_.size(); ++b) solve_six(mass_factor_[b], velocity_[b]);
    for (ConeUnit& unit : units_) {
        unit.u = speed_along(unit, velocity_, unit.z);
        for (int i = 0; i < unit.size; ++i) unit.u[i] -= unit.right[i];
    }
}

/// What is lost of a speed beside the largest impulse: bodies squeezed without a way out push ever harder.
double ConeNewton::rounding() const {
    double largest = 0.0;
    for (const ConeUnit& unit : units_)
        largest = std::max(largest, std::abs(unit.z[0]) / (unit.root * unit.root));
    return 1e-16 * largest;
}

/// The speeds there are without contacts, and those that rows ask for.
double ConeNewton::speed_of(const MixedSystem& system) const {
    double speed = 0.0;
    for (std::size_t b = 0; b < system.momentum.size(); ++b) {
        Vec6 v = system.momentum[b];
        solve_six(mass_factor_[b], v);
        for (int a = 0; a < 3; ++a) speed = std::max(speed, std::abs(v[a]));
    }
    for (const ConeUnit& unit : units_)
        for (int i = 0; i < unit.size; ++i) speed = std::max(speed, std::abs(unit.right[i]));
    return speed;
}

/// The next point: on along the path as far as it stays near, else towards it.
ConeNewton::Search ConeNewton::search(double blur) const {
    const double wide = near_ * near_ * static_cast<double>(units_.size());
    for (const double share : {1e-3, 1e-2, 0.1, 0.3, 0.6, 0.9}) {
        const double next = share * blur, room = wide * next * next;
        if (merit(next, 1.0, 1.0 - share, room) <= room) return {next, 1.0, 1.0 - share};
    }
    const double before = merit(blur, 0.0, 0.0, unbounded);
    double length = 1.0, least = before;
    Search found{blur, 0.0, 0.0};
    for (int halving = 0; halving < 8; ++halving, length *= 0.5) {
        const double now = merit(blur, length, 0.0, before);
        if (now < least) least = now, found.length = length;
        if (now <= (1.0 - 2e-4 * length) * before) break;
    }
    return found;
}

/// Takes down where the units stand: they are held there.
void ConeNewton::hold() {
    for (ConeUnit& unit : units_) {
        unit.held = unit.scaled();
        unit.load = std::abs(unit.held[0]);
    }
}

void ConeNewton::move(const MixedSystem& system, const Search& found) {
    if (!(found.length > 0.0)) return;
    for (ConeUnit& unit : units_)
        for (int i = 0; i < unit.size; ++i) unit.z[i] += found.length * unit.dz[i] + found.along * unit.tz[i];
    measure(system);
}

ConeReport ConeNewton::solve(MixedSystem& system, const std::vector<FrictionPoint>& points) {
    ConeReport report;
    prepare(system, points);
    connect();
    speed_ = speed_of(system);
    measure(system);
    Left best = worst();
    keep();
    double blur = start_blur * best.map, met = -1.0;  // the blur where the path was met last
    int stalled = 0, jumps = -1, losses = 0;          // jumps made, negative on the path; times it was lost
    double least = unbounded;                         // residual of this row of jumps, m/s
    near_ = nearest, hold_ = loosest_hold;
    Left before = best;
    const double goal = best.speed > known * speed_ ? tightest * speed_ : unbounded;
    while (best.speed > goal && report.iterations < max_iterations && losses < max_losses) {
        double enough = 1e-12;  // the longer nothing better is found, the less is asked
        for (int k = 0; k < stalled && enough < loosest; ++k) enough *= 10.0;
        if (stalled > 0 && best.speed <= std::min(loosest, enough) * speed_) break;
        Watch::look();
        hold();
        if (!step(system, blur)) break;
        ++report.iterations;
        const Search found = jumps >= 0 ? Search{0.0, 1.0, 0.0} : search(blur);
        move(system, found);
        const Left left = worst();
        stalled = left.speed < 0.5 * best.speed || found.along > 0.3 ? 0 : stalled + 1;
        if (left.speed < best.speed) {
            best = left;
            keep();
        }
        // Far behind the blur: what is held back is all that is left.
        if (left.map > behind * found.blur && left.map > slow * before.map)
            hold_ = std::max(0.1 * hold_, tightest_hold);
        before = left;
        if (found.along > 0.0) {
            met = found.blur;
            for (ConeUnit& unit : units_) unit.met = unit.z;
        }
        blur = found.blur;
        const bool lost =
            stalled >= (best.speed > far * speed_ ? long_patience : patience) || found.length < narrow;
        if (lost && best.speed <= near_enough * speed_) break;
        if (jumps < 0 && !lost) continue;
        if (jumps < 0 && met > 0.0) {
            jumps = 0, blur = 0.0;
            least = unbounded;
            continue;
        }
        if (jumps >= 0) {
            jumps = left.speed < 0.5 * least ? 0 : jumps + 1;
            least = std::min(least, left.speed);
            if (jumps < max_jumps) continue;
        }
        if (best.speed <= near_enough * speed_) break;
        // Begin anew, further from the end and more carefully.
        jumps = -1, stalled = 0, hold_ = loosest_hold, ++losses;
        if (met > 0.0) {
            near_ *= nearer;
            blur = back * met;
            for (ConeUnit& unit : units_) unit.z = unit.met;
            measure(system);
        } else {
            blur *= back;
        }
    }
    for (std::size_t k = 0; k < units_.size(); ++k) {
        ConeUnit& unit = units_[k];
        unit.z = best_[k].first;
        unit.u = best_[k].second;
        unit.finish();
        for (int i = 0; i < unit.size; ++i) system.rows[unit.block].multiplier[unit.row + i] = unit.z[i];
    }
    measure(system);  // what is handed over, not what led to it
    system.velocity = velocity_;
    const double speed = std::max(worst().speed, rounding());
    report.residual = speed_ > 0.0 ? speed / speed_ : speed;
    report.converged = report.residual <= loosest;
    return report;
}

void ConeNewton::keep() {
    best_.resize(units_.size());
    for (std::size_t k = 0; k < units_.size(); ++k) best_[k] = {units_[k].z, units_[k].u};
}

}  // namespace spook
