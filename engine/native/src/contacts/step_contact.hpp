// What a step with contacts knows of its points, and of pairs that may have some yet.
#pragma once

#include <vector>

#include "collision/detection.hpp"
#include "collision/shape_cast.hpp"
#include "contacts/contact_geometry.hpp"
#include "linear/vec.hpp"

namespace spook {

/// A point that is closed, or will be within the step. It is read ten times a step: what few have is in their ContactExtras.
struct StepContact {
    Contact contact;             // of an impact: where it will touch, the gap along that normal
    Vec3 first_arm, second_arm;  // from the centres of mass, m
    Vec3 tangent;                // first tangent along world axes or the material's direction, unit
    double friction = 0.0;       // mu; where it differs with the direction, the smaller one
    double toi = -1.0;           // when it touches within the step, s; negative if the pair is closed
    double meeting_gap = 0.0;    // at an impact, m: other points of the pair may still be open
    double begun = 0.0;          // gap along its normal with both bodies where the step began, m
    double approach = 0.0;       // C v, m/s, negative when closing
    double dv_ext = 0.0;         // C (free velocity − v), m/s, negative when pressed together
    int extras = -1;             // the place of its ContactExtras, −1 if it has none
    bool event = false;          // acts at the time of its impact, not at the start of the step
    bool queued = false;         // will act at that time, see ImpactQueue
    bool at_start = false;       // an impact with the point of the step's start already
    bool solved = false;         // in an earlier round of this step: these start the next
    bool answered = false;       // the same, by a solve and not by warm_start_by_pgs()
    double bounce = -1.0;        // psi' if the point takes part in the impact, else −1
    double rounding = 0.0;       // approaches slower than this are none, m/s
    double before = -1.0;        // normal impulse of the step before, −1 if the point is new
    double compression_before = 0.0;
    double normal = 0.0;              // of the round before
    double tangents[2] = {0.0, 0.0};  // the same, or of the step before
    double impact = 0.0;              // normal impulse of the step's impacts, N s
    /// A plastic hit is met by the resting row itself, so that friction gets its share of the whole impact.
    double resting_approach() const noexcept { return approach < -rounding ? 0.0 : approach; }
};

/// How fast the first body moves at a point against the second, along `direction`, m/s. `velocity` is per body of the scene.
inline double relative_velocity(const StepContact& point, Vec3 direction,
                                const std::vector<Vec6>& velocity) noexcept {
    double total = 0.0;
    total += dot(contact_row(direction, point.first_arm), velocity[point.contact.first]);
    total -= dot(contact_row(direction, point.second_arm), velocity[point.contact.second]);
    return total;
}

/// What else a point has that an impact has pushed, that meets friction where its bodies turn, or whose friction differs with
/// the direction or is a box.
struct ContactExtras {
    double axis_scale[2] = {1.0, 1.0};    // of the tangents' rows: what makes an ellipse of friction a disc
    double turning[3] = {0.0, 0.0, 0.0};  // impulses of the round or the step before
    double guessed = -1.0;  // what the box takes where there was no step before, −1 if it has not yet
    Vec3 impact_impulse;
    bool is_anisotropic() const noexcept { return axis_scale[0] != axis_scale[1]; }
};

/// Two that are apart at the start of the step; they may still meet.
struct OpenPair {
    IndexPair pair;
    int first, second;  // bodies; the first is negative once they have met: they have points then
    Separation apart;
    double first_arm = 0.0, second_arm = 0.0;  // see turning_arm(); negative: a plane
    bool pressed = false;  // in the last step, and has points already: asked where these do not press now
    bool has_met() const noexcept { return first < 0; }
};

}  // namespace spook
