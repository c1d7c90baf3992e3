// Contacts in a step of rigid bodies: detection, impact, resting, and the position projection of overlapping bodies.
//
// A step with contacts (v and q are those at its start; positions are frozen until its end):
//   1. detect      points that are closed, and pairs that will touch within this step: where, and when;
//   2. impact      if some point with restitution is approached: 0 <= nu ⟂ C v₊ + psi C v₋ >= 0 with Coulomb
//                  friction |beta| <= mu nu against the slip D v₊, joints included, forces dropped;
//   3. solve       C v₊ + Sig nu >= r ⟂ nu >= 0 with joints and friction, where r is
//                    −(4/h) Ups g + Ups C v   for a closed gap (the SPOOK row; without Ups C v if it is hit: a
//                                             plastic impact, with friction), and
//                    −g/h                     for an open one: it may close, no more;
//                  then pairs that touch only because of these impulses, or of what joints make of forces, are looked for,
//                  and all is solved again (by PGS between its iterations). If one of these is to rebound, 2 comes again,
//                  with the plastic impacts that set it in motion, then 3;
//   4. projection  where the step ends, a displacement that removes overlaps and leaves no trace in v.
//
// A point is closed up to a gap of `closed` times the larger body's radius (ContactBodies::is_closed()). A pair of open shapes
// gets rows only if a cast of both along their motion finds that they meet (`collision/shape_cast.hpp`): supported bodies
// (`contacts/supported_bodies.cpp`) are cast with v, flying ones with v + h M⁻¹ f.
//
// Impacts of what flies, and of a few balls that something holds, are events at their own times t within the step, one after the
// other (contacts/impact_queue.hpp), with the normals and the arms of their meetings: impulses act there, with a part of the
// step's forces before and the rest after, and the bodies move by t v₋ + (h − t) v₊. Which part: contacts/supported_bodies.cpp.
// Other impacts act at the start of the step: the gap may close, no more; with restitution a step early, psi then
// reduced to psi', psi'² = psi² − (1 − psi²) 2 a g/V², a the approaching acceleration and V the approaching
// speed, so that the fall still ahead is not won twice.
//
// Why 4: the SPOOK row answers a depth with a speed that a contact cannot take back: bodies that start overlapped would be
// launched at .21 |g|/h (damping 4.5 h). Only the depth by which a compliant contact was pressed in while it was one enters
// r. The rest is removed by positions, through the same solver with joints held: more rigidly than their compliance, which at
// tiny steps yields more than a body does, and than the contacts, so that joints win where both cannot be. An overlap the
// scene began with goes at the rate 4 Ups per step; one from curved paths, features that swung in or iterations that stopped
// early goes at once: there the contacts have taken the energy that lifting the bodies back costs. What a displacement of
// finite size does to joints, momenta and energy is put right in `rigid/project_positions.cpp`.
//
// Why a settled step cannot raise the energy (E kinetic and potential, constant force f, k = h M⁻¹ f): from
// v₊ = v + k + M⁻¹ Gᵀ z and q₊ = q + h v₊ follows E₊ − E = z·G v₊ − ½ |v₊ − v|²_M. Of rigid contacts z·G v₊ = z·r
// with r <= 0 but for rounding, friction takes (beta·D v₊ <= 0), and the projection pays for what it lifts. So r has no
// Ups C v for a rigid contact that opens: it would push a body after its own speed, up to ½ Ups² |k|²_M a step.
// A solve that stopped early proves nothing: its impulses z are shortened, island by island, to the largest s z for
// which E₊ <= E. It exists: s = 0 is free fall, E₊ − E = −½ |k|²_M, and E₊ is convex in s.
#pragma once

#include <memory>
#include <vector>

#include "collision/detection.hpp"
#include "contacts/candidate_search.hpp"
#include "contacts/contact_cache.hpp"
#include "contacts/contact_pgs.hpp"
#include "contacts/impact_solver.hpp"
#include "contacts/position_projection.hpp"
#include "contacts/resting_solver.hpp"

