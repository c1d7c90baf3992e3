// One stage in joint coordinates: Newton's method on what the joints let the bodies gain.
#include <algorithm>
#include <cmath>

#include "collision/rotation.hpp"
#include "linear/elementary.hpp"
#include "rigid/joint_rounds.hpp"
#include "rigid/joint_tree.hpp"

namespace spook {

/// What the stage starts from.
void JointTree::take(const LargeArray<BodyState>& bodies) noexcept {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        const BodyConstants& constants = constants_[node.body];
        const BodyState& s = bodies[node.body];
        const BodyState& holder = node.parent < 0 ? world_ : bodies[nodes_[node.parent].body];
        Course& m = courses_[k];
        m.axes = spook::axes(constants, s);
        m.place = constants.start + s.displacement;
        m.reach = carried(s.turn_less_one, node.arm);
        m.relative = {};
        const Quat q = node.turns > 0 ? conjugate(holder.turn) * s.turn : Quat{};
        if (node.turns == 1) {
            const double along = dot(vector_of(q), node.axis),
                         over = 1.0 / std::sqrt(q.w * q.w + along * along);
            const Vec3 e = over * along * node.axis;
            m.relative = {over * q.w, e.x, e.y, e.z};
        } else if (node.turns == 3) {
            m.relative = unit(q);
        }
        m.frame = holder.turn_less_one;
        if (node.parent >= 0) {
            m.parent_reach = carried(holder.turn_less_one, node.parent_arm);
            m.from_parent = constants.start - constants_[nodes_[node.parent].body].start + s.displacement -
                            holder.displacement;
        }
        if (node.turns == 1) {
            m.along[0] = carried(m.frame, node.axis);
        } else if (node.turns == 3) {
            for (int i = 0; i < 3; ++i) {
                m.along[i] = {m.frame.m[i], m.frame.m[3 + i], m.frame.m[6 + i]};
                m.along[i][i] += 1.0;
            }
        }
        m.gap = {};
        if (node.slides == 0) continue;
        const Vec3 gap = s.displacement - holder.displacement + s.turn_less_one * node.arm -
                         holder.turn_less_one * node.parent_arm;
        for (int i = 0; i < node.slides; ++i) {
            const Vec3 axis = carried(m.frame, node.slide_axes[i]);
            m.along[node.turns + i] = axis;
            m.slide[i] = dot(gap, axis);
            m.gap += m.slide[i] * axis;
        }
    }
}

/// The first guess. False if it is out of reach.
bool JointTree::look_at(const double* increments) noexcept {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        const double* own = increments + node.first;
        Course& m = courses_[k];
        const Vec3 e = node.turns == 1   ? own[0] * node.axis
                       : node.turns == 3 ? Vec3{own[0], own[1], own[2]}
                                         : Vec3{};
        const double squared = 1.0 - dot(e, e);
        if (!(squared > 0.1)) return false;
        m.moved = {std::sqrt(squared), e.x, e.y, e.z};
        for (int i = 0; i < node.slides; ++i) m.slid[i] = own[node.turns + i];
    }
    return true;
}

JointTree::Log JointTree::log_of(double y, double cosine) noexcept {
    Log log;
    if (y < 1e-7) {
        log.ratio += log.ratio_slope * y;
        log.bend += log.bend_slope * y;
        return log;
    }
    log.ratio = arc_tangent(std::sqrt(y), cosine) / std::sqrt(y);
    log.bend = (1.0 - log.ratio * cosine) / y;
    log.ratio_slope = (1.0 / cosine - log.ratio) / (2.0 * y);
    log.bend_slope = (0.5 * log.ratio / cosine - log.ratio_slope * cosine - log.bend) / y;
    return log;
}

/// How the bodies move over the stage, and the momenta that takes: m Δx/τ, and for a turn φ = θ n in body axes that of the
/// discrete Lagrangian φ·I φ/2τ, (1/τ)(I φ + ½ φ × I φ + κ φ × (φ × I φ)), κ θ² = 1 − (θ/2) cot θ/2: a steady spin's turn,
/// and symplectic as that of rotation.hpp is, which does not say its momentum from the turn.
void JointTree::move(double tau) noexcept {
    const double over = 2.0 / tau;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        Course& m = courses_[k];
        const Vec3 e = carried(m.frame, vector_of(m.moved));
        m.turn = {m.moved.w, e.x, e.y, e.z};
        Vec3 gap;
        for (int i = 0; i < node.slides; ++i) gap += m.slid[i] * m.along[node.turns + i];
        m.shift = gap;
        if (node.parent >= 0) {
            const Course& p = courses_[node.parent];
            m.turn = p.turn * m.turn;
            m.shift += p.shift + p.turned * (m.parent_reach + m.gap + gap);
        }
        m.turned = rotation_less_one(m.turn);
        m.shift -= m.turned * m.reach;
        m.half = transposed_times(m.axes, vector_of(m.turn));
        m.log = log_of(dot(m.half, m.half), m.turn.w);
        m.spin = times(node.inertia, m.half);
        m.bent = cross(m.half, m.spin);
        m.bent_twice = cross(m.half, m.bent);
        m.momentum =
            m.axes * ((over * m.log.ratio) * (m.spin + m.log.ratio * m.bent + m.log.bend * m.bent_twice));
    }
}

