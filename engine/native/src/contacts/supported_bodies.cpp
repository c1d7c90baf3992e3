// Which bodies are supported. Bodies touch where one lies on the other, and also where they fly side by side: these fall as if they
// were alone. A body is supported if the step's forces press it, from one to the next, onto what does not move by itself.
//
// A free body goes along a parabola, on which it has v + k/2 at the start of a step with the kick k. Until the time t of an event
// it takes (1/2 + t/h) k, and goes with v + k: ½ |v + k/2|² and the height change by what the impact takes, and by nothing else,
// whatever t, and however many impacts come (tests/engine/contacts/test_elastic_balls.py). A supported one stays on its way with v, its support taking the kick:
// all of it is left for the rest of the step, and the energy changes by (t/h) k·(v₊ − v) − ½ |v₊ − v₁|² with v₁ after the
// impact. That is a gain where the impact gives a speed along the forces. So a supported body that moves along them already is not advanced, but
// where what it meets can only push against them, see ImpactQueue::find_meetings(). Another body that an impact sends along them, or against
// them, is let go, and free from then on. What still would be won, at most ½ |k|² by falling in the rest of the step,
// is paid in height.
#include "contacts/supported_bodies.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

using namespace tolerances::supported_bodies;

bool is_along(Vec3 kick, Vec3 velocity) {
    return std::abs(dot(kick, velocity)) > level * norm(kick) * (norm(kick) + norm(velocity));
}

void SupportedBodies::begin(std::size_t bodies) {
    supported_.assign(bodies, 0);
    pairs_.clear();
    impulse_dv_.assign(bodies, Vec6{});
}

void SupportedBodies::note(StepContact& point, const ContactBodies& bodies, const std::vector<Vec6>& velocity,
                           const std::vector<Vec6>& dv_ext) {
    const int a = point.contact.first, b = point.contact.second;
    const Vec3 n = point.contact.point.normal;
    const double first = dot(contact_row(n, point.first_arm), dv_ext[a]),
                 second = -dot(contact_row(n, point.second_arm), dv_ext[b]),
                 least = pressed_by * (norm(linear(dv_ext[a])) + norm(linear(dv_ext[b])));
    point.approach = relative_velocity(point, n, velocity);
    point.dv_ext = first + second;
    const auto presses = [&](double push) { return push < -least && point.approach + push < 0.0; };
    const bool both = bodies.moves(a) && bodies.moves(b) && presses(first + second);
    pairs_.push_back({a, b, both || presses(first), both || presses(second), both});
    supported_[a] = supported_[b] = 1;
}

void SupportedBodies::find(const ContactBodies& bodies) {
    for (std::size_t b = 0; b < bodies.count(); ++b)
        supported_[b] = supported_[b] && (!bodies.moves(b) || bodies.jointed[b]);
    const auto carry = [this](const Pair& at) {
        char &first = supported_[at.first], &second = supported_[at.second];
        const bool more = (at.first_presses && !first && (second || at.both)) ||
                          (at.second_presses && !second && (first || at.both));
        first = first || (at.first_presses && (second || at.both));
        second = second || (at.second_presses && (first || at.both));
        return more;
    };
    for (bool more = true; more;) {  // there and back: most heaps are numbered from below
        more = false;
        for (auto at = pairs_.begin(); at != pairs_.end(); ++at) more = carry(*at) || more;
        if (!more) break;
        more = false;
        for (auto at = pairs_.rbegin(); at != pairs_.rend(); ++at) more = carry(*at) || more;
    }
}

bool pushes_against_forces(const StepContact& point, const ContactBodies& bodies,
                           const std::vector<Vec6>& dv_ext) {
    const int a = point.contact.first, b = point.contact.second;
    if (point.toi < 0.0 || std::min(bodies.solver_index[a], bodies.solver_index[b]) >= 0) return false;
    const Vec3 n = point.contact.point.normal;
    return bodies.solver_index[a] >= 0 ? dot(n, linear(dv_ext[a])) < 0.0 : dot(n, linear(dv_ext[b])) > 0.0;
}

void SupportedBodies::release(int body, double part, const Vec6& dv_ext) {
    supported_[body] = 0;
    for (int i = 0; i < 6; ++i) impulse_dv_[body][i] = part * dv_ext[i];
}

bool SupportedBodies::has_released() const noexcept {
    return std::any_of(impulse_dv_.begin(), impulse_dv_.end(), [](const Vec6& k) { return k != Vec6{}; });
}

void SupportedBodies::book(const MixedSystem& system, const Islands& islands, const ContactBodies& bodies,
                           std::vector<CachedContact>& cache) const {
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        if (impulse_dv_[b] == Vec6{}) continue;
        const Vec3 momentum = system.mass[bodies.solver_index[b]][0] * linear(impulse_dv_[b]);
        for (CachedContact& cached : cache) {
            const auto [first, second] = bodies.solver_pair(cached.contact);
            if (std::min(first, second) >= 0 || !bodies.is_closed(cached.contact)) continue;
            if (islands.of_body[std::max(first, second)] != islands.of_body[bodies.solver_index[b]]) continue;
            cached.impulse += first >= 0 ? -momentum : momentum;
            break;
        }
    }
}

}  // namespace spook
