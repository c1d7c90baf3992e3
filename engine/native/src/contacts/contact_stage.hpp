// Contacts in a step of rigid bodies: detection, impact, resting, and the parting of overlapping bodies.
//
// A step with contacts (v and q are those at its start; positions are frozen until its end):
//   1. detect      points that are closed, and pairs that will touch within this step: where, and when;
//   2. impact      if some point with restitution is approached: 0 <= nu ⟂ C v₊ + psi C v₋ >= 0 with Coulomb
//                  friction |beta| <= mu nu against the slip D v₊, joints included, forces dropped;
//   3. solve       C v₊ + Sig nu >= r ⟂ nu >= 0 with joints and friction, where r is
//                    −(4/h) Ups g + Ups C v   for a closed gap (the SPOOK row; without Ups C v if it is hit: a
//                                             plastic impact, with friction), and
//                    −g/h                     for an open one: it may close, no more;
//                  then pairs that touch only because of these impulses, or of what joints alone make of forces, are
//                  looked for, and all is solved again
//                  (the iterative solver looks between its sweeps, and gives them rows in the same solve). If one of
//                  these is to rebound, 2 comes again, with the plastic blows that set it in motion, then 3;
//   4. parting     where the step ends, a displacement that parts overlapping bodies and leaves no trace in v.
//
// What does not touch is not touched: a pair of open shapes gets rows only if a sweep of both along their motion
// finds that they meet (`collision/sweep.hpp`). Bodies that contacts carry (`contacts/contact_carried.cpp`) are swept
// with v, which their supports agree with; flying ones with v + h M⁻¹ f, whether or not they touch.
//
// A strike of balls that no other contact disturbs is an event at its own time t within the step, with the normal and the
// arms of the meeting: impulses act there, with the part t/h of the step's forces before and the rest after, and both bodies
// are led t v₋ + (h − t) v₊ along.
// Other strikes act at the start of the step: the gap may close, no more; with restitution a step early, psi then
// reduced to psi', psi'² = psi² − (1 − psi²) 2 a g/V², a the approaching acceleration and V the approaching
// speed, so that the fall still ahead is not won twice.
//
// Why 4: the SPOOK row answers a depth with a speed, and a contact cannot take that speed back, so bodies that
// start overlapped would be launched at .21 |g|/h (damping 4.5 h). Only the depth by which a compliant contact was
// pressed in while it was one, the way its bodies went along the normal, enters r: what it gives back it has been
// given. The rest is parted by positions, through the same solver with joints held: far more rigidly than their
// compliance, which at tiny steps yields more than a body does, and more rigidly than the contacts, so that joints
// win where both cannot be. An overlap the scene began with goes at the rate 4 Ups per step; one that comes from
// curved paths, features that swung in or sweeps that stopped early goes at once, in the step that makes it: there
// the contacts have taken the energy that lifting the bodies back costs. What such a displacement of finite size
// does to joints, momenta and energy is put right in `rigid/rigid_parting.cpp`.
//
// Why a settled step cannot raise the energy (E kinetic and potential, constant force f, k = h M⁻¹ f): from
// v₊ = v + k + M⁻¹ Gᵀ z and q₊ = q + h v₊ follows E₊ − E = z·G v₊ − ½ |v₊ − v|²_M. Of rigid contacts z·G v₊ = z·r
// with r <= 0 but for rounding, friction takes (beta·D v₊ <= 0), and parting pays for what it lifts. So r has no
// Ups C v for a rigid contact that opens: it would push a body after its own speed, up to ½ Ups² |k|²_M a step.
// A solve that stopped early proves nothing: its impulses z are shortened, island by island, to the largest s z for
// which E₊ <= E. It exists: s = 0 is free fall, E₊ − E = −½ |k|²_M, and E₊ is convex in s.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "collision/detection.hpp"
#include "contacts/contact_arrays.hpp"
#include "contacts/contact_islands.hpp"
#include "contacts/contact_material.hpp"
#include "contacts/contact_sweeps.hpp"
#include "contacts/friction_direct.hpp"
#include "contacts/friction_sweeps.hpp"
#include "contacts/step_points.hpp"
#include "linear/large_array.hpp"
#include "run/named_enum.hpp"
#include "run/team.hpp"

