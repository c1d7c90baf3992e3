// Bodies locked to each other in chains and trees: every step's rows solved link by link, in O(links).
//
// A lock's rows have equal coefficients in all directions, so that the basis they are written in drops out. With x the
// velocity of the child at the joint (linear, angular), u that of its parent there, μ the impulse on the child there:
//   x − u + C μ = y,   N x = q + μ,   so   μ = K u + d,   K = (N⁻¹ + C)⁻¹,   d = K (y + C q) − q
// N and q are mass and momentum of all that is attached to the joint. K and d, moved to the parent's centre, are what its
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
#include "rigid/solver.hpp"

namespace spook {

/// What one solve is asked for besides the bodies' states.
struct LockedLoads {
    double time_step;
    Vec3 gravity;                               // m/s², of all bodies, if there are no loads
    std::span<const BodyConstants> constants;   // for torques
    std::span<const Vec3> acceleration, force;  // per body; empty where there are none
    bool follows_turns;                         // as JointSet::follow_turns()
};

class LockedTree {
public:
    struct Counters {
        std::uint64_t factorisations = 0, block_operations = 0, solves = 0;
    };

    /// Null if every joint is a lock whose compliance and damping are the same along all axes and the same about all
    /// axes, and no two ways lead from body to body or from body to what moves as it is told. Else why not,
    /// and nothing is kept.
    Refusal analyse(std::span<const BodyConstants> constants, const JointSet& joints,
                    std::span<const int> tied);

    /// Velocities after the step, refined so many times, by velocity(body, Twist), each body once, parents first.
    /// False when a number was not finite. Allocates nothing.
    template <class Velocity>
    bool solve(std::span<const BodyState> bodies, const LockedLoads& loads, int refinements,
               Velocity velocity) noexcept {
        eliminate(bodies, loads, true, false);
        if (!finite_) return false;
        ++counters_.factorisations;
        counters_.block_operations += operations_;
        counters_.solves += 1 + static_cast<std::uint64_t>(refinements);
        for (int round = 0; round < refinements; ++round) {
            for (std::size_t k = links_.size(); k-- > 0;) {
                ask(k - AHEAD, bodies, false);
                descend(k, round == 0);
            }
            eliminate(bodies, loads, false, round > 0);
        }
        for (std::size_t k = links_.size(); k-- > 0;) {
            ask(k - AHEAD, bodies, true);
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
    /// A body and what it hands on.
    struct Link {
        int body = 0;
        int parent = -1;     // its link; −1: there is none
        int gain = -1;       // of the joint to it; −1: a root that floats
        bool leaf = true;    // nothing is carried to it
        bool takes = false;  // and adds what waits
        enum Next : std::uint8_t { hands_on, waits, joins } next = hands_on;  // what it carries to its parent
        double mass = 0.0;
    };
    /// The joint to its parent, as it was at the start.
    struct Hold {
        int joint = -1, other = -1;  // what the body is locked to: a body, −1 the world
        bool child_is_first = false;
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
        Twist base, impulse, velocity;
        Twist left;  // y, or what the velocities so far leave of it; then the correction of the velocity
    };
    struct Carried {
        Inertia6 mass;
        Twist momentum;
    };

    int gain_of(const JointSet& joints, int joint);
    template <bool FIRST>
    void eliminate(std::span<const BodyState> bodies, const LockedLoads& loads, bool again) noexcept;
    void eliminate(std::span<const BodyState> bodies, const LockedLoads& loads, bool first,
                   bool again) noexcept;
    void locate(std::size_t k, std::span<const BodyState> bodies, const LockedLoads& loads,
                Work& work) const noexcept;
    void follow_turns(std::size_t k, std::span<const BodyState> bodies, const LockedLoads& loads,
                      Work& work) const noexcept;
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
        if (link.gain < 0) {
            step = solve_whole(work.stiffness, work.base);
        } else {
            Twist ahead;
            impulse = work.base;
            if (link.parent >= 0) {
                const Work& parent = works_[link.parent];
                ahead = to_joint(first ? parent.velocity : parent.left, work.other_arm);
                impulse += work.stiffness * ahead;
            }
            step = to_centre(work.left + ahead - give(work, gains_[link.gain], impulse), work.arm);
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

    /// Beyond the caches the links' numbers are asked for before they are needed.
    static constexpr std::size_t AHEAD = 6;
    static void ask(const void* memory, std::size_t bytes) noexcept {
        const char* from = static_cast<const char*>(memory);
        for (std::size_t at = 0; at < bytes; at += 64) __builtin_prefetch(from + at, 1);
    }
    void ask(std::size_t k, std::span<const BodyState> bodies, bool states) const noexcept {
        if (k >= links_.size()) return;
        ask(&works_[k], sizeof(Work));
        if (states) ask(&bodies[links_[k].body], sizeof(BodyState));
    }

    LargeArray<Link> links_;  // leaves first; a parent follows one of its children at once
    LargeArray<Hold> holds_;
    std::vector<Gain> gains_;
    LargeArray<Work> works_;
    std::vector<Carried> waiting_;
    BodyState still_;  // of the world
    std::uint64_t operations_ = 0;
    bool finite_ = true;
    Counters counters_;
};

}  // namespace spook
