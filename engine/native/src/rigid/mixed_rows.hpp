// Rows with bounds and contacts beside those of joints that all hold: impacts, and the velocities of the step, by pivoting,
// Newton's method or projected Gauss–Seidel; see solve_velocities.cpp, detect.cpp and impact.cpp.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "contacts/contact_stage.hpp"
#include "contacts/pivot_solver.hpp"
#include "rigid/forces.hpp"
#include "rigid/load_dependent_bounds.hpp"
#include "rigid/row_curvature.hpp"
#include "rigid/step_scratch.hpp"

namespace spook {

/// Mass and inertia of a body where it is.
void fill_mass(const BodyConstants& body, const BodyState& at, Mat6& mass) noexcept;

class MixedRows {
public:
    MixedRows(const RigidModel& model, RigidState& live, JointSet& joints, Forces& forces,
              RowCurvature& curvature, StepScratch& scratch, const StageTimer& clock) noexcept
        : model_(model),
          live_(live),
          joints_(joints),
          forces_(forces),
          curvature_(curvature),
          scratch_(scratch),
          clock_(clock) {}

    MixedSystem system;  // rows of joints first, block by block, then those of a step's contacts
    std::uint64_t rounds = 0, pgs_iterations = 0;
    bool stops_are_apart = false;  // none is connected to another

    /// Which stages run here.
    void take_stages(RigidModel& model);
    /// The surfaces that may touch, of a scene with the stage collision; `dynamic` bodies are constrained then.
    void take_contacts(const RigidScene& scene);
    void begin();
    /// Once more from the start of the run.
    void begin_again();
    bool follow_load() const noexcept { return !load_dependent_.empty(); }

    /// The contacts of a run, and whether there can be any; null without the stage.
    ContactStage* contacts() noexcept { return contacts_ ? &*contacts_ : nullptr; }
    const ContactStage* contacts() const noexcept { return contacts_ ? &*contacts_ : nullptr; }
    const ContactStage* surfaces() const noexcept { return fresh_contacts_ ? &*fresh_contacts_ : nullptr; }
    bool may_touch() const noexcept { return fresh_contacts_ && fresh_contacts_->possible(); }
    /// Whether the step has any.
    bool touching() const noexcept { return touching_; }
    void clear_touching() noexcept { touching_ = false; }

    /// The stage: contact points of the step.
    void detect();
    /// In a step that began without contacts, whether bodies meet because of what joints make of their velocities,
    /// scratch.next: cast along their own they do not. Then the step is to be solved with contacts.
    bool find_late_contacts();
    /// The stages: impacts, and velocities of all bodies that have rows.
    void solve(bool touching);

    /// Of a block of rows of joints, as the last solve had it, which may have been that of `rows`.
    const double* jacobian(const BlockRows& rows, int block, bool second) const noexcept {
        if (live_.last_rows != LastRows::mixed) return rows.jacobian(block, second);
        const RowBlock& of = system.rows[block];
        return (second ? of.second_jacobian : of.first_jacobian)[0].data();
    }
    double* jacobian(BlockRows& rows, int block, bool second) noexcept {
        return const_cast<double*>(std::as_const(*this).jacobian(rows, block, second));
    }

    /// The bodies of a row of joints beyond its first two: into it those that move by themselves, of others their speed.
    void fill_further(int block, RowBlock& rows, BlockRight& numbers, std::vector<FurtherBody>& beyond) const;
    BlockLdlt::Counters counters() const noexcept { return pivot_.counters(); }

private:
    void note_start_of_contacts();
    void act_before_events();
    void impact();
    void fill_momenta(bool forces);
    void fill_rows(bool solved = false);
    static RowBlock other_end(const RowBlock& block);
    void begin_solve(bool touching);
    bool find_stops();
    bool find_pushes();
    void move_to_impact(StepMotion& motion);
    double leading_work(std::size_t block) const;
    bool is_driven(const JointBlock& block) const;
    bool leave_open();
    void take_velocities(bool angular_too, const std::function<bool(int)>& untouched);
    void take_multipliers();
    bool solve_joints();
    bool iterate_joints();
    bool settle_joints();
    double pgs_tolerance() const;
    void judge_pgs();
    void judge_contacts();

    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    Forces& forces_;
    RowCurvature& curvature_;
    StepScratch& scratch_;
    const StageTimer& clock_;
    std::vector<std::vector<FurtherBody>> further_;  // per block of joints, of its rows
    PivotSolver pivot_;
    LoadDependentBounds load_dependent_;
    bool breaks_ = false;  // whether some joint may
    bool touching_ = false;
    std::optional<ContactStage> contacts_, fresh_contacts_;
};

/// By tree of joints: whether a body of it touches something. It may spin otherwise after the step than before it, and its joints
/// do not follow how it turns.
void find_what_touches(const ContactStage* contacts, std::span<const BodyConstants> bodies,
                       const JointSet& joints, std::vector<char>& touched);
bool follows_turns(const JointSet& joints, const JointBlock& block,
                   const std::vector<char>& touched) noexcept;

}  // namespace spook
