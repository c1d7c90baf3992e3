// Rows held exactly by construction: a scene of joints as a forest of joint coordinates, with few rows to close loops.
//
// A stage of a composition (rigid_composition.cpp) ends on the rows for some impulses Gᵀ Λ at its start. Seen from the
// other side: let p'(q, q₊) be the momenta that carry the bodies from q to q₊, explicit in both poses. With q₊ given
// by joint coordinates the rows hold, and Λ drops out where each joint may move:
//
//   Σ over the bodies beyond joint i   J_i(q)ᵀ [p'(q, q₊) − p]  =  Σ over the rows that close loops   G_i(q)ᵀ λ,
//   and those rows hold at q₊.
//
// One unknown for a door instead of ten rows, by Newton's method with the exact derivative. Rows that joints of the
// forest fulfil whatever they do (the second hinge of a door, all that leaves the plane of a plane mechanism) are
// dropped. The map is the one of rigid_hold.cpp, to rounding.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linear/band_lu.hpp"
#include "rigid/joint_set.hpp"
#include "rigid/pivot_bodies.hpp"
#include "rigid/plane_tree.hpp"
#include "rigid/solver.hpp"

namespace spook {

class JointTree {
public:
    struct Node {  // a body with the joint it is attached to; a parent stands before all attached to it
        // joint: −1 of a root that floats; end: of the nodes attached to it.
        int body = -1, joint = -1, parent = -1, end = 0;
        int turns = 0, slides = 0;  // coordinates: 0, 1 about the axis or 3; along slide_axes
        int first = 0;              // of its coordinates
        int tree = 0;               // which of the forest's
        bool backwards = false;     // the body is the joint's first
        Vec3 parent_arm, arm;       // from the centres to the joint, at the start
        Vec3 axis, slide_axes[3];
        double mass = 0.0, extent = 1.0;
        double armature = 0.0;  // of its joint's coordinate, kg or kg m²
        Vec3 inertia;
        int coordinates() const noexcept { return turns + slides; }
    };

    /// Takes the scene if it can: every constrained body is attached by joints it knows to the world or on a body that floats, in
    /// small trees, and what closes loops is not redundant at the start. Empty otherwise, and why.
    Refusal analyse(std::span<const BodyConstants> constants, const JointSet& joints,
                    std::span<const int> tied, const LargeArray<BodyState>& start);
    /// Takes the bodies without stages of its own if joints hang them up in trees of any size, and close no loop. What floats may
    /// be a particle.
    bool hang(std::span<const BodyConstants> constants, const JointSet& joints, std::span<const int> bodies);
    std::span<const Node> nodes() const noexcept { return nodes_; }
    /// Joint coordinates that can move; 0: not a scene for this.
    int coordinates() const noexcept { return coordinates_; }
    /// Rows that close loops.
    int rows() const noexcept { return rows_; }
    /// The axis of the world that all hinges turn about and all slides lie across (0: x), if numbers of a plane do; −1.
    int across() const noexcept { return plane_.empty() ? -1 : plane_.normal(); }
    /// Whether every body is attached to a ball joint of the world and nothing else, and so turns like a free one.
    bool pivots() const noexcept { return !pivots_.empty(); }
    /// Whether the joints of the forest hold where the bodies are, as joint coordinates take for granted.
    bool holds(const LargeArray<BodyState>& bodies);