/// Where the joints are at the end, as the derivatives need it.
void JointTree::turn_ends() noexcept {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        Course& m = courses_[k];
        m.end_place = m.place + m.shift;
        m.end_reach = carried(m.turned, m.reach);
        for (int i = 0; i < node.coordinates(); ++i)
            m.end_along[i] = node.parent < 0 ? m.along[i] : carried(courses_[node.parent].turned, m.along[i]);
    }
}

/// ahead_: poses at the end, made from joint coordinates anew, so that violations never add up.
void JointTree::place() noexcept {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        const Course& m = courses_[k];
        const BodyState& holder = node.parent < 0 ? world_ : ahead_[nodes_[node.parent].body];
        BodyState& s = ahead_[node.body];
        const Quat relative = m.moved * m.relative;
        s.turn = unit(node.parent < 0 ? relative : holder.turn * relative);
        s.turn_less_one = rotation_less_one(s.turn);
        Vec3 gap;
        for (int i = 0; i < node.slides; ++i) gap += (m.slide[i] + m.slid[i]) * node.slide_axes[i];
        s.displacement = holder.displacement + gap - s.turn_less_one * node.arm;
        if (node.parent >= 0) s.displacement += holder.turn_less_one * (node.parent_arm + gap);
    }
}

/// The joints go on by `step`, per coordinate rad or m, at the end of the stage.
void JointTree::turn_by(const double* step) noexcept {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        const double* own = step + node.first;
        Course& m = courses_[k];
        if (node.turns > 0) {
            const Vec3 e = node.turns == 1 ? 0.5 * own[0] * node.axis : 0.5 * Vec3{own[0], own[1], own[2]};
            const Quat q = Quat{std::sqrt(1.0 - dot(e, e)), e.x, e.y, e.z} * m.moved;
            // Its scalar part from the others: to scale all four would turn every stage a little the same way.
            m.moved = {std::sqrt(1.0 - dot(vector_of(q), vector_of(q))), q.x, q.y, q.z};
        }
        for (int i = 0; i < node.slides; ++i) m.slid[i] += own[node.turns + i];
    }
}

/// How far the coordinate of a joint with armature goes [rad or m], as the joint counts it.
double JointTree::moved(const Node& node, const Course& m) noexcept {
    const double goes =
        node.turns == 1 ? 2.0 * arc_tangent(dot(vector_of(m.moved), node.axis), m.moved.w) : m.slid[0];
    return node.backwards ? -goes : goes;
}

/// right_: −τ/scale × what the coordinates still gain that no force gives.
void JointTree::gain(const LargeArray<BodyState>& bodies, const JointStates& joints, double tau) noexcept {
    const double over = tau / scale_;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        Course& m = courses_[k];
        const BodyState& s = bodies[node.body];
        m.push = node.mass * ((1.0 / tau) * m.shift - s.velocity);
        m.twist = m.momentum - s.angular_momentum;
    }
    for (std::size_t k = nodes_.size(); k-- > 0;) {
        const Node& node = nodes_[k];
        const Course& m = courses_[k];
        const Vec3 about = m.twist - cross(m.reach, m.push);
        for (int i = 0; i < node.coordinates(); ++i)
            right_[place_of_[node.first + i]] = -over * dot(m.along[i], i < node.turns ? about : m.push);
        if (node.armature > 0.0) {
            const double gained = node.armature * (moved(node, m) / tau - joints.states[node.joint].rotor);
            right_[place_of_[node.first]] -= over * (node.backwards ? -gained : gained);
        }
        if (node.parent < 0) continue;
        Course& p = courses_[node.parent];
        p.push += m.push;
        p.twist += m.twist + cross(m.from_parent, m.push);
    }
}