namespace spook {

/// What later steps depend on is in Snapshot, with which bodies sleep; all else is of one step, or memory that is kept for the next.
/// A copy goes on alike.
class ContactStage {
public:
    /// One material and one solver index per body of the scene; `joints` are the pairs of bodies that rows of joints tie;
    /// `yielding`: per block of those rows, whether it gives way while overlaps are parted, as springs do; `tumblers`: bodies
    /// whose moments of inertia differ.
    ContactStage(Detection detection, const std::vector<SurfaceMaterial>& materials,
                 std::vector<int> solver_index, const ContactOptions& options,
                 std::vector<JointTie> joints = {}, std::vector<char> yielding = {},
                 std::vector<PairFriction> pair_frictions = {}, std::vector<Tumbler> tumblers = {});

    /// Whether any contact can ever be; if not, the stage can be left out.
    bool possible() const noexcept { return search_.detection.possible(); }

    /// Finds this step's contacts. `velocity` is v and `free_velocity` v + h M⁻¹ f, one per body of the scene.
    /// False if there is none: nothing else need be called in this step, but meets() where there are joints.
    bool detect(const std::vector<Pose>& poses, const std::vector<Vec6>& velocity,
                const std::vector<Vec6>& free_velocity);

    /// After detect() found none: whether bodies meet with the velocities that joints alone would give them, one per
    /// body of the scene. Then it is a step with contacts.
    bool meets(const std::vector<Vec6>& next);

    /// Whether a contact with restitution is approached faster than rounding, or a stop among the rows of joints in
    /// `system` is hit that is connected to bodies in contact; asked anew after each impact.
    bool impact_needed(const MixedSystem& system) { return impacts_.needed(system, model_->bodies, points_); }

    /// The part of the step's forces that acts on `body` before the impact, or before the last one that hit it.
    double toi_fraction(int body) const noexcept { return motion_.toi_fraction[body]; }

    /// Finds the next impact of the step. What it hits that is not a ball is to be brought there before impact(), in `system`, which
    /// holds mass and momentum, and in the motion it gives.
    StepMotion& find_next_impact(MixedSystem& system) {
        impacts_.find_next(system, search_.open(), motion_, points_);
        return motion_;
    }

    /// The impact. `system` holds mass, momentum M v₋ (with the forces before events) and the rows of joints as for solve(), of
    /// which those take part that are connected to a point. Bilateral ones keep G v₊ + Sig lambda = 0, limits that touch do
    /// not close, those that are hit rebound, others, and motors, let go. Fills system.velocity, and adds its impulses to
    /// `impulses`, a row block of a joint each. It never raises the kinetic energy (with kinematic bodies: that of the rest).
    void impact(MixedSystem& system, std::vector<Vec6>& impulses);

    struct SolveEnd {
        bool finite = true;
        bool ends_passed = false;  // of a stop whose row is that of its other end: both get rows
    };
    /// The resting stage. `system` holds mass, momentum M v + h f (less the forces before events) and rows of joints, `velocity`
    /// is v after the impact. Appends rows of contacts; fills velocity and multipliers. Unfinished where an impact comes first.
    /// Contacts of bodies `anew`, by their index in MixedSystem, start from nothing, whatever they have done.
    SolveEnd solve(MixedSystem& system, const std::vector<Vec6>& velocity, const std::vector<char>& anew);

    /// Velocity to add to v₊ when positions advance, per moving body; empty when there is none. It leads an event's
    /// bodies to where they are at the step's end.
    const std::vector<Vec6>& correction() const noexcept { return motion_.correction; }

    /// The displacements by which overlapping bodies part, which are at `poses`, where the step ends; null if there are none.
    /// `system` is that of solve(), with `joints` rows of joints. To be asked `again` when bodies are displaced.
    const PositionProjection* project_positions(const MixedSystem& system, std::size_t joints,
                                                const std::vector<Pose>& poses, bool again);
    /// Whether an island's first overlaps have parted where its bodies have been displaced to; PositionProjector::parts().
    bool parts_first_overlaps(int island, double share, const std::vector<Pose>& poses);

