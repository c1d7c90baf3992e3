// All joints of a scene: their blocks of rows, right sides and readable forces.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "contacts/pivot_system.hpp"
#include "linear/large_array.hpp"
#include "linear/regularisation.hpp"
#include "rigid/joint_rows.hpp"
#include "rigid/joint_state.hpp"

namespace spook {

/// One block of up to six rows between two bodies: a joint's own rows, or those of its free coordinate.
struct JointBlock {
    int joint = 0;
    bool axial =
        false;  // motor, limit, spring, armature, friction, in this order, as far as the joint has them
    int first = -1, second = -1;  // bodies of the scene, −1 the world
    int size = 1;
    int rotor = -1;  // the row of its armature
    std::array<double, 6> softness{};
};

/// The numbers of a block in one step, besides its Jacobians. A row reads
/// G v₊ + softness λ = right where lower < λ < upper; λ are impulses on the second body.
struct BlockRight {
    std::array<double, 6> right, lower, upper;
    const double* softness = nullptr;  // of rows whose softness changes from step to step
    StopRow stop;
};

/// A row that rubs: the wire's, its own and those of the eyes before it, by block; tanh ½µφ.
struct EyeRow {
    int block = 0, wire = 0;
    std::vector<int> before;
    double grip = 0.0;
};
/// Three rows of a tyre, by block, and its friction along and across.
struct TyreRows {
    int block = 0;
    std::array<double, 2> friction{};
};
/// A row of friction in a joint whose bound grows with what the joint holds, by block.
struct BearingRow {
    int block = 0, row = 0, way = 0;     // way: 0 along the axis, 1 about it
    int holding = 0;                     // the block of what it holds
    double constant = 0.0, share = 0.0;  // N s or N m s; 1 or m
};
/// A spring of a free coordinate, by the block of its joint's own rows.
struct JointSpring {
    int block = 0;
    double stiffness = 0.0, rest = 0.0;
};
class JointSet : public JointStates {
public:
    using State = JointState;

    JointSet(const RigidScene& scene, double time_step);

    std::span<const JointBlock> blocks() const noexcept { return blocks_; }
    int count() const noexcept { return static_cast<int>(joints_.size()); }
    int rows(int joint) const noexcept { return joints_[joint].constants.rows; }
    const JointConstants& constants(int joint) const noexcept { return joints_[joint].constants; }
    /// The bodies of a block beyond its first two: relations and wires may have more.
    std::span<const int> others(int block) const noexcept;
    /// Their Jacobians, a row of six each, as the last assemble() found them; null where no row has any.
    const double* other_rows() const noexcept { return gradient_.empty() ? nullptr : gradient_.data() + 12; }

    /// Writes the Jacobians of a block (rows × 6 each; the memory holds zeros or an earlier call's values) and
    /// its right side without the share of bodies that move by themselves.
    void assemble(int block, std::span<const BodyState> bodies, double* first, double* second,
                  BlockRight& right) noexcept;

    /// The constants of one row: (4/h) Ups; θ; and the size of the joint that curvature and rounding are measured
    /// by (m; 1 for angles).
    struct RowGain {
        double violation, relaxation, extent;
    };
    RowGain gain(int block, int row) const noexcept;
    /// Coefficients of one of a joint's own rows: Ups, (4/h) Ups, Sig.
    struct RowLaw {
        double upsilon, violation, softness;
        bool operator==(const RowLaw&) const = default;
    };
    RowLaw law(int joint, int row) const noexcept {
        const Joint& of = joints_[joint];
        return {of.gain[row].upsilon, of.gain[row].violation, blocks_[of.block].softness[row]};
    }

    /// Second time derivatives of a block's rows when both ends go on with constant velocities.
    void bias(int block, std::span<const BodyState> bodies, double* out) const noexcept;

    /// joint_curvature() of a joint's own rows; zero for rows over more than two bodies, and for tyres.
    void curvature(int joint, std::span<const BodyState> bodies, std::span<const BodyState> there, double h,
                   double* out) const noexcept;