namespace spook {

SPOOK_NAMED_ENUM(SolverKind, direct, iterative, hybrid)

/// What bodies that touch but do not approach each other do while a blow passes. simultaneous: they take part in
/// it. successive: only points that are approached take part, again and again until none is: a blow runs through a
/// row of touching balls, and the last one leaves. Of open ones the next to close comes next, with those closed by then.
SPOOK_NAMED_ENUM(ImpactOrder, simultaneous, successive)

struct ContactOptions {
    double time_step = 0.0;
    FrictionModel friction = FrictionModel::cone;
    SolverKind solver = SolverKind::direct;
    int iterations = 50;
    double residual_tolerance = 1e-10;  // m/s
    double floor = 1e-12;               // of pivots, in the factor only
    int refinements = 1;
    ImpactOrder impacts = ImpactOrder::simultaneous;
    double unsettled_residual = 0.1;  // m/s; a solve that leaves more has no answer
    int threads = 1;
};

struct ContactCounters {  // exact, equal on every machine
    std::uint64_t contacts = 0, impacts = 0, corrections = 0, friction_rounds = 0, pivots = 0, sweeps = 0,
                  unsettled = 0;  // solves that stopped at a limit of rounds
};

/// All state from one step to the next is in plain members: copy the stage to save it.
class ContactStage {
public:
    /// One material and one `unknown` per body of the scene; unknown[b] is the body's index in MixedSystem, or −1
    /// if it does not move by itself (static, kinematic). `joints` are the pairs of bodies that rows of joints tie;
    /// `yielding` tells of each block of those rows whether it gives way while overlaps are parted, as springs do.
    ContactStage(Detection detection, const std::vector<SurfaceMaterial>& materials, std::vector<int> unknown,
                 const ContactOptions& options, std::vector<IndexPair> joints = {},
                 std::vector<char> yielding = {});

    /// Whether any contact can ever be; if not, the stage can be left out.
    bool possible() const noexcept { return detection_.possible(); }

    /// Strikes of this body are met at the start of the step, like the stops of its joints, never at their own time.
    void leave_at_start(int body) noexcept { ball_[body] = 0; }

    /// Finds this step's contacts. `velocity` is v and `free_velocity` v + h M⁻¹ f, one per body of the scene.
    /// False if there is none: nothing else need be called in this step, but meets() where there are joints.
    bool detect(const std::vector<Pose>& poses, const std::vector<Vec6>& velocity,
                const std::vector<Vec6>& free_velocity);

    /// After detect() found none: whether bodies meet with the velocities that joints alone would give them, one per
    /// body of the scene. Then it is a step with contacts. Whether some stop among the joints is `struck`, and whether one
    /// `rebounds`.
    bool meets(const std::vector<Vec6>& next, bool struck, bool rebounds);

    /// Whether a contact with restitution is approached faster than rounding, or a stop among the rows of joints in
    /// `system` is hit that hangs together with bodies in contact; asked anew after each impact.
    bool impact_needed(const MixedSystem& system) const { return impact_needed_ || stop_is_hit(system); }

    /// The part of the step's forces that acts on `body` before the impact, or before the last one that hit it.
    double lead(int body) const noexcept { return lead_[body]; }

    /// The impact. `system` holds mass, momentum M v₋ (v₋ with the lead of forces) and the rows of joints as for
    /// solve(), of which those take part that hang together with a point. Bilateral ones keep G v₊ + Sig lambda = 0,
    /// limits that touch do not close, those that are hit rebound, others, and motors, let go: right sides are not used.
    /// Fills system.velocity with v after the impact. It never raises the kinetic energy (with
    /// moving kinematic bodies: that of the rest).
    void impact(MixedSystem& system);

