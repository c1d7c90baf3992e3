#include "rigid/general_rows.hpp"

#include <algorithm>
#include <numbers>

#include "linear/elementary.hpp"

namespace spook {

void GeneralRows::add(const RigidScene& scene, const JointSpec& spec, double time_step) {
    GeneralRow general;
    general.length = spec.rest_length;
    general.restitution = spec.restitution;
    general.one_sided = spec.one_sided;
    general.row = regularise(spec.compliance[0], spec.damping[0], time_step);
    const auto mention = [&](int body) {
        if (body < 0 || scene.bodies[body].motion == Motion::fixed) return;
        if (std::find(general.bodies.begin(), general.bodies.end(), body) == general.bodies.end())
            general.bodies.push_back(body);
    };
    for (const RelationTerm& term : spec.terms) {
        const JointSpec& joint = scene.joints[term.joint];
        mention(joint.first);
        mention(joint.second);
        general.terms.push_back(
            {term.joint, term.coefficient, joint.first, joint.second, constants_of(scene, joint)});
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
    gradient_.resize(std::max<std::size_t>({gradient_.size(), 12, 6 * general.bodies.size()}));
    rows_.push_back(std::move(general));
}

/// An eye goes on where its wire stands in eyes_: those before it are further to the front.
void GeneralRows::make_eye(const JointSpec& spec, int block, int wire, int wire_block) {
    EyeRow row;
    row.block = block;
    row.wire = wire_block;
    for (const EyeRow& other : eyes_)
        if (other.wire == row.wire) row.before.push_back(other.block);
    GeneralRow& general = rows_.back();
    general.eye = static_cast<int>(eyes_.size());
    general.previous = rows_[wire].points[spec.eye - 1];
    general.friction = spec.friction[0];
    general.turned = 2.0 * std::numbers::pi * spec.turns;
    eyes_.push_back(std::move(row));
}

/// How hard the wire holds where it bends: tanh ½µφ, φ the angle of its bend and of its turns there.
void GeneralRows::rub(const GeneralRow& general, std::span<const BodyState> bodies) noexcept {
    const auto place = [&](const GeneralRow::Point& point) {
        const BodyState& s = state_of(point.body, bodies);
        return point.start + s.displacement + s.turn_less_one * point.arm;
    };
    const Vec3 at = place(general.points[0]);
    const Vec3 from = at - place(general.previous), on = place(general.points[1]) - at;
    const double bend = arc_tangent(norm(cross(from, on)), dot(from, on));
    eyes_[general.eye].grip = hyperbolic_tangent(0.5 * general.friction * (bend + general.turned));
}

/// Violation, G v and, unless null, the gradient: six numbers per body of the row.
GeneralRows::Along GeneralRows::along(const GeneralRow& general, std::span<const BodyState> bodies,
                                      const LargeArray<JointState>& states, double* gradient) const noexcept {
    Along sum;
    const auto add = [&](int index, Vec3 linear, Vec3 angular) {
        if (gradient == nullptr) return;
        const auto found = std::find(general.bodies.begin(), general.bodies.end(), index);
        if (found == general.bodies.end()) return;
        double* row = gradient + 6 * (found - general.bodies.begin());
        for (int k = 0; k < 3; ++k) row[k] += linear[k], row[3 + k] += angular[k];
    };
    if (gradient) std::fill_n(gradient, std::max<std::size_t>(12, 6 * general.bodies.size()), 0.0);
    for (const GeneralRow::Term& term : general.terms) {
        const AxialRow row =
            axial_row(term.constants, state_of(term.first, bodies), state_of(term.second, bodies));
        const double c = term.coefficient;
        sum.violation += c * unwrapped(term.constants, row.coordinate, states[term.joint].angle);
        sum.rate += c * row.rate;
        const auto scaled = [c](const double* j) { return c * Vec3{j[0], j[1], j[2]}; };
        add(term.first, scaled(row.first), scaled(row.first + 3));
        add(term.second, scaled(row.second), scaled(row.second + 3));
    }
    if (general.points.empty()) return sum;
    const auto arm = [&](const GeneralRow::Point& point) {
        return point.arm + state_of(point.body, bodies).turn_less_one * point.arm;
    };
    for (std::size_t k = 0; k + 1 < general.points.size(); ++k) {
        const GeneralRow::Point &from = general.points[k], &to = general.points[k + 1];
        const BodyState &first = state_of(from.body, bodies), &second = state_of(to.body, bodies);
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

double GeneralRows::bias(int row, std::span<const BodyState> bodies) const noexcept {
    const GeneralRow& general = rows_[row];
    double sum = 0.0;
    for (const GeneralRow::Term& term : general.terms)
        sum += term.coefficient *
               axial_bias(term.constants, state_of(term.first, bodies), state_of(term.second, bodies));
    for (std::size_t k = 0; k + 1 < general.points.size(); ++k) {
        const GeneralRow::Point &from = general.points[k], &to = general.points[k + 1];
        JointConstants piece;
        piece.kind = JointKind::distance;
        piece.first_arm = from.arm;
        piece.second_arm = to.arm;
        piece.span = to.start - from.start;
        double bias = 0.0;
        joint_bias(piece, state_of(from.body, bodies), state_of(to.body, bodies), &bias);
        sum += bias;
    }
    return sum;
}

void GeneralRows::assemble(int index, std::span<const BodyState> bodies, const LargeArray<JointState>& states,
                           JointState& state, JointStops& stops, double* first, double* second,
                           BlockRight& right) noexcept {
    const GeneralRow& general = rows_[index];
    const Along row = along(general, bodies, states, gradient_.data());
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
        right.right[0] = stops.right(-1.0, row.violation, row.rate, general.row, general.restitution,
                                     unbounded, state, right.stop);
        right.upper[0] = 0.0;
        return;
    }
    right.right[0] = general.row.upsilon * row.rate - general.row.violation_gain * row.violation;
}

}  // namespace spook
