#include "rigid/plane_step.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "linear/elementary.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::plane_step;

Refusal PlaneStep::analyse(std::span<const BodyConstants> constants, const JointSet& joints,
                           std::span<const int> tied, const Options& options) {
    const auto refuse = [this](Refusal refusal) { return joints_.clear(), refusal; };
    joints_.clear(), nodes_.clear(), rows_.clear();
    options_ = options;
    const auto blocks = joints.blocks();
    int normal = -1;
    for (const JointBlock& block : blocks) {
        const JointConstants& joint = joints.constants(block.joint);
        for (int i = 0; i < 3 && normal < 0 && joint.kind == JointKind::hinge; ++i)
            if (std::fabs(joint.axes[0][i]) > 0.9) normal = i;
    }
    if (normal < 0) return "no hinge is along an axis of the world";
    plane_ = {normal};
    std::vector<int> node_of(constants.size(), static_cast<int>(tied.size()));
    for (const int body : tied) {
        const BodyConstants& c = constants[body];
        if (c.particle) return "some body cannot turn";
        const Mat3& p = c.start_principal;
        const Vec3 axis{p(normal, 0), p(normal, 1), p(normal, 2)};
        const Vec3 spin{c.inertia.x * axis.x, c.inertia.y * axis.y, c.inertia.z * axis.z};
        Node node;
        node.body = body;
        node.mass = c.mass;
        node.inertia = dot(axis, spin);
        if (!(norm(spin - node.inertia * axis) <= 4.0 * rounding * node.inertia))
            return "some body would wobble";
        node.over_mass = 1.0 / node.mass;
        node.over_inertia = 1.0 / node.inertia;
        node_of[body] = static_cast<int>(nodes_.size());
        nodes_.push_back(node);
    }
    nodes_.emplace_back();
    std::vector<int> root(nodes_.size());
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&root](int i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    joint_at_.assign(static_cast<std::size_t>(joints.count()), -1);
    int row = 0;
    for (const JointBlock& block : blocks) {
        if (!take_joint(constants, joints, block, row, node_of)) return refuse("some joint leads out of it");
        row += block.size;
        root[find(joints_.back().first)] = find(joints_.back().second);
    }
    for (int k = 0; k < static_cast<int>(nodes_.size()); ++k)  // what floats could tip over
        if (find(k) != find(static_cast<int>(tied.size())))
            return refuse("a mechanism that floats could tip over");
    return order_rows(joints) ? nullptr : refuse("its rows have too wide an envelope");
}

/// False if it is none of the joints that hold bodies in the plane, or holds them beside it.
bool PlaneStep::take_joint(std::span<const BodyConstants> constants, const JointSet& joints,
                           const JointBlock& block, int first_row, std::span<const int> node_of) {
    const JointConstants& from = joints.constants(block.joint);
    if (block.axial || (from.kind != JointKind::hinge && from.kind != JointKind::lock &&
                        from.kind != JointKind::prismatic && from.kind != JointKind::planar))
        return false;
    const auto lies = [this](Vec3 v) { return std::fabs(v[plane_.normal]) <= rounding * norm(v); };
    const auto stands = [this](Vec3 v) {
        return std::fabs(v[plane_.first()]) <= rounding && std::fabs(v[plane_.second()]) <= rounding;
    };
    if (!lies(from.first_arm) || !lies(from.second_arm)) return false;
    const auto node = [&](int body) {
        return body < 0 ? static_cast<int>(nodes_.size()) - 1 : node_of[static_cast<std::size_t>(body)];
    };
    for (const int body : {block.first, block.second})
        if (body >= 0 && constants[body].motion == Motion::kinematic) return false;
    if ((from.kind == JointKind::hinge || from.kind == JointKind::planar) && !stands(from.axes[0]))
        return false;
    Joint joint;
    joint.joint = block.joint;
    joint.first = node(block.first);
    joint.second = node(block.second);
    joint.first_arm = plane_(from.first_arm);
    joint.second_arm = plane_(from.second_arm);
    joint.row = static_cast<int>(rows_.size());
    int index = 0;
    const auto add = [&] {
        const JointSet::RowLaw law = joints.law(block.joint, index);
        const JointSet::RowGain size = joints.gain(static_cast<int>(&block - joints.blocks().data()), index);
        rows_.push_back({block.joint, index, first_row + index, law.upsilon - 1.0, law.violation,
                         0.25 + size.relaxation, options_.cap * size.extent});
    };
    for (int k = from.holds.linear_first; k < from.holds.linear_end; ++k, ++index) {
        if (stands(from.axes[k])) continue;
        if (!lies(from.axes[k]) || joint.linear == 2) return false;
        joint.axes[joint.linear++] = plane_(from.axes[k]);
        add();
    }
    for (int k = 0; k < 3 && from.holds.turning == Turning::held; ++k, ++index) {
        if (lies(from.axes[k])) continue;
        if (!stands(from.axes[k]) || joint.sense != 0.0) return false;
        joint.sense = from.axes[k][plane_.normal];
        add();
    }
    joint_at_[block.joint] = static_cast<int>(joints_.size());
    joints_.push_back(joint);
    return true;
}