    /// The resting stage. `system` holds mass, momentum M v + h f (less the lead) and rows of joints, `velocity` is
    /// v after the impact. Appends rows of contacts behind those of joints; fills velocity and multipliers.
    /// False if a value was not finite. It ends unfinished where ends_passed().
    bool solve(MixedSystem& system, const std::vector<Vec6>& velocity);

    /// Whether the solve leads past the end of some joint's stop whose row is that of its other end: it is to be solved
    /// again with rows for both.
    bool ends_passed() const noexcept { return ends_passed_; }

    /// Velocity to add to v₊ when positions advance, per moving body; empty when there is none. It leads an event's
    /// bodies to where they are at the step's end.
    const std::vector<Vec6>& correction() const noexcept { return correction_; }

    /// How overlapping bodies are to be displaced at the end of the step.
    struct Parting {
        std::vector<Vec6> velocity;  // per moving body; empty when none is
        Islands islands;             // of bodies that push each other, or hang together by joints
        std::vector<char> grounded;  // per island: something that does not move by itself took part
        std::vector<char> supplied;  // per island: what moves it, or a first overlap, may do work on it
        double deepest = 0.0;        // overlap that nothing explains, m
    };
    const Parting& parting() const noexcept { return parting_; }
    /// Whether displacements come by sweeps: cheap, and as exact as the next step will need.
    bool parts_by_sweeps() const noexcept {
        return options_.solver == SolverKind::iterative && !resists_turning_;
    }

    /// Looks among the pairs of this step's points for overlaps with the bodies at `poses`, where the step ends, and
    /// fills parting(); false if there is none. `system` is that of solve(), with `joints` rows of joints. To be asked
    /// `again` when the bodies are displaced: what is linear in the displacement is not all. Then it is false, too, where
    /// the displacement before was of no use, or by sweeps so small that nothing comes of it.
    bool part(const MixedSystem& system, std::size_t joints, const std::vector<Pose>& poses, bool again);

    /// Books the momentum [N s] that an island of parting() lost when it paid for its displacement as an impulse at
    /// the first pushing contact with what does not move by itself: there forces keep adding up to the momentum, not
    /// moments to the angular one. An island that only joints tie to such a thing has nothing to book it at.
    void pay(int island, Vec3 momentum) noexcept;

    /// Whether a moving body (by its index in MixedSystem) had rows in the last solve; others fly freely.
    bool held(int unknown) const noexcept { return held_[unknown] != 0; }

    /// What this step's contacts did.
    struct Touch {
        Contact contact;
        Vec3 impulse;                    // on the first body, impact and resting, N s
        double normal = 0.0;             // nu of the resting stage, N s
        double impact = 0.0;             // normal impulse of the impact, N s
        double tangent[2] = {0.0, 0.0};  // of the resting stage along the tangents, for a warm start
        double turning[3] = {0, 0, 0};   // of rolling along them and of turning, scaled, for a warm start
        double pressed = 0.0;            // how far its bodies have pressed it in by the step's end, m
        double friction = 0.0;           // mu of the pair, along its direction if it has one
        bool active = false;             // pushes, or closed
    };
    const std::vector<Touch>& touches() const noexcept { return touches_; }

    // contact_sleep.cpp: bodies that sleep have no pairs with each other, nor with what stands still.
    /// These fall asleep where they are, and everybody who touches them: what their touches did stays, to be read.
    void put_to_sleep(const std::vector<int>& bodies);
    /// These are awake again, with their touches as they were left.
    void wake(const std::vector<int>& bodies);
    /// A body that moves as it is told does so in this step, or stands still.
    void stir(int body, bool moves) noexcept { detection_.stir(body, moves); }
    /// Sleepers that touch one of those who `stirs`, by body.
    std::vector<int> touching(const std::vector<char>& stirs) const;
    /// Sleepers that somebody met, or was led into, since the step began.
    const std::vector<int>& roused() const noexcept { return roused_; }
    /// A step that all bodies sleep through.
    void sleep_through();
    /// Whether a surface of the contact moves along itself.
    bool conveys(const Contact& contact) const;
    double radius(int body) const noexcept { return detection_.radius()[body]; }  // m, of its surface

