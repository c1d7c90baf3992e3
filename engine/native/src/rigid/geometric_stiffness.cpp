// The geometric stiffness of loaded joints, treated implicitly.
//
// A force F at the arm r of a body turns it with r × F; turned on by φ, by (r·F)(1 − r̂ r̂ᵀ) φ less. Freezing r in a
// step integrates that stiffness K explicitly: unstable where h² K exceeds 4 I. As for a compliant row the torque is
// taken at ¼(φ₊ + 2φ + φ₋), h/4 (w₊ − w) from here: (I + h²/4 K) w₊ = ℓ + h torque + h²/4 K w + Gᵀλ, with F of the
// step before. A steady turn feels nothing of it. Of bodies that nothing holds, the torques taken from each
// do not add up to zero: a turn of the whole, rigid and so free for the joints, gives the angular momentum back.
#include <algorithm>
#include <cmath>

#include "linear/disjoint_sets.hpp"
#include "rigid/island_frame.hpp"
#include "rigid/joint_pulls.hpp"
#include "rigid/string_stiffness.hpp"

namespace spook {

namespace {

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

}  // namespace

/// h²/4 K of every constrained body, from the forces of the step before.
void StringStiffness::add() {
    std::fill(rows_.stiffness.begin(), rows_.stiffness.end(), Mat3{});
    const auto rows = [this](int k) { return mixed_.jacobian(rows_, k, true); };
    each_pull(joints_, model_.solver_index, model_.constants, rows, [this](int body, Vec3 arm, Vec3 impulse) {
        const double pull = dot(arm, impulse), length2 = dot(arm, arm);
        if (!(pull > 0.0) || length2 == 0.0) return;
        Mat3& held = rows_.stiffness[model_.solver_index[body]];
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                held(i, j) += 0.25 * model_.h * pull * ((i == j ? 1.0 : 0.0) - arm[i] * arm[j] / length2);
    });
}

/// The forces at the start, which the stiffness of the first step is made of. The first round knows none and moves
/// light bodies under a heavy load far too fast; its forces are right all the same.
void StringStiffness::find_tensions() {
    rows_.stiffness.assign(model_.constrained.size(), Mat3{});
    if (islands_.empty()) find_islands();
    forces_.find();
    const auto blocks = joints_.blocks();
    for (int round = 0; round < 3; ++round) {
        if (round > 0) add();
        rows_.assemble();
        rows_.fill_inertias();
        rows_.fill_momenta();
        if (!rows_.factor_and_solve()) return;  // the first step will say so
        const double* x = rows_.solution.data();
        for (const JointBlock& block : blocks)
            for (int i = 0; i < block.size; ++i, ++x)
                if (!block.axial) joints_.states[block.joint].multiplier[i] = -*x;
    }
    rows_.matrix.clear_counters();
}

/// Tied bodies by what joins them, without those that the world, a fixed or a driven body holds.
void StringStiffness::find_islands() {
    const int world = static_cast<int>(model_.constrained.size());  // all that does not float
    DisjointSets tied;
    tied.begin(model_.constrained.size() + 1);
    const auto place = [this, world](int body) {
        return body < 0 || model_.solver_index[body] < 0 ? world : model_.solver_index[body];
    };
    for (const JointBlock& block : joints_.blocks()) tied.join(place(block.first), place(block.second));
    std::vector<std::vector<int>> members(model_.constrained.size());
    for (int k = 0; k < world; ++k) members[tied.root(k)].push_back(k);
    const int held = tied.root(world);
    for (int k = 0; k < static_cast<int>(members.size()); ++k)
        if (k != held && !members[k].empty()) islands_.push_back(members[k]);
}

/// Gives every floating island back the angular momentum that the stiffness took from its bodies.
void StringStiffness::keep_angular_momentum() {
    const auto values = [&](int k) { return rows_.solution.data() + rows_.body_at(k); };
    for (const std::vector<int>& island : islands_) {
        const Vec3 centre = island_frame(model_, live_.bodies, island).centre;
        Vec3 missing;
        for (int k : island) {
            if (model_.constants[model_.constrained[k]].particle) continue;
            const double* x = values(k);
            missing += rows_.stiffness[k] *
                       (Vec3{x[3], x[4], x[5]} - live_.bodies[model_.constrained[k]].angular_velocity);
        }
        const Vec3 turn = turn_of(island, centre, missing);
        for (int k : island) {
            double* x = values(k);
            const Vec3 v = cross(turn, model_.position(model_.constrained[k], live_.bodies) - centre);
            for (int i = 0; i < 3; ++i) x[i] += v[i];
            for (int i = 0; i < 3 && !model_.constants[model_.constrained[k]].particle; ++i)
                x[3 + i] += turn[i];
        }
    }
}

/// The turn that gives some bodies an angular momentum as if they were one, found in axes along the line through their centre and
/// what is heavy and far: the inertia of a row of bodies about it would be lost in sums with that across.
Vec3 StringStiffness::turn_of(const std::vector<int>& members, Vec3 centre, Vec3 angular_momentum) const {
    Vec3 line{1.0, 0.0, 0.0};
    double most = 0.0;
    for (int k : members) {
        const Vec3 r = model_.position(model_.constrained[k], live_.bodies) - centre;
        const double share = model_.constants[model_.constrained[k]].mass * dot(r, r);
        if (share > most) most = share, line = (1.0 / norm(r)) * r;
    }
    const Vec3 aside = cross(line, std::abs(line.x) < 0.6 ? Vec3{1.0, 0.0, 0.0} : Vec3{0.0, 1.0, 0.0});
    const Vec3 across = (1.0 / norm(aside)) * aside, axes[3] = {line, across, cross(line, across)};
    Mat3 inertia;
    for (int k : members) {
        const BodyConstants& body = model_.constants[model_.constrained[k]];
        const Vec3 place = model_.position(model_.constrained[k], live_.bodies) - centre;
        const Vec3 r{dot(axes[0], place), dot(axes[1], place), dot(axes[2], place)};
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                const double others = r[(i + 1) % 3] * r[(i + 1) % 3] + r[(i + 2) % 3] * r[(i + 2) % 3];
                inertia(i, j) += body.mass * (i == j ? others : -r[i] * r[j]);
                if (!body.particle)
                    inertia(i, j) += dot(axes[i], live_.bodies[model_.constrained[k]].inertia * axes[j]);
            }
    }
    const Vec3 l = angular_momentum;
    const Vec3 w = solved(inertia, {dot(axes[0], l), dot(axes[1], l), dot(axes[2], l)});
    return w.x * axes[0] + w.y * axes[1] + w.z * axes[2];
}

}  // namespace spook
