// How far bodies may get in a step, and how far they are looked for.
#pragma once

#include <vector>

#include "contacts/contact_bodies.hpp"
#include "contacts/pivot_system.hpp"

namespace spook {

class SearchMargins {
public:
    /// Of the two velocities that a body may have, the faster. `room`: for those that are only pushed in this step.
    void begin(const ContactBodies& bodies, double h, const std::vector<Vec6>& velocity,
               const std::vector<Vec6>& free_velocity, bool room);
    /// Whether some body that `changed` names goes further than the search allowed for; if so, the search is widened.
    bool outrun(const ContactBodies& bodies, double h, const std::vector<Vec6>& velocity,
                const std::vector<char>& changed);

    const std::vector<double>& reach() const noexcept { return reach_; }    // where bodies may get, m
    const std::vector<double>& search() const noexcept { return search_; }  // where they are looked for, m
    const std::vector<int>& grown() const noexcept { return grown_; }  // bodies it was widened for at last

private:
    std::vector<double> reach_, search_;
    std::vector<int> grown_;
};

}  // namespace spook
