// The stages of joint_tree.hpp for mechanisms that move in a plane: a number for an angle, two for a place.
//
// Where all hinges turn about one axis of the world and slides lie across it, turns commute, a body's spin is J θ/τ
// for a turn θ over the stage, and nothing out of the plane is left in the equations. The map is the one of
// joint_tree_stage.cpp to rounding; a mechanism in another plane takes that, and so shows it.
#pragma once

#include <cstdint>
#include <vector>

#include "linear/band_lu.hpp"
#include "linear/large_array.hpp"
#include "linear/plane.hpp"
#include "rigid/rigid_state.hpp"

namespace spook {

class PlaneTree {
public:
    /// A body on one hinge or slide; a parent stands before all attached to it.
    struct Node {
        int body = -1, parent = -1, end = 0;  // end: of the nodes attached to it
        bool slides = false;
        int place = 0;            // of its coordinate among the unknowns
        Vec2 parent_arm, arm;     // from the centres to the joint, at the start
        Vec2 along;               // of a slide, at the start
        Vec2 start, from_parent;  // where its centre began, in the world and seen from its parent's
        double mass = 0.0, inertia = 0.0, extent = 1.0;
    };
    /// Two points of two bodies that stay together.
    struct Closing {
        struct Column {
            int node, place;
            bool second;  // whether it moves the second body
        };
        struct End {
            int node = -1, body = -1;  // node: −1 of what is fixed; body: −1 the world
            Vec2 arm, point;           // from the centre, and in the world, at the start
        };
        End first, second;
        int at = 0;       // of its two rows among the multipliers
        int places[2]{};  // of its rows among the unknowns
        int reduced = 0;  // of its columns among all
        std::vector<Column> columns;
    };

    bool empty() const noexcept { return nodes_.empty(); }
    void clear() noexcept { nodes_.clear(); }
    int normal() const noexcept { return plane_.normal; }
    /// Nodes and closings are those of a JointTree, with its numbers; `scale` in kg m².
    void take(Plane3 plane, std::vector<Node> nodes, std::vector<Closing> closings, int reach, double scale);

    /// As JointTree::stage().
    bool stage(double tau, LargeArray<BodyState>& bodies, double* increments, std::int64_t& rounds) noexcept;

private:
    struct Course {  // of one node in one stage
        // At its start:
        HalfTurn relative;  // of the joint since the scene's start
        Vec2 place, reach;  // of the centre, in the world; from it to the joint
        Vec2 lever;         // from the parent's centre to the joint, with its slide
        Vec2 from_parent, along;
        Vec2 velocity;
        double spin = 0.0, slide = 0.0;
        // At its end, as far as found:
        double angle = 0.0;  // the turn of the joint
        HalfTurn moved;
        double slid = 0.0;
        double whole_angle = 0.0;  // the turn of the body over the stage
        HalfTurn turn;
        TurnLessOne turned;
        Vec2 shift;
        double spins = 0.0;
        Vec2 push;  // momenta gained; then those of all that is attached to it
        double twist = 0.0;
        Vec2 end_place, end_centre, end_along;
        HalfTurn pose;  // since the scene's start
        TurnLessOne posed;
        Vec2 displacement;
    };

    template <int NORMAL> void read(const LargeArray<BodyState>& bodies) noexcept;
    template <int NORMAL>
    void write(double tau, LargeArray<BodyState>& bodies, double* increments) const noexcept;
    template <int NORMAL>
    bool stage(double tau, LargeArray<BodyState>& bodies, double* increments, std::int64_t& rounds) noexcept;
    bool look_at(const double* increments) noexcept;
    void move(double tau) noexcept;
    void gain(double tau) noexcept;
    void turn_ends() noexcept;
    void fill_masses() noexcept;
    void place() noexcept;
    void fill_loops(bool derivatives) noexcept;

    Plane3 plane_;
    std::vector<Node> nodes_;
    std::vector<Course> courses_;
    std::vector<Closing> closings_;
    std::vector<Vec2> start_rows_;  // per column of a closing
    std::vector<Vec2> fixed_gap_;   // per closing: of its ends that are fixed
    std::vector<double> multiplier_, right_;
    std::vector<Vec2> pushes_;
    std::vector<double> twists_;
    BandLu system_;
    double scale_ = 1.0;
};

}  // namespace spook
