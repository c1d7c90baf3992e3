// The rows of a contact point: normal, tangents and turning, as solvers take them.
#pragma once

#include <vector>

#include "contacts/contact_points.hpp"
#include "contacts/friction_point.hpp"
#include "contacts/pgs_contacts.hpp"
#include "contacts/step_motion.hpp"
#include "linear/regularisation.hpp"

namespace spook {

/// What rows are made of.
struct ContactRows {
    const StepMotion& motion;
    const ContactPoints& points;

    /// What every solver is told of a point: directions, arms, and what bodies and surfaces that are moved ask for.
    PgsContact packed(const StepContact& point) const;
    /// The same of a point at rest, which it measures: with its gap, what gives way, and where the solve starts.
    PgsContact resting(StepContact& point) const;
    /// The first `rows` of normal, tangents and turning: 1, 3 or 6.
    RowBlock row_block(const StepContact& point, const PgsContact& packed, int rows) const;
    /// Those of a point at rest; the tangents' bounds are left to the friction law.
    RowBlock resting_block(StepContact& point) const;
    /// The rows of a block that friction bounds.
    void add_friction(const StepContact& point, int block, std::vector<FrictionPoint>& friction) const;

private:
    double resting_right(StepContact& point, const Regularisation& row) const;
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