bool PlaneStep::holds(std::span<const BodyConstants> constants, std::span<const Vec3> acceleration,
                      const LargeArray<BodyState>& bodies) {
    const auto lies = [this](Vec3 v, double part) { return std::fabs(v[plane_.normal]) <= part * norm(v); };
    const auto stands = [this](Vec3 v, double part) {
        return norm(plane_.lifted(plane_(v))) <= part * norm(v);
    };
    for (std::size_t i = 0; i < constants.size(); ++i)
        if (!constants[i].moves() && (!is_zero(bodies[i].displacement) || bodies[i].turn.w != 1.0))
            return false;
    for (Node& node : nodes_) {
        if (node.body < 0) continue;
        const BodyState& s = bodies[node.body];
        const Vec3 torque = constants[node.body].torque, turn{s.turn.x, s.turn.y, s.turn.z};
        if (!lies(acceleration[node.body], rounding) || !stands(torque, rounding) ||
            !lies(s.displacement, in_plane) || !lies(s.velocity, in_plane) || !stands(turn, in_plane) ||
            !stands(s.angular_momentum, in_plane))
            return false;
        node.kick = plane_(options_.time_step * acceleration[node.body]);
        node.turn_kick = node.over_inertia * (options_.time_step * torque[plane_.normal]);
    }
    read(bodies);
    assemble();
    return factor();
}

void PlaneStep::read(const LargeArray<BodyState>& bodies) noexcept {
    for (Node& node : nodes_) {
        if (node.body < 0) continue;
        const BodyState& s = bodies[node.body];
        const Vec3 turn{s.turn.x, s.turn.y, s.turn.z};
        node.at.displacement = plane_(s.displacement);
        node.at.turn = {s.turn.w, turn[plane_.normal]};
        node.at.turned = less_one(node.at.turn);
        node.velocity = plane_(s.velocity);
        node.spin = s.angular_momentum[plane_.normal];
        node.rate = node.over_inertia * node.spin;
    }
}

void PlaneStep::write(LargeArray<BodyState>& bodies) const noexcept {
    for (const Node& node : nodes_) {
        if (node.body < 0) continue;
        BodyState& s = bodies[node.body];
        const Vec3 turn = upright(node.at.turn.sine);
        s.displacement = plane_.lifted(node.at.displacement);
        s.turn = {node.at.turn.cosine, turn.x, turn.y, turn.z};
        s.velocity = plane_.lifted(node.velocity);
        s.angular_velocity = upright(node.rate);
        s.angular_momentum = upright(node.spin);
        s.turn_less_one = {};
        const int u = plane_.first(), v = plane_.second();
        s.turn_less_one(u, u) = s.turn_less_one(v, v) = node.at.turned.fall;
        s.turn_less_one(u, v) = -node.at.turned.sine;
        s.turn_less_one(v, u) = node.at.turned.sine;
    }
}

