#include "rigid/plane_tree.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "linear/elementary.hpp"
#include "rigid/joint_rounds.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::plane_tree;

void PlaneTree::take(Plane3 plane, std::vector<Node> nodes, std::vector<Closing> closings, int reach,
                     double scale) {
    plane_ = plane;
    nodes_ = std::move(nodes);
    closings_ = std::move(closings);
    scale_ = scale;
    courses_.assign(nodes_.size(), Course{});
    pushes_.assign(nodes_.size(), {});
    twists_.assign(nodes_.size(), 0.0);
    std::size_t columns = 0;
    for (Closing& loop : closings_) {
        loop.reduced = static_cast<int>(columns);
        columns += loop.columns.size();
    }
    start_rows_.assign(columns, {});
    fixed_gap_.assign(closings_.size(), {});
    multiplier_.assign(2 * closings_.size(), 0.0);
    const std::size_t unknowns = nodes_.size() + multiplier_.size();
    right_.assign(unknowns, 0.0);
    system_.prepare(static_cast<int>(unknowns), reach);
}

/// What the stage starts from.
template <int NORMAL> void PlaneTree::read(const LargeArray<BodyState>& bodies) noexcept {
    constexpr Plane3 flat{NORMAL};
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        const BodyState& s = bodies[node.body];
        Course& m = courses_[k];
        const Vec3 turn{s.turn.x, s.turn.y, s.turn.z};
        m.pose = {s.turn.w, turn[NORMAL]};
        m.posed = less_one(m.pose);
        m.displacement = flat(s.displacement);
        m.velocity = flat(s.velocity);
        m.spin = s.angular_momentum[NORMAL];
        m.place = node.start + m.displacement;
        const Vec2 bent = m.posed * node.arm;
        m.reach = node.arm + bent;
        m.relative = m.pose;
        m.lever = {};
        m.along = node.along;
        Vec2 gap = m.displacement + bent;
        if (node.parent >= 0) {
            const Course& p = courses_[node.parent];
            m.relative = conjugate(p.pose) * m.pose;
            const Vec2 lever = p.posed * node.parent_arm;
            m.lever = node.parent_arm + lever;
            m.from_parent = node.from_parent + (m.displacement - p.displacement);
            gap -= p.displacement + lever;
            m.along = carried(p.posed, node.along);
        }
        if (node.slides) {
            m.relative = {};
            m.slide = dot(gap, m.along);
            m.lever += m.slide * m.along;
        } else {
            m.relative = unit(m.relative);
        }
    }
    for (std::size_t l = 0; l < closings_.size(); ++l) {
        const Closing& loop = closings_[l];
        const auto fixed = [&](const Closing::End& end) -> Vec2 {
            if (end.node >= 0 || end.body < 0) return {};
            const BodyState& s = bodies[end.body];
            return flat(s.displacement + s.turn_less_one * flat.lifted(end.arm));
        };
        fixed_gap_[l] = fixed(loop.second) - fixed(loop.first);
        Vec2* row = start_rows_.data() + loop.reduced;
        for (const Closing::Column& column : loop.columns) {
            const Course& m = courses_[column.node];
            if (nodes_[column.node].slides) {
                *row = m.along;
            } else {
                const Closing::End& end = column.second ? loop.second : loop.first;
                const Course& b = courses_[end.node];
                *row = across(b.place + carried(b.posed, end.arm) - (m.place + m.reach));
            }
            if (!column.second) *row = -1.0 * *row;
            ++row;
        }
    }
}

/// The first guess. False if it is out of reach.
bool PlaneTree::look_at(const double* increments) noexcept {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        Course& m = courses_[k];
        m.angle = 0.0;
        m.moved = {};
        m.slid = 0.0;
        if (nodes_[k].slides) {
            m.slid = increments[k];
            continue;
        }
        m.angle = increments[k];
        m.moved = half_turn(m.angle);
        if (!(m.moved.cosine > min_half_turn_cosine)) return false;
    }
    return true;
}

/// How the bodies move over the stage, and the spin that takes: J θ/τ for a turn θ.
void PlaneTree::move(double tau) noexcept {
    const double over = 1.0 / tau;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        Course& m = courses_[k];
        m.turn = m.moved;
        m.whole_angle = m.angle;
        m.shift = m.slid * m.along;
        if (node.parent >= 0) {
            const Course& p = courses_[node.parent];
            m.turn = p.turn * m.turn;
            m.whole_angle += p.whole_angle;
            m.shift += p.shift + p.turned * (m.lever + m.shift);
        }
        m.turned = less_one(m.turn);
        m.shift -= m.turned * m.reach;
        m.spins = over * m.whole_angle * node.inertia;
    }
}

