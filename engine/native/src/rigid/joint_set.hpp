// All joints of a scene: their blocks of rows, right sides and readable forces.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "linear/large_array.hpp"
#include "rigid/general_rows.hpp"
#include "rigid/joint_blocks.hpp"
#include "rigid/joint_drives.hpp"
#include "rigid/joint_rows.hpp"
#include "rigid/joint_state.hpp"
#include "rigid/joint_stops.hpp"
#include "run/energy_made.hpp"

namespace spook {

class JointSet : public JointStates {
public:
    using State = JointState;

    JointSet(const RigidScene& scene, double time_step);

    std::span<const BodyConstants> turning;  // whose fast turns the right sides follow; empty: none follow
    /// Which bodies joints tie together, and which of these trees follow fast turns: those that something holds, and those that are
    /// one body. What floats and folds would be given energy. Whether joints make no loop, through what is fixed either.
    bool find_trees(std::span<const BodyConstants> bodies);
    std::vector<int> trees;  // per body: one of those it is tied to

    std::span<const JointBlock> blocks() const noexcept { return blocks_; }
    int count() const noexcept { return static_cast<int>(joints_.size()); }
    int rows(int joint) const noexcept { return joints_[joint].constants.rows; }
    const JointConstants& constants(int joint) const noexcept { return joints_[joint].constants; }
    /// The bodies of a block beyond its first two: relations and wires may have more.
    std::span<const int> others(int block) const noexcept {
        const int general = blocks_[block].axial ? -1 : joints_[blocks_[block].joint].general;
        return general < 0 ? std::span<const int>{} : generals_.others(general);
    }
    /// Their Jacobians, a row of six each, as the last assemble() found them; null where no row has any.
    const double* other_rows() const noexcept { return generals_.other_gradient(); }

    /// Writes the Jacobians of a block (rows × 6 each; the memory holds zeros or an earlier call's values) and
    /// its right side without the share of bodies that move by themselves. `follows`: fast turns, where it is asked for at all.
    void assemble(int block, std::span<const BodyState> bodies, double* first, double* second,
                  BlockRight& right, bool follows = true) noexcept;

    /// The constants of one row: (4/h) Ups; θ; and the size of the joint that curvature and rounding are measured
    /// by (m; 1 for angles).
    struct RowGain {
        double violation, relaxation, extent;
    };
    RowGain gain(int block, int row) const noexcept;
    /// Coefficients of one of a joint's own rows: Ups, (4/h) Ups, Sig.
    struct RowLaw {
        double upsilon, violation, softness;
        /// Whether the row is meant to, in steps h.
        bool gives_way(double h) const noexcept { return softness * h > rigid_compliance * violation; }
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
    /// Whether a motor drives a block: it does whatever work that takes.
    bool has_motor(const JointBlock& block) const noexcept {
        return block.axial && drives_.of(block.joint)->has_motor;
    }
    /// Whether a block has a row that only pushes one way.
    bool may_stop(const JointBlock& block) const noexcept {
        const Joint& joint = joints_[block.joint];
        return (block.axial && drives_.of(block.joint)->has_limit) ||
               (joint.general >= 0 && generals_[joint.general].one_sided);
    }
    /// Whether that row holds nothing where it is not overstepped; other than a coordinate between two ends that are one, or where
    /// it is after many impacts.
    bool lets_go(const JointBlock& block) const noexcept {
        if (!block.axial) return may_stop(block);
        const Axial& axial = *drives_.of(block.joint);
        return axial.has_limit && axial.lower < axial.upper && !states[block.joint].folds;
    }
    bool has_spring(const JointBlock& block) const noexcept {
        return block.axial && drives_.of(block.joint)->has_spring;
    }
    /// Free coordinate of a hinge (unwrapped) or prismatic joint.
    double coordinate(int joint, std::span<const BodyState> bodies) const noexcept;
    bool folds(int block) const noexcept {
        return blocks_[block].axial && states[blocks_[block].joint].folds;
    }
    /// How far the one-sided row of a block is to come back in this step, since the scene began beyond it: a part of
    /// its overstep(), whose sign it has; `row` is its index. 0 where there is none.
    double overstep_to_return(int block, int& row) const noexcept;
    /// From now on the turns of this hinge are counted.
    void track(int joint) noexcept {
        if (std::find(followed_.begin(), followed_.end(), joint) == followed_.end())
            followed_.push_back(joint);
        joints_[joint].tracked = true;
    }
    /// Counts the turns of tracked hinges after every step, whose rates tell how many there were.
    void follow(std::span<const BodyState> bodies) noexcept;
    bool follows() const noexcept { return !followed_.empty(); }
    std::span<const int> followed() const noexcept { return followed_; }
    /// After a solve: a joint whose own rows carried more than its strength holds nothing from the next step on.
    void break_overloaded(int joint, std::int64_t step);
    /// Blocks that have a rotor, see rotors.hpp.
    std::span<const int> rotors() const noexcept { return rotors_; }
    /// Energy of the spring of a joint's free coordinate about `rest` [J]; of a broken joint none.
    double spring_energy(int joint, double rest, std::span<const BodyState> bodies) const noexcept;
    /// That of all of them whose rest does not move with the time.
    double spring_energy(std::span<const BodyState> bodies) const noexcept;

    JointDrives& drives() noexcept { return drives_; }
    const JointDrives& drives() const noexcept { return drives_; }
    JointStops& stops() noexcept { return stops_; }

    /// Rows whose bounds follow from what other rows carry, see also drives(); the grip of an eye is that of the last assemble().
    std::span<const EyeRow> eyes() const noexcept { return generals_.eyes(); }
    std::span<const TyreRows> tyres() const noexcept { return tyres_; }

private:
    struct Joint {
        JointConstants constants;
        int first = -1, second = -1;
        int block = 0;     // of its own rows: index into blocks_
        int general = -1;  // of a relation, a wire or an eye: index into generals_
        int tyre = -1;     // index into tyre_forms_
        bool tracked = false, breakable = false, follows = false;
        double strength = 0.0, torque_strength = 0.0;  // N s, N m s
        struct {
            double upsilon, violation;
        } gain[6];
    };
    struct TyreForm {
        double radius = 0.0;
        std::array<double, 2> slip_stiffness{};
        std::array<double, 6> softness{};  // of the coming step
    };
    JointBlock add_own_rows(const RigidScene& scene, const JointSpec& spec, Joint& joint);
    void assemble_tyre(const Joint& joint, State& state, std::span<const BodyState> bodies, double* first,
                       double* second, BlockRight& right) noexcept;
    void follow_turns(const Joint& joint, std::span<const BodyState> bodies,
                      BlockRight& right) const noexcept;
    void assemble_axial(const JointBlock& block, std::span<const BodyState> bodies, double* first,
                        double* second, BlockRight& right) noexcept;

    double time_step_;
    LargeArray<Joint> joints_;
    JointDrives drives_;
    JointStops stops_;
    GeneralRows generals_;
    std::vector<TyreRows> tyres_;
    std::vector<TyreForm> tyre_forms_;
    std::vector<int> followed_;  // joints whose turns are counted
    std::vector<int> rotors_;    // blocks
    LargeArray<JointBlock> blocks_;
};

}  // namespace spook
