// The impacts of a step in the order of their times: which come next, and the bodies that are moved to when they do.
#pragma once

#include <cstdint>
#include <vector>

#include "contacts/candidate_search.hpp"
#include "contacts/contact_points.hpp"
#include "contacts/islands.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

class ImpactQueue {
public:
    /// Of a step.
    void begin(const ContactModel& model);
    /// Whether impacts may come one after the other at all.
    bool possible() const noexcept { return possible_; }
    /// Whether something in the islands of a contact's bodies may rebound, as where several bodies meet in a scene in which any does:
    /// then its impact without a rebound is met in its order as well, since others may follow from it. Else it is left to the
    /// resting rows, at its time.
    bool rebounds(const Contact& contact) const noexcept {
        return (rebounds_[contact.first] | rebounds_[contact.second]) != 0;
    }
    /// Whether impacts come one after the other between the bodies of a point.
    bool come_in_order(const ContactModel& model, const StepContact& point) const;
    /// What the step's islands are, once it is known which bodies meet. Balls that are followed will be moved to their impacts: these act
    /// with the normals and arms of their meetings. Where nothing rebounds, few balls are moved to an impact that is all that
    /// goes on between them.
    void find_meetings(const CandidateSearch& search, StepMotion& motion, ContactPoints& points);
    /// Of impacts that come in order those to be answered next, of the others all, as places in `points`: of what may meet in
    /// this step the points that are closed when the first of those that are approached closes; where impacts are successive, those that
    /// are approached themselves. Balls are moved to that time.
    void find_next(MixedSystem& system, const OpenPairs& open_pairs, StepMotion& motion,
                   ContactPoints& points, std::vector<std::size_t>& hit_points);
    /// An open point among balls that are moved by successive impacts is moved to the time of their last one.
    void move_to_last_impact(const StepMotion& motion, StepContact& point) const;

private:
    struct Island {
        double first = unbounded;  // the next impact, s
        int members = 0;
        bool balls = true, flies = true,
             known = true;  // all in it: are, are held by nothing, are where the queue says
        bool fast = false;  // some of it is more than forces give in a few steps
        bool followed = false, moved = false;      // its impacts come in order, and bodies are moved to them
        bool rebounds = false;                     // something in it, or what it may set in motion
        bool open = false;                         // more than one pair of it may meet yet, or is approached
        double fastest = 0.0;                      // of its bodies, m/s
        std::uint64_t pair = 0;                    // that meets, plus one
        int moving_along = 0, may_move_along = 0;  // how many move along the forces, on a support, and may
    };
    Vec6 path_until(const StepMotion& motion, std::size_t body, double time) const;
    double gap_at(const StepMotion& motion, const StepContact& point, double time) const;
    double last_impact_time(const StepContact& point) const noexcept;
    double closing_time(const StepMotion& motion, const StepContact& point) const;
    void apply_forces_before(std::size_t body, double part, StepMotion& motion, MixedSystem& system);
    void find_islands(const OpenPairs& open_pairs, const StepMotion& motion, const ContactPoints& points);
    void look_at_bodies(const StepMotion& motion);
    int island(const ContactBodies& bodies, std::size_t body) const noexcept;
    Island& of(const ContactBodies& bodies, const StepContact& point) noexcept {
        return islands_[connected_.islands().of_body[bodies.solver_body(point.contact)]];
    }
    void find_closing(const StepMotion& motion, const ContactPoints& points);
    void look_at_meeting(const StepContact& point, const std::vector<double>& reach,
                         const StepMotion& motion);
    void look_at_open(const OpenPairs& open_pairs, const StepMotion& motion);
    void advance(StepMotion& motion, MixedSystem& system);

    std::vector<double> clock_;          // by body: up to when its way in the step is known, s
    std::vector<Vec6> path_;             // and that way, m and rad
    std::vector<signed char> in_order_;  // bodies: 1 if impacts come one by one in this step, −1 if not
    std::vector<char> rebounds_;         // bodies: whether something in their island does
    bool possible_ = false;
    // Of one call:
    IslandFinder connected_;
    std::vector<Island> islands_;
    std::vector<double> closing_;  // when each point closes, s
    std::vector<char> hit_;        // bodies
};

}  // namespace spook
