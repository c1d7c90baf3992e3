#include "rigid/block_rows.hpp"

#include <algorithm>
#include <cmath>

namespace spook {

void BlockRows::take() {
    std::size_t spare = 0;
    for (const JointBlock& block : joints_.blocks()) {
        count_ += static_cast<std::size_t>(block.size);
        spare_at_.push_back(spare);
        spare += static_cast<std::size_t>(12 * block.size);
    }
    spare_.assign(spare, 0.0);
}

void BlockRows::reset() {
    redundant_.reset(matrix);
    matrix.clear_counters();
}

void BlockRows::analyse() {
    // Rows come first, so that the block of an edge is the Jacobian itself, rows × 6.
    const auto blocks = joints_.blocks();
    const int row_blocks = static_cast<int>(blocks.size());
    std::vector<int> sizes;
    std::vector<BlockEdge> edges;
    std::vector<std::uint8_t> is_constraint(blocks.size() + model_.constrained.size(), 0);
    places_.assign(blocks.size(), {});
    std::size_t wide = 0;
    for (int k = 0; k < row_blocks; ++k) {
        sizes.push_back(blocks[k].size);
        is_constraint[k] = 1;
        const auto tie = [&](int body, int& edge, bool& particle) {
            if (body < 0 || model_.solver_index[body] < 0) return;
            edge = static_cast<int>(edges.size());
            particle = model_.constants[body].particle;
            edges.push_back({k, row_blocks + model_.solver_index[body]});
        };
        tie(blocks[k].first, places_[k].first_edge, places_[k].first_particle);
        tie(blocks[k].second, places_[k].second_edge, places_[k].second_particle);
        places_[k].wide_at = wide;
        wide += 6 * joints_.others(k).size();
        for (int body : joints_.others(k)) {
            bool particle = false;
            places_[k].other_edges.push_back(-1);
            tie(body, places_[k].other_edges.back(), particle);
        }
    }
    wide_.assign(wide, 0.0);
    for (int body : model_.constrained) sizes.push_back(model_.constants[body].particle ? 3 : 6);
    matrix.analyse(sizes, edges, is_constraint, true);
    right.assign(matrix.unknowns(), 0.0);
    solution.assign(matrix.unknowns(), 0.0);
    redundant_.prepare(matrix);
    for (int k = 0; k < row_blocks; ++k)
        for (int i = 0; i < sizes[k]; ++i) matrix.diagonal(k)[i] = -blocks[k].softness[i];
    for (std::size_t k = 0; k < model_.constrained.size(); ++k) {
        const int block = row_blocks + static_cast<int>(k), n = matrix.size(block);
        for (int i = 0; i < 3; ++i)
            matrix.diagonal(block)[i * n + i] = model_.constants[model_.constrained[k]].mass;
    }
}

double* BlockRows::jacobian(int block, bool second) noexcept {
    const Place& place = places_[block];
    const int edge = second ? place.second_edge : place.first_edge;
    const bool particle = second ? place.second_particle : place.first_particle;
    if (edge >= 0 && !particle) return matrix.coupling(edge);
    return spare_.data() + spare_at_[block] + (second ? 6 * joints_.blocks()[block].size : 0);
}

/// Jacobians into the matrix, right sides of the rows.
void BlockRows::assemble() {
    const auto blocks = joints_.blocks();
    const int row_blocks = static_cast<int>(blocks.size());
    double* to = right.data();
    live_.last_rows = LastRows::block;
    for (int k = 0; k < row_blocks; ++k) {
        const JointBlock& block = blocks[k];
        const Place& place = places_[k];
        double *first = jacobian(k, false), *second = jacobian(k, true);
        BlockRight numbers;
        joints_.assemble(k, live_.bodies, first, second, numbers);
        const auto given = [&](int body, const double* rows) {
            if (body < 0 || model_.constants[body].motion != Motion::kinematic) return;
            const BodyState& s = live_.bodies[body];
            for (int i = 0; i < block.size; ++i)
                numbers.right[i] -=
                    dot({rows[6 * i], rows[6 * i + 1], rows[6 * i + 2]}, s.velocity) +
                    dot({rows[6 * i + 3], rows[6 * i + 4], rows[6 * i + 5]}, s.angular_velocity);
        };
        if (place.first_edge < 0) given(block.first, first);
        if (place.second_edge < 0) given(block.second, second);
        const auto narrow = [&](int edge, const double* rows) {
            for (int i = 0; i < block.size; ++i) std::copy_n(rows + 6 * i, 3, matrix.coupling(edge) + 3 * i);
        };
        const double* other = joints_.other_rows();
        std::copy_n(other, 6 * place.other_edges.size(), wide_.data() + place.wide_at);
        for (std::size_t i = 0; i < place.other_edges.size(); ++i, other += 6) {
            const int edge = place.other_edges[i];
            if (edge < 0) {
                given(joints_.others(k)[i], other);
                continue;
            }
            std::copy_n(other, model_.constants[joints_.others(k)[i]].particle ? 3 : 6,
                        matrix.coupling(edge));
        }
        if (place.first_particle) narrow(place.first_edge, first);
        if (place.second_particle) narrow(place.second_edge, second);
        std::copy_n(numbers.right.data(), block.size, to);
        to += block.size;
    }
}

void BlockRows::fill_inertias() {
    const int row_blocks = static_cast<int>(joints_.blocks().size());
    for (std::size_t k = 0; k < model_.constrained.size(); ++k) {
        if (model_.constants[model_.constrained[k]].particle) continue;
        const BodyState& s = live_.bodies[model_.constrained[k]];
        double* diagonal = matrix.diagonal(row_blocks + static_cast<int>(k)) + 21;
        for (int row = 0; row < 3; ++row) std::copy_n(s.inertia.m + 3 * row, 3, diagonal + 6 * row);
        for (int i = 0; !stiffness.empty() && i < 9; ++i) diagonal[6 * (i / 3) + i % 3] += stiffness[k].m[i];
    }
}

void BlockRows::fill_momenta() {
    double* to = right.data() + count_;
    for (std::size_t k = 0; k < model_.constrained.size(); ++k) {
        const int i = model_.constrained[k];
        const BodyConstants& body = model_.constants[i];
        const BodyState& s = live_.bodies[i];
        const Vec3 p = body.mass * (s.velocity + forces_.kick(i));
        to[0] = p.x, to[1] = p.y, to[2] = p.z;
        to += 3;
        if (body.particle) continue;
        Vec3 l = s.angular_momentum + model_.h * body.torque;
        if (!stiffness.empty()) l += stiffness[k] * s.angular_velocity;
        to[0] = l.x, to[1] = l.y, to[2] = l.z;
        to += 3;
    }
}

bool BlockRows::factor_and_solve() {
    const bool doubtful = redundant_.factor_and_solve(
        matrix, model_.method.floor, right.data(), solution.data(), model_.method.refinements,
        [this](std::span<const double> left) { return settled(left); });
    if (redundant_.finite() && doubtful) find_contradiction();
    return redundant_.finite();
}

void BlockRows::solve_again() {
    redundant_.solve(matrix, model_.method.floor, right.data(), solution.data(), model_.method.refinements,
                     [this](std::span<const double> left) { return settled(left); });
}

void BlockRows::deliver() {
    const double* x = solution.data();
    for (const JointBlock& block : joints_.blocks()) {
        double* multiplier = joints_.states[block.joint].multipliers(block.axial);
        for (int i = 0; i < block.size; ++i) multiplier[i] = -*x++;
    }
}

bool BlockRows::settled(std::span<const double> left) const {
    const Worst worst = worst_row(left);
    return worst.residual <= 1e-13 * worst.speed;
}

BlockRows::Worst BlockRows::worst_row(std::span<const double> left) const {
    Worst worst;
    for (int i : model_.constrained) {
        const Vec3 v = live_.bodies[i].velocity + forces_.kick(i);
        worst.speed = std::max({worst.speed, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
    std::size_t row = 0;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row) {
            worst.speed = std::max(worst.speed, std::abs(right[row]));
            if (!(std::abs(left[row]) <= worst.residual))
                worst.residual = std::abs(left[row]), worst.block = k;
        }
    return worst;
}

void BlockRows::find_contradiction() {
    // Redundant rows agree with the others, and refinement leaves them a residual of rounding. Rows that cannot
    // hold together keep one of the size of the speeds they ask for.
    const Worst worst = worst_row(redundant_.residual(matrix, right.data(), solution.data()));
    if (worst.residual <= 1e-3 * worst.speed) return;
    live_.contradicted = model_.mover(joints_.blocks()[worst.block]);
    live_.named = {joints_.blocks()[worst.block].joint};
}

/// The block that carries the largest force: of rows that contradict each other, one of those.
int BlockRows::busiest_block() const noexcept {
    int worst = 0, row = 0;
    double largest = -1.0;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row)
            if (std::abs(solution[row]) > largest) largest = std::abs(solution[row]), worst = k;
    return worst;
}

/// Per row, G v' for the accelerations that keep the row still: −(second derivative of the row at constant twists)
/// + G I⁻¹ (w × ℓ), with the sign turned.
void BlockRows::find_bias(double* bias) const {
    const auto blocks = joints_.blocks();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        joints_.bias(static_cast<int>(k), live_.bodies, bias);
        for (int end = 0; end < ends(static_cast<int>(k)); ++end) {
            const int body = end_body(static_cast<int>(k), end);
            if (body < 0 || !model_.constants[body].moves() || model_.constants[body].particle) continue;
            const BodyState& s = live_.bodies[body];
            const Vec3 gyro =
                turned_by(model_.constants[body], s, cross(s.angular_velocity, s.angular_momentum));
            const double* rows = end_rows(static_cast<int>(k), end) + 3;
            for (int i = 0; i < blocks[k].size; ++i)
                bias[i] -= dot({rows[6 * i], rows[6 * i + 1], rows[6 * i + 2]}, gyro);
        }
        bias += blocks[k].size;
    }
}

/// G v per row, with the velocities of the bodies as they are, or of the solution.
double BlockRows::row_speed(int block, int row, bool solved) const {
    double sum = 0.0;
    for (int end = 0; end < ends(block); ++end) {
        const int body = end_body(block, end);
        if (body < 0 || model_.constants[body].motion == Motion::fixed) continue;
        const double* j = end_rows(block, end) + 6 * row;
        const BodyState& s = live_.bodies[body];
        Vec3 v = s.velocity, w = s.angular_velocity;
        if (solved && model_.solver_index[body] >= 0) {
            const double* x = solution.data() + body_at(model_.solver_index[body]);
            v = {x[0], x[1], x[2]};
            w = model_.constants[body].particle ? Vec3{} : Vec3{x[3], x[4], x[5]};
        }
        sum += dot({j[0], j[1], j[2]}, v) + dot({j[3], j[4], j[5]}, w);
    }
    return sum;
}

/// Momenta += Gᵀ Λ with the Jacobians as assembled.
void BlockRows::push(const double* multipliers) {
    const auto blocks = joints_.blocks();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        for (int end = 0; end < ends(static_cast<int>(k)); ++end) {
            const int body = end_body(static_cast<int>(k), end);
            if (body < 0 || !model_.constants[body].moves()) continue;
            const double* j = end_rows(static_cast<int>(k), end);
            Vec3 force, torque;
            for (int i = 0; i < blocks[k].size; ++i, j += 6) {
                force += multipliers[i] * Vec3{j[0], j[1], j[2]};
                torque += multipliers[i] * Vec3{j[3], j[4], j[5]};
            }
            live_.bodies[body].velocity += (1.0 / model_.constants[body].mass) * force;
            if (!model_.constants[body].particle) live_.bodies[body].angular_momentum += torque;
        }
        multipliers += blocks[k].size;
    }
}

}  // namespace spook
