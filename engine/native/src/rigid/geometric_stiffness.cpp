// The geometric stiffness of loaded joints, treated implicitly, and what a divergence looks like without it.
//
// A force F at the arm r of a body turns it with r × F; turned on by φ, by (r·F)(1 − r̂ r̂ᵀ) φ less. Freezing r in a
// step integrates that stiffness K explicitly: unstable where h² K exceeds 4 I. As for a compliant row the torque is
// taken at ¼(φ₊ + 2φ + φ₋), h/4 (w₊ − w) from here: (I + h²/4 K) w₊ = ℓ + h torque + h²/4 K w + Gᵀλ, with F of the
// step before. A steady turn feels nothing of it. Of bodies that nothing holds, the torques taken from each
// do not add up to zero: a turn of the whole, rigid and so free for the joints, gives the angular momentum back.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "rigid/joint_pulls.hpp"
#include "rigid/rigid_system.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::geometric_stiffness;

/// x of A x = b for a symmetric A, the last two unknowns first: the first entry may be smaller by any factor.
Vec3 solved(const Mat3& a, Vec3 b) noexcept {
    const double det = a(1, 1) * a(2, 2) - a(1, 2) * a(1, 2);
    if (!(det > 0.0)) return {};
    const auto others = [&](double y, double z) {
        return Vec3{0.0, (a(2, 2) * y - a(1, 2) * z) / det, (a(1, 1) * z - a(1, 2) * y) / det};
    };
    const Vec3 share = others(a(0, 1), a(0, 2)), rest = others(b.y, b.z);
    const double own = a(0, 0) - a(0, 1) * share.y - a(0, 2) * share.z;
    const double x = own > 0.0 ? (b.x - a(0, 1) * rest.y - a(0, 2) * rest.z) / own : 0.0;
    return {x, rest.y - x * share.y, rest.z - x * share.z};
}

/// Whether a joint pulls at one of its bodies, of mass m at an arm l, with a tension T of which T h²/(m l) is above TAUT.
bool is_taut(const JointBlock& block, const JointSet::State& state, bool second, double mass,
             double h) noexcept {
    if (block.axial) return false;
    double impulse = 0.0;
    const int linear = std::min(block.size, 3);
    for (int i = 0; i < linear; ++i) impulse = std::max(impulse, std::abs(state.multiplier[i]));
    const double arm = norm(second ? state.second_reach : state.first_reach);
    return arm > 0.0 && h * impulse > TAUT * mass * arm;
}

}  // namespace

/// h²/4 K of every constrained body, from the forces of the step before.
void RigidSystem::add_geometric_stiffness() {
    std::fill(stiffness_.begin(), stiffness_.end(), Mat3{});
    const auto rows = [this](int k) { return jacobian(k, true); };
    each_pull(joints_, solver_index_, constants_, rows, [this](int body, Vec3 arm, Vec3 impulse) {
        const double pull = dot(arm, impulse), length2 = dot(arm, arm);
        if (!(pull > 0.0) || length2 == 0.0) return;
        Mat3& held = stiffness_[solver_index_[body]];
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                held(i, j) += 0.25 * h_ * pull * ((i == j ? 1.0 : 0.0) - arm[i] * arm[j] / length2);
    });
}

/// The forces at the start, which the stiffness of the first step is made of. The first round knows none and moves
/// light bodies under a heavy load far too fast; its forces are right all the same.
void RigidSystem::find_tensions() {
    stiffness_.assign(constrained_.size(), Mat3{});
    if (islands_.empty()) find_islands();
    if (!force_.empty()) find_forces();
    const auto blocks = joints_.blocks();
    for (int round = 0; round < 3; ++round) {
        if (round > 0) add_geometric_stiffness();
        assemble_blocks();
        fill_inertias();
        fill_block_momenta();
        if (!factor_and_solve()) return;  // the first step will say so
        const double* x = solution_.data();
        for (const JointBlock& block : blocks)
            for (int i = 0; i < block.size; ++i, ++x)
                if (!block.axial) joints_.states[block.joint].multiplier[i] = -*x;
    }
    matrix_.clear_counters();
}

