// The rigid-body stepper: what a step needs, in the order of the step, and nothing else.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "contacts/contact_stage.hpp"
#include "contacts/pivot_solver.hpp"
#include "linear/block_ldlt.hpp"
#include "linear/dense_rows.hpp"
#include "linear/redundant_rows.hpp"
#include "rigid/joint_set.hpp"
#include "rigid/joint_tree.hpp"
#include "rigid/load_dependent_bounds.hpp"
#include "rigid/locked_tree.hpp"
#include "rigid/plane_step.hpp"
#include "rigid/run_state.hpp"
#include "rigid/sleep.hpp"
#include "rigid/step_scratch.hpp"
#include "run/quantities.hpp"
#include "run/run_loop.hpp"
#include "run/stage_clock.hpp"
#include "run/stages.hpp"

namespace spook {

/// How a step's rows are solved: block is one factorisation, for bilateral rows; pivot and iterative know bounds.
enum class RigidSolver { none, block, pivot, iterative };

/// One scene with its state. One step of h, symplectic order:
///   forces → p = M v + h f;  contacts → impact;  joints → rows;  one solve → v₊, λ;
///   positions and orientations with v₊.
/// Bodies that can never have rows are moved directly. The angular momentum of a body is its state, so that a
/// free body keeps it to the last bit. A step in which nothing touches is solved as if contacts were impossible.
class RigidSystem {
public:
    /// Built from the stages; throws std::invalid_argument for those it cannot run, or joints that no stage solves.
    /// It has a state once it was reset.
    RigidSystem(const RigidScene& scene, StageList stages);

    const StageList& stages() const noexcept { return stages_; }
    /// How stages run that have several ways, for those that ask.
    void tell(StageChoices& choices) const;

