// Rows over several bodies: linear relations between free coordinates (gears, racks, screws, belts, differentials), and
// the length of a wire that runs through points of bodies and may go slack.
//
//   relation   g = Σ c_k q_k                 q_k the free coordinate of joint k, turns counted, zero at the start
//   wire       g = Σ |p_(i+1) − p_i| − L     p_i points of bodies or of the world; one-sided: it only pulls, λ <= 0;
//              + Σ r_k q_k for the drums it is wound on
//   eye        the wire behind a point of it goes through there at the rate of Σ |p_(i+1) − p_i| over what follows
//              (and of its drums): kept at zero as far as friction reaches, see load_dependent_bounds.hpp
#include <algorithm>
#include <numbers>

#include "linear/elementary.hpp"
#include "rigid/joint_set.hpp"

namespace spook {

JointSet::General JointSet::general_of(const RigidScene& scene, const JointSpec& spec) const {
    General general;
    general.terms = spec.terms;
    general.length = spec.rest_length;
    general.restitution = spec.restitution;
    general.one_sided = spec.one_sided;
    general.row = regularise(spec.compliance[0], spec.damping[0], time_step_);
    const auto mention = [&](int body) {
        if (body < 0 || scene.bodies[body].motion == Motion::fixed) return;
        if (std::find(general.bodies.begin(), general.bodies.end(), body) == general.bodies.end())
            general.bodies.push_back(body);
    };
    for (const RelationTerm& term : spec.terms) {
        mention(scene.joints[term.joint].first);
        mention(scene.joints[term.joint].second);
    }
    for (const End& end : spec.points) {
        mention(end.body);
        const Vec3 centre = end.body < 0 ? end.point : scene.bodies[end.body].position;
        general.points.push_back({end.body, end.point, end.point - centre});
    }
    // A row over several begins with bodies that move by themselves: one of them stands for it in its island.
    if (general.bodies.size() > 2)
        std::stable_partition(general.bodies.begin(), general.bodies.end(),
                              [&](int body) { return scene.bodies[body].motion == Motion::dynamic; });
    return general;
}

/// An eye goes on where its wire stands in eyes_: those before it are further to the front.
void JointSet::add_eye(const JointSpec& spec, General& general) {
    EyeRow row;
    row.block = static_cast<int>(blocks_.size());
    row.wire = joints_[spec.wire].block;
    for (const EyeRow& other : eyes_)
        if (other.wire == row.wire) row.before.push_back(other.block);
    general.eye = static_cast<int>(eyes_.size());
    general.previous = generals_[joints_[spec.wire].general].points[spec.eye - 1];
    general.friction = spec.friction[0];
    general.turned = 2.0 * std::numbers::pi * spec.turns;
    eyes_.push_back(std::move(row));
}

/// How hard the wire holds where it bends: tanh ½µφ, φ the angle of its bend and of its turns there.
void JointSet::rub(const General& general, std::span<const BodyState> bodies) noexcept {
    const auto place = [&](const General::Point& point) {
        const BodyState& s = body(point.body, bodies);
        return point.start + s.displacement + s.turn_less_one * point.arm;
    };
    const Vec3 at = place(general.points[0]);
    const Vec3 from = at - place(general.previous), on = place(general.points[1]) - at;
    const double bend = arc_tangent(norm(cross(from, on)), dot(from, on));
    eyes_[general.eye].grip = hyperbolic_tangent(0.5 * general.friction * (bend + general.turned));
}

std::span<const int> JointSet::others(int block) const noexcept {
    const int general = blocks_[block].axial ? -1 : joints_[blocks_[block].joint].general;
    if (general < 0 || generals_[general].bodies.size() <= 2) return {};
    return std::span<const int>(generals_[general].bodies).subspan(2);
}

/// Violation, G v and, unless null, the gradient: six numbers per body of the row.
JointSet::Along JointSet::along(const General& general, std::span<const BodyState> bodies,
                                double* gradient) const noexcept {
    Along sum;
    const auto add = [&](int index, Vec3 linear, Vec3 angular) {
        if (gradient == nullptr) return;
        const auto found = std::find(general.bodies.begin(), general.bodies.end(), index);
        if (found == general.bodies.end()) return;
        double* row = gradient + 6 * (found - general.bodies.begin());
        for (int k = 0; k < 3; ++k) row[k] += linear[k], row[3 + k] += angular[k];
    };
    if (gradient) std::fill_n(gradient, std::max<std::size_t>(12, 6 * general.bodies.size()), 0.0);
    for (const RelationTerm& term : general.terms) {
        const Joint& joint = joints_[term.joint];
        const AxialRow row =
            axial_row(joint.constants, body(joint.first, bodies), body(joint.second, bodies));
        const double c = term.coefficient;
        sum.violation += c * unwrapped(joint, row.coordinate, states[term.joint].angle);
        sum.rate += c * row.rate;
        const auto scaled = [c](const double* j) { return c * Vec3{j[0], j[1], j[2]}; };
        add(joint.first, scaled(row.first), scaled(row.first + 3));
        add(joint.second, scaled(row.second), scaled(row.second + 3));
    }
    if (general.points.empty()) return sum;
    const auto arm = [&](const General::Point& point) {
        return point.arm + body(point.body, bodies).turn_less_one * point.arm;
    };
    for (std::size_t k = 0; k + 1 < general.points.size(); ++k) {
        const General::Point &from = general.points[k], &to = general.points[k + 1];
        const BodyState &first = body(from.body, bodies), &second = body(to.body, bodies);
        const Vec3 from_arm = arm(from), to_arm = arm(to);
        const Vec3 d = to.start - from.start + (second.displacement - first.displacement) +
                       (to_arm - to.arm) - (from_arm - from.arm);
        const double length = norm(d);
        const Vec3 u = length > 0.0 ? (1.0 / length) * d : Vec3{};
        sum.violation += length;
        sum.rate += dot(u, second.velocity + cross(second.angular_velocity, to_arm) - first.velocity -
                               cross(first.angular_velocity, from_arm));
        add(from.body, -u, -cross(from_arm, u));
        add(to.body, u, cross(to_arm, u));
    }
    sum.violation -= general.length;
    return sum;
}

/// The second time derivative of the row when all its bodies go on with constant velocities.
double JointSet::general_bias(const General& general, std::span<const BodyState> bodies) const noexcept {
    double sum = 0.0;
    for (const RelationTerm& term : general.terms) {
        const Joint& joint = joints_[term.joint];
        sum += term.coefficient *
               axial_bias(joint.constants, body(joint.first, bodies), body(joint.second, bodies));
    }
    for (std::size_t k = 0; k + 1 < general.points.size(); ++k) {
        const General::Point &from = general.points[k], &to = general.points[k + 1];
        JointConstants piece;
        piece.kind = JointKind::distance;
        piece.first_arm = from.arm;
        piece.second_arm = to.arm;
        piece.span = to.start - from.start;
        double bias = 0.0;
        joint_bias(piece, body(from.body, bodies), body(to.body, bodies), &bias);
        sum += bias;
    }
    return sum;
}

void JointSet::assemble_general(const Joint& joint, State& state, std::span<const BodyState> bodies,
                                double* first, double* second, BlockRight& right) noexcept {
    const General& general = generals_[joint.general];
    const Along row = along(general, bodies, gradient_.data());
    std::copy_n(gradient_.data(), 6, first);
    std::copy_n(gradient_.data() + 6, 6, second);
    if (general.eye >= 0) {
        rub(general, bodies);
        right.right[0] = 0.0;
        right.lower[0] = -state.bound[0];
        right.upper[0] = state.bound[0];
        return;
    }
    if (general.one_sided) {
        right.stop.row = 0;
        right.right[0] = one_sided(-1.0, row.violation, row.rate, general.row, general.restitution, unbounded,
                                   state, right.stop);
        right.upper[0] = 0.0;
        return;
    }
    right.right[0] = general.row.upsilon * row.rate - general.row.violation_gain * row.violation;
}

}  // namespace spook