/// right_: −τ/scale × what the coordinates still gain that no force gives.
void PlaneTree::gain(double tau) noexcept {
    const double over = tau / scale_, rate = 1.0 / tau;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        Course& m = courses_[k];
        m.push = nodes_[k].mass * (rate * m.shift - m.velocity);
        m.twist = m.spins - m.spin;
    }
    for (std::size_t k = nodes_.size(); k-- > 0;) {
        const Node& node = nodes_[k];
        const Course& m = courses_[k];
        right_[node.place] = -over * (node.slides ? dot(m.along, m.push) : m.twist - cross(m.reach, m.push));
        if (node.parent < 0) continue;
        Course& p = courses_[node.parent];
        p.push += m.push;
        p.twist += m.twist + cross(m.from_parent, m.push);
    }
}

/// Where the joints are at the end, as the derivatives need it.
void PlaneTree::turn_ends() noexcept {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        Course& m = courses_[k];
        m.end_place = m.place + m.shift;
        m.end_centre = m.end_place + carried(m.turned, m.reach);
        m.end_along = node.parent < 0 ? m.along : carried(courses_[node.parent].turned, m.along);
    }
}

/// The derivative of gain(): τ/scale × what coordinates gain when one of them ends further on.
void PlaneTree::fill_masses() noexcept {
    const double over = 1.0 / scale_;
    for (int k = 0; k < static_cast<int>(nodes_.size()); ++k) {
        const Node& node = nodes_[k];
        const Course& own = courses_[k];
        const auto put = [&](int b, Vec2 push, double twist) {
            const Node& at = nodes_[b];
            const Course& m = courses_[b];
            system_.at(at.place, node.place) =
                over * (at.slides ? dot(m.along, push) : twist - cross(m.reach, push));
        };
        for (int b = k; b < node.end; ++b) {
            const Course& m = courses_[b];
            if (node.slides) {
                pushes_[b] = nodes_[b].mass * own.end_along;
                twists_[b] = 0.0;
            } else {
                pushes_[b] = nodes_[b].mass * across(m.end_place - own.end_centre);
                twists_[b] = nodes_[b].inertia;
            }
        }
        for (int b = node.end - 1; b > k; --b) {
            const int p = nodes_[b].parent;
            put(b, pushes_[b], twists_[b]);
            pushes_[p] += pushes_[b];
            twists_[p] += twists_[b] + cross(courses_[b].from_parent, pushes_[b]);
        }
        const Vec2 push = pushes_[k];
        double twist = twists_[k];
        for (int b = k;;) {
            put(b, push, twist);
            if (nodes_[b].parent < 0) break;
            twist += cross(courses_[b].from_parent, push);
            b = nodes_[b].parent;
        }
    }
}

/// Poses at the end, made from joint coordinates anew, so that violations never add up.
void PlaneTree::place() noexcept {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        Course& m = courses_[k];
        const HalfTurn joint = m.moved * m.relative;
        const Vec2 gap = node.slides ? (m.slide + m.slid) * node.along : Vec2{};
        if (node.parent < 0) {
            m.pose = unit(joint);
            m.posed = less_one(m.pose);
            m.displacement = gap - m.posed * node.arm;
        } else {
            const Course& p = courses_[node.parent];
            m.pose = unit(p.pose * joint);
            m.posed = less_one(m.pose);
            m.displacement = p.displacement + gap - m.posed * node.arm + p.posed * (node.parent_arm + gap);
        }
    }
}

