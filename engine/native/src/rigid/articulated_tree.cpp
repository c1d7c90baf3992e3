#include "rigid/articulated_tree.hpp"

#include <algorithm>
#include <cmath>

#include "collision/rotation.hpp"
#include "linear/elementary.hpp"

namespace spook {

namespace {

Vec3 symmetric_times(const double* s, Vec3 v) noexcept {
    return {s[0] * v.x + s[3] * v.y + s[4] * v.z, s[3] * v.x + s[1] * v.y + s[5] * v.z,
            s[4] * v.x + s[5] * v.y + s[2] * v.z};
}

/// s −= over · a aᵀ.
void take_square(double* s, double over, Vec3 a) noexcept {
    const Vec3 b = over * a;
    s[0] -= a.x * b.x;
    s[1] -= a.y * b.y;
    s[2] -= a.z * b.z;
    s[3] -= a.x * b.y;
    s[4] -= a.x * b.z;
    s[5] -= a.y * b.z;
}

/// Of an angle, by its square y: sin θ/θ, (1 − cos θ)/θ² and (1 − (θ/2) cot θ/2)/θ².
struct TurnFactors {
    double sine = 1.0, cosine = 0.5, logarithm = 1.0 / 12.0;
};

TurnFactors turn_factors(double y) noexcept {
    if (y < 0.0625)  // up to 1/4: what is left out is below 1e-17
        return {
            1.0 -
                y / 6 * (1.0 - y / 20 * (1.0 - y / 42 * (1.0 - y / 72 * (1.0 - y / 110 * (1.0 - y / 156))))),
            0.5 * (1.0 -
                   y / 12 *
                       (1.0 - y / 30 * (1.0 - y / 56 * (1.0 - y / 90 * (1.0 - y / 132 * (1.0 - y / 182)))))),
            1.0 / 12 + y * (1.0 / 720 +
                            y * (1.0 / 30240 +
                                 y * (1.0 / 1209600 + y * (1.0 / 47900160 + y * (691.0 / 1307674368000)))))};
    const double angle = std::sqrt(y);
    const SineCosine of = sine_cosine(angle), half = sine_cosine(0.5 * angle);
    TurnFactors factors;
    factors.sine = of.sine / angle;
    factors.cosine = 2.0 * half.sine * half.sine / y;
    factors.logarithm = (1.0 - 0.5 * factors.sine / factors.cosine) / y;
    return factors;
}

Mat3 cross_matrix(Vec3 a) noexcept { return {{0, -a.z, a.y, a.z, 0, -a.x, -a.y, a.x, 0}}; }

/// 1 + sine [φ] + cosine [φ]².
Mat3 turn_matrix(Vec3 a, double sine, double cosine) noexcept {
    const Vec3 s = sine * a, c = cosine * a;
    return {{1.0 - c.y * a.y - c.z * a.z, c.x * a.y - s.z, c.x * a.z + s.y, c.x * a.y + s.z,
             1.0 - c.x * a.x - c.z * a.z, c.y * a.z - s.x, c.x * a.z - s.y, c.y * a.z + s.x,
             1.0 - c.x * a.x - c.y * a.y}};
}

}  // namespace

void ArticulatedTree::take(const JointTree& tree, std::span<const BodyConstants> constants,
                           const JointSet& joints) {
    joints_ = &joints;
    links_.clear();
    extents_.clear();
    for (const JointTree::Node& node : tree.nodes()) {
        Link link;
        const BodyConstants& body = constants[static_cast<std::size_t>(node.body)];
        link.body = node.body;
        link.joint = node.joint;
        link.carrier = node.parent + 1;
        link.turns = node.turns;
        link.slides = node.slides;
        link.first = extents_.size();
        link.backwards = node.backwards;
        link.particle = body.particle;
        link.mass = node.mass;
        link.armature = node.armature;
        link.carrier_arm = node.parent_arm;
        link.arm = node.arm;
        link.axis = node.axis;
        std::copy_n(node.slide_axes, 3, link.slide_axes);
        if (!body.particle) {
            const Mat3& r = body.start_principal;
            const Mat3 own = r * Mat3::diagonal(body.inertia) * transpose(r);
            const int at[6] = {0, 4, 8, 1, 2, 5};
            for (int i = 0; i < 6; ++i) link.inertia[i] = own.m[at[i]];
        }
        const std::span<const JointSpring> springs = joints.drives().springs();
        for (std::size_t i = 0; i < springs.size(); ++i)
            if (joints.blocks()[static_cast<std::size_t>(springs[i].block)].joint == link.joint)
                link.spring = static_cast<int>(i);
        for (int i = 0; i < node.coordinates(); ++i) extents_.push_back(i < node.turns ? 1.0 : node.extent);
        links_.push_back(link);
    }
    coordinates_ = extents_.size();
    charts_.assign(links_.size(), {});
    poses_.assign(links_.size() + 1, {});
    poses_[0].axes = Mat3::identity();
    along_.assign(coordinates_, {});
}

void ArticulatedTree::count(std::span<const int> joints) noexcept {
    for (Link& link : links_)
        link.counted = link.turns + link.slides == 1 &&
                       std::find(joints.begin(), joints.end(), link.joint) != joints.end();
}

int ArticulatedTree::body_of(std::size_t coordinate) const noexcept {
    const auto after = std::upper_bound(links_.begin(), links_.end(), coordinate,
                                        [](std::size_t at, const Link& link) { return at < link.first; });
    return after[-1].body;
}

void ArticulatedTree::begin(const LargeArray<BodyState>& bodies, JointSet& joints, double* rates) noexcept {
    static const BodyState world;
    for (std::size_t k = 0; k < links_.size(); ++k) {
        const Link& link = links_[k];
        Chart& chart = charts_[k];
        const BodyState& s = bodies[link.body];
        const BodyState& holder =
            link.carrier == 0 ? world : bodies[links_[static_cast<std::size_t>(link.carrier - 1)].body];
        double* own = rates + link.first;
        const Vec3 spin = s.angular_velocity - holder.angular_velocity;
        chart.relative = {};
        chart.slid = {};
        if (link.turns > 0) {
            const Quat q = conjugate(holder.turn) * s.turn;
            if (link.turns == 1) {
                const double along = spook::dot(vector_of(q), link.axis),
                             over = 1.0 / std::sqrt(q.w * q.w + along * along);
                const Vec3 e = over * along * link.axis;
                chart.relative = {over * q.w, e.x, e.y, e.z};
                own[0] = spook::dot(spin, carried(holder.turn_less_one, link.axis));
            } else {
                chart.relative = unit(q);
                const Vec3 w = spin + transposed_times(holder.turn_less_one, spin);
                own[0] = w.x, own[1] = w.y, own[2] = w.z;
            }
            chart.turned = rotation_less_one(chart.relative);
            for (int i = 0; i < 3; ++i) chart.turned(i, i) += 1.0;
            if (link.turns == 1) {
                const Mat3 across = cross_matrix(link.axis);
                chart.turned_across = across * chart.turned;
                chart.turned_along = across * chart.turned_across;
            }
        }
        if (link.slides > 0) {
            const Vec3 reach = carried(s.turn_less_one, link.arm),
                       other = carried(holder.turn_less_one, link.carrier_arm);
            const Vec3 gap = s.displacement - holder.displacement + s.turn_less_one * link.arm -
                             holder.turn_less_one * link.carrier_arm;
            const Vec3 goes = s.velocity + cross(s.angular_velocity, reach) - holder.velocity -
                              cross(holder.angular_velocity, other + gap);
            for (int i = 0; i < link.slides; ++i) {
                const Vec3 axis = carried(holder.turn_less_one, link.slide_axes[i]);
                chart.slid += spook::dot(gap, axis) * link.slide_axes[i];
                own[link.turns + i] = spook::dot(goes, axis);
            }
        }
        // What a joint of the world has slid moves the point that screws are about: lengths are those of the tree.
        chart.offset = link.carrier == 0 ? Vec3{} : link.carrier_arm + chart.slid;
        if (link.spring >= 0 || link.counted) {
            double& angle = joints.states[link.joint].angle;
            chart.coordinate = angle = joints.coordinate(link.joint, bodies);
        }
    }
}

ArticulatedTree::Screw ArticulatedTree::times(const Inertia& i, const Screw& m) noexcept {
    return {symmetric_times(i.turn, m.turn) + i.mixed * m.shift,
            transposed_times(i.mixed, m.turn) + symmetric_times(i.shift, m.shift)};
}

/// Poses, velocities and the accelerations that are no coordinate's, from the world outwards.
void ArticulatedTree::move(const double* moved, const double* rates, double* pace) noexcept {
    for (std::size_t k = 0; k < links_.size(); ++k) {
        const Link& link = links_[k];
        const Chart& chart = charts_[k];
        const Pose& carrier = poses_[static_cast<std::size_t>(link.carrier)];
        Pose& pose = poses_[k + 1];
        Along* along = along_.data() + link.first;
        const double *at = moved + link.first, *goes = rates + link.first;
        double* pace_here = pace + link.first;
        Vec3 joint = carrier.place + carrier.axes * chart.offset;
        pose.motion = carrier.motion;
        pose.bias = {};
        if (link.slides > 0) {
            Vec3 speed;
            for (int i = 0; i < link.slides; ++i) {
                const int own = link.turns + i;
                const Vec3 axis = carrier.axes * link.slide_axes[i];
                along[own].along = {{}, axis};
                joint += at[own] * axis;
                speed += goes[own] * axis;
                pace_here[own] = goes[own];
            }
            pose.bias.shift = cross(carrier.motion.turn, speed);
            pose.motion.shift += speed;
        }
        if (link.turns == 0) {
            pose.axes = carrier.axes;
        } else {
            Vec3 spin, passing;  // of the turns: angular velocity, and that of the point
            if (link.turns == 1) {
                const SineCosine turn = sine_cosine(at[0]);
                const double less = 1.0 - turn.cosine;
                Mat3 relative = chart.turned;
                for (int i = 0; i < 9; ++i)
                    relative.m[i] += turn.sine * chart.turned_across.m[i] + less * chart.turned_along.m[i];
                pose.axes = carrier.axes * relative;
                const Vec3 axis = carrier.axes * link.axis;
                along[0].along = {axis, cross(joint, axis)};
                spin = goes[0] * axis;
                passing = goes[0] * along[0].along.shift;
                pace_here[0] = goes[0];
            } else {
                const Vec3 turned{at[0], at[1], at[2]}, w{goes[0], goes[1], goes[2]};
                const TurnFactors of = turn_factors(spook::dot(turned, turned));
                pose.axes = carrier.axes * (turn_matrix(turned, of.sine, of.cosine) * chart.turned);
                for (int i = 0; i < 3; ++i) {
                    const Vec3 axis{carrier.axes.m[i], carrier.axes.m[3 + i], carrier.axes.m[6 + i]};
                    along[i].along = {axis, cross(joint, axis)};
                }
                spin = carrier.axes * w;
                passing = cross(joint, spin);
                const Vec3 bent = cross(turned, w);
                const Vec3 changes = w - 0.5 * bent + of.logarithm * cross(turned, bent);
                pace_here[0] = changes.x, pace_here[1] = changes.y, pace_here[2] = changes.z;
            }
            pose.bias.turn = cross(carrier.motion.turn, spin);
            pose.bias.shift += cross(carrier.motion.turn, passing) + cross(pose.motion.shift, spin);
            pose.motion.turn += spin;
            pose.motion.shift += passing;
        }
        pose.place = joint - pose.axes * link.arm;
        weigh(link, pose);
    }
}

/// A link's own inertia, and the force that its motion takes beside its acceleration, less what acts on it.
void ArticulatedTree::weigh(const Link& link, Pose& pose) const noexcept {
    const Mat3& r = pose.axes;
    const double* own = link.inertia;
    const double m = link.mass;
    const Vec3 c = pose.place, mc = m * c;
    Inertia& out = pose.inertia;
    double turn[6] = {};
    if (!link.particle) {
        Vec3 rows[3];  // of the axes times the inertia
        for (int i = 0; i < 3; ++i)
            rows[i] = symmetric_times(own, {r.m[3 * i], r.m[3 * i + 1], r.m[3 * i + 2]});
        const auto entry = [&](int i, int j) {
            return rows[i].x * r.m[3 * j] + rows[i].y * r.m[3 * j + 1] + rows[i].z * r.m[3 * j + 2];
        };
        turn[0] = entry(0, 0), turn[1] = entry(1, 1), turn[2] = entry(2, 2);
        turn[3] = entry(0, 1), turn[4] = entry(0, 2), turn[5] = entry(1, 2);
    }
    const Vec3 w = pose.motion.turn, momentum = m * pose.motion.shift + cross(w, mc);
    const Vec3 spin = symmetric_times(turn, w) + cross(c, momentum);
    pose.force.turn =
        cross(w, spin) + cross(pose.motion.shift, momentum) - link.torque - cross(c, link.force);
    pose.force.shift = cross(w, momentum) - link.force;
    out.turn[0] = turn[0] + mc.y * c.y + mc.z * c.z;
    out.turn[1] = turn[1] + mc.x * c.x + mc.z * c.z;
    out.turn[2] = turn[2] + mc.x * c.x + mc.y * c.y;
    out.turn[3] = turn[3] - mc.x * c.y;
    out.turn[4] = turn[4] - mc.x * c.z;
    out.turn[5] = turn[5] - mc.y * c.z;
    out.mixed = cross_matrix(mc);
    out.shift[0] = out.shift[1] = out.shift[2] = m;
    out.shift[3] = out.shift[4] = out.shift[5] = 0.0;
}

/// What the spring of a joint with one coordinate pulls along it.
double ArticulatedTree::spring(const Link& link, const Chart& chart, double moved,
                               double rate) const noexcept {
    const JointSpring& spring = joints_->drives().springs()[static_cast<std::size_t>(link.spring)];
    const double sign = link.backwards ? -1.0 : 1.0, gone = chart.coordinate + sign * moved - spring.rest;
    return -sign * spring.stiffness * (gone + spring.damping * sign * rate);
}

/// Coordinates eliminated from the tips inwards: what a link is for the rest of its tree, once its joint gives way.
void ArticulatedTree::gather(const double* moved, const double* rates) noexcept {
    for (std::size_t k = links_.size(); k-- > 0;) {
        const Link& link = links_[k];
        Pose& pose = poses_[k + 1];
        Inertia& inertia = pose.inertia;
        Along* along = along_.data() + link.first;
        const int count = link.turns + link.slides;
        const Screw biased = times(inertia, pose.bias);
        pose.force.turn += biased.turn;
        pose.force.shift += biased.shift;
        for (int i = count; i-- > 0;) {
            Along& here = along[i];
            here.weight = times(inertia, here.along);
            here.over = 1.0 / (dot(here.along, here.weight) + link.armature);
            here.gained = -dot(here.along, pose.force);
            if (link.spring >= 0)
                here.gained += spring(link, charts_[k], moved[link.first], rates[link.first]);
            if (link.carrier == 0 && i == 0) break;
            const double share = here.gained * here.over;
            pose.force.turn += share * here.weight.turn;
            pose.force.shift += share * here.weight.shift;
            take_square(inertia.turn, here.over, here.weight.turn);
            take_square(inertia.shift, here.over, here.weight.shift);
            const Vec3 across = here.over * here.weight.turn, push = here.weight.shift;
            double* mixed = inertia.mixed.m;
            for (int row = 0; row < 3; ++row, mixed += 3) {
                mixed[0] -= across[row] * push.x;
                mixed[1] -= across[row] * push.y;
                mixed[2] -= across[row] * push.z;
            }
        }
        if (link.carrier == 0) continue;
        Pose& carrier = poses_[static_cast<std::size_t>(link.carrier)];
        carrier.force.turn += pose.force.turn;
        carrier.force.shift += pose.force.shift;
        for (int i = 0; i < 6; ++i) carrier.inertia.turn[i] += inertia.turn[i];
        for (int i = 0; i < 6; ++i) carrier.inertia.shift[i] += inertia.shift[i];
        for (int i = 0; i < 9; ++i) carrier.inertia.mixed.m[i] += inertia.mixed.m[i];
    }
}

void ArticulatedTree::accelerate(const double* moved, const double* rates, double* pace,
                                 double* acceleration) noexcept {
    move(moved, rates, pace);
    gather(moved, rates);
    for (std::size_t k = 0; k < links_.size(); ++k) {
        const Link& link = links_[k];
        Pose& pose = poses_[k + 1];
        Screw gaining = poses_[static_cast<std::size_t>(link.carrier)].gaining;
        for (std::size_t i = link.first; i < link.first + static_cast<std::size_t>(link.turns + link.slides);
             ++i) {
            const Along& here = along_[i];
            const double found = here.over * (here.gained - dot(here.weight, gaining));
            acceleration[i] = found;
            gaining.turn += found * here.along.turn;
            gaining.shift += found * here.along.shift;
        }
        pose.gaining.turn = gaining.turn + pose.bias.turn;
        pose.gaining.shift = gaining.shift + pose.bias.shift;
    }
}

void ArticulatedTree::place(const double* moved, const double* rates, LargeArray<BodyState>& bodies,
                            const LargeArray<BodyConstants>& constants, JointStates& joints) noexcept {
    static const BodyState world;
    for (std::size_t k = 0; k < links_.size(); ++k) {
        const Link& link = links_[k];
        const Chart& chart = charts_[k];
        const BodyState& holder =
            link.carrier == 0 ? world : bodies[links_[static_cast<std::size_t>(link.carrier - 1)].body];
        BodyState& s = bodies[link.body];
        const double *at = moved + link.first, *goes = rates + link.first;
        Quat relative = chart.relative;
        Vec3 spin;
        if (link.turns == 1) {
            const SineCosine half = sine_cosine(0.5 * at[0]);
            const Vec3 e = half.sine * link.axis;
            relative = Quat{half.cosine, e.x, e.y, e.z} * relative;
            spin = goes[0] * link.axis;
        } else if (link.turns == 3) {
            const Vec3 turned{at[0], at[1], at[2]};
            const double angle2 = 0.25 * spook::dot(turned, turned);
            const TurnFactors of = turn_factors(angle2);
            const Vec3 e = 0.5 * of.sine * turned;
            relative = Quat{1.0 - angle2 * of.cosine, e.x, e.y, e.z} * relative;
            spin = {goes[0], goes[1], goes[2]};
        }
        Vec3 slid = chart.slid, speed;
        for (int i = 0; i < link.slides; ++i) {
            slid += at[link.turns + i] * link.slide_axes[i];
            speed += goes[link.turns + i] * link.slide_axes[i];
        }
        s.turn = unit(link.carrier == 0 ? relative : holder.turn * relative);
        s.turn_less_one = rotation_less_one(s.turn);
        s.displacement = holder.displacement + slid - s.turn_less_one * link.arm +
                         holder.turn_less_one * (link.carrier_arm + slid);
        if (link.carrier == 0) s.displacement = slid - s.turn_less_one * link.arm;
        s.angular_velocity = holder.angular_velocity + carried(holder.turn_less_one, spin);
        s.velocity = holder.velocity + carried(holder.turn_less_one, speed) +
                     cross(holder.angular_velocity, carried(holder.turn_less_one, link.carrier_arm + slid)) -
                     cross(s.angular_velocity, carried(s.turn_less_one, link.arm));
        if (link.carrier == 0)
            s.velocity = speed - cross(s.angular_velocity, carried(s.turn_less_one, link.arm));
        if (link.counted)
            joints.states[link.joint].angle = chart.coordinate + (link.backwards ? -at[0] : at[0]);
        if (link.armature > 0.0) joints.states[link.joint].rotor = link.backwards ? -goes[0] : goes[0];
        if (link.particle) continue;
        const Vec3 w = s.angular_velocity;
        refresh(constants[static_cast<std::size_t>(link.body)], s);  // for the inertia
        s.angular_momentum = s.inertia * w;
        s.angular_velocity = w;
    }
}

}  // namespace spook