/// The derivative of gain(): τ/scale × what coordinates gain when one of them ends further on.
void JointTree::fill_masses() noexcept {
    const double over = 1.0 / scale_;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        const Vec3 centre = courses_[k].end_place + courses_[k].end_reach;
        for (int j = 0; j < node.coordinates(); ++j) {
            const Vec3 axis = courses_[k].end_along[j];
            const int column = place_of_[node.first + j];
            for (int b = static_cast<int>(k); b < node.end; ++b) {
                const Course& m = courses_[b];
                if (j >= node.turns) {
                    pushes_[b] = nodes_[b].mass * axis;
                    twists_[b] = {};
                    continue;
                }
                pushes_[b] = nodes_[b].mass * cross(axis, m.end_place - centre);
                const Vec3 d = transposed_times(m.axes, axis), inertia = nodes_[b].inertia;
                const Vec3 turn = 0.5 * (m.turn.w * d + cross(d, m.half));
                const double dy = 2.0 * dot(m.half, turn), ratio = m.log.ratio;
                const Vec3 more = times(inertia, turn), bent = cross(turn, m.spin) + cross(m.half, more),
                           twice = cross(turn, m.bent) + cross(m.half, bent);
                twists_[b] = m.axes * ((2.0 * dy * m.log.ratio_slope) *
                                           (m.spin + 2.0 * ratio * m.bent + m.log.bend * m.bent_twice) +
                                       (2.0 * ratio) * (more + ratio * bent + m.log.bend * twice +
                                                        (dy * m.log.bend_slope) * m.bent_twice));
            }
            const auto put = [&](int b, Vec3 push, Vec3 twist) {
                const Course& m = courses_[b];
                const Vec3 about = twist - cross(m.reach, push);
                for (int i = 0; i < nodes_[b].coordinates(); ++i)
                    system_.at(place_of_[nodes_[b].first + i], column) =
                        over * dot(m.along[i], i < nodes_[b].turns ? about : push);
            };
            for (int b = node.end - 1; b > static_cast<int>(k); --b) {
                put(b, pushes_[b], twists_[b]);
                const int p = nodes_[b].parent;
                pushes_[p] += pushes_[b];
                twists_[p] += twists_[b] + cross(courses_[b].from_parent, pushes_[b]);
            }
            const Vec3 push = pushes_[k];
            Vec3 twist = twists_[k];
            for (int b = static_cast<int>(k);; b = nodes_[b].parent) {
                put(b, push, twist);
                if (nodes_[b].parent < 0) break;
                twist += cross(courses_[b].from_parent, push);
            }
            system_.at(column, column) += over * node.armature;
        }
    }
}

/// The rows of a loop at some poses: violations, and Jacobians of both bodies.
void JointTree::find_rows(const Closing& loop, const LargeArray<BodyState>& bodies, LoopRows& out) noexcept {
    const JointBlock& block = joints_->blocks()[loop.block];
    const BodyState &first = state(block.first, bodies), &second = state(block.second, bodies);
    const JointConstants& joint = joints_->constants(block.joint);
    if (loop.row[loop.kept - 1] >= joint.holds.linear()) {
        double one[36] = {}, other[36] = {};
        JointRows rows{one, other, {}, {}};
        Vec3 first_reach, second_reach;
        assemble_joint(joint, first, second, rows, first_reach, second_reach);
        for (int r = 0; r < loop.kept; ++r) {
            const double *a = one + 6 * loop.row[r], *b = other + 6 * loop.row[r];
            out.violation[r] = rows.violation[loop.row[r]];
            out.linear[r][0] = {a[0], a[1], a[2]}, out.angular[r][0] = {a[3], a[4], a[5]};
            out.linear[r][1] = {b[0], b[1], b[2]}, out.angular[r][1] = {b[3], b[4], b[5]};
        }
        return;
    }
    // Points alone: the rows of assemble_joint() without its rotations.
    const Vec3 reach = carried(second.turn_less_one, joint.second_arm);
    const Vec3 gap = second.displacement - first.displacement + second.turn_less_one * joint.second_arm -
                     first.turn_less_one * joint.first_arm;
    const Vec3 other = carried(first.turn_less_one, joint.first_arm) + gap;
    for (int r = 0; r < loop.kept; ++r) {
        const Vec3 axis = carried(first.turn_less_one, joint.axes[joint.holds.linear_first + loop.row[r]]);
        out.violation[r] = dot(axis, gap);
        out.linear[r][0] = -axis, out.angular[r][0] = -cross(other, axis);
        out.linear[r][1] = axis, out.angular[r][1] = cross(reach, axis);
    }
}