    /// Violations of a joint's own rows at the given state [m or rad].
    void violation(int joint, std::span<const BodyState> bodies, double* out) const noexcept;
    /// How far the rows of a block are from where they hold; of limits and wires, how far they are overstepped; zero
    /// for rows that give way: motors, springs, broken joints.
    void overstep(int block, std::span<const BodyState> bodies, double* out) const noexcept;
    /// Whether all rows of a block hold wherever it stands.
    bool always_holds(const JointBlock& block) const noexcept {
        const Joint& joint = joints_[block.joint];
        const bool one_sided = joint.general >= 0 && generals_[joint.general].one_sided;
        return !block.axial && !one_sided && !gives_way(joint.constants.kind) && !states[block.joint].broken;
    }
    /// Whether a block has a row that only pushes one way.
    bool may_stop(const JointBlock& block) const noexcept {
        const Joint& joint = joints_[block.joint];
        return (block.axial && axials_[joint.axial].has_limit) ||
               (joint.general >= 0 && generals_[joint.general].one_sided);
    }
    bool has_spring(const JointBlock& block) const noexcept {
        return block.axial && axials_[joints_[block.joint].axial].has_spring;
    }
    /// Free coordinate of a hinge (unwrapped) or prismatic joint.
    double coordinate(int joint, std::span<const BodyState> bodies) const noexcept;
    /// From now on a stop that is hit several times in a step, by turns with its other end, gives back what all of these leave.
    void let_stops_fold() noexcept { stops_fold_ = true; }
    bool folds(int block) const noexcept {
        return blocks_[block].axial && states[blocks_[block].joint].folds;
    }
    /// Whether some limit was assembled, since this was asked last, that a step does not end at by its velocities: the scene
    /// began beyond it, or it folds.
    bool take_given() noexcept { return std::exchange(some_given_, false); }
    /// How far the one-sided row of a block is to come back in this step, since the scene began beyond it: a part of
    /// its overstep(), whose sign it has; `row` is its index. 0 where there is none.
    double given_back(int block, int& row) const noexcept;
    /// From now on the turns of this hinge are counted.
    void track(int joint) noexcept {
        if (std::find(some_.followed.begin(), some_.followed.end(), joint) == some_.followed.end())
            some_.followed.push_back(joint);
        joints_[joint].tracked = true;
    }
    /// A new step: whose stops were closed in the one before is known from then on, however often rows are assembled.
    void begin_step() noexcept {
        for (const int joint : some_.stops) {
            states[joint].at_limit = states[joint].closed;
            states[joint].rebounds = 0.0;
            states[joint].met = 0;
            states[joint].folds = false;
        }
    }
    /// Counts the turns of tracked hinges after every step, whose rates tell how many there were.
    void follow(std::span<const BodyState> bodies) noexcept;
    bool follows() const noexcept { return !some_.followed.empty(); }
    /// After a solve: a joint whose own rows carried more than its strength holds nothing from the next step on.
    void break_overloaded(int joint, std::int64_t step);
    /// Those of all free coordinates.
    std::span<const JointSpring> springs() const noexcept { return springs_; }
    /// Blocks that have a rotor, see rotors.hpp.
    std::span<const int> rotors() const noexcept { return some_.rotors; }
    /// Energy of the spring of a joint's free coordinate about `rest` [J]; of a broken joint none.
    double spring_energy(int joint, double rest, std::span<const BodyState> bodies) const noexcept;
    /// That of all of them whose rest does not move with the time.
    double spring_energy(std::span<const BodyState> bodies) const noexcept;

    void set_speed(int joint, double speed) noexcept { axials_[joints_[joint].axial].speed = speed; }
    /// Whether some motor or spring gives energy that no book has: it has a speed or a force of its own, or a rest that moves, or
    /// gives way where ½ k d² goes on.
    bool drives() const noexcept {
        for (const Axial& axial : axials_)
            if (axial.pushes || (axial.has_motor && axial.speed != 0.0) || axial.rest_moves ||
                (axial.has_spring && std::isfinite(axial.spring_impulse)))
                return true;
        return false;
    }
    /// A new target of a motor whose force stays bounded or unbounded, as it was. Whether it is another.
    bool set_motor(int joint, double speed, double max_force);
    /// What a motor pushes with, or the most it may [N or N m].
    void set_push(int joint, double force) noexcept {
        Axial& axial = axials_[joints_[joint].axial];
        axial.impulse = time_step_ * (axial.pushes ? force : std::max(0.0, force));
    }
    /// A new rest of a spring of a free coordinate; the second: one that moves with the time, with its speeds over
    /// the step before and the coming one. Whether it is another.
    bool set_rest(int joint, double rest);
    void let_rest_move(int joint) noexcept { axials_[joints_[joint].axial].rest_moves = true; }
    void set_moving_rest(int joint, double rest, double before, double ahead);