/// Tied bodies by what joins them, without those that the world, a fixed or a driven body holds.
void RigidSystem::find_islands() {
    std::vector<int> root(constrained_.size() + 1);  // the last one is all that does not float
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&root](int i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    const auto place = [this](int body) {
        return body < 0 || solver_index_[body] < 0 ? static_cast<int>(constrained_.size())
                                                   : solver_index_[body];
    };
    for (const JointBlock& block : joints_.blocks())
        root[find(place(block.first))] = find(place(block.second));
    std::vector<std::vector<int>> members(root.size());
    for (int k = 0; k < static_cast<int>(constrained_.size()); ++k) members[find(k)].push_back(k);
    const int held = find(static_cast<int>(constrained_.size()));
    for (int k = 0; k < static_cast<int>(members.size()); ++k)
        if (k != held && !members[k].empty()) islands_.push_back(members[k]);
}

/// Gives every floating island back the angular momentum that the stiffness took from its bodies.
void RigidSystem::keep_angular_momentum() {
    const int row_blocks = static_cast<int>(joints_.blocks().size());
    const auto values = [&](int k) { return solution_.data() + matrix_.offset(row_blocks + k); };
    for (const std::vector<int>& island : islands_) {
        const Vec3 centre = island_frame(island).centre;
        Vec3 missing;
        for (int k : island) {
            if (constants_[constrained_[k]].particle) continue;
            const double* x = values(k);
            missing +=
                stiffness_[k] * (Vec3{x[3], x[4], x[5]} - live_.bodies[constrained_[k]].angular_velocity);
        }
        const Vec3 turn = turn_of(island, centre, missing);
        for (int k : island) {
            double* x = values(k);
            const Vec3 v = cross(turn, position_of(constrained_[k]) - centre);
            for (int i = 0; i < 3; ++i) x[i] += v[i];
            for (int i = 0; i < 3 && !constants_[constrained_[k]].particle; ++i) x[3 + i] += turn[i];
        }
    }
}

/// The turn that gives some bodies an angular momentum as if they were one. It is found in axes along the line through
/// their centre and what is heavy and far: a row of light bodies between two heavy ones has about it a part in 1e9 of
/// its inertia across, which would be lost in sums of both.
Vec3 RigidSystem::turn_of(const std::vector<int>& members, Vec3 centre, Vec3 angular_momentum) const {
    Vec3 line{1.0, 0.0, 0.0};
    double most = 0.0;
    for (int k : members) {
        const Vec3 r = position_of(constrained_[k]) - centre;
        const double share = constants_[constrained_[k]].mass * dot(r, r);
        if (share > most) most = share, line = (1.0 / norm(r)) * r;
    }
    const Vec3 aside = cross(line, std::abs(line.x) < 0.6 ? Vec3{1.0, 0.0, 0.0} : Vec3{0.0, 1.0, 0.0});
    const Vec3 across = (1.0 / norm(aside)) * aside, axes[3] = {line, across, cross(line, across)};
    Mat3 inertia;
    for (int k : members) {
        const BodyConstants& body = constants_[constrained_[k]];
        const Vec3 place = position_of(constrained_[k]) - centre;
        const Vec3 r{dot(axes[0], place), dot(axes[1], place), dot(axes[2], place)};
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                const double others = r[(i + 1) % 3] * r[(i + 1) % 3] + r[(i + 2) % 3] * r[(i + 2) % 3];
                inertia(i, j) += body.mass * (i == j ? others : -r[i] * r[j]);
                if (!body.particle)
                    inertia(i, j) += dot(axes[i], live_.bodies[constrained_[k]].inertia * axes[j]);
            }
    }
    const Vec3 l = angular_momentum;
    const Vec3 w = solved(inertia, {dot(axes[0], l), dot(axes[1], l), dot(axes[2], l)});
    return w.x * axes[0] + w.y * axes[1] + w.z * axes[2];
}