/// What the loops ask for, into right_; with `derivatives` their rows too: G(q₊) below the masses, −G(q)ᵀ beside them.
void PlaneTree::fill_loops(bool derivatives) noexcept {
    for (std::size_t l = 0; l < closings_.size(); ++l) {
        const Closing& loop = closings_[l];
        Vec2 first, second, gap = fixed_gap_[l];  // the points from where they began, and in the world
        if (loop.second.node >= 0) {
            const Course& m = courses_[loop.second.node];
            second = m.displacement + m.posed * loop.second.arm;
            gap += second;
            second += loop.second.point;
        }
        if (loop.first.node >= 0) {
            const Course& m = courses_[loop.first.node];
            first = m.displacement + m.posed * loop.first.arm;
            gap -= first;
            first += loop.first.point;
        }
        const int u = loop.places[0], v = loop.places[1];
        const Vec2 force{multiplier_[loop.at], multiplier_[loop.at + 1]};
        right_[u] = -gap.x;
        right_[v] = -gap.y;
        const Vec2* before = start_rows_.data() + loop.reduced;
        for (const Closing::Column& column : loop.columns) {
            right_[column.place] += dot(*before, force);
            if (derivatives) {
                const Course& m = courses_[column.node];
                const Vec2 on = nodes_[column.node].slides
                                    ? m.end_along
                                    : across((column.second ? second : first) - m.end_centre);
                const double sign = column.second ? 1.0 : -1.0;
                system_.at(column.place, u) = -before->x;
                system_.at(column.place, v) = -before->y;
                system_.at(u, column.place) = sign * on.x;
                system_.at(v, column.place) = sign * on.y;
            }
            ++before;
        }
    }
}

template <int NORMAL>
void PlaneTree::write(double tau, LargeArray<BodyState>& bodies, double* increments) const noexcept {
    constexpr Plane3 flat{NORMAL};
    const double over = 1.0 / tau;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Course& m = courses_[k];
        BodyState& s = bodies[nodes_[k].body];
        s.displacement = flat.lifted(m.displacement);
        Vec3 turn;
        turn[NORMAL] = m.pose.sine;
        s.turn = {m.pose.cosine, turn.x, turn.y, turn.z};
        s.turn_less_one = {};
        constexpr int u = flat.first(), v = flat.second();
        s.turn_less_one(u, u) = s.turn_less_one(v, v) = m.posed.fall;
        s.turn_less_one(u, v) = -m.posed.sine;
        s.turn_less_one(v, u) = m.posed.sine;
        s.velocity = flat.lifted(over * m.shift);
        s.angular_momentum = {};
        s.angular_momentum[NORMAL] = m.spins;
        increments[k] = nodes_[k].slides ? m.slid : m.angle;
    }
}

template <int NORMAL>
bool PlaneTree::stage(double tau, LargeArray<BodyState>& bodies, double* increments,
                      std::int64_t& rounds) noexcept {
    read<NORMAL>(bodies);
    if (!look_at(increments)) return false;
    std::fill(multiplier_.begin(), multiplier_.end(), 0.0);
    for (JointRounds round;;) {
        move(tau);
        gain(tau);
        if (round.fresh()) {
            turn_ends();
            system_.clear();
            fill_masses();
        }
        if (!closings_.empty()) {
            place();
            fill_loops(round.fresh());
        }
        ++rounds;
        if (round.fresh() && !system_.factor()) return false;
        system_.solve(right_.data());
        double size = 0.0, moved = 0.0;
        for (const Node& node : nodes_) {
            const double off = std::fabs(right_[node.place]) / (node.slides ? node.extent : 1.0);
            if (!(off <= size)) size = off;
        }
        if (round.lost(size)) return false;
        for (std::size_t k = 0; k < nodes_.size(); ++k) {
            const double step = right_[nodes_[k].place];
            Course& m = courses_[k];
            if (nodes_[k].slides) {
                m.slid += step;
                continue;
            }
            m.angle += step;
            const double e = 0.5 * step;
            if (std::fabs(e) < 0x1p-27) m.moved = HalfTurn{1.0, e} * m.moved;  // e² is below rounding
            else m.moved = half_turn(m.angle);
            moved = std::max(moved, m.moved.sine * m.moved.sine);
        }
        for (const Closing& loop : closings_)
            for (int i = 0; i < 2; ++i) multiplier_[loop.at + i] += right_[loop.places[i]];
        if (round.settled(size, moved, !closings_.empty())) break;
    }
    for (const Course& course : courses_)
        if (!(course.moved.cosine > min_half_turn_cosine)) return false;
    move(tau);
    ++rounds;
    place();
    write<NORMAL>(tau, bodies, increments);
    return true;
}

bool PlaneTree::stage(double tau, LargeArray<BodyState>& bodies, double* increments,
                      std::int64_t& rounds) noexcept {
    switch (plane_.normal) {
        case 0: return stage<0>(tau, bodies, increments, rounds);
        case 1: return stage<1>(tau, bodies, increments, rounds);
        default: return stage<2>(tau, bodies, increments, rounds);
    }
}

}  // namespace spook