    // For run_loop:
    void advance(std::int64_t steps);
    void observe(Recorder& recorder, std::int64_t sample);
    Health health() const;
    void save() {
        keep(saved_);
        work_kept_ = work_done();
    }
    void restore() {
        go_back(saved_);
        work_taken_back_ = work_taken_back_ + (work_done() - work_kept_);
        replaying_ = true;
        early_joints_.clear();
    }
    /// Fewer steps between two checks, the larger the scene: they are taken back together.
    std::int64_t block() const noexcept { return std::clamp<std::int64_t>(200'000 / bodies(), 16, 64); }

    struct Snapshot;
    /// All that the coming steps depend on, drives apart; going back to it gives the bits of going on from it. Where
    /// velocities were looked ahead for with contacts, it is what was before, and they are found again: what their
    /// contacts left for the end of the step is too much to keep.
    void keep(Snapshot& kept) const;
    void go_back(const Snapshot& kept);

    // What may be set between steps, from outside; reset() takes nothing of it back.
    /// Where the next reset() begins: 13 numbers per body, as final_state() gives them.
    void place(std::span<const double> state);
    void set_load(int body, Vec3 force, Vec3 torque);
    void set_velocity(int body, Vec3 velocity, Vec3 angular_velocity);
    void set_motor(int joint, double speed, double max_force) {
        if (joints_.set_motor(joint, speed, max_force)) wake_joint(joint);
    }
    void set_rest(int joint, double rest) {
        catch_up();
        if (joints_.set_rest(joint, rest)) wake_joint(joint);
    }

    void reset(StageClock* clock);
    RigidSolver solver() const noexcept { return solver_; }
    void count(RunReport& report, std::int64_t steps) const;
    using Unsettled = spook::Unsettled;
    const Unsettled& unsettled() const noexcept { return live_.unsettled; }
    std::vector<double> final_state();
    /// The same without a solve: velocities are NaN.
    std::vector<double> places() const;
    void judge_energy(RunReport& report) const;  // energy_made.cpp

    // What can be observed:
    int bodies() const noexcept { return static_cast<int>(constants_.size()); }
    const BodyConstants& constants(int body) const noexcept { return constants_[body]; }
    const BodyState& state(int body) const noexcept { return live_.bodies[body]; }
    Vec3 position_of(int body) const noexcept { return position(constants_[body], live_.bodies[body]); }
    Quat orientation_of(int body) const noexcept { return orientation(constants_[body], live_.bodies[body]); }
    double kinetic_energy() const noexcept;
    double potential_energy() const noexcept;
    const JointSet& joints() const noexcept { return joints_; }
    JointSet& joints() noexcept { return joints_; }
    /// Samples will read velocities or forces: where those live between the samples they are looked up for it.
    void see_velocities() noexcept { velocities_seen_ = true; }
    void violation(int joint, double* out) const { joints_.violation(joint, live_.bodies, out); }
    double coordinate(int joint) const { return joints_.coordinate(joint, live_.bodies); }
    /// Force and torque on the second body at the joint in the last step [N, N m], world axes.
    void wrench(int joint, double* out) const noexcept;
    /// Tension of a distance in the last step [N], positive where it pulls.
    double tension(int joint) const noexcept;
    /// Force [N] on `body` from `other` (−1: from all) in the last step; count and depth of its contact points.
    Vec3 contact_force(int body, int other) const noexcept {
        return contacts_ ? contacts_->cache().force(body, other, h_) : Vec3{};
    }
    int contact_count() const noexcept { return contacts_ ? contacts_->cache().count() : 0; }
    void contact_points(int most, double* out) const noexcept {
        if (contacts_) contacts_->cache().tell(most, h_, out);
        else std::fill_n(out, CONTACT_NUMBERS * most, std::numeric_limits<double>::quiet_NaN());
    }
    double penetration() const noexcept { return contacts_ ? contacts_->cache().penetration() : 0.0; }

public:
    /// What solves of the next step start from.
    struct WarmStart {
        MixedSystem mixed;
        RedundantRows::Memory redundancy;
        std::vector<double> jacobians;  // of the last step, which the stiffness of the next is made of
    };
    struct Snapshot {
        RigidState state;
        JointStates joints;
        WarmStart warm;
        ContactStage::Snapshot contacts;
    };

private:
    int find_whirling(std::span<const int> bodies);
    const char* cause(bool known = false) const noexcept;
    // rigid_loads.cpp: what follows the time, and fluids
    void take_loads(const RigidScene& scene);
    void follow_time();
    void find_loads(double time);
    struct SpringEnd {
        Vec3 place, velocity, arm;  // the arm in world axes
    };
    SpringEnd spring_end(const End& end) const noexcept;
    void pull_aside(const SpringForce& spring) noexcept;
    void add_fluid(const Fluid& fluid, int body, Vec3& force, Vec3& torque) const noexcept;
    void add_geometric_stiffness();
    void find_tensions();
    void find_islands();
    void keep_angular_momentum();
    struct IslandFrame {
        Vec3 centre;
        Mat3 inertia;
    };
    IslandFrame island_frame(const std::vector<int>& members) const;
    Vec3 turn_of(const std::vector<int>& members, Vec3 centre, Vec3 angular_momentum) const;
    struct Loop;
    void find_loops();
    void judge_loops();
    void take_probe(Loop& loop, double part);
    void watch_redundancy();
    void watch(Loop& loop, RigidState::Watched& seen);
    double motion_of(const Loop& loop) const;
    double driven(const Loop& loop);
    bool find_repeated(Loop& loop);
    bool stops(const RigidState::Watched& seen, double motion) const noexcept;
    void note_locked(const Loop& loop);
    void note_projected();
    std::vector<double> shares(const Loop& loop) const;
    void find_extents(Loop& loop);
    void take_stages(const RigidScene& scene);
    void step();
    void deliver();
    void begin_step();
    void begin_velocities();
    void keep_first_joints();
    void end_step();
    void find_velocities();
    void solve_ahead();

    // rigid_half_step.cpp: velocities at mid-step and the curvature of the rows
    void make_room_for_half_step();
    void start_half_step();
    void start_half_step_touching();
    void read_half_step();
    void find_bias(double* bias) const;
    void move_all(double h);
    void violations_at(const LargeArray<BodyState>& at, double* out) const;
    double row_speed(int block, int row, bool solved) const;
    void curve_rows(bool solved);
    // energy_made.cpp:
    void begin_energy();
    bool has_power() const noexcept;
    void note_energy();
    void take_solution(int k, BodyState& s) const noexcept;
    double bend(std::size_t row) const noexcept { return bend_.empty() ? 0.0 : bend_[row]; }
    void bend_rows_back();
    void correct_curvature();

    // wake.cpp, sleep.cpp
    void take_sleep(const RigidScene& scene);
    void begin_sleep();
    bool asleep(int body) const noexcept { return live_.sleep.sleepers > 0 && live_.sleep.island[body] != 0; }
    bool rests(int block) const noexcept;
    bool rests(const std::vector<int>& parted) const;
    void leave_out_sleepers();
    void leave_out_sleepers_for_now();
    bool all_sleep() const noexcept;
    void sleep_through();
    bool wake_met();
    void keep_jacobians();
    bool is_moving(int body) const noexcept;
    void wake();
    void wake(const std::vector<int>& met);
    void mark_moving(int body);
    void wake_joint(int joint);
    void note_places();
    bool still(int body) const noexcept;
    void sleep();

    // rigid_plane.cpp: steps by numbers of a plane
    bool may_lie_in_plane(const RigidScene& scene) const;
    bool plane_velocities();
    void move_in_plane();
    void take_plane();
    void leave_plane();
    void write_plane();
    bool wants_look();

    // rigid_composition.cpp: symmetric compositions of higher order
    void start_composition();
    void compose(std::int64_t steps);
    void composed_step(double h, int depth);
    double tension_rate(double allowed);
    void look_at_tension();
    bool composed_stage(double tau, std::size_t stage);
    bool hold_stage(double tau, double span, std::size_t stage);
    void guess(std::size_t stage, double span);
    void remember(std::size_t stage, double span);
    void forget(std::size_t stage);
    void catch_up();
    void kick_all(double span);
    void push(const double* multipliers);
    double violations_ahead(double tau);
    void prepare_hold();
    bool factor_dense();
    bool iterate(double tau, bool dense);
    bool hold_rows(double tau);
    void mix(int iteration, int& kept);
    void read_composition();

    void assemble_blocks();
    void fill_inertias();
    void fill_block_momenta();
    void take_block_solution();
    void apply_forces();
    void find_forces();
    void kick_free_body(int body) noexcept;
    void detect();
    bool meet_late();
    void fill_masses();
    void fill_momenta(bool forces);
    void fill_rows(bool solved = false);
    static RowBlock other_end(const RowBlock& block);
    bool find_other_ends();
    bool solve_joints();
    bool settle_joints();
    double pgs_tolerance() const;
    void fill_further(int block, RowBlock& rows, BlockRight& numbers, std::vector<FurtherBody>& beyond) const;
    void impact();
    void take_velocities(bool angular_too, const std::function<bool(int)>& untouched);
    void note_unsettled(int body, double residual, bool sunk = false);
    void judge_pgs();
    void judge_contacts();
    void solve_block();
    void solve_locked();
    struct
        Worst {  // row residual, its block, and the largest speed that rows and forces ask for, m/s or rad/s
        double residual = 0.0, speed = 0.0;
        int block = 0;
    };
    Worst worst_row(std::span<const double> left) const;
    bool settled(std::span<const double> left) const;
    bool factor_and_solve();  // false when nothing it gives may be used
    void solve_again();       // new right sides, same matrix
    void find_contradiction();
    int body_of(int row_block) const noexcept;
    int busiest_block() const noexcept;
    void solve_velocities();
    void solve_mixed(bool touching);
    bool iterate_joints();
    // project_positions.cpp: overlaps are removed by positions
    void note_start_of_contacts();
    void project_overlaps();
    void project_limits();
    void gather_islands();
    void project_bodies();
    double affordable_share(int island) const;
    bool project_island(int island, double share);
    bool take_back(int island);
    bool keep_energy(int island);
    bool hold_joints(const std::vector<int>& members, const std::vector<int>& own_blocks);
    void keep_spin_energy(int body);
    bool keep_momenta(const std::vector<int>& members, double limit);
    double dissipated_energy(const std::vector<int>& members, const std::vector<int>& own_blocks) const;
    double lifting_energy(const std::vector<int>& members) const;
    Vec3 force(int body) const {
        const Vec3 f = constants_[body].mass * acceleration_[body];
        return force_.empty() ? f : f + force_[body];
    }

    void integrate();
    void project_positions();
    void analyse_block();
    double* jacobian(int block, bool second) noexcept;
    /// The bodies of a block of rows as they follow each other: its first, its second, those beyond; and the Jacobian of
    /// one, rows × 6, as assembled for the block matrix.
    int ends(int block) const noexcept { return 2 + static_cast<int>(places_[block].other_edges.size()); }
    int end_body(int block, int end) const noexcept {
        const JointBlock& both = joints_.blocks()[block];
        return end == 0 ? both.first : end == 1 ? both.second : joints_.others(block)[end - 2];
    }
    const double* end_rows(int block, int end) const noexcept {
        return end < 2 ? jacobian(block, end == 1) : wide_.data() + places_[block].wide_at + 6 * (end - 2);
    }
    Vec3 place(const End& end) const noexcept { return end.body < 0 ? end.point : position_of(end.body); }
    double share(int body) const noexcept { return share_.empty() ? 1.0 : share_[body]; }
    const double* jacobian(int block, bool second) const noexcept {
        return const_cast<RigidSystem*>(this)->jacobian(block, second);
    }
    Vec3 kick(int body) const noexcept {  // change of velocity by forces in a step
        Vec3 dv = h_ * acceleration_[body];
        if (!force_.empty()) dv += (h_ / constants_[body].mass) * force_[body];
        return share_.empty() ? dv : share_[body] * dv;
    }
    Vec3 twist(int body) const noexcept { return share(body) * h_ * constants_[body].torque; }
    void lead_events();

    // The scene.
    StageList stages_;
    LargeArray<BodyConstants> constants_;
    LargeArray<BodyState> start_;
    std::vector<Vec3> acceleration_;                      // gravity and loads
    std::vector<SpringForce> springs_, turning_springs_;  // between centres; beside them
    std::vector<CentralField> fields_;
    std::vector<TimeDrive> drives_;
    std::vector<Fluid> fluids_;
    std::vector<std::vector<Collider>> floaters_;  // per body
    std::vector<int> load_follows_;                // bodies whose load changes from step to step
    struct Load {
        Vec3 force, torque;
    };
    std::vector<Load> steady_;  // per body, if some follow: the part of its load that does not change
    Vec3 gravity_;
    RigidMethod method_;
    double h_ = 0.0;  // of one substep
    RigidSolver solver_ = RigidSolver::none;

    // The state.
    RigidState live_;
    Snapshot saved_, before_solve_ahead_;  // the latter: before solve_ahead(), with contacts
    Snapshot before_waking_;               // before the velocities of a step in which some body may wake
    JointSet joints_;
    bool replaying_ = false;                    // a block that ended unfit
    LargeArray<JointSet::State> early_joints_;  // then: as its first step left them

    // One step's work.
    std::vector<Vec3> force_;         // of springs and centres, per body
    std::vector<int> constrained_;    // dynamic bodies that have rows
    std::vector<int> free_, driven_;  // dynamic bodies that never have rows; kinematic ones
    bool constrained_are_moved_ = false;
    std::vector<int> solver_index_;  // per body: its place among the constrained bodies, −1
    BlockLdlt matrix_;
    RedundantRows redundant_;
    struct Loop {  // joints that close one, and all that is attached to them; see rigid_locking.cpp
        std::vector<int> blocks, members;                // of joints; places among the constrained bodies
        std::vector<int> drives;                         // blocks of motors, limits and springs
        std::vector<int> edges;                          // of matrix_, in the probe's order
        BlockLdlt probe;                                 // matrix_ of these with rigid rows
        bool may_lock = false;                           // whether its redundant rows are watched
        std::vector<double> weakness, repeated, square;  // per row; per unknown; per member, m²

        void repeat();
        double held_back(const LargeArray<BodyConstants>& constants, std::span<const BodyState> bodies,
                         const std::vector<int>& constrained) const;
        bool bends(const JointSet& joints, const LargeArray<BodyConstants>& constants,
                   std::vector<BodyState> along, const std::vector<int>& constrained, double floor) const;
    };
    std::vector<Loop> loops_;
    std::vector<Vec6> push_;  // per constrained body: of drives
    LargeArray<double> right_, solution_;
    struct BlockPlace {
        int first_edge = -1, second_edge = -1;  // in matrix_
        bool first_particle = false, second_particle = false;
        std::vector<int> other_edges;  // of a row over more than two bodies, −1: it does not move by itself
        std::size_t wide_at = 0;       // in wide_
    };
    std::vector<BlockPlace> places_;
    LargeArray<double> spare_;  // Jacobians with nowhere else to go, per block 2 × rows × 6
    std::vector<std::size_t> spare_at_;
    LargeArray<double> wide_;    // Jacobians of the bodies beyond a row's first two
    bool mixed_values_ = false;  // whether the last step's rows are in mixed_ or in matrix_
    MixedSystem mixed_;
    std::vector<std::vector<FurtherBody>> further_;  // per block of joints, of its rows
    PivotSolver pivot_;
    LoadDependentBounds load_dependent_;
    bool breaks_ = false;  // whether some joint may
    std::optional<ContactStage> contacts_, fresh_contacts_;
    std::vector<double> share_;  // of a body's forces that is still to act in this step; empty: all of it
    bool touching_ = false;      // whether the step had any
    PositionProjection limit_projection_;             // of bodies beyond their joints' limits
    const PositionProjection* projection_ = nullptr;  // what is at hand
    StepScratch scratch_;
    PivotSolver holding_pivot_;
    SleepRules sleep_rules_;
    struct Place {
        Vec3 displacement, velocity;
        Quat turn;
    };
    std::vector<Place> start_places_;  // per body: where it was, and how fast, as the step began
    double residual_ = 0.0, residual_before_waking_ = 0.0;  // largest an iterative solve stopped at, m/s
    // Beyond plain SPOOK; all per row of matrix_ unless said otherwise.
    bool composed_ = false, half_step_ = false, stiff_ = false, velocities_seen_ = false;
    LargeArray<BodyState> trial_;          // per body
    bool curved_ = false;                  // whether curve_rows() does the corrections
    LargeArray<BodyState> from_, behind_;  // per body
    std::vector<double> bent_,
        bend_;  // what curve_rows() takes from the right sides: for the way here, and in all
    std::vector<double> first_right_, violation_, bias_, multiplier_;
    LockedTree locked_;          // of plain steps in which all joints are locks that make trees; else empty
    bool undelivered_ = false;   // its multipliers are not in joints_.states yet
    PlaneStep plane_;            // of plain and half-step steps that stay in a plane; else empty
    bool in_plane_ = false;      // whether this run may use it
    bool at_hand_ = false;       // whether the bodies are in it, live_.bodies behind
    bool plane_values_ = false;  // whether the last step's rows are in it
    std::uint64_t plane_solves_ = 0;
    JointTree tree_;
    bool in_tree_ = false;
    std::size_t unknowns_ = 0;  // of a stage: rows, or joint coordinates
    std::vector<double> change_, last_plain_, last_step_, mixing_, extent_;
    std::vector<Mat3> axes_;  // per constrained body, those of its inertia where the stage starts
    bool dense_ = false;
    DenseRows dense_rows_;
    struct Meeting {                    // of two blocks on one moving body
        int block, other, row, column;  // row and column: the first of each
        int end, other_end, body;
    };
    std::vector<Meeting> meetings_;
    std::vector<Mat3> stiffness_;  // per constrained body: h²/4 of its joints' geometric stiffness, kg m²
    std::vector<std::vector<int>> islands_;  // of constrained bodies that nothing holds to the world
    static constexpr int MOST_HALVINGS = 12;
    LargeArray<BodyState> step_start_[MOST_HALVINGS];
    std::uint64_t rows_ = 0, rounds_ = 0, pgs_iterations_ = 0;

    /// Work whose counters go_back() leaves alone, of solvers that are in no memory. How much of it blocks take back
    /// depends on how long they are, and that on the clock: it is no work of the run.
    struct Work {
        BlockLdlt::Counters factors;
        std::uint64_t rounds = 0, pgs_iterations = 0;
        Work operator+(const Work& more) const noexcept;
        Work operator-(const Work& less) const noexcept;
    };
    Work work_done() const noexcept;
    Work work_kept_, work_taken_back_;
    StageClock* clock_ = nullptr;
};

}  // namespace spook