    /// One stage over τ: from poses and kicked momenta to poses at its end and momenta on the way. `increments`, per
    /// coordinate: in, where to look; out, what each joint moved (m; rad in a plane, in space the sine of half the angle). False, and
    /// nothing changed, if no solution is near. `rounds` counts evaluations.
    bool stage(double tau, LargeArray<BodyState>& bodies, JointStates& joints, double* increments,
               std::int64_t& rounds) noexcept;

private:
    /// Of a turn θ, by y = sin² θ/2: (θ/2)/sin θ/2, (1 − (θ/2) cot θ/2)/y and their derivatives.
    struct Log {
        double ratio = 1.0, bend = 1.0 / 3.0, ratio_slope = 1.0 / 6.0, bend_slope = 2.0 / 15.0;
    };
    static Log log_of(double y, double cosine) noexcept;
    struct Course {  // of one node in one stage
        // At its start:
        Mat3 frame, axes;  // of what carries the joint; of the body
        Vec3 place, reach, parent_reach, gap, from_parent;
        Vec3 along[6];  // directions of its coordinates
        Quat relative;
        double slide[3];
        // At its end, as far as found:
        Quat moved;  // the turn of the joint, in its frame
        double slid[3];
        Quat turn;    // of the body over the stage, world axes
        Mat3 turned;  // the same, less one
        Vec3 shift;   // of the body
        Vec3 end_place, end_reach, end_along[6];
        Vec3 half;                    // vector part of the turn, body axes
        Vec3 spin, bent, bent_twice;  // I half, half × that, half × that
        Log log;
        Vec3 momentum;     // angular, world axes
        Vec3 push, twist;  // momenta gained; then those of all that is attached to it
    };
    struct Closing {  // a joint that closes a loop, with the rows the forest does not fulfil anyway
        int block, first, second;  // nodes, −1: fixed
        int rows, kept;
        int row[6];
        int at = 0, reduced = 0;  // of its rows among all; of their entries
        double extent[6];
        struct Column {
            int node, coordinate;
        };
        std::vector<Column> columns;  // the coordinates that move it
        std::vector<int> places;      // the same, in the system
    };

    struct LoopRows {  // of the rows kept, on the first body and the second
        double violation[6];
        Vec3 linear[6][2], angular[6][2];
    };

    Refusal attach(std::span<const int> tied, const LargeArray<BodyState>& start);
    bool hang_up(std::span<const int> tied, bool particles);
    Node node_held_by(int block, int body) const noexcept;
    bool has_all_rotors() const noexcept;
    bool has_small_trees() const;
    bool has_light() const noexcept;
    bool close(const LargeArray<BodyState>& start);
    void drop_fulfilled_rows();
    bool independent(const LargeArray<BodyState>& start);
    bool order();
    void flatten();
    void free_pivots();
    void take(const LargeArray<BodyState>& bodies) noexcept;
    bool look_at(const double* increments) noexcept;
    void move(double tau) noexcept;
    void turn_ends() noexcept;
    void place() noexcept;
    void turn_by(const double* step) noexcept;
    void deliver(double tau, LargeArray<BodyState>& bodies, JointStates& joints,
                 double* increments) const noexcept;
    void gain(const LargeArray<BodyState>& bodies, const JointStates& joints, double tau) noexcept;
    static double moved(const Node& node, const Course& course) noexcept;
    void fill_masses() noexcept;
    void fill_loops(bool derivatives) noexcept;
    void find_rows(const Closing& loop, const LargeArray<BodyState>& bodies, LoopRows& out) noexcept;
    void reduce(const Closing& loop, const LoopRows& rows, bool end, double* out) const noexcept;
    const BodyState& state(int body, const LargeArray<BodyState>& bodies) const noexcept {
        return body < 0 ? world_ : bodies[body];
    }

    std::span<const BodyConstants> constants_;
    const JointSet* joints_ = nullptr;
    BodyState world_;
    std::vector<Node> nodes_;
    std::vector<Course> courses_;
    std::vector<Closing> loops_;
    std::vector<int> node_of_;     // per body, −1: fixed
    std::vector<int> place_of_;    // of coordinates, then of closing rows, in the system
    LargeArray<BodyState> ahead_;  // poses at the end, per body
    std::vector<double> start_rows_, end_rows_, multiplier_;  // end_rows_: of one loop
    std::vector<double> right_, step_;
    std::vector<Vec3> pushes_, twists_;
    BandLu system_;
    PlaneTree plane_;
    PivotBodies pivots_;
    int coordinates_ = 0, rows_ = 0, trees_ = 0;
    double scale_ = 1.0;  // kg m²: of the inertias that coordinates feel
};

}  // namespace spook