    /// All that a later step depends on.
    struct Memory {
        std::vector<Touch> touches, kept;
        std::vector<char> asleep;
        ContactCounters counters;
        IslandSolver::PatienceOf resting, impact, parting;
        DepthOfPair given;
        bool begun = false, by_rows = false;
    };
    void keep(Memory& memory) const {
        memory.touches = touches_, memory.kept = kept_, memory.asleep = asleep_, memory.counters = counters_;
        resting_solver_.patience(memory.resting);
        impact_solver_.patience(memory.impact);
        parting_solver_.patience(memory.parting);
        memory.given = given_, memory.begun = begun_, memory.by_rows = by_rows_;
    }
    void remember(const Memory& memory) {
        touches_ = memory.touches, counters_ = memory.counters;
        lie_as(memory);
        given_ = memory.given, begun_ = memory.begun, by_rows_ = memory.by_rows;
        resting_solver_.be_patient(memory.resting);
        impact_solver_.be_patient(memory.impact);
        parting_solver_.be_patient(memory.parting);
    }

    /// Force [N] on `body` from `other` (or from all if −1), mean over the step.
    Vec3 force(int body, int other) const noexcept;
    /// Points that push or are closed.
    int count() const noexcept;
    /// Largest depth [m] among this step's points, at its start.
    double penetration() const noexcept;
    /// Points that push or are closed, ten numbers each: place [m], normal onto the first body, force [N] on it,
    /// coefficient of friction. The first `most` of them in order of bodies; NaN where there are fewer.
    void points(int most, double* out) const noexcept;

