#include "contacts/cone_newton.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/pivot_solver.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

constexpr double tightest = 1e-14, loosest = 1e-9;  // residuals, of the speeds in the system
constexpr double known = 1e-13;                     // of a start that is an answer already
constexpr double refined = 1e-16;                   // of the square of what a direction is to answer
constexpr int patience = 60;                        // iterations without half the residual, or half the blur
constexpr double narrow = 0.03;                     // a step so short has left the path
constexpr double centre = 0.01;                  // of the blur's square: what is left where the path is met
constexpr double fastest = 1e-3, slowest = 0.9;  // the blur's next part of itself, learnt on the way

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
    unit.lower = given.lower[row] / unit.root;
    unit.upper = given.upper[row] / unit.root;
    unit.z[0] = std::clamp(unit.z[0], given.lower[row], given.upper[row]);
    if (unit.size == 3) unit.friction = friction->coefficient;
}

void ConeNewton::prepare(MixedSystem& system, const std::vector<FrictionPoint>& points) {
    const std::size_t bodies = system.mass.size();
    mass_factor_.resize(bodies);
    for (std::size_t b = 0; b < bodies; ++b) mass_factor_[b] = factor_six(system.mass[b]);
    std::vector<const FrictionPoint*> friction(system.rows.size(), nullptr);
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
        std::vector<BlockEdge> edges;
        for (const auto& [a, b] : needed_) edges.push_back({a, b});
        matrix_.analyse(bodies, edges);
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

double ConeNewton::merit(double blur, double length) const {
    double sum = 0.0, map[3];
    for (const ConeUnit& unit : units_) {
        ConeUnit::Vec z = unit.z, u = unit.u;
        for (int i = 0; i < unit.size; ++i) z[i] += length * unit.dz[i], u[i] += length * unit.du[i];
        sum += unit.natural(z, u, blur, map);
    }
    return sum;
}

/// The largest natural map, and as a velocity.
ConeNewton::Left ConeNewton::worst() const {
    Left largest;
    double map[3];
    for (const ConeUnit& unit : units_) {
        const double size = std::sqrt(unit.natural(unit.z, unit.u, 0.0, map));
        if (!(size <= largest.map)) largest.map = size;
        if (!(size / unit.root <= largest.speed)) largest.speed = size / unit.root;
    }
    return largest;
}

double* ConeNewton::block(const ConeUnit& unit, bool row_first, bool column_first) {
    if (row_first == column_first) return matrix_.diagonal(row_first ? unit.first : unit.second);
    return row_first != unit.turned ? matrix_.forth(unit.edge) : matrix_.back(unit.edge);
}

/// Newton's direction, by a factor of M + Σ Gᵀ K G.
bool ConeNewton::step(const MixedSystem& system, double blur) {
    matrix_.clear();
    for (int b = 0; b < bodies_; ++b) std::copy_n(system.mass[b].data(), 36, matrix_.diagonal(b));
    for (ConeUnit& unit : units_) {
        unit.linearise(blur, relief);
        const int n = unit.size;
        for (const bool column : {true, false}) {
            if ((column ? unit.first : unit.second) < 0) continue;
            const Vec6* from = column ? unit.first_row : unit.second_row;
            double t[18];  // K G
            for (int i = 0; i < n; ++i)
                for (int a = 0; a < 6; ++a) {
                    double sum = 0.0;
                    for (int j = 0; j < n; ++j) sum += unit.k[n * i + j] * from[j][a];
                    t[6 * i + a] = sum;
                }
            for (const bool row : {true, false}) {
                if ((row ? unit.first : unit.second) < 0) continue;
                const Vec6* to = row ? unit.first_row : unit.second_row;
                double* out = block(unit, row, column);
                for (int i = 0; i < n; ++i)
                    for (int a = 0; a < 6; ++a)
                        for (int b = 0; b < 6; ++b) out[6 * a + b] += to[i][a] * t[6 * i + b];
            }
        }
    }
    ++factorisations_;
    block_operations_ += static_cast<std::uint64_t>(matrix_.operations());
    if (!matrix_.factor()) return false;
    return find_direction();
}

/// dz by generalised conjugate residuals. The factor, with its relief, is the preconditioner, and what each direction
/// does is measured without it, so the residual falls whatever rounding does to the factor. Where rows are redundant
/// that takes a few directions more. False if nothing finite was found.
bool ConeNewton::find_direction() {
    double asked = 0.0;
    for (ConeUnit& unit : units_) {
        unit.dz = {};
        unit.lack = {-unit.map[0], -unit.map[1], -unit.map[2]};
        asked += unit.square(unit.lack);
    }
    double left = asked;
    int count = 0, stalled = 0;
    for (; count < max_directions && left > refined * asked && stalled < 4; ++count) {
        if (static_cast<int>(directions_.size()) <= count) directions_.emplace_back();
        Direction& now = directions_[count];
        now.z.resize(units_.size());
        now.image.resize(units_.size());
        precondition(now);
        image_of(now);
        for (int k = 0; k < count; ++k) {
            const Direction& old = directions_[k];
            double share = 0.0;
            for (std::size_t i = 0; i < units_.size(); ++i) share += dot(now.image[i], old.image[i]);
            for (std::size_t i = 0; i < units_.size(); ++i)
                for (int a = 0; a < 3; ++a)
                    now.z[i][a] -= share * old.z[i][a], now.image[i][a] -= share * old.image[i][a];
        }
        double size = 0.0, along = 0.0;
        for (std::size_t i = 0; i < units_.size(); ++i) {
            size += dot(now.image[i], now.image[i]);
            along += dot(now.image[i], units_[i].lack);
        }
        if (!std::isfinite(size)) return false;
        if (size == 0.0) break;
        const double over = 1.0 / std::sqrt(size);
        along *= over;
        const double before = left;
        left = 0.0;
        for (std::size_t i = 0; i < units_.size(); ++i) {
            ConeUnit& unit = units_[i];
            for (int a = 0; a < 3; ++a) {
                now.z[i][a] *= over, now.image[i][a] *= over;
                unit.dz[a] += along * now.z[i][a];
                unit.lack[a] -= along * now.image[i][a];
            }
            left += unit.square(unit.lack);
        }
        stalled = left < 0.5 * before ? 0 : stalled + 1;
    }
    velocities_of([](const ConeUnit& unit) { return unit.dz; }, change_);
    for (ConeUnit& unit : units_) unit.du = speed_along(unit, change_, unit.dz);
    return true;
}

/// The dz that answers what the units' laws lack, by the factor.
void ConeNewton::precondition(Direction& direction) {
    image_.assign(mass_factor_.size(), Vec6{});
    for (ConeUnit& unit : units_) {
        unit.respond(unit.lack, relief);
        push(unit, unit.c, image_);
    }
    matrix_.solve(image_[0].data());
    for (std::size_t k = 0; k < units_.size(); ++k) {
        const ConeUnit& unit = units_[k];
        const ConeUnit::Vec turn = along(unit, image_);
        direction.z[k] = {};
        for (int i = 0; i < unit.size; ++i) {
            double sum = unit.c[i];
            for (int j = 0; j < unit.size; ++j) sum -= unit.k[unit.size * i + j] * turn[j];
            direction.z[k][i] = sum;
        }
    }
}

/// What a direction changes in the units' laws, momentum kept to rounding.
void ConeNewton::image_of(Direction& direction) {
    std::size_t next = 0;
    velocities_of([&](const ConeUnit&) { return direction.z[next++]; }, image_);
    for (std::size_t k = 0; k < units_.size(); ++k)
        direction.image[k] = units_[k].law(direction.z[k], speed_along(units_[k], image_, direction.z[k]));
}

/// v ← M⁻¹ Gᵀ z, with z of each unit.
template <class Multiplier> void ConeNewton::velocities_of(const Multiplier& z, std::vector<Vec6>& v) const {
    v.assign(mass_factor_.size(), Vec6{});
    for (const ConeUnit& unit : units_) push(unit, z(unit), v);
    for (std::size_t b = 0; b < v.size(); ++b) solve_six(mass_factor_[b], v[b]);
}

/// to += Gᵀ z of one unit.
void ConeNewton::push(const ConeUnit& unit, const ConeUnit::Vec& z, std::vector<Vec6>& to) {
    for (int i = 0; i < unit.size; ++i)
        for (int a = 0; a < 6; ++a) {
            if (unit.first >= 0) to[unit.first][a] += unit.first_row[i][a] * z[i];
            if (unit.second >= 0) to[unit.second][a] += unit.second_row[i][a] * z[i];
        }
}

/// G v of one unit.
ConeUnit::Vec ConeNewton::along(const ConeUnit& unit, const std::vector<Vec6>& v) {
    ConeUnit::Vec sum{};
    for (int i = 0; i < unit.size; ++i) {
        if (unit.first >= 0) sum[i] += dot(unit.first_row[i], v[unit.first]);
        if (unit.second >= 0) sum[i] += dot(unit.second_row[i], v[unit.second]);
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

/// The longest of a few steps along Newton's direction that lowers the smoothed map enough, else the best of them.
ConeNewton::Search ConeNewton::search(double blur) const {
    Search found{merit(blur, 0.0), unbounded, 0.0};
    double length = 1.0;
    for (int halving = 0; halving < 8; ++halving, length *= 0.5) {
        const double now = merit(blur, length);
        if (now < found.after) found.after = now, found.length = length;
        if (now <= (1.0 - 2e-4 * length) * found.before) break;
    }
    if (!(found.after < found.before)) found.length = 0.0;
    return found;
}

ConeReport ConeNewton::solve(MixedSystem& system, const std::vector<FrictionPoint>& points) {
    ConeReport report;
    prepare(system, points);
    connect();
    speed_ = speed_of(system);
    measure(system);
    Left left = worst(), best = left;
    keep();
    double blur = 0.2 * left.map, met = blur,
           lowest = blur;  // where the path was met last, and nearest to its end
    double shrink = fastest;
    int stalled = 0;
    const double goal = left.speed > known * speed_ ? tightest * speed_ : unbounded;
    while (best.speed > goal && report.iterations < max_iterations && stalled < patience) {
        double enough = 1e-12;  // the longer nothing better is found, the less is asked
        for (int k = 0; k < stalled && enough < loosest; ++k) enough *= 10.0;
        if (stalled > 0 && best.speed <= std::min(loosest, enough) * speed_) break;
        Watch::look();
        for (ConeUnit& unit : units_) unit.kink_share = blur / (blur + std::abs(unit.z[0] / unit.root));
        if (!step(system, blur)) break;
        ++report.iterations;
        const Search found = search(blur);
        if (found.length > 0.0) {
            for (ConeUnit& unit : units_)
                for (int i = 0; i < unit.size; ++i) unit.z[i] += found.length * unit.dz[i];
            measure(system);
            left = worst();
        }
        stalled = left.speed < 0.5 * best.speed ? 0 : stalled + 1;
        if (left.speed < best.speed) {
            best = left;
            keep();
        }
        if (found.length < narrow) {  // off the path: back towards where it was met, then less far at once
            shrink = std::min(std::sqrt(shrink), slowest);
            blur = blur < met ? shrink * met : 2.0 * blur;
            met = std::max(met, blur);
            continue;
        }
        if (found.after < centre * blur * blur) {
            if (blur < 0.5 * lowest) lowest = blur, stalled = 0;
            met = blur;
            if (found.length == 1.0) shrink = std::max(shrink * shrink, fastest);
        }
        if (found.after < 1e-4 * blur * blur) blur = std::min(blur, std::max(shrink * blur, 0.01 * left.map));
        else if (found.after < 0.25 * found.before)
            blur = std::min(blur, std::max(std::max(0.05, shrink) * blur, 0.2 * left.map));
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
