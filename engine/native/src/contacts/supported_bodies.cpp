// Which bodies are supported. Bodies touch where one lies on the other, and also where they fly side by side: these fall as if they
// were alone. A body is supported if the step's forces press it, from one to the next, onto what does not move by itself.
//
// A free body goes along a parabola, on which it has v + k/2 at the start of a step with the kick k. Until the time t of an event
// it takes (1/2 + t/h) k, and goes with v + k: ½ |v + k/2|² and the height change by what the impact takes, and by nothing else,
// whatever t, and however many impacts come (tests/test_engine_elastic_balls.py). One that comes to rest in it has no more of k, or
// it would be lifted by the rest, see lay_down(). A supported one stays on its way with v, its support taking the kick:
// all of it is left for the rest of the step, and the energy changes by (t/h) k·(v₊ − v) − ½ |v₊ − v₁|² with v₁ after the
// impact. That is a gain where the impact gives a speed along the forces. So a supported body that moves along them already is not advanced, but
// where what it meets can only push against them, see find_events(). Another body that an impact sends along them, or against
// them, is let go, and free from then on. What still would be won, at most ½ |k|² by falling in the rest of the step,
// is paid in height.
#include <algorithm>
#include <cmath>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::supported_bodies;

bool is_along(Vec3 kick, Vec3 velocity) {
    return std::abs(dot(kick, velocity)) > level * norm(kick) * (norm(kick) + norm(velocity));
}

}  // namespace

/// Takes down which way the forces press the bodies of a closed point, if they do not part faster.
void ContactStage::note_supports(Point& point) {
    const int a = point.contact.first, b = point.contact.second;
    const Vec3 n = point.contact.point.normal;
    const double first = dot(contact_row(n, point.first_arm), dv_ext_[a]),
                 second = -dot(contact_row(n, point.second_arm), dv_ext_[b]),
                 least = pressed_by * (norm(linear(dv_ext_[a])) + norm(linear(dv_ext_[b])));
    point.approach = relative(point, n, velocity_, false);
    point.dv_ext = first + second;
    const auto presses = [&](double push) { return push < -least && point.approach + push < 0.0; };
    const bool both =
        bodies_->solver_index[a] >= 0 && bodies_->solver_index[b] >= 0 && presses(first + second);
    support_pairs_.push_back({a, b, both || presses(first), both || presses(second), both});
}

/// Leaves those in supported_ that are supported.
void ContactStage::find_supported() {
    for (std::size_t b = 0; b < bodies_->solver_index.size(); ++b)
        supported_[b] = supported_[b] && (bodies_->solver_index[b] < 0 || bodies_->jointed[b]);
    const auto carry = [this](const SupportPair& at) {
        char &first = supported_[at.first], &second = supported_[at.second];
        const bool more = (at.first_presses && !first && (second || at.both)) ||
                          (at.second_presses && !second && (first || at.both));
        first = first || (at.first_presses && (second || at.both));
        second = second || (at.second_presses && (first || at.both));
        return more;
    };
    for (bool more = true; more;) {  // there and back: most heaps are numbered from below
        more = false;
        for (auto at = support_pairs_.begin(); at != support_pairs_.end(); ++at) more = carry(*at) || more;
        if (!more) break;
        more = false;
        for (auto at = support_pairs_.rbegin(); at != support_pairs_.rend(); ++at) more = carry(*at) || more;
    }
}

/// Whether a body that is supported, or jointed, moves along the forces.
bool ContactStage::moves_along_forces(int body) const {
    return (supported_[body] || bodies_->jointed[body]) &&
           is_along(linear(dv_ext_[body]), linear(velocity_[body]));
}

/// Whether a point is an impact of what stands still that pushes the other one against the forces.
bool ContactStage::pushes_against_forces(const Point& point) const {
    const int a = point.contact.first, b = point.contact.second;
    if (point.toi < 0.0 || std::min(bodies_->solver_index[a], bodies_->solver_index[b]) >= 0) return false;
    const Vec3 n = point.contact.point.normal;
    return bodies_->solver_index[a] >= 0 ? dot(n, linear(dv_ext_[a])) < 0.0
                                         : dot(n, linear(dv_ext_[b])) > 0.0;
}

/// A supported body that an impact sends along the forces, or against them: until then its support took its kick.
void ContactStage::release_support(int body, const Vec6& velocity) {
    if (event_time_[body] < 0.0 || toi_fraction_[body] > 0.0 || !(supported_[body] || bodies_->jointed[body]))
        return;
    const Vec3 kick = linear(dv_ext_[body]), before = linear(velocity_[body]);
    if (is_along(kick, before) || !is_along(kick, linear(velocity) - before)) return;
    supported_[body] = 0;
    toi_fraction_[body] = part_of_forces(event_time_[body] / options_.time_step, surfaces_->rebounds);
    for (int i = 0; i < 6; ++i) support_impulse_dv_[body][i] = toi_fraction_[body] * dv_ext_[body][i];
    for (double& k : dv_ext_[body]) k *= 1.0 - toi_fraction_[body];
}

/// What a supported body of an event that falls in the rest of the step is to go besides, m/s: it falls for all of it, or it
/// would have the speed of a fall and not have lost the height.
Vec3 ContactStage::free_fall_correction(int body, Vec3 after) const {
    const Vec3 k = linear(dv_ext_[body]), change = after - linear(velocity_[body]);
    if (!supported_[body] || !(dot(k, k) > 0.0)) return {};
    const double won = event_time_[body] / options_.time_step * dot(k, after - linear(predicted_[body])) -
                       0.5 * dot(change, change);
    return won > 0.0 ? (won / dot(k, k)) * k : Vec3{};
}

/// Books what supports took of the kicks of those they let go: forces add up to the momentum where an island leans on what
/// does not move by itself.
void ContactStage::apply_support_impulses(const MixedSystem& system) {
    if (std::none_of(support_impulse_dv_.begin(), support_impulse_dv_.end(),
                     [](const Vec6& k) { return k != Vec6{}; }))
        return;
    const Islands& islands = connected(system, 0);
    for (std::size_t b = 0; b < bodies_->solver_index.size(); ++b) {
        if (support_impulse_dv_[b] == Vec6{}) continue;
        const Vec3 momentum = system.mass[bodies_->solver_index[b]][0] * linear(support_impulse_dv_[b]);
        for (CachedContact& cached : state_.cache.points) {
            const int first = bodies_->solver_index[cached.contact.first],
                      second = bodies_->solver_index[cached.contact.second];
            if (std::min(first, second) >= 0 || !bodies_->is_closed(cached.contact)) continue;
            if (islands.of_body[std::max(first, second)] != islands.of_body[bodies_->solver_index[b]])
                continue;
            cached.impulse += first >= 0 ? -momentum : momentum;
            break;
        }
    }
}

}  // namespace spook