    ContactCounters counters() const noexcept { return counters_; }
    BlockLdlt::Counters factor_counters() const noexcept;
    double residual() const noexcept { return residual_; }  // the last solve's or blow's rows_residual(), m/s
    /// A body whose rows the last solve left further from their law than `unsettled_residual`; −1 if there is none.
    int unsettled_body() const noexcept { return unsettled_body_; }
    double unsettled_by() const noexcept { return unsettled_by_; }  // m/s
    bool unsettled_sunk() const noexcept { return sunk_; }          // and not for what a row is off by

private:
    using Point = StepPoint;
    void add_point(const Contact& contact, const Pose& first, const Pose& second, double strike);
    void lie_as(const Memory& memory);
    void rouse(const Contact& contact);
    bool sleeps(int body) const noexcept { return asleep_[body] != 0; }
    void orient(Point& point, const Pose& first, const Pose& second);
    PairMaterial material(const Contact& contact) const noexcept {
        return combined(materials_[contact.first], materials_[contact.second]);
    }
    const PointRest& rest(const Point& point) const noexcept {
        static constexpr PointRest none{};
        return point.rest < 0 ? none : rests_[point.rest];
    }
    PointRest& own_rest(Point& point) {
        if (point.rest < 0) {
            point.rest = static_cast<int>(rests_.size());
            rests_.emplace_back();
        }
        return rests_[point.rest];
    }
    void find_open();
    void find_open_again();
    bool is_blow(const Point& point) const noexcept;
    bool blows_come_first();
    bool find_left_out(const std::vector<Vec6>& velocity);
    void look_at(const std::vector<IndexPair>& near);
    OpenPair opened(const IndexPair& pair, const Separation& apart) const;
    bool let_pass(std::size_t from);
    bool passes_by(const Point& point, double overlap) const;
    int find_strikes(const std::vector<Vec6>& velocity, bool late);
    bool find_turned(const std::vector<Vec6>& velocity);
    bool is_known(const Contact& contact, std::size_t from, std::size_t end, double size, bool& named) const;
    bool add_strike(IndexPair pair, const Pose& first, const Pose& second, double time,
                    const std::vector<Vec6>& velocity, bool late);
    bool add_strike_at_start(const OpenPair& open, double time, const std::vector<Vec6>& velocity);
    void take_back_strikes(std::size_t from, const std::vector<Vec6>& velocity);
    void find_events();
    // contact_carried.cpp
    void note_pressing(Point& point);
    void find_carried();
    bool climbs(int body) const;
    bool lifts(const Point& point) const;
    void let_go(int body, const Vec6& velocity);
    Vec3 whole_fall(int body, Vec3 after) const;
    void book_carried(const MixedSystem& system);
    void order_points();
    void measure_points();
    void measure(Point& point) const;
    double margin_of(std::size_t body, const std::vector<Vec6>& velocity,
                     const std::vector<Vec6>& other) const;
    bool reachable(const Contact& contact) const;
    RowBlock row_block(const Point& point, int rows) const;
    void add_turning_rows(const Point& point, RowBlock& block) const;
    void add_friction(const Point& point, int block, std::vector<FrictionPoint>& friction) const;
    double carried(const Point& point, Vec3 direction) const noexcept;
    double relative(const Point& point, Vec3 direction, const std::vector<Vec6>& velocity,
                    bool only_prescribed) const;
    FrictionReport run(MixedSystem& system, std::vector<FrictionPoint>& points, IslandSolver& solver,
                       FrictionModel model, const std::vector<char>* answered = nullptr);
    const Islands& hanging(const MixedSystem& system, std::size_t joints) const;
    int island_of(const Islands& islands, const Point& point) const noexcept;
    bool is_hit(const RowBlock& block) const noexcept;
    bool stop_is_hit(const MixedSystem& system) const;
    bool stop_comes_first(const MixedSystem& system, std::size_t known, const std::vector<Vec6>& next);
    bool pass_other_ends(const MixedSystem& system, std::size_t joints);
    void find_earliest_blows(MixedSystem& system, std::vector<std::size_t>& who);
    void lead_forces(std::size_t body, MixedSystem& system);
    Vec6 way_until(std::size_t body, double time) const;
    double gap_at(const Point& point, double time) const;
    double both_known(const Point& point) const noexcept;
    double closing_time(const Point& point) const;
    void lead_point(Point& point);
    void take_part(MixedSystem& system, const std::vector<std::size_t>& who,
                   std::vector<RowBlock>& rows) const;
    void share_blow(MixedSystem& hit, std::size_t joints, const std::vector<std::size_t>& who) const;
    void hit_exactly(MixedSystem& hit, std::size_t joints, std::vector<FrictionPoint>& friction,
                     FrictionModel model);
    void after_impact(const MixedSystem& system);
    void mark_held(const MixedSystem& system);
    void move_on(const MixedSystem& system, std::vector<Vec6>& next);
    bool outrun(const std::vector<Vec6>& velocity);
    double slop(const OpenPair& open) const noexcept;
    double sunk_by(const Point& point, bool late) const;
    void index_points();
    void leave_out_what_others_keep_off(std::vector<Meeting>& meetings, const std::vector<Vec6>& velocity);
    bool keeps_off(const Meeting& earlier, const Meeting& later, int body,
                   const std::vector<Vec6>& velocity) const;
    bool is_seam(const Mover& moving, int body, const Mover& other, const OpenPair& open,
                 const std::vector<Vec6>& velocity, double time, bool late, Vec3 facing = {}) const;
    Pose moved(int body, const std::vector<Vec6>& velocity) const;
    Mover mover(int collider, const Pose& pose, const std::vector<Vec6>& velocity) const;
    double meeting(const OpenPair& open, const std::vector<Vec6>& velocity, bool late) const;
    bool passes(const OpenPair& open, const std::vector<Vec6>& velocity) const;
    double resting_right(Point& point) const;
    bool is_pressed(const Point& point) const noexcept;
    RowBlock resting_row(Point& point) const;
    Touch& record(const MixedSystem& system, const Point& point, double normal, Vec3 along);
    double pressed(const MixedSystem& system, const Point& point) const;
    Vec3 read_back(const RowBlock& block, Point& point);
    // contact_iterative.cpp: the same by sweeps over compact contacts
    bool solve_by_sweeps(MixedSystem& system, bool& left);
    void foresee(MixedSystem& system, std::size_t known, int round);
    struct Unanswered {
        std::vector<int> island;          // of each point
        std::vector<char> open;           // islands to be solved
        std::vector<std::size_t> points;  // of each
        std::size_t largest = 0;          // points of one of those
    };
    const Unanswered& find_unanswered(std::size_t bodies, std::size_t known);
    bool find_more(bool over);
    void take_in(std::size_t known);
    void note_sinking();
    bool is_settled(MixedSystem& system);
    bool runs_away(const MixedSystem& system) const;
    void hand_over();
    void judge(const MixedSystem& system, const std::vector<FrictionPoint>& points,
               const FrictionReport& report);
    void judge_blow(const MixedSystem& hit, const std::vector<FrictionPoint>& points, FrictionModel model);
    void blame(double residual, int unknown);
    void blame_sunk();
    void shorten_unsettled(MixedSystem& system, std::size_t joints, const std::vector<char>& pushes,
                           std::vector<double>& share) const;
    void correct_events(const MixedSystem& system);
    // contact_parting.cpp
    void find_given();
    void note_given();
    double way(int body, const std::vector<Pose>& poses) const;
    void find_beside(const std::vector<Pose>& poses, double margin);
    void add_lap(const Contact& contact, const std::vector<Pose>& poses, double excess);
    double find_overlaps(const std::vector<Pose>& poses, bool again);
    double look_for_overlaps(const std::vector<Pose>& poses, double margin, bool again);
    double find_overlaps_beside(const std::vector<Pose>& poses, double margin);
    bool keep_parted(const std::vector<Pose>& poses);
    bool parts_far(const Lap& lap) const noexcept;
    void note_far();
    bool is_looked_at(int a, int b) const noexcept {
        return looked_at_.empty() || looked_at_[a] != 0 || looked_at_[b] != 0;
    }
    bool is_deep(const Contact& contact) const noexcept { return contact.point.gap <= -slack(contact); }
    double parting_speed(const Lap& lap, bool again) const;
    bool part_directly(MixedSystem& parting, bool again);
    bool part_by_sweeps(MixedSystem& parting, bool again);
    void find_gives(const MixedSystem& parting);
    double give_of(const Contact& contact, const std::vector<double>& gives) const noexcept;
    void hold_joints(MixedSystem& parting, double least) const;
    void note_parted(const MixedSystem& parting);
    bool is_supplied(const Contact& contact) const;
    double time_left(const Point& point) const noexcept;
    double explained_depth(const Point& point) const noexcept;
    double moving_size(const Contact& contact) const noexcept;
    double slack(const Contact& contact) const noexcept;
    double size(const Contact& contact) const noexcept;
    double gap(const Contact& contact) const noexcept;
    bool is_closed(const Contact& contact, double gap) const noexcept;
    bool is_closed(const Contact& contact) const noexcept { return is_closed(contact, contact.point.gap); }

