// Contacts in a step of rigid bodies: detection, impact, resting, and the parting of overlapping bodies.
//
// A step with contacts (v and q are those at its start; positions are frozen until its end):
//   1. detect      points with a gap the bodies could close in this step;
//   2. impact      if some point with restitution is approached: 0 <= nu ⟂ C v₊ + psi C v₋ >= 0, joints included,
//                  forces and friction dropped;
//   3. solve       C v₊ + Sig nu >= r ⟂ nu >= 0 with joints and friction, where r is
//                    −(4/h) Ups g + Ups C v   for a closed gap (the SPOOK row; without Ups C v if it is hit: a
//                                             plastic impact, with friction), and
//                    −g/h                     for an open one: it may close, no more;
//   4. correction  an extra displacement velocity that parts overlapping bodies and leaves no trace in v.
//
// Why 4: the SPOOK row answers a depth with a speed, and a contact cannot take that speed back, so bodies that
// start overlapped would be launched at .21 |g|/h (damping 4.5 h). Only the depth a contact's own compliance
// explains, twice eps times the force it carried last, enters r; the rest is parted by positions, at the same
// rate 4 Ups per step, through the same solver with joints held. Positions that move without velocities keep the
// centre of mass to rounding; the angular momentum of bodies in flight, r × p, changes a little while they part.
//
// Restitution acts a step early on a gap that is still open by g but closes in this step; else a fast body would
// have to enter the other first. psi is then reduced to psi' so that the fall still ahead is not won twice:
// psi'² = psi² − (1 − psi²) 2 a g/V², a the approaching acceleration and V the approaching speed.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/detection.hpp"
#include "contacts/contact_islands.hpp"
#include "contacts/contact_material.hpp"
#include "contacts/friction_direct.hpp"
#include "contacts/friction_sweeps.hpp"
#include "run/named_enum.hpp"

namespace spook {

SPOOK_NAMED_ENUM(SolverKind, direct, iterative, hybrid)

struct ContactOptions {
    double time_step = 0.0;
    FrictionModel friction = FrictionModel::cone;
    SolverKind solver = SolverKind::direct;
    int iterations = 50;
    double residual_tolerance = 1e-10;  // m/s
    double floor = 1e-12;               // of pivots, in the factor only
    int refinements = 1;
};

struct ContactCounters {  // exact, equal on every machine
    std::uint64_t contacts = 0, impacts = 0, corrections = 0, friction_rounds = 0, pivots = 0, sweeps = 0,
                  unsettled = 0;  // solves that stopped at a limit of rounds
};

/// All state from one step to the next is in plain members: copy the stage to save it.
class ContactStage {
public:
    /// One material and one `unknown` per body of the scene; unknown[b] is the body's index in MixedSystem, or −1
    /// if it does not move by itself (static, kinematic).
    ContactStage(Detection detection, std::vector<SurfaceMaterial> materials, std::vector<int> unknown,
                 const ContactOptions& options);

    /// Whether any contact can ever be; if not, the stage can be left out.
    bool possible() const noexcept { return detection_.possible(); }

    /// Finds this step's contacts. `velocity` is v and `free_velocity` v + h M⁻¹ f, one per body of the scene.
    /// False if there is none: nothing else need be called in this step.
    bool detect(const std::vector<Pose>& poses, const std::vector<Vec6>& velocity,
                const std::vector<Vec6>& free_velocity);

    /// Whether a contact with restitution is approached faster than rounding.
    bool impact_needed() const noexcept { return impact_needed_; }

    /// The impact. `system` holds mass, momentum M v₋ and the rows of joints as for solve(); their right sides are
    /// not used: bilateral rows keep G v₊ + Sig lambda = 0, limits do not close, motors let go. Fills
    /// system.velocity with v after the impact. It never raises the kinetic energy (with moving kinematic bodies:
    /// that of the rest).
    void impact(MixedSystem& system);

    /// The resting stage. `system` holds mass, momentum M v + h f and rows of joints, `velocity` as in detect() but
    /// after the impact. Appends rows of contacts behind those of joints; fills velocity and multipliers.
    /// False if a value was not finite.
    bool solve(MixedSystem& system, const std::vector<Vec6>& velocity);

    /// Velocity to add to v₊ when positions advance, per moving body; empty when nothing overlapped.
    const std::vector<Vec6>& correction() const noexcept { return correction_; }

    /// What this step's contacts did.
    struct Touch {
        Contact contact;
        Vec3 impulse;                    // on the first body, impact and resting, N s
        double normal = 0.0;             // nu of the resting stage, N s
        double impact = 0.0;             // normal impulse of the impact, N s
        double tangent[2] = {0.0, 0.0};  // along world tangents, for a warm start
        bool active = false;             // pushes, or closed
    };
    const std::vector<Touch>& touches() const noexcept { return touches_; }

    /// Force [N] on `body` from `other` (or from all if −1), mean over the step.
    Vec3 force(int body, int other) const noexcept;
    /// Points that push or are closed.
    int count() const noexcept;
    /// Largest depth [m] among this step's points, at its start.
    double penetration() const noexcept;

    ContactCounters counters() const noexcept { return counters_; }
    BlockLdlt::Counters factor_counters() const noexcept;
    double residual() const noexcept { return residual_; }  // of the last solve, see FrictionReport

private:
    struct Point {
        SurfaceMaterial material;
        Vec3 first_arm, second_arm;  // from the centres of mass, m
        Vec3 tangent;                // first tangent along world axes, unit
        double approach = 0.0;       // C v, m/s, negative when closing; after the impact in solve()
        double push = 0.0;           // C (free velocity − v), m/s, negative when pressed together
        double bounce = 0.0;         // psi' if the point takes part in the impact, else −1
        double rounding = 0.0;       // approaches slower than this are none, m/s
        double before = -1.0;        // normal impulse of the step before, −1 if the point is new
        double tangent_before[2] = {0.0, 0.0};
    };
    /// Bodies that pass each other sideways need no row: what counts is the speed along the normal.
    void drop_unreachable(const std::vector<Vec6>& velocity, const std::vector<Vec6>& free_velocity);
    RowBlock row_block(std::size_t k, bool tangents) const;
    double relative(std::size_t k, Vec3 direction, const std::vector<Vec6>& velocity,
                    bool only_prescribed) const;
    double kinetic_energy(const MixedSystem& system, const std::vector<Vec6>& velocity) const;
    FrictionReport run(MixedSystem& system, std::vector<FrictionPoint>& points, IslandSolver& solver);
    void part_overlaps(const MixedSystem& system, std::size_t joints);
    double explained_depth(std::size_t k) const noexcept;
    bool is_closed(std::size_t k) const noexcept;

    Detection detection_;
    std::vector<SurfaceMaterial> materials_;
    std::vector<int> unknown_;
    ContactOptions options_;
    IslandSolver resting_solver_, impact_solver_, parting_solver_;

    std::vector<Contact> contacts_;
    std::vector<Point> points_;
    std::vector<Touch> touches_;  // of this step; of the step before until solve()
    std::vector<double> margin_;
    std::vector<Vec6> prescribed_;  // velocities of bodies that do not move by themselves, zero for the rest
    std::vector<Vec6> correction_;
    bool impact_needed_ = false;
    double residual_ = 0.0;
    ContactCounters counters_;
};

}  // namespace spook
