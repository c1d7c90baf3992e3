// Successive impacts: which comes next, and the free balls that are moved to its time.
#pragma once

#include <cstdint>
#include <vector>

#include "contacts/contact_points.hpp"
#include "contacts/islands.hpp"
#include "contacts/open_pairs.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

class SuccessiveImpacts {
public:
    /// Of a step.
    void begin(const ContactModel& model);
    /// Whether impacts may come one after the other at all.
    bool possible() const noexcept { return !clock_.empty(); }
    /// Whether impacts come one after the other between the bodies of a point.
    bool come_in_order(const ContactModel& model, const StepContact& point) const;
    /// Of impacts that come in order those to be answered next, of the others all, as places in `points`: of what may meet in
    /// this step the points that are approached, and closed when the first of them is. Free balls are moved there, as to the time
    /// of a single impact.
    void find_earliest(MixedSystem& system, const OpenPairs& open_pairs, StepMotion& motion,
                       ContactPoints& points, std::vector<std::size_t>& hit_points);
    /// An open point among balls that are moved by successive impacts is moved to the time of their last one.
    void move_to_last_impact(const StepMotion& motion, StepContact& point) const;

private:
    Vec6 path_until(const StepMotion& motion, std::size_t body, double time) const;
    double gap_at(const StepMotion& motion, const StepContact& point, double time) const;
    double last_impact_time(const StepContact& point) const noexcept;
    double closing_time(const StepMotion& motion, const StepContact& point) const;
    void apply_forces_before(std::size_t body, double part, StepMotion& motion, MixedSystem& system);
    const Islands& connected(const MixedSystem& system, const OpenPairs& open_pairs,
                             const ContactBodies& bodies, const ContactPoints& points);
    int island(const ContactBodies& bodies, std::size_t body) const noexcept;
    void find_closing(const StepMotion& motion, const ContactPoints& points);
    bool closes_then(const StepMotion& motion, const ContactPoints& points, std::size_t k) const;
    void find_orderly(const StepMotion& motion, const ContactPoints& points);
    void advance(MixedSystem& system, StepMotion& motion);

    std::vector<double> clock_;          // by body: up to when its way in the step is known, s
    std::vector<Vec6> path_;             // and that way, m and rad
    std::vector<signed char> in_order_;  // bodies: 1 if impacts come one by one in this step, −1 if not
    // Of one call:
    IslandFinder connected_;
    std::vector<double> first_, closing_;  // the next impact of each island, s; when each point closes
    std::vector<char> orderly_, balls_;    // islands
    std::vector<char> hit_;                // bodies
    std::vector<std::uint64_t> pairs_;     // by island
};

}  // namespace spook