    Detection detection_;
    std::shared_ptr<Team> team_;  // of several threads, or none
    SharedValues<SurfaceMaterial> materials_;
    std::vector<int> unknown_, body_of_;  // index of a body in MixedSystem, or −1; and back
    ContactOptions options_;
    std::vector<IndexPair> joints_;
    std::vector<char> jointed_;  // bodies with rows of joints
    bool conveys_ = false;       // some surface moves along itself
    bool supplies_ = false;      // or, in this step, something that does not move by itself
    bool oriented_ = false;      // some surface has a friction that differs with the direction
    bool resists_turning_ = false;
    bool swings_ = false;     // some surface has sides: what turns on it may meet elsewhere
    std::vector<char> ball_;  // bodies whose only surface is a sphere round their centre
    IslandSolver resting_solver_, impact_solver_, parting_solver_;
    ContactSweeps sweeps_, parting_sweeps_;
    MixedSystem parting_system_;
    Parting parting_;
    std::vector<char> yielding_;
    std::vector<double> gives_;      // of contacts of jointed bodies, see find_gives(), 1/kg
    double expected_overlap_ = 0.0;  // of the last step: how near to look at balls, no more
    LargeArray<Lap> laps_, parted_;  // points of the step's pairs where it ends; of all its partings
    std::vector<Pose> lap_poses_;    // where bodies were at the last of them
    bool far_ = false;               // the last may not have been enough, see parts_far()
    std::vector<char> looked_at_;    // for whom not, by body; empty: for anybody
    DepthOfPair given_;              // by pair: overlap the scene began with, as far as it is left, m
    bool begun_ = false;             // whether it is known
    bool by_rows_ = false;       // sweeps over few joints and contacts have failed: they are solved directly
    bool ran_away_ = false;      // in this solve: islands that are not too large are solved directly
    std::vector<Vec6> next_;     // velocities between sweeps, per body of the scene
    std::vector<char> changed_;  // who has another than at the look before: the rest was judged then
    std::size_t handed_over_ = 0, ordered_ = 0;  // points the sweeps have; points in order
    Unanswered unanswered_;
    std::vector<Touch> unordered_;
    LargeArray<OpenPair> merged_;
    mutable ContactArrays arrays_;  // what is in them is of one call

