// Bodies locked to each other in chains and trees: every step's rows solved link by link, in O(links).
//
// A lock's rows have equal coefficients in all directions, so that the basis they are written in drops out. With x the
// velocity of the child at the joint (linear, angular), u that of its parent there, μ the impulse on the child there:
//   x − u + C μ = y,   N x = q + μ,   so   μ = K u + d,   K = (N⁻¹ + C)⁻¹,   d = K (y + C q) − q
// N and q are mass and momentum of all that hangs on the joint. K and d, moved to the parent's centre, are what its
// own mass and momentum gain: leaves first. Velocities then follow from the root on. This is the elimination of the
// saddle system [[M, Gᵀ], [G, −Sig]], child before parent, with nothing stored that lever arms say: 6 × 6 numbers
// a link instead of four blocks of them. K comes from N by one rank-one step per direction, so that C = 0 is exact.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linear/large_array.hpp"
#include "rigid/inertia6.hpp"
#include "rigid/joint_set.hpp"

namespace spook {

/// What one solve is asked for besides the bodies' states.
struct LockedLoads {
    double time_step;
    std::span<const BodyConstants> constants;
    std::span<const Vec3> acceleration, force;  // per body; force may be empty
};

class LockedTree {
public:
    struct Counters {
        std::uint64_t factorisations = 0, block_operations = 0, solves = 0;
    };

    /// True if every joint is a lock whose compliance and damping are the same along all axes and the same about all
    /// axes, and no two ways lead from body to body or from body to what moves as it is told. Else nothing is kept.
    bool analyse(std::span<const BodyConstants> constants, const JointSet& joints, std::span<const int> tied);
    bool empty() const noexcept { return links_.empty(); }

    /// Velocities after the step, refined so many times, by velocity(body, Twist), each body once, parents first.
    /// False when a number was not finite. Allocates nothing.
    template <class Velocity>
    bool solve(std::span<const BodyState> bodies, const LockedLoads& loads, int refinements,
               Velocity velocity) noexcept {
        eliminate(bodies, loads, true);
        if (!finite_) return false;
        ++counters_.factorisations;
        counters_.block_operations += operations_;
        counters_.solves += 1 + static_cast<std::uint64_t>(refinements);
        for (int round = 0; round < refinements; ++round) {
            for (std::size_t k = links_.size(); k-- > 0;) descend(k, round == 0);
            eliminate(bodies, loads, false);
        }
        for (std::size_t k = links_.size(); k-- > 0;) {
            descend(k, refinements == 0);
            velocity(links_[k].body, works_[k].velocity);
        }
        return true;
    }

    /// The multipliers of the last solve, of the second body and along the world's axes, and where they act.
    void deliver(std::span<JointSet::State> states) const noexcept;

    Counters counters() const noexcept { return counters_; }
    void clear_counters() noexcept { counters_ = {}; }

private:
    /// A body and the joint to its parent.
    struct Link {
        int body = 0, other = -1;     // what it is locked to: a body, −1 the world
        int parent = -1, joint = -1;  // the parent's link, −1: there is none; −1: a root that floats
        int gain = 0;
        bool child_is_first = false;
        bool leaf = true;                                                     // nothing is carried to it
        bool takes = false;                                                   // and adds what waits
        enum Next : std::uint8_t { hands_on, waits, joins } next = hands_on;  // what it carries to its parent
        double mass = 0.0;
        Vec3 arm, other_arm;
    };
    struct Gain {
        double upsilon[2], violation[2], softness[2];  // linear, angular
        bool operator==(const Gain&) const = default;
    };
    struct Work {
        Vec3 arm, other_arm;  // from both centres to the joint
        Vec3 tilt;            // vector part of the relative turn, world axes: the rows' angles are 2 × it
        double tilt_softness = 0.0;
        Inertia6 stiffness;  // K; of a floating root, the factor of its mass
        Twist right, base;   // y and d
        Twist left;          // of y, by the velocities so far; then the correction of the velocity
        Twist impulse, velocity;
    };
    struct Carried {
        Inertia6 mass;
        Twist momentum;
    };

    template <bool FIRST>
    void eliminate(std::span<const BodyState> bodies, const LockedLoads& loads) noexcept;
    void eliminate(std::span<const BodyState> bodies, const LockedLoads& loads, bool first) noexcept;
    void locate(const Link& link, std::span<const BodyState> bodies, Work& work) const noexcept;
    Twist momentum_of(const Link& link, const BodyState& s, const LockedLoads& loads) const noexcept;

    /// How far the rows give way under an impulse: C μ.
    static Twist give(const Work& work, const Gain& gain, const Twist& impulse) noexcept {
        return {gain.softness[0] * impulse.linear,
                gain.softness[1] * impulse.angular +
                    (work.tilt_softness * dot(work.tilt, impulse.angular)) * work.tilt};
    }

    /// Velocity and impulse of a link whose parent's are known.
    void descend(std::size_t k, bool first) noexcept {
        const Link& link = links_[k];
        Work& work = works_[k];
        Twist impulse, step;
        if (link.joint < 0) {
            step = solve_whole(work.stiffness, work.base);
        } else {
            Twist ahead;
            impulse = work.base;
            if (link.parent >= 0) {
                const Work& parent = works_[link.parent];
                ahead = to_joint(first ? parent.velocity : parent.left, work.other_arm);
                impulse += work.stiffness * ahead;
            }
            step = to_centre(
                (first ? work.right : work.left) + ahead - give(work, gains_[link.gain], impulse), work.arm);
        }
        if (first) {
            work.velocity = step;
            work.impulse = impulse;
            return;
        }
        work.left = step;
        work.velocity += step;
        work.impulse += impulse;
    }

    std::vector<Link> links_;  // leaves first; a parent follows one of its children at once
    std::vector<Gain> gains_;
    LargeArray<Work> works_;
    std::vector<Carried> waiting_;
    BodyState still_;  // of the world
    std::uint64_t operations_ = 0;
    bool finite_ = true;
    Counters counters_;
};

}  // namespace spook