    /// Rows whose bounds follow from what other rows carry; the grip of an eye is that of the last assemble().
    std::span<const EyeRow> eyes() const noexcept { return eyes_; }
    std::span<const TyreRows> tyres() const noexcept { return tyres_; }
    std::span<const BearingRow> bearings() const noexcept { return bearings_; }

private:
    struct Joint {
        JointConstants constants;
        int first = -1, second = -1, axial = -1;  // axial: index into axials_
        int block = 0;                            // of its own rows: index into blocks_
        int general = -1;                         // of a relation, a wire or an eye: index into generals_
        int tyre = -1;                            // index into tyre_forms_
        bool tracked = false, breakable = false;
        double strength = 0.0, torque_strength = 0.0;  // N s, N m s
        struct {
            double upsilon, violation;
        } gain[6];
    };
    struct Axial {
        bool has_motor = false, has_limit = false, has_spring = false, pushes = false;
        std::array<bool, 2> rubs{};
        std::array<double, 2> friction{};  // N s, N m s
        double speed = 0.0, impulse = 0.0;
        double lower = 0.0, upper = 0.0, restitution = 0.0, spring_impulse = 0.0;
        int spring_at = -1;         // in springs_
        bool spring_pulls = false;  // as a force, without a row
        bool rest_moves = false;    // then, over the step before and this one, m/s or rad/s:
        double rest_before = 0.0, rest_ahead = 0.0;
        Regularisation limit, spring;
    };
    /// One row over any number of bodies: a relation between free coordinates, or the length of a wire.
    struct General {
        std::vector<RelationTerm> terms;
        struct Point {
            int body;
            Vec3 start, arm;  // world place at the start, and seen from the body's centre
        };
        std::vector<Point> points;
        std::vector<int> bodies;  // that are not fixed, in the order of first mention
        double length = 0.0, restitution = 0.0;
        bool one_sided = false;
        int eye = -1;                         // index into eyes_
        Point previous{};                     // of an eye: where the wire comes from
        double friction = 0.0, turned = 0.0;  // µ; rad beyond the bend
        Regularisation row;
    };
    struct TyreForm {
        double radius = 0.0;
        std::array<double, 2> slip_stiffness{};
        std::array<double, 6> softness{};  // of the coming step
    };
    struct Along {
        double violation = 0.0, rate = 0.0;
    };

    static const BodyState& body(int index, std::span<const BodyState> bodies) noexcept {
        static const BodyState world;
        return index < 0 ? world : bodies[index];
    }
    General general_of(const RigidScene& scene, const JointSpec& spec) const;
    Along along(const General& general, std::span<const BodyState> bodies, double* gradient) const noexcept;
    double general_bias(const General& general, std::span<const BodyState> bodies) const noexcept;
    void assemble_general(const Joint& joint, State& state, std::span<const BodyState> bodies, double* first,
                          double* second, BlockRight& right) noexcept;
    void rub(const General& general, std::span<const BodyState> bodies) noexcept;
    void add_eye(const JointSpec& spec, General& general);
    void assemble_tyre(const Joint& joint, State& state, std::span<const BodyState> bodies, double* first,
                       double* second, BlockRight& right) noexcept;
    double one_sided(double inwards, double violation, double rate, const Regularisation& row,
                     double restitution, double room, State& state, StopRow& stop) noexcept;
    double fold(double inwards, double violation, double approach, double restitution, State& state,
                StopRow& stop) noexcept;
    double unwrapped(const Joint& joint, double angle, double near) const noexcept;
    void assemble_axial(const Joint& joint, State& state, std::span<const BodyState> bodies, double* first,
                        double* second, BlockRight& right) noexcept;

    double time_step_;
    bool some_given_ = false, stops_fold_ = false;
    LargeArray<Joint> joints_;
    std::vector<Axial> axials_;
    std::vector<General> generals_;
    std::vector<EyeRow> eyes_;
    std::vector<TyreRows> tyres_;
    std::vector<TyreForm> tyre_forms_;
    std::vector<BearingRow> bearings_;
    std::vector<double> gradient_;  // of one general row: six per body
    struct {
        std::vector<int> followed;
        std::vector<int> stops;   // joints with a row that only pushes one way
        std::vector<int> rotors;  // blocks
    } some_;
    std::vector<JointSpring> springs_;
    LargeArray<JointBlock> blocks_;
};

}  // namespace spook
