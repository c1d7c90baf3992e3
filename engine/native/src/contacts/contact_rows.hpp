// The rows of a contact point: normal, tangents and turning, as solvers take them.
#pragma once

#include <vector>

#include "contacts/contact_points.hpp"
#include "contacts/friction_point.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

/// What rows are made of.
struct ContactRows {
    const StepMotion& motion;
    const ContactPoints& points;

    /// The first `rows` of normal, tangents and turning: 1, 3 or 6.
    RowBlock row_block(const StepContact& point, int rows) const;
    /// The resting row of a point, which it measures; the tangents' bounds are left to the friction law.
    RowBlock resting(StepContact& point) const;
    /// What the normal's resting row adds to the right side of the bodies that do not move by themselves, m/s.
    double resting_right(StepContact& point) const;
    /// The rows of a block that friction bounds.
    void add_friction(const StepContact& point, int block, std::vector<FrictionPoint>& friction) const;

private:
    void add_turning(const StepContact& point, RowBlock& block) const;
    bool is_pressed(const StepContact& point) const noexcept;
};

/// What a solve found for a point, along world tangents: it may have turned its own. Gives the impulse along the surface.
Vec3 store_solution(const ContactBodies& bodies, const RowBlock& block, ContactPoints& points,
                    StepContact& point);
/// Takes down what a point did behind what the others did: its normal impulse, and that along the surface.
CachedContact& cache_contact(const ContactRows& rows, const MixedSystem& system, const StepContact& point,
                             double normal, Vec3 along, std::vector<CachedContact>& cache);

}  // namespace spook