/// The same in joint coordinates, at the start or the end of the stage.
void JointTree::reduce(const Closing& loop, const LoopRows& rows, bool end, double* out) const noexcept {
    for (const Closing::Column& column : loop.columns) {
        const Node& node = nodes_[column.node];
        const Course& m = courses_[column.node];
        const bool second = loop.second >= column.node && loop.second < node.end;
        const Vec3 along = end ? m.end_along[column.coordinate] : m.along[column.coordinate];
        double* to = out++;
        const int step = static_cast<int>(loop.columns.size());
        if (column.coordinate >= node.turns) {
            for (int r = 0; r < loop.kept; ++r) to[r * step] = dot(along, rows.linear[r][second]);
            continue;
        }
        const Course& b = courses_[second ? loop.second : loop.first];
        const Vec3 lever = end ? b.end_place - m.end_place - m.end_reach : b.place - m.place - m.reach;
        const Vec3 swung = cross(along, lever);
        for (int r = 0; r < loop.kept; ++r)
            to[r * step] = dot(swung, rows.linear[r][second]) + dot(along, rows.angular[r][second]);
    }
}

/// What the loops ask for, into right_; with `derivatives` their rows too: G(q₊) below the masses, −G(q)ᵀ beside them.
void JointTree::fill_loops(bool derivatives) noexcept {
    for (const Closing& loop : loops_) {
        LoopRows rows;
        find_rows(loop, ahead_, rows);
        if (derivatives) reduce(loop, rows, true, end_rows_.data());
        const double *before = start_rows_.data() + loop.reduced, *after = end_rows_.data();
        for (int r = 0; r < loop.kept; ++r) {
            const int row = place_of_[coordinates_ + loop.at + r];
            const double force = multiplier_[loop.at + r];
            right_[row] = -rows.violation[r];
            for (const int coordinate : loop.places) {
                right_[coordinate] += *before * force;
                if (derivatives) {
                    system_.at(coordinate, row) = -*before;
                    system_.at(row, coordinate) = *after++;
                }
                ++before;
            }
        }
    }
}

bool JointTree::stage(double tau, LargeArray<BodyState>& bodies, JointStates& joints, double* increments,
                      std::int64_t& rounds) noexcept {
    if (!plane_.empty()) return plane_.stage(tau, bodies, increments, rounds);
    if (!pivots_.empty()) {
        pivots_.stage(tau, bodies, rounds);
        return true;
    }
    take(bodies);
    if (!look_at(increments)) return false;
    for (const Closing& loop : loops_) {
        LoopRows rows;
        find_rows(loop, bodies, rows);
        reduce(loop, rows, false, start_rows_.data() + loop.reduced);
    }
    std::fill(multiplier_.begin(), multiplier_.end(), 0.0);
    for (JointRounds round;;) {
        move(tau);
        gain(bodies, joints, tau);
        if (round.fresh()) {
            turn_ends();
            system_.clear();
            fill_masses();
        }
        if (!loops_.empty()) {
            place();
            fill_loops(round.fresh());
        }
        ++rounds;
        if (round.fresh() && !system_.factor()) return false;
        system_.solve(right_.data());
        double size = 0.0, moved = 0.0;
        for (const Node& node : nodes_)
            for (int i = 0; i < node.coordinates(); ++i) {
                const double step = right_[place_of_[node.first + i]];
                const double off = std::fabs(step) / (i < node.turns ? 1.0 : node.extent);
                step_[node.first + i] = step;
                if (!(off <= size)) size = off;
            }
        if (round.lost(size)) return false;
        turn_by(step_.data());
        for (int row = 0; row < rows_; ++row) multiplier_[row] += right_[place_of_[coordinates_ + row]];
        for (const Course& course : courses_)
            moved = std::max(moved, dot(vector_of(course.moved), vector_of(course.moved)));
        if (round.settled(size, moved, !loops_.empty())) break;
    }
    for (const Course& course : courses_)
        if (!(course.moved.w > 0.3)) return false;
    move(tau);
    ++rounds;
    place();
    deliver(tau, bodies, joints, increments);
    return true;
}

/// Poses at the end, momenta on the way, speeds of rotors, and what each joint moved.
void JointTree::deliver(double tau, LargeArray<BodyState>& bodies, JointStates& joints,
                        double* increments) const noexcept {
    const double over = 1.0 / tau;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        const Course& m = courses_[k];
        const BodyState& end = ahead_[node.body];
        BodyState& s = bodies[node.body];
        s.displacement = end.displacement;
        s.turn = end.turn;
        s.turn_less_one = end.turn_less_one;
        s.velocity = over * m.shift;
        s.angular_momentum = m.momentum;
        if (node.armature > 0.0) joints.states[node.joint].rotor = over * moved(node, m);
        double* own = increments + node.first;
        const Vec3 e = vector_of(m.moved);
        if (node.turns == 1) own[0] = dot(e, node.axis);
        for (int i = 0; i < 3 && node.turns == 3; ++i) own[i] = e[i];
        for (int i = 0; i < node.slides; ++i) own[node.turns + i] = m.slid[i];
    }
}

}  // namespace spook
