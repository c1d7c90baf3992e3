// Plain, half-step and corrected steps of mechanisms that are their own mirror image in a plane: three numbers a body, two
// rows a hinge.
//
// Where bodies, joints and loads lie in one plane of the world, all that leaves it stays zero, and the step is the
// one of step.cpp without it, to rounding: the same rows with compliance and damping, the same turn. Of
// (G M⁻¹ Gᵀ + Sig) λ = right − G v, with v after the forces, few rows are left; they are factored in an envelope, and
// refined by what the rows themselves still ask for. A pivot far below its diagonal tells of redundant rows, or of loads
// far heavier than what carries them: such a step is left to the block factorisation, which is made for both.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linear/large_array.hpp"
#include "linear/plane.hpp"
#include "rigid/joint_set.hpp"
#include "rigid/solver.hpp"

namespace spook {

class PlaneStep {
public:
    struct Options {
        double time_step = 0.0;
        int refinements = 1, corrections = 0;
        double cap = 0.0;  // of a correction, part of the joint's size
        bool follows_turns = false;
    };
    /// Takes the scene if every constrained body moves in the plane and is held there by hinges, locks, slides and planar joints
    /// on each other, and somewhere on what is fixed. Empty otherwise, and why.
    Refusal analyse(std::span<const BodyConstants> constants, const JointSet& joints,
                    std::span<const int> tied, const Options& options);
    bool empty() const noexcept { return joints_.empty(); }
    /// The axis of the world that stands on the plane (0: x).
    int normal() const noexcept { return plane_.normal; }
    int rows() const noexcept { return static_cast<int>(rows_.size()); }
    /// Blocks of the matrix of joints: one for each, and for each two that meet on a moving body.
    std::uint64_t blocks() const noexcept { return blocks_; }

    /// Whether loads and the bodies' state lie in the plane, and the rows are independent there.
    bool holds(std::span<const BodyConstants> constants, std::span<const Vec3> acceleration,
               const LargeArray<BodyState>& bodies);

    void read(const LargeArray<BodyState>& bodies) noexcept;
    /// All of a constrained body's state but its inertia in world axes.
    void write(LargeArray<BodyState>& bodies) const noexcept;

    /// The impulses of a step and the velocities they lead to. False where a pivot is too small.
    bool find_velocities() noexcept;
    /// Twice the kinetic energy of the k-th constrained body with those velocities [J].
    double motion(int k) const noexcept {
        const Node& n = nodes_[k];
        return n.mass * dot(n.next_velocity, n.next_velocity) + n.next_spin * n.next_rate;
    }
    void take_velocities() noexcept;
    /// Of all rows of the scene, where the step before began.
    void read_violations(std::span<const double> all) noexcept;
    void write_violations(std::span<double> all) const noexcept;
    /// Velocity and angular momentum of the k-th constrained body before the last take_velocities().
    void read_before(int k, Vec3 velocity, Vec3 spin) noexcept {
        nodes_[k].next_velocity = plane_(velocity);
        nodes_[k].next_spin = spin[plane_.normal];
    }
    Vec3 velocity_before(int k) const noexcept { return plane_.lifted(nodes_[k].next_velocity); }
    Vec3 spin_before(int k) const noexcept { return upright(nodes_[k].next_spin); }
    /// Poses a step on. The first body that turns by a radian or more, −1.
    int move() noexcept;

    /// The impulses of the last step, and where they act.
    void deliver(LargeArray<JointSet::State>& states) const noexcept;
    /// Force and torque impulse [N s, N m s] on the second body of a joint, at the joint, from its multipliers.
    void wrench(int joint, const JointSet::State& state, double* out) const noexcept;

private:
    struct Pose {
        Vec2 displacement;
        HalfTurn turn;
        TurnLessOne turned;
    };
    struct Node {
        int body = -1;
        double mass = 0.0, inertia = 0.0, over_mass = 0.0, over_inertia = 0.0;
        Vec2 kick;               // of a step, m/s
        double turn_kick = 0.0;  // rad/s
        Pose at, ahead;
        Vec2 velocity, next_velocity;
        double spin = 0.0, rate = 0.0, next_spin = 0.0, next_rate = 0.0;  // angular momentum; over inertia
    };
    struct Lever {  // a row's derivative by one body's place and angle
        double x = 0.0, y = 0.0, turn = 0.0;
    };
    struct Row {
        int joint = 0, index = 0;         // of the joint's own
        int place = 0;                    // among all of the scene
        double damped = 0.0, gain = 0.0;  // Ups − 1, (4/h) Ups
        double ahead = 0.0, cap = 0.0;    // ¼ + θ; of a correction
    };
    struct Joint {
        int joint = 0, first = 0, second = 0;  // nodes; the last one stands for all that is fixed
        int row = 0, end = 0;                  // its rows in the plane
        int linear = 0;                        // how many of them are of places
        double sense = 0.0;                    // of a row of angles: the axis on the normal; 0: it has none
        Vec2 first_arm, second_arm, axes[2];
        Vec2 first_reach, second_reach;
    };
    struct Coupling {  // of two rows on one body, into the envelope
        int to, lever, other;
    };

    Vec3 upright(double value) const noexcept {
        Vec3 out;
        out[plane_.normal] = value;
        return out;
    }
    bool take_joint(std::span<const BodyConstants> constants, const JointSet& joints, const JointBlock& block,
                    int first_row, std::span<const int> node_of);
    bool order_rows(const JointSet& joints);
    bool place_rows(const JointSet& joints);
    void assemble() noexcept;
    bool factor() noexcept;
    void solve() noexcept;
    void solve_refined() noexcept;
    void look(const Joint& joint, const Pose& a, const Pose& b, double* violation) const noexcept;
    double changed(int row, const Node& a, const Node& b) const noexcept;
    void follow_turns(const Joint& joint, Vec2 first, Vec2 second, Vec2 gap) noexcept;
    void take_past_curvature() noexcept;
    void correct() noexcept;
    void advance(Vec2 velocity, double rate, Pose& pose) const noexcept;

    Plane3 plane_;
    Options options_;
    std::vector<Node> nodes_;
    std::vector<Joint> joints_;
    std::vector<int> joint_at_;  // per joint of the scene: its place in joints_
    std::vector<Row> rows_;
    std::vector<Lever> levers_, shares_;  // per row and body; over their masses
    std::vector<Coupling> couplings_;
    std::uint64_t blocks_ = 0;
    std::vector<int> first_, start_;  // of a row in the envelope: its first column, and where that stands
    std::vector<double> blank_, envelope_, inverse_, softness_, asked_, right_, multiplier_;
    std::vector<double> violation_, rate_, last_violation_, first_asked_, ahead_;  // per row
};

}  // namespace spook
