// The particle pipeline: state, forces, distance rows and their solve, one SPOOK step at a time.
//
// Nodes are the bodies and the world points rows and springs hang from (inverse mass 0, so nothing moves
// them). If the rows form open paths the nodes stand in path order and row k of a path joins neighbours:
// the Schur matrix G M⁻¹ Gᵀ + Sig is then tridiagonal and one pass up and down solves it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "linear/block_ldlt.hpp"
#include "linear/redundant_rows.hpp"
#include "linear/regularisation.hpp"
#include "particles/particle_scene.hpp"
#include "particles/path_order.hpp"
#include "run/recorder.hpp"
#include "run/report.hpp"
#include "run/run_loop.hpp"
#include "run/stage_clock.hpp"
#include "run/stages.hpp"

namespace spook {

inline Vec3 vec_at(const double* p) noexcept { return {p[0], p[1], p[2]}; }

/// |d + s| − |d| − u·s without cancellation: (s² − (u·s)²) / (|d + s| + |d| + u·s), never negative; u = d/|d|.
inline double curvature(Vec3 u, double length, Vec3 s) noexcept {
    const double along = dot(u, s), across = std::max(0.0, dot(s, s) - along * along), moved = length + along;
    return across == 0.0 ? 0.0 : across / (std::sqrt(moved * moved + across) + moved);
}

class ParticleSystem {
public:
    /// Built from the stages; throws std::invalid_argument for those it cannot run, or for rows nobody solves.
    ParticleSystem(const ParticleScene& scene, StageList stages);

    const StageList& stages() const noexcept { return stages_; }

    ParticleSolver solver() const noexcept { return solver_; }
    const std::vector<int>& node_of_body() const noexcept { return node_of_body_; }

    // --- what run_loop asks for ---
    void advance(std::int64_t steps);
    void observe(Recorder& recorder, std::int64_t sample);
    Health health() const noexcept;
    void save();
    void restore();
    std::int64_t block() const noexcept { return block_; }

    /// Back to the start state; `clock` null means stages are not timed.
    void reset(StageClock* clock);
    void count(RunReport& report, std::int64_t steps) const;
    std::vector<double> final_state();

    // --- what the samplers read, at the current sample ---
    Vec3 position(int body) const noexcept { return x_[node_of_body_[body]]; }
    Vec3 velocity(int body) const noexcept { return seen_v_[node_of_body_[body]]; }
    double mass(int body) const noexcept { return scene_.bodies[body].mass; }
    int bodies() const noexcept { return static_cast<int>(scene_.bodies.size()); }
    int rows() const noexcept { return static_cast<int>(scene_.rows.size()); }
    double violation(int row) const noexcept;
    double tension(int row) const noexcept { return -seen_lambda_[slot_of_row_[row]] / h_; }
    double kinetic_energy() const noexcept;
    double potential_energy() const noexcept;

private:
    struct Row {                       // one distance: constants
        int a, b;                      // nodes
        double rest, stiff, diagonal;  // m; w_a + w_b; the same + softness, 1/kg
        double violation_gain, velocity_gain, relaxation, softness, rest_inverse, rest_inverse_square;
    };
    struct Link {  // what this step found out about it
        Vec3 u;
        double length, g, rhs, lambda, pivot_inverse, lower;
    };
    struct SpringNodes {
        int a, b;
        SpringForce spring;
    };

    void lay_out_paths(const std::vector<Path>& paths);
    void lay_out_plain();
    int anchor(Vec3 point);

    template <bool Timed> void advance_by(std::int64_t steps);
    template <bool Timed> void velocity_stage();
    template <bool Timed> void mark(Stage stage) noexcept {
        if constexpr (Timed) clock_->mark(stage);
    }
    void position_stage() noexcept;
    void half_kick_back();
    void find_tensions();

    void apply_central_gravity() noexcept;
    void apply_springs() noexcept;
    void assemble_rows() noexcept;
    void solve_rows();
    void solve_rows_again();  // new right sides, same matrix
    void solve_iterative() noexcept;
    void bend_rows_back() noexcept;
    void correct_curvature();
    void kick_nodes(std::vector<Vec3>& v) const noexcept;