    /// Books the momentum [N s] that an island of a projection lost when it paid for its displacement as an impulse at the first
    /// pushing contact with what does not move by itself, so that forces add up to the momentum, if not moments to the angular one.
    void apply_balancing_impulse(const Islands& islands, int island, Vec3 momentum) noexcept;

    /// Whether a moving body (by its index in MixedSystem) had rows in the last solve; others fly freely.
    bool has_rows(int index) const noexcept { return has_rows_[index] != 0; }

    /// What this step's contacts did.
    const ContactCache& cache() const noexcept { return state_.cache; }

    // Bodies that sleep have no pairs with each other, nor with what stands still.
    /// These fall asleep where they are, and every body that touches them: what their touches did stays, to be read.
    void put_to_sleep(const std::vector<int>& bodies);
    /// These are awake again, with their touches as they were left.
    void wake(const std::vector<int>& bodies);
    /// A body that moves as it is told does so in this step, or stands still.
    void mark_moving(int body, bool moves) noexcept { search_.detection.mark_moving(body, moves); }
    /// Sleepers that another body met, or was moved into, since the step began.
    const std::vector<int>& woken() const noexcept { return search_.woken; }
    /// A step that all bodies sleep through.
    void sleep_through();
    const ContactModel& model() const noexcept { return *model_; }

    /// What a later step depends on: copying it back goes back.
    struct State {
        ContactCache cache;
        ContactCounters counters;
        DepthOfPair initial_penetration;  // by pair: overlap the scene began with, as far as it is left, m
        bool initial_penetration_known = false;  // whether it has been looked for
        bool by_rows = false;  // PGS over few joints and contacts has failed: they are solved directly
    };
    /// That, and what the solvers of islands have learnt of how long to wait.
    struct Snapshot {
        State state;
        IslandSolver::BackoffOf resting, impact, projection;
    };
    void keep(Snapshot& kept) const {
        kept.state = state_;
        resting_.islands().backoff(kept.resting);
        impacts_.solver().backoff(kept.impact);
        projector_.solver().backoff(kept.projection);
    }
    void go_back(const Snapshot& kept);

    ContactCounters counters() const noexcept { return state_.counters; }
    BlockLdlt::Counters factor_counters() const noexcept;
    /// How near to their law the rows of the last solve, or impact, were left.
    const SolveQuality& quality() const noexcept { return quality_; }
    JudgedStep judged() const noexcept { return {motion_, points_, state_.initial_penetration}; }

private:
    bool needs_impact_first();
    int find_impacts(const Cast& cast);
    void order_points() { points_.order(state_.cache, model_->surfaces.resists_turning); }
    void after_impact(const MixedSystem& system);
    void mark_rows(std::size_t bodies, const std::vector<RowBlock>& rows);
    void move_on(const MixedSystem& system);
    void correct_events(const MixedSystem& system);
    /// Whether few rows are solved directly though iterations are asked for.
    bool by_rows(std::size_t joints) const noexcept;
    // solve_by_pgs.cpp: the same by PGS over compact contacts
    struct PgsSolveEnd : SolveEnd {
        bool unfinished = false;  // few rows are better solved directly, or the iterations run away
    };
    PgsSolveEnd solve_by_pgs(MixedSystem& system);
    bool warm_start_by_pgs(MixedSystem& system, std::size_t known, int round);
    bool find_more(bool over, bool& iterating);
    bool iterate(MixedSystem& system, FrictionReport& report);

    State state_;
    std::shared_ptr<ContactModel> model_;
    StepMotion motion_;
    CandidateSearch search_;
    ContactPoints points_;
    ImpactSolver impacts_;
    RestingSolver resting_;
    ContactPgs pgs_;
    EnergyLimit energy_;
    PositionProjector projector_;
    bool ran_away_ = false;       // in this solve: islands that are not too large are solved directly
    bool rebounds_late_ = false;  // some impact that a solve, or its iterations, showed
    std::vector<Vec6> next_;      // velocities between iterations, per body of the scene
    std::vector<char> changed_;   // bodies with another than at the look before: the rest was judged then
    IslandFinder connected_;
    std::vector<char> has_rows_;  // moving bodies with rows, by solver index
    SolveQuality quality_;
};

}  // namespace spook
