// The stages of a step: which there are, which of them a scene needs and why, and which a pipeline runs.
//
// A pipeline's choose_stages() looks at a scene once and decides every stage. The system is built from what it kept
// and from nothing else: each part takes the stages it runs, and a stage that no part takes is an error at the start.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "run/named_enum.hpp"

namespace spook {

/// In the order of the step.
SPOOK_NAMED_ENUM(Stage, collision, meet_meshes, apply_gravity, apply_central_gravity, apply_springs,
                 apply_loads, follow_time, apply_fluids, impact, string_stiffness, assemble_rows,
                 couple_joints, hold_wires, wind_wires, tangents, solve_path, solve_block, solve_iterative,
                 pivot, friction, orient_friction, move_surfaces, roll, rub_wires, roll_tyres, rub_joints,
                 break_joints, correct_curvature, half_step, integrate_positions, integrate_rotations,
                 project_positions, sleep, observe)

inline constexpr std::size_t STAGES = static_cast<std::size_t>(Stage::observe) + 1;

struct StageChoice {
    bool kept = false;
    std::string reason, how;  // why; how it is run, where it has several ways

    std::string told() const { return how.empty() ? reason : reason + ": " + how; }
};

/// How a system runs stages.
struct StageNote {
    Stage stage;
    std::string how;
};
using StageNotes = std::vector<StageNote>;

/// One choice per stage, in the order of the step.
using StageChoices = std::array<StageChoice, STAGES>;

/// Words, or what finds them for the facts of a scene.
template <class Facts> struct Reason {
    const char* words = nullptr;
    std::string (*find)(const Facts&) = nullptr;

    constexpr Reason(const char* fixed) noexcept : words(fixed) {}
    template <class Find>
    constexpr Reason(Find found) noexcept
        requires std::convertible_to<Find, std::string (*)(const Facts&)>
        : find(found) {}
    std::string operator()(const Facts& is) const { return words ? words : find(is); }
};

/// Whether a stage is kept for a scene, and the reason for the one or the other.
template <class Facts> struct StageRule {
    Stage stage;
    bool (*keeps)(const Facts&);  // null: never
    Reason<Facts> why, why_not;

    constexpr StageRule(Stage stage, bool (*keeps)(const Facts&), Reason<Facts> why, Reason<Facts> why_not)
        : stage(stage), keeps(keeps), why(why), why_not(why_not) {}
    constexpr StageRule(Stage stage, Reason<Facts> why_not)
        : stage(stage), keeps(nullptr), why(""), why_not(why_not) {}
};

/// One rule per stage, in the order of the step.
template <class Facts> using StageTable = std::array<StageRule<Facts>, STAGES>;

template <class Facts> constexpr bool is_in_order(const StageTable<Facts>& table) {
    for (std::size_t k = 0; k < STAGES; ++k)
        if (table[k].stage != static_cast<Stage>(k)) return false;
    return true;
}

template <class Facts> StageChoices choose_by(const StageTable<Facts>& table, const Facts& is) {
    StageChoices choices;
    for (std::size_t k = 0; k < STAGES; ++k) {
        const bool kept = table[k].keeps && table[k].keeps(is);
        choices[k] = {kept, kept ? table[k].why(is) : table[k].why_not(is)};
    }
    return choices;
}

/// The stages in whose loops a stage is done where it has none of its own: the first of them that is kept has its time.
inline std::vector<Stage> hosts(Stage stage) {
    switch (stage) {
        case Stage::meet_meshes: return {Stage::collision};
        case Stage::apply_springs: return {Stage::apply_central_gravity};
        case Stage::apply_loads:
            return {Stage::apply_gravity, Stage::apply_springs, Stage::apply_central_gravity};
        case Stage::string_stiffness:
        case Stage::couple_joints:
        case Stage::hold_wires:
        case Stage::wind_wires: return {Stage::assemble_rows};
        case Stage::tangents:
        case Stage::friction:
        case Stage::orient_friction:
        case Stage::move_surfaces:
        case Stage::roll:
        case Stage::rub_wires:
        case Stage::roll_tyres:
        case Stage::rub_joints:
        case Stage::break_joints: return {Stage::pivot, Stage::solve_iterative};
        case Stage::apply_gravity:
        case Stage::assemble_rows:
        case Stage::correct_curvature:
            return {Stage::solve_path, Stage::solve_block, Stage::pivot, Stage::solve_iterative};
        case Stage::half_step:
        case Stage::integrate_rotations: return {Stage::integrate_positions};
        default: return {};
    }
}

/// The stage in whose loop this one may be done in such a program; itself where there is none.
inline Stage host(Stage stage, const StageChoices& choices) {
    for (const Stage other : hosts(stage))
        if (choices[static_cast<std::size_t>(other)].kept) return other;
    return stage;
}

/// The stages of one program while its system is built.
class StageList {
public:
    StageList() = default;
    StageList(std::initializer_list<Stage> stages) {
        for (const Stage stage : stages) listed_[index(stage)] = true;
    }
    explicit StageList(const StageChoices& choices) {
        for (std::size_t k = 0; k < STAGES; ++k) listed_[k] = choices[k].kept;
    }

    /// Whether the stage is listed; what asks will run it.
    bool take(Stage stage) noexcept {
        taken_[index(stage)] = listed_[index(stage)];
        return listed_[index(stage)];
    }
    /// Whether the stage is listed and some part runs it.
    bool runs(Stage stage) const noexcept { return taken_[index(stage)]; }
    /// The stages that are run, in the order of the step.
    std::vector<Stage> taken() const {
        std::vector<Stage> stages;
        for (std::size_t k = 0; k < STAGES; ++k)
            if (taken_[k]) stages.push_back(static_cast<Stage>(k));
        return stages;
    }
    /// Throws std::invalid_argument when a stage is listed that no part of the pipeline runs.
    void expect_all_taken(const char* pipeline) const {
        for (std::size_t k = 0; k < STAGES; ++k)
            if (listed_[k] && !taken_[k])
                throw std::invalid_argument(std::string(pipeline) + " cannot run the stage " +
                                            to_text(static_cast<Stage>(k)));
    }

private:
    static constexpr std::size_t index(Stage stage) noexcept { return static_cast<std::size_t>(stage); }
    std::array<bool, STAGES> listed_{}, taken_{};
};

}  // namespace spook
