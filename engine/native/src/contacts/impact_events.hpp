// Impacts that act at their own time of impact; the others act at the start of the step.
#pragma once

#include <cstdint>
#include <vector>

#include "contacts/candidate_search.hpp"
#include "linear/disjoint_sets.hpp"

namespace spook {

class ImpactEvents {
public:
    /// Islands of balls whose only impact is one pair, and in which nothing else is approached, are moved to the impact's
    /// time. Balls, since other shapes would have to be turned to that time as well, and a turn without the momentum
    /// that goes with it changes the energy. A supported body that moves along the forces would gain energy by it, unless what
    /// is moved supports it, or the impact is with something that stands still and pushes against the forces.
    void find(const CandidateSearch& search, StepMotion& motion, ContactPoints& points);

private:
    struct Island {
        std::size_t members = 0;
        std::uint64_t impact_pair = 0;                     // the pair of its impact, plus one
        double time = -1.0;                                // when that is, s
        double fastest = 0.0;                              // of its bodies, m/s
        bool plain = true;                                 // nothing else goes on in it
        bool rebounds = false;                             // some impact in it has a restitution
        bool held = false;                                 // not all in it is free
        std::size_t moving_along = 0, may_move_along = 0;  // how many move along the forces, and may
    };
    Island& of(const ContactBodies& bodies, int body) {
        return islands_[bodies.moves(body) ? connected_.root(body) : body];
    }
    void connect(const ContactBodies& bodies, const ContactPoints& points);
    void look_at_bodies(const StepMotion& motion);
    void look_at(const StepContact& point, const std::vector<double>& reach, const StepMotion& motion);
    void look_at(const OpenPairs& open, const StepMotion& motion);
    bool is_event(const Island& island) const noexcept;

    DisjointSets connected_;       // bodies, by contacts and joints
    std::vector<Island> islands_;  // by their first body, and what does not move by itself
};

}  // namespace spook