/// Centre of mass of some constrained bodies, and their inertia about it as if they were one.
RigidSystem::IslandFrame RigidSystem::island_frame(const std::vector<int>& members) const {
    IslandFrame frame;
    double mass = 0.0;
    for (int k : members) {
        const BodyConstants& body = constants_[constrained_[k]];
        frame.centre += body.mass * position_of(constrained_[k]);
        mass += body.mass;
    }
    frame.centre *= 1.0 / mass;
    for (int k : members) {
        const BodyConstants& body = constants_[constrained_[k]];
        const Vec3 r = position_of(constrained_[k]) - frame.centre;
        const double r2 = dot(r, r);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                frame.inertia(i, j) += body.mass * ((i == j ? r2 : 0.0) - r[i] * r[j]) +
                                       (body.particle ? 0.0 : live_.bodies[constrained_[k]].inertia(i, j));
    }
    return frame;
}

/// What made a run leave the finite numbers, as far as the joints show a few steps before: the option that cures it.
/// A body that a joint makes go round by a radian a step, and pulls at with a tension T of which T h²/(m l) is above
/// TAUT: rows that stand still in the step no longer guide its way. −1 if there is none. An arm along the axis, as of a
/// wheel beside its hinge, stays where it is, and so does the ground under a tyre.
int RigidSystem::find_whirling(std::span<const int> bodies) {
    if (joints_.blocks().empty()) return -1;
    for (const int i : bodies) {
        const BodyConstants& body = constants_[i];
        const BodyState& s = live_.bodies[i];
        const double least = std::min({body.inertia.x, body.inertia.y, body.inertia.z});
        if (body.particle || h_ * h_ * dot(s.angular_momentum, s.angular_momentum) < least * least) continue;
        const Vec3 spin = turned_by(body, s, s.angular_momentum);
        if (h_ * norm(spin) < 1.0) continue;
        deliver();
        for (const JointBlock& block : joints_.blocks()) {
            if (joints_.constants(block.joint).kind >= JointKind::relation) continue;
            const JointSet::State& state = joints_.states[block.joint];
            for (const bool second : {false, true}) {
                if ((second ? block.second : block.first) != i) continue;
                const Vec3 around = cross(second ? state.second_reach : state.first_reach, spin);
                if (body.mass * dot(around, around) > ASIDE * dot(spin, s.angular_momentum) &&
                    is_taut(block, state, second, body.mass, h_))
                    return i;
            }
        }
    }
    return -1;
}

/// Why a run ended, if tension did it; `known`: that it did.
const char* RigidSystem::cause(bool known) const noexcept {
    if (!known && (composed_ || early_joints_.size() != joints_.states.size())) return "";
    for (const JointBlock& block : joints_.blocks())
        for (const bool second : {false, true}) {
            const int body = second ? block.second : block.first;
            if (known || body < 0 || !constants_[body].moves()) continue;
            known = is_taut(block, early_joints_[block.joint], second, constants_[body].mass, h_);
        }
    if (!known) return "";
    return stiff_ ? "ran away: its joints carry more than so light a body can take in a step (T h²/(m l) is "
                    "above 0.3), and their load changes within one, while string_stiffness knows that of "
                    "the step before; use composition=\"order4\" without it, or a smaller time step"
           : contacts_ || solver_ != RigidSolver::block
               ? "ran away: its joints carry more tension than so light a body can take in a step "
                 "(T h²/(m l) is above 0.3); use a smaller time step"
               : "ran away: its joints carry more tension than so light a body can take in a step "
                 "(T h²/(m l) is above 0.3); use string_stiffness=True, or a smaller time step";
}

}  // namespace spook
