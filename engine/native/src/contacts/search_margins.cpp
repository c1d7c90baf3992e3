#include "contacts/search_margins.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

/// How far a body may get in the step with either velocity, m.
double margin_of(double radius, double h, const Vec6& velocity, const Vec6& other) {
    const double speed = std::max(norm(linear(velocity)), norm(linear(other))),
                 spin = std::max(norm(angular(velocity)), norm(angular(other)));
    return h * (speed + spin * radius) + closed * radius;
}
double margin_of(double radius, double h, const Vec6& velocity) {
    return h * (norm(linear(velocity)) + norm(angular(velocity)) * radius) + closed * radius;
}

}  // namespace

void SearchMargins::begin(const ContactBodies& bodies, double h, const std::vector<Vec6>& velocity,
                          const std::vector<Vec6>& free_velocity, bool room) {
    reach_.resize(velocity.size());
    for (std::size_t b = 0; b < reach_.size(); ++b)
        reach_[b] = margin_of(bodies.radius[b], h, velocity[b], free_velocity[b]);
    search_ = reach_;
    if (!room) return;
    double squares = 0.0;
    for (const double margin : reach_) squares += margin * margin;
    const double more = std::sqrt(squares / static_cast<double>(reach_.size()));
    for (double& margin : search_) margin += more;
}

bool SearchMargins::outrun(const ContactBodies& bodies, double h, const std::vector<Vec6>& velocity,
                           const std::vector<char>& changed) {
    bool faster = false;
    for (std::size_t b = 0; b < reach_.size(); ++b) {
        if (!changed[b]) continue;
        const double margin = margin_of(bodies.radius[b], h, velocity[b]);
        faster = faster || margin > search_[b] * (1.0 + 1e-9);
        reach_[b] = std::max(reach_[b], margin);
    }
    if (!faster) return false;
    grown_.clear();
    for (std::size_t b = 0; b < reach_.size(); ++b)
        if (reach_[b] > search_[b]) search_[b] = reach_[b], grown_.push_back(static_cast<int>(b));
    return true;
}

}  // namespace spook