/// How far the rows of a joint are off where its bodies are.
void PlaneStep::look(const Joint& joint, const Pose& a, const Pose& b, double* violation) const noexcept {
    const Vec2 gap =
        b.displacement - a.displacement + b.turned * joint.second_arm - a.turned * joint.first_arm;
    for (int k = 0; k < joint.linear; ++k) *violation++ = dot(carried(a.turned, joint.axes[k]), gap);
    if (joint.sense == 0.0) return;
    const HalfTurn between = conjugate(a.turn) * b.turn;
    *violation = (between.cosine < 0.0 ? -2.0 : 2.0) * joint.sense * between.sine;
}

/// Levers and shares, what the rows ask of the change of velocities, and the matrix.
void PlaneStep::assemble() noexcept {
    for (Joint& joint : joints_) {
        const Node &a = nodes_[joint.first], &b = nodes_[joint.second];
        const Vec2 first = a.at.turned * joint.first_arm, second = b.at.turned * joint.second_arm;
        const Vec2 gap = b.at.displacement - a.at.displacement + second - first;
        joint.second_reach = joint.second_arm + second;
        joint.first_reach = joint.first_arm + first + gap;
        int r = joint.row;
        const auto put = [&](Lever on_first, Lever on_second, double violation) {
            levers_[2 * r] = on_first;
            levers_[2 * r + 1] = on_second;
            shares_[2 * r] = {a.over_mass * on_first.x, a.over_mass * on_first.y,
                              a.over_inertia * on_first.turn};
            shares_[2 * r + 1] = {b.over_mass * on_second.x, b.over_mass * on_second.y,
                                  b.over_inertia * on_second.turn};
            // G v₊ + Sig λ = Ups G v − (4/h) Ups g: without the speed that both sides have.
            const double rate = on_first.x * a.velocity.x + on_first.y * a.velocity.y +
                                on_first.turn * a.rate + on_second.x * b.velocity.x +
                                on_second.y * b.velocity.y + on_second.turn * b.rate;
            rate_[r] = rate;
            violation_[r] = violation;
            asked_[r] = rows_[r].damped * rate - rows_[r].gain * violation;
            ++r;
        };
        for (int k = 0; k < joint.linear; ++k) {
            const Vec2 u = carried(a.at.turned, joint.axes[k]);
            put({-u.x, -u.y, -cross(joint.first_reach, u)}, {u.x, u.y, cross(joint.second_reach, u)},
                dot(u, gap));
        }
        if (options_.follows_turns) follow_turns(joint, first, second, gap);
        if (joint.sense == 0.0) continue;
        HalfTurn between = conjugate(a.at.turn) * b.at.turn;
        if (between.cosine < 0.0) between = {-between.cosine, -between.sine};
        const double on = joint.sense * between.cosine;
        put({0.0, 0.0, -on}, {0.0, 0.0, on}, 2.0 * joint.sense * between.sine);
    }
    std::copy(blank_.begin(), blank_.end(), envelope_.begin());
    for (const Coupling& m : couplings_) {
        const Lever &one = levers_[m.lever], &two = shares_[m.other];
        envelope_[m.to] += one.x * two.x + one.y * two.y + one.turn * two.turn;
    }
}

/// As JointSet::follow_turns(). `first`, `second`: what the arms' turns have added to them; `gap`: between their ends.
void PlaneStep::follow_turns(const Joint& joint, Vec2 first, Vec2 second, Vec2 gap) noexcept {
    const Node &a = nodes_[joint.first], &b = nodes_[joint.second];
    const double h = options_.time_step,
                 share = share_of_bend(h * std::max(std::fabs(a.rate), std::fabs(b.rate)));
    if (!(share > 0.0)) return;
    Vec2 slid = gap, slide = b.velocity + b.rate * across(joint.second_reach) - a.velocity -
                             a.rate * across(joint.first_reach);
    for (int k = 0; k < joint.linear; ++k) {
        const Vec2 u = carried(a.at.turned, joint.axes[k]);
        slid -= dot(u, slid) * u;
        slide -= dot(u, slide) * u;
    }
    const auto bend = [&](double way) {
        const TurnLessOne of_first = less_one(half_turn(way * a.rate)),
                          of_second = less_one(half_turn(way * b.rate));
        const Vec2 there = slid + way * slide;
        return of_second * (joint.second_arm + second) - way * b.rate * across(joint.second_reach) -
               of_first * (joint.first_arm + first) + way * a.rate * across(joint.first_reach) - way * slide -
               of_first * there;
    };
    const Vec2 ahead = bend(h), back = bend(-h);
    for (int k = 0; k < joint.linear; ++k) {
        const Vec2 u = carried(a.at.turned, joint.axes[k]);
        const int r = joint.row + k;
        asked_[r] -= share * rows_[r].gain * (rows_[r].ahead * dot(u, ahead) + 0.25 * dot(u, back));
    }
}

