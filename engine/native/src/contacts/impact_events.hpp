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
    /// By an island's first body.
    struct Arrays {
        std::vector<std::size_t> members;
        std::vector<std::uint64_t> impact_pair;  // the pair of the island's impact, plus one
        std::vector<char> plain, bouncy;
        std::vector<double> when, speed;
        std::vector<std::size_t> moving_along, may_move_along;  // how many move along the forces, and may
    };
    DisjointSets connected_;  // bodies, by contacts and joints
    Arrays arrays_;
};

}  // namespace spook
