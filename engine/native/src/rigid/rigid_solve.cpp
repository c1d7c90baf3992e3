// The rows of a step, solved: one factorisation when all are bilateral, else with bounds and contacts.
#include <algorithm>
#include <cmath>
#include <utility>

#include "rigid/rigid_system.hpp"

namespace spook {

void RigidSystem::analyse_block() {
    // Rows come first, so that the block of an edge is the Jacobian itself, rows × 6.
    const auto blocks = joints_.blocks();
    const int row_blocks = static_cast<int>(blocks.size());
    std::vector<int> sizes;
    std::vector<BlockEdge> edges;
    std::vector<std::uint8_t> is_constraint(blocks.size() + constrained_.size(), 0);
    places_.assign(blocks.size(), {});
    std::size_t wide = 0;
    for (int k = 0; k < row_blocks; ++k) {
        sizes.push_back(blocks[k].size);
        is_constraint[k] = 1;
        const auto tie = [&](int body, int& edge, bool& particle) {
            if (body < 0 || solver_index_[body] < 0) return;
            edge = static_cast<int>(edges.size());
            particle = constants_[body].particle;
            edges.push_back({k, row_blocks + solver_index_[body]});
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
    for (int body : constrained_) sizes.push_back(constants_[body].particle ? 3 : 6);
    matrix_.analyse(sizes, edges, is_constraint, true);
    right_.assign(matrix_.unknowns(), 0.0);
    solution_.assign(matrix_.unknowns(), 0.0);
    redundant_.prepare(matrix_);
    for (int k = 0; k < row_blocks; ++k)
        for (int i = 0; i < sizes[k]; ++i) matrix_.diagonal(k)[i] = -blocks[k].softness[i];
    for (std::size_t k = 0; k < constrained_.size(); ++k) {
        const int block = row_blocks + static_cast<int>(k), n = matrix_.size(block);
        for (int i = 0; i < 3; ++i) matrix_.diagonal(block)[i * n + i] = constants_[constrained_[k]].mass;
    }
}

double* RigidSystem::jacobian(int block, bool second) noexcept {
    if (mixed_values_)
        return (second ? mixed_.rows[block].second_jacobian : mixed_.rows[block].first_jacobian)[0].data();
    const BlockPlace& place = places_[block];
    const int edge = second ? place.second_edge : place.first_edge;
    const bool particle = second ? place.second_particle : place.first_particle;
    if (edge >= 0 && !particle) return matrix_.coupling(edge);
    return spare_.data() + spare_at_[block] + (second ? 6 * joints_.blocks()[block].size : 0);
}

/// Jacobians into the matrix, right sides of the rows.
void RigidSystem::assemble_blocks() {
    const auto blocks = joints_.blocks();
    const int row_blocks = static_cast<int>(blocks.size());
    double* right = right_.data();
    mixed_values_ = plane_values_ = false;
    for (int k = 0; k < row_blocks; ++k) {
        const JointBlock& block = blocks[k];
        const BlockPlace& place = places_[k];
        double *first = jacobian(k, false), *second = jacobian(k, true);
        BlockRight numbers;
        joints_.assemble(k, live_.bodies, first, second, numbers);
        const auto given = [&](int body, const double* rows) {
            if (body < 0 || constants_[body].motion != Motion::kinematic) return;
            const BodyState& s = live_.bodies[body];
            for (int i = 0; i < block.size; ++i)
                numbers.right[i] -=
                    dot({rows[6 * i], rows[6 * i + 1], rows[6 * i + 2]}, s.velocity) +
                    dot({rows[6 * i + 3], rows[6 * i + 4], rows[6 * i + 5]}, s.angular_velocity);
        };
        if (place.first_edge < 0) given(block.first, first);
        if (place.second_edge < 0) given(block.second, second);
        const auto narrow = [&](int edge, const double* rows) {
            for (int i = 0; i < block.size; ++i) std::copy_n(rows + 6 * i, 3, matrix_.coupling(edge) + 3 * i);
        };
        const double* other = joints_.other_rows();
        std::copy_n(other, 6 * place.other_edges.size(), wide_.data() + place.wide_at);
        for (std::size_t i = 0; i < place.other_edges.size(); ++i, other += 6) {
            const int edge = place.other_edges[i];
            if (edge < 0) {
                given(joints_.others(k)[i], other);
                continue;
            }
            std::copy_n(other, constants_[joints_.others(k)[i]].particle ? 3 : 6, matrix_.coupling(edge));
        }
        if (place.first_particle) narrow(place.first_edge, first);
        if (place.second_particle) narrow(place.second_edge, second);
        std::copy_n(numbers.right.data(), block.size, right);
        right += block.size;
    }
}

void RigidSystem::fill_inertias() {
    const int row_blocks = static_cast<int>(joints_.blocks().size());
    for (std::size_t k = 0; k < constrained_.size(); ++k) {
        if (constants_[constrained_[k]].particle) continue;
        const BodyState& s = live_.bodies[constrained_[k]];
        double* diagonal = matrix_.diagonal(row_blocks + static_cast<int>(k)) + 21;
        for (int row = 0; row < 3; ++row) std::copy_n(s.inertia.m + 3 * row, 3, diagonal + 6 * row);
        for (int i = 0; stiff_ && i < 9; ++i) diagonal[6 * (i / 3) + i % 3] += stiffness_[k].m[i];
    }
}

void RigidSystem::fill_block_momenta() {
    double* right = right_.data() + rows_;
    for (std::size_t k = 0; k < constrained_.size(); ++k) {
        const int i = constrained_[k];
        const BodyConstants& body = constants_[i];
        const BodyState& s = live_.bodies[i];
        const Vec3 p = body.mass * (s.velocity + kick(i));
        right[0] = p.x, right[1] = p.y, right[2] = p.z;
        right += 3;
        if (body.particle) continue;
        Vec3 l = s.angular_momentum + h_ * body.torque;
        if (stiff_) l += stiffness_[k] * s.angular_velocity;
        right[0] = l.x, right[1] = l.y, right[2] = l.z;
        right += 3;
    }
}

/// Velocities of bodies that are locked to each other in trees, and their places while at hand.
void RigidSystem::solve_locked() {
    const bool at_once = !clock_;
    mixed_values_ = false;
    LockedLoads loads{h_, stages_.runs(Stage::apply_gravity) ? gravity_ : Vec3{}, constants_, {}, force_};
    if (stages_.runs(Stage::apply_loads) || !load_follows_.empty()) loads.acceleration = acceleration_;
    const auto take = [this, at_once](int body, const Twist& v) {
        BodyState& s = live_.bodies[body];
        s.velocity = v.linear;
        s.angular_momentum = s.inertia * v.angular;
        if (at_once) spook::integrate(constants_[body], h_, live_.bodies[body]);
    };
    bool finite = false;
    if (contacts_) {
        scratch_.next = scratch_.free_velocities;
        finite = locked_.solve(live_.bodies, loads, method_.refinements, [this](int body, const Twist& v) {
            scratch_.next[body] = {v.linear.x, v.linear.y, v.linear.z, v.angular.x, v.angular.y, v.angular.z};
        });
        if (clock_) clock_->mark(Stage::solve_block);
        if (finite && meet_late()) return solve_mixed(true);
        for (int i : constrained_)
            if (finite)
                take(i, {{scratch_.next[i][0], scratch_.next[i][1], scratch_.next[i][2]},
                         {scratch_.next[i][3], scratch_.next[i][4], scratch_.next[i][5]}});
    } else {
        finite = locked_.solve(live_.bodies, loads, method_.refinements, take);
    }
    if (!finite) live_.not_solved = constrained_.front();
    constrained_are_moved_ = at_once && finite;
    undelivered_ = finite;
    if (clock_) clock_->mark(Stage::solve_block);
}

void RigidSystem::solve_block() {
    if (!locked_.empty()) return solve_locked();
    if (stiff_) add_geometric_stiffness();
    assemble_blocks();
    fill_inertias();
    fill_block_momenta();
    if (curved_) {
        first_right_.assign(right_.begin(), right_.begin() + static_cast<std::ptrdiff_t>(rows_));
        curve_rows(false);
        for (std::size_t row = 0; row < static_cast<std::size_t>(rows_); ++row) right_[row] -= bend_[row];
    } else if (method_.corrections > 0) {
        bend_rows_back();
    }
    if (clock_) clock_->mark(Stage::assemble_rows);

    const bool finite = factor_and_solve();
    if (clock_) clock_->mark(Stage::solve_block);
    if (!finite) {
        live_.not_solved = constrained_.front();
        return;
    }
    if (contacts_) {
        scratch_.next = scratch_.free_velocities;
        const double* x = solution_.data() + rows_;
        for (int i : constrained_) {
            const int size = constants_[i].particle ? 3 : 6;
            std::copy_n(x, size, scratch_.next[i].data());
            x += size;
        }
        if (meet_late()) return solve_mixed(true);
    }
    if (method_.corrections > 0) {
        correct_curvature();
        if (clock_) clock_->mark(Stage::correct_curvature);
    }
    if (stiff_) keep_angular_momentum();
    watch_redundancy();
    take_block_solution();
    if (clock_) clock_->mark(Stage::solve_block);
}

void RigidSystem::take_block_solution() {
    const auto blocks = joints_.blocks();
    const double* x = solution_.data();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        JointSet::State& state = joints_.states[blocks[k].joint];
        double* multiplier = blocks[k].axial ? state.axial_multiplier.data() : state.multiplier.data();
        for (int i = 0; i < blocks[k].size; ++i) multiplier[i] = -*x++;
    }
    const bool at_once = !clock_ && !half_step_;  // moved while at hand; a timed run keeps the stages apart
    for (int i : constrained_) {
        BodyState& s = live_.bodies[i];
        s.velocity = {x[0], x[1], x[2]};
        x += 3;
        if (!constants_[i].particle) {
            s.angular_momentum = s.inertia * Vec3{x[0], x[1], x[2]};
            x += 3;
        }
        if (at_once) spook::integrate(constants_[i], h_, live_.bodies[i]);
    }
    constrained_are_moved_ = at_once;
}

bool RigidSystem::factor_and_solve() {
    const bool doubtful = redundant_.factor_and_solve(
        matrix_, method_.floor, right_.data(), solution_.data(), method_.refinements,
        [this](std::span<const double> left) { return settled(left); });
    if (redundant_.finite() && doubtful) find_contradiction();
    if (redundant_.parted() && method_.corrections == 0 && !composed_) note_projected();
    return redundant_.finite();
}

void RigidSystem::solve_again() {
    redundant_.solve(matrix_, method_.floor, right_.data(), solution_.data(), method_.refinements,
                     [this](std::span<const double> left) { return settled(left); });
}

bool RigidSystem::settled(std::span<const double> left) const {
    const Worst worst = worst_row(left);
    return worst.residual <= 1e-13 * worst.speed;
}

RigidSystem::Worst RigidSystem::worst_row(std::span<const double> left) const {
    Worst worst;
    for (int i : constrained_) {
        const Vec3 v = live_.bodies[i].velocity + kick(i);
        worst.speed = std::max({worst.speed, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
    std::size_t row = 0;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row) {
            worst.speed = std::max(worst.speed, std::abs(right_[row]));
            if (!(std::abs(left[row]) <= worst.residual))
                worst.residual = std::abs(left[row]), worst.block = k;
        }
    return worst;
}

void RigidSystem::find_contradiction() {
    // Redundant rows agree with the others, and refinement leaves them a residual of rounding. Rows that cannot
    // hold together keep one of the size of the speeds they ask for.
    const Worst worst = worst_row(redundant_.residual(matrix_, right_.data(), solution_.data()));
    if (worst.residual <= 1e-3 * worst.speed) return;
    live_.contradicted = body_of(worst.block);
    live_.named = {joints_.blocks()[worst.block].joint};
}

int RigidSystem::body_of(int row_block) const noexcept {
    const JointBlock& block = joints_.blocks()[row_block];
    return block.second >= 0 && constants_[block.second].moves() ? block.second : block.first;
}

/// The block that carries the largest force: of rows that contradict each other, one of those.
int RigidSystem::busiest_block() const noexcept {
    int worst = 0, row = 0;
    double largest = -1.0;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row)
            if (std::abs(solution_[row]) > largest) largest = std::abs(solution_[row]), worst = k;
    return worst;
}

/// The bodies of a row beyond its first two: into it those that move by themselves, of others their speed.
void RigidSystem::fill_further(int block, RowBlock& rows, BlockRight& numbers,
                               std::vector<FurtherBody>& beyond) const {
    beyond.clear();
    const double* gradient = joints_.other_rows();
    for (int body : joints_.others(block)) {
        FurtherBody other{solver_index_[body], {}};
        std::copy_n(gradient, 6, other.jacobian.data());
        gradient += 6;
        const BodyState& s = live_.bodies[body];
        if (other.body >= 0) beyond.push_back(other);
        else
            numbers.right[0] -=
                dot(other.jacobian, {s.velocity.x, s.velocity.y, s.velocity.z, s.angular_velocity.x,
                                     s.angular_velocity.y, s.angular_velocity.z});
    }
    rows.further = beyond;
}

/// `solved`: whether the curvature of the rows is that of a solution, not of the velocities at hand.
void RigidSystem::fill_rows(bool solved) {
    if (curved_) curve_rows(solved);
    const auto blocks = joints_.blocks();
    mixed_.rows.resize(blocks.size());
    further_.resize(blocks.size());
    std::size_t first_row = 0;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        RowBlock& rows = mixed_.rows[k];
        const std::size_t at = std::exchange(first_row, first_row + static_cast<std::size_t>(blocks[k].size));
        if (rests(static_cast<int>(k))) {
            rows.right = rows.lower = rows.upper = rows.multiplier = Vec6{};
            rows.stop = {};
            continue;
        }
        BlockRight numbers;
        joints_.assemble(static_cast<int>(k), live_.bodies, rows.first_jacobian[0].data(),
                         rows.second_jacobian[0].data(), numbers);
        if (!joints_.others(static_cast<int>(k)).empty())
            fill_further(static_cast<int>(k), rows, numbers, further_[k]);
        for (int body : {blocks[k].first, blocks[k].second}) {
            if (body < 0 || constants_[body].motion != Motion::kinematic) continue;
            const BodyState& s = live_.bodies[body];
            const Vec6 given{s.velocity.x,         s.velocity.y,         s.velocity.z,
                             s.angular_velocity.x, s.angular_velocity.y, s.angular_velocity.z};
            const auto& jacobian = body == blocks[k].first ? rows.first_jacobian : rows.second_jacobian;
            for (int i = 0; i < rows.size; ++i) numbers.right[i] -= dot(jacobian[i], given);
            if (const int i = numbers.stop.row; i >= 0) numbers.stop.given += dot(jacobian[i], given);
        }
        for (int i = 0; i < rows.size; ++i) numbers.right[i] -= bend(at + static_cast<std::size_t>(i));
        if (const int i = rows.rotor; i >= 0) numbers.right[i] -= rows.softness[i] * scratch_.impulses[k][i];
        rows.right = numbers.right;
        rows.lower = numbers.lower;
        rows.upper = numbers.upper;
        rows.stop = numbers.stop;
        if (numbers.softness) std::copy_n(numbers.softness, rows.size, rows.softness.data());
        if (const int i = rows.stop.row;
            i >= 0)  // an impact is over long before the step is: its row does not give way
            rows.softness[i] = rows.stop.rebound != 0.0 ? 0.0 : blocks[k].softness[i];
    }
    for (const int k : scratch_.other_ends) {
        mixed_.rows[k].stop.both = true;
        mixed_.rows.push_back(other_end(mixed_.rows[k]));
    }
}

void RigidSystem::wrench(int joint, double* out) const noexcept {
    std::fill_n(out, 6, 0.0);
    const JointSet::State& state = joints_.states[joint];
    if (plane_values_) {
        plane_.wrench(joint, state, out);
        for (int k = 0; k < 6; ++k) out[k] /= h_;
        return;
    }
    if (!locked_.empty() && !mixed_values_) {  // along the world's axes, at the joint
        for (int k = 0; k < 6; ++k) out[k] = state.multiplier[k] / h_;
        return;
    }
    const auto blocks = joints_.blocks();
    Vec3 force, torque;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        if (blocks[k].joint != joint) continue;
        const double* rows = jacobian(static_cast<int>(k), true);
        const double* multiplier = blocks[k].axial ? state.axial_multiplier.data() : state.multiplier.data();
        for (int i = 0; i < blocks[k].size; ++i) {
            const double f = multiplier[i] / h_;
            force += f * Vec3{rows[6 * i], rows[6 * i + 1], rows[6 * i + 2]};
            torque += f * Vec3{rows[6 * i + 3], rows[6 * i + 4], rows[6 * i + 5]};
        }
    }
    torque -= cross(state.second_reach, force);
    for (int k = 0; k < 3; ++k) out[k] = force[k], out[3 + k] = torque[k];
}

double RigidSystem::tension(int joint) const noexcept { return -joints_.states[joint].multiplier[0] / h_; }

}  // namespace spook