/// L D Lᵀ in place. False where a pivot is too small.
bool PlaneStep::factor() noexcept {
    const int n = rows();
    for (int r = 0; r < n; ++r) {
        double* row = envelope_.data() + start_[r];
        const double scale = row[r];
        double pivot = scale;
        for (int s = first_[r]; s < r; ++s) {
            const double* above = envelope_.data() + start_[s];
            double entry = row[s];
            for (int k = std::max(first_[r], first_[s]); k < s; ++k) entry -= row[k] * above[k];
            row[s] = entry;
        }
        for (int s = first_[r]; s < r; ++s) {
            const double lower = row[s] * inverse_[s];
            pivot -= row[s] * lower;
            row[s] = lower;
        }
        if (!(pivot > doubtful_pivot * scale)) return false;
        inverse_[r] = 1.0 / pivot;
    }
    return true;
}

/// What the rows still ask for, right_, into the impulses that give it to them.
void PlaneStep::solve() noexcept {
    const int n = rows();
    for (int r = 1; r < n; ++r) {
        const double* row = envelope_.data() + start_[r];
        double value = right_[r];
        for (int s = first_[r]; s < r; ++s) value -= row[s] * right_[s];
        right_[r] = value;
    }
    for (int r = 0; r < n; ++r) right_[r] *= inverse_[r];
    for (int r = n - 1; r > 0; --r) {
        const double* row = envelope_.data() + start_[r];
        const double value = right_[r];
        for (int s = first_[r]; s < r; ++s) right_[s] -= row[s] * value;
    }
}

bool PlaneStep::find_velocities() noexcept {
    assemble();
    if (!factor()) return false;
    if (options_.corrections > 0) take_past_curvature();
    solve_refined();
    if (options_.corrections > 0) correct();
    for (Node& node : nodes_) {
        node.next_velocity += node.velocity;
        node.next_spin = node.spin + node.inertia * node.next_rate;
        node.next_rate = node.over_inertia * node.next_spin;
    }
    return true;
}

/// As RowCurvature::take_past_curvature(): where the rows came from is known.
void PlaneStep::take_past_curvature() noexcept {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
        const double back = last_violation_[r] - violation_[r] + options_.time_step * rate_[r];
        asked_[r] -= rows_[r].gain * 0.25 * std::clamp(back, -rows_[r].cap, rows_[r].cap);
    }
    first_asked_ = asked_;
}

/// As RowCurvature::correct(): where the solution, then the corrected one, would take the rows.
void PlaneStep::correct() noexcept {
    const double h = options_.time_step;
    for (int round = 0; round < options_.corrections; ++round) {
        for (Node& node : nodes_) {
            node.ahead = node.at;
            const double spin = node.spin + node.inertia * node.next_rate;
            advance(node.velocity + node.next_velocity, node.over_inertia * spin, node.ahead);
        }
        for (const Joint& joint : joints_) {
            const Node &a = nodes_[joint.first], &b = nodes_[joint.second];
            look(joint, a.ahead, b.ahead, ahead_.data() + joint.row);
            for (int r = joint.row; r < joint.end; ++r) {
                const double curved = ahead_[r] - violation_[r] - h * (rate_[r] + changed(r, a, b));
                asked_[r] = first_asked_[r] -
                            rows_[r].gain * rows_[r].ahead * std::clamp(curved, -rows_[r].cap, rows_[r].cap);
            }
        }
        solve_refined();
    }
}

/// What the step changes of a row's speed so far.
double PlaneStep::changed(int row, const Node& a, const Node& b) const noexcept {
    const Lever &one = levers_[2 * row], &two = levers_[2 * row + 1];
    return one.x * a.next_velocity.x + one.y * a.next_velocity.y + one.turn * a.next_rate +
           two.x * b.next_velocity.x + two.y * b.next_velocity.y + two.turn * b.next_rate;
}