    // particle_paths.cpp: rows in open paths, tridiagonal
    void factor_paths(bool rigid = false) noexcept;
    void substitute_paths() noexcept;
    void kick_paths(std::vector<Vec3>& v) const noexcept;

    // particle_blocks.cpp: rows that branch or close loops, and stiff strings
    void analyse_blocks();
    void factor_blocks();
    void stiffen_strings();
    void substitute_blocks();
    bool rows_hold(std::span<const double> residuals) const;
    void find_contradiction();

    // particle_composition.cpp: symmetric compositions of higher order
    void start_composition();
    void compose(std::int64_t steps);
    void drift_kick(double tau) noexcept;
    void find_kicks() noexcept;
    void constrained_step(double h, int depth);
    bool constrained_stage(double tau, double* history);
    void push(std::vector<Vec3>& v) const noexcept;
    double lengthen_paths(double tau, bool fresh) noexcept;
    void shorten_paths() noexcept;
    void predict_paths(double part) noexcept;
    double lengthen_blocks(double tau, bool fresh);
    void shorten_blocks();
    void factor_rigid_blocks();
    void solve_rigidly();
    void read_composition();

    // particle_kernels.cpp: the same arithmetic with the time loop inside, for scenes that need no more
    void fly(std::int64_t steps) noexcept;
    void swing(std::int64_t steps) noexcept;
    template <bool Curved> void swing_by(std::int64_t steps) noexcept;

    ParticleScene scene_;
    double h_;  // s, of a substep
    StageList stages_;
    ParticleSolver solver_ = ParticleSolver::none;
    bool stiff_strings_ = false, half_step_ = false;
    int corrections_ = 0;  // extra solves per step for the curvature of the rows
    std::vector<CentralField> fields_;
    bool moving_forces_ = false;   // forces that depend on the state
    bool velocity_ready_ = false;  // the velocity stage of the coming step is already done
    std::int64_t block_ = 1024;

    // nodes
    std::vector<Vec3> x_, v_, kick_, steady_kick_, seen_v_, trial_;
    std::vector<double> w_;  // inverse mass, 1/kg
    std::vector<int> node_of_body_, body_of_node_;
    // rows, in path order if they form paths
    std::vector<Row> row_;
    std::vector<Link> link_;
    std::vector<double> seen_lambda_, first_rhs_;
    std::vector<int> slot_of_row_, path_first_;  // path p has rows path_first_[p] … path_first_[p+1] − 1
    std::vector<SpringNodes> springs_;
    // the saddle system [[M, Gᵀ], [G, −Sig]] of rows that branch, close loops or stiffen the bodies
    struct RowBlocks {
        int row, a, b;  // block of the row, edges to its bodies; −1 where a world point stands
        int between;    // edge between its bodies, for string stiffness
    };
    BlockLdlt ldlt_;
    std::vector<int> block_of_node_;
    std::vector<RowBlocks> row_blocks_;
    std::vector<double> saddle_rhs_, saddle_;
    std::int64_t operations_at_start_ = 0;
    RedundantRows redundant_;
    int contradicted_ = -1;  // a body held by rows that cannot hold together
    double residual_ = 0.0;
    std::int64_t sweeps_ = 0;

    // compositions
    bool composed_ = false, lost_ = false;
    double pending_ = 0.0;          // s: half a stage still to be kicked (with rows) or drifted (without)
    std::int64_t stage_steps_ = 0;  // steps the history has seen
    std::int64_t newton_iterations_ = 0, halved_steps_ = 0;
    static constexpr int MOST_HALVINGS = 12;
    std::vector<Vec3> step_x_[MOST_HALVINGS], step_v_[MOST_HALVINGS];  // where each step began
    std::vector<double> upper_;    // super-diagonal of the Newton matrix of paths, per row
    std::vector<double> impulse_;  // of rows before an iteration, N s
    std::vector<double> history_;  // stages × three steps × rows, N

    struct Snapshot {
        std::vector<Vec3> x, v;
        std::vector<double> lambda, history;
        double pending = 0.0;
        std::int64_t stage_steps = 0, newton_iterations = 0, halved_steps = 0;
        bool velocity_ready = false;
        std::int64_t sweeps = 0;
        double residual = 0.0, share = 0.0;
    } saved_;
    StageClock* clock_ = nullptr;
};

}  // namespace spook