    std::vector<Pose> poses_;
    std::vector<Vec6> velocity_, kick_, predicted_;  // v, h M⁻¹ f, and what bodies are swept with
    LargeArray<OpenPair> open_;
    int met_ = 0;                         // of them
    std::vector<IndexPair> open_bodies_;  // of each, to look through many that nobody moved; empty: not yet
    std::vector<Separation> apart_;       // of pairs, found on several threads
    std::vector<std::vector<Meeting>> meetings_;  // found by each thread
    std::vector<MeetingOf> meetings_of_;          // by body and time
    std::vector<IndexPair> beside_, seams_;       // pairs without points, where others part; those let in
    std::vector<IndexPair> near_;                 // where the search was widened
    std::vector<int> grown_;                      // whom it was widened for
    std::vector<char> supported_;                 // bodies that closed contacts carry
    struct Pressing {                             // of a closed point: whom the forces press on the other one
        int first, second;
        bool first_presses, second_presses, both;  // on each other, carried or not
    };
    std::vector<Pressing> pressing_;
    std::vector<Vec6> carried_kick_;  // what supports took of a body's kick until they let it go
    std::vector<double> depth_;       // of a body's closed contacts, m
    std::vector<double> sinking_;     // what sweeps that have not settled would add to it in this step, m
    std::vector<Contact> scratch_;
    std::vector<int> points_of_, points_begin_;  // points by moving body, and where each one's begin
    std::vector<int> root_;
    std::vector<std::uint64_t> known_;
    std::vector<double> lead_, event_time_;
    std::vector<double> clock_;  // of successive blows: up to when a body's way in the step is known, s
    std::vector<Vec6> way_;      // and that way, m and rad
    LargeArray<Point> points_, strikes_;
    std::vector<PointRest> rests_;                                               // of points, in no order
    std::vector<std::pair<std::uint64_t, std::size_t>> places_, parted_places_;  // of points, by key
    std::vector<Touch> touches_;           // of the last step until the end of solve()
    std::vector<Touch> kept_;              // of sleepers
    std::vector<char> asleep_;             // by body; empty while none has slept
    std::vector<int> roused_;              // sleepers met in this step
    std::vector<double> margin_, search_;  // where bodies may get, and where they are looked for, m
    std::vector<char> held_;               // moving bodies with rows, by unknown
    std::vector<Vec6> prescribed_;  // velocities of bodies that do not move by themselves, zero for the rest
    std::vector<Vec6> correction_;
    bool impact_needed_ = false;
    bool foreseen_ = false;       // the step's next solve starts from foresee()
    bool settling_ = false;       // sweeps go on: what bodies do so far is not what they will
    bool late_blow_ = false;      // a strike found after the solve needs an impact
    bool plastic_first_ = false;  // plastic blows are met in the impact as well
    bool ends_passed_ = false;    // by the last solve
    int impact_rounds_ = 0;
    double residual_ = 0.0, unsettled_by_ = 0.0;
    bool sunk_ = false;
    bool joint_is_worst_ = false;  // of what the last sweeps have left
    int unsettled_body_ = -1;
    ContactCounters counters_;
};

}  // namespace spook
