// Accelerations of trees of joints by the articulated-body algorithm (Featherstone 1983), in joint coordinates.
//
// All screws are about one point per tree and in world axes, where inertias of links add without a transformation. The chart is
// that of the step at hand: coordinates are moves since its start, a ball's the rotation vector of its turn in the axes of what
// carries it, so that none comes near a singular position. Each coordinate is eliminated by itself, a ball's three and a
// floating body's six one after the other, as a Cholesky factorisation does.
#pragma once

#include <span>
#include <vector>

#include "rigid/joint_set.hpp"
#include "rigid/joint_tree.hpp"

namespace spook {

class ArticulatedTree {
public:
    void take(const JointTree& tree, std::span<const BodyConstants> constants, const JointSet& joints);
    std::size_t coordinates() const noexcept { return coordinates_; }
    /// Joints whose turns are counted, by what they move: no step is too long for that.
    void count(std::span<const int> joints) noexcept;

    /// The chart of a step from where the bodies are; how fast the coordinates go there, rad/s or m/s, into `rates`.
    void begin(const LargeArray<BodyState>& bodies, JointSet& joints, double* rates) noexcept;
    /// Force and torque about the centre on a body, world axes, from now on.
    template <class Each> void load(Each&& each) noexcept {
        for (Link& link : links_) each(link.body, link.force, link.torque);
    }
    /// How coordinates and rates change there.
    void accelerate(const double* moved, const double* rates, double* pace, double* acceleration) noexcept;
    /// The bodies there.
    void place(const double* moved, const double* rates, LargeArray<BodyState>& bodies,
               const LargeArray<BodyConstants>& constants, JointStates& joints) noexcept;
    /// What a coordinate is measured in: 1 rad, or the size of its joint [m].
    double extent(std::size_t coordinate) const noexcept { return extents_[coordinate]; }
    int body_of(std::size_t coordinate) const noexcept;

private:
    struct Screw {  // a motion: angular, and linear of the point; a force: torque about it, force
        Vec3 turn, shift;
    };
    struct Inertia {  // of a motion, into momentum: blocks xx yy zz xy xz yz, and the one between
        double turn[6], shift[6];
        Mat3 mixed;
    };
    struct Link {
        int body = -1, joint = -1;
        int carrier = 0;  // among poses_: 0 is the world
        int turns = 0, slides = 0;
        std::size_t first = 0;  // of its coordinates: turns before slides
        bool backwards = false, particle = false, counted = false;
        double mass = 0.0, armature = 0.0;
        double inertia[6] = {};  // at the start of the run, world axes
        Vec3 carrier_arm, arm;   // from the centres to the joint, at the start of the run
        Vec3 axis, slide_axes[3];
        int spring = -1;  // of its coordinate
        Vec3 force, torque;
    };
    struct Chart {  // where the step begins
        Quat relative;
        Mat3 turned, turned_across, turned_along;  // by the hinge: its sine and 1 − cosine take the latter
        Vec3 offset;  // to the joint from the carrier's centre, in the latter's axes
        Vec3 slid;
        double coordinate = 0.0;  // of a spring, or where turns are counted
    };
    struct Pose {
        Mat3 axes;
        Vec3 place;            // of the centre
        Screw motion, bias;    // bias: acceleration that is no coordinate's
        Screw force, gaining;  // gaining: acceleration
        Inertia inertia;
    };
    struct Along {  // of a coordinate
        Screw along, weight;
        double over = 0.0, gained = 0.0;
    };
    static double dot(const Screw& a, const Screw& b) noexcept {
        return spook::dot(a.turn, b.turn) + spook::dot(a.shift, b.shift);
    }
    static Screw times(const Inertia& inertia, const Screw& motion) noexcept;
    void move(const double* moved, const double* rates, double* pace) noexcept;
    void weigh(const Link& link, Pose& pose) const noexcept;
    void gather(const double* moved, const double* rates) noexcept;
    double spring(const Link& link, const Chart& chart, double moved, double rate) const noexcept;

    std::vector<Link> links_;
    std::vector<Chart> charts_;
    std::vector<Pose> poses_;  // of the links, after that of the world
    std::vector<Along> along_;
    std::vector<double> extents_;
    std::size_t coordinates_ = 0;
    const JointSet* joints_ = nullptr;
};

}  // namespace spook