/// Impulses for what the rows ask, and into the nodes what the step changes of their velocities.
void PlaneStep::solve_refined() noexcept {
    for (Node& node : nodes_) {
        node.next_velocity = node.kick;
        node.next_rate = node.turn_kick;
    }
    const int n = rows();
    std::fill(multiplier_.begin(), multiplier_.end(), 0.0);
    for (int round = 0; round <= options_.refinements; ++round) {
        for (const Joint& joint : joints_) {
            const Node &a = nodes_[joint.first], &b = nodes_[joint.second];
            for (int r = joint.row; r < joint.end; ++r)
                right_[r] = asked_[r] - softness_[r] * multiplier_[r] - changed(r, a, b);
        }
        solve();
        for (int r = 0; r < n; ++r) multiplier_[r] += right_[r];
        for (const Joint& joint : joints_) {
            Node &a = nodes_[joint.first], &b = nodes_[joint.second];
            for (int r = joint.row; r < joint.end; ++r) {
                const double value = right_[r];
                const Lever &one = shares_[2 * r], &two = shares_[2 * r + 1];
                a.next_velocity += value * Vec2{one.x, one.y};
                b.next_velocity += value * Vec2{two.x, two.y};
                a.next_rate += value * one.turn;
                b.next_rate += value * two.turn;
            }
        }
    }
    nodes_.back().next_velocity = {};
    nodes_.back().next_rate = 0.0;
}

void PlaneStep::take_velocities() noexcept {
    for (Node& node : nodes_) {
        std::swap(node.velocity, node.next_velocity);
        std::swap(node.spin, node.next_spin);
        std::swap(node.rate, node.next_rate);
    }
    if (options_.corrections > 0) std::copy(violation_.begin(), violation_.end(), last_violation_.begin());
}

/// A pose a step on.
void PlaneStep::advance(Vec2 velocity, double rate, Pose& pose) const noexcept {
    pose.displacement += options_.time_step * velocity;
    pose.turn = unit(half_turn(options_.time_step * rate) * pose.turn);
    pose.turned = less_one(pose.turn);
}

int PlaneStep::move() noexcept {
    int fast = -1;
    for (Node& node : nodes_) {
        advance(node.velocity, node.rate, node.at);
        if (options_.time_step * std::fabs(node.rate) >= 1.0 && fast < 0) fast = node.body;
    }
    return fast;
}

void PlaneStep::read_violations(std::span<const double> all) noexcept {
    for (std::size_t r = 0; r < rows_.size(); ++r) last_violation_[r] = all[rows_[r].place];
}

void PlaneStep::write_violations(std::span<double> all) const noexcept {
    for (std::size_t r = 0; r < rows_.size(); ++r) all[rows_[r].place] = last_violation_[r];
}

void PlaneStep::deliver(LargeArray<JointSet::State>& states) const noexcept {
    for (const Joint& joint : joints_) {
        JointSet::State& state = states[joint.joint];
        state.multiplier = {};
        state.first_reach = plane_.lifted(joint.first_reach);
        state.second_reach = plane_.lifted(joint.second_reach);
    }
    for (std::size_t r = 0; r < rows_.size(); ++r)
        states[rows_[r].joint].multiplier[rows_[r].index] = multiplier_[r];
}

void PlaneStep::wrench(int joint, const JointSet::State& state, double* out) const noexcept {
    const Joint& at = joints_[joint_at_[joint]];
    Vec2 force;
    double torque = 0.0;
    const int end = at.row + at.linear;  // of its rows of places
    for (int r = at.row; r < end; ++r)
        force += state.multiplier[rows_[r].index] * Vec2{levers_[2 * r + 1].x, levers_[2 * r + 1].y};
    if (at.sense != 0.0) torque = state.multiplier[rows_[end].index] * levers_[2 * end + 1].turn;
    const Vec3 push = plane_.lifted(force), twist = upright(torque);
    for (int k = 0; k < 3; ++k) out[k] = push[k], out[3 + k] = twist[k];
}

}  // namespace spook
