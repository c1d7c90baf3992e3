#include "contacts/contact_bodies.hpp"

#include <cmath>
#include <utility>

namespace spook {

using namespace tolerances::contact_bodies;

ContactBodies::ContactBodies(const Detection& detection, std::vector<int> solver_indices,
                             std::vector<JointTie> ties, std::vector<Tumbler> tumbling)
    : solver_index(std::move(solver_indices)),
      joints(std::move(ties)),
      jointed(solver_index.size(), 0),
      driven(solver_index.size(), 0),
      ball(detection.balls()),
      radius(detection.radius()),
      swings(!detection.single_points()),
      tumblers(std::move(tumbling)) {
    for (std::size_t b = 0; b < count(); ++b) {
        if (solver_index[b] < 0) continue;
        body_of.resize(std::max(body_of.size(), static_cast<std::size_t>(solver_index[b]) + 1));
        body_of[solver_index[b]] = static_cast<int>(b);
    }
    for (const JointTie& joint : joints)
        for (const int body : {joint.first, joint.second}) {
            if (body < 0) continue;
            jointed[body] = 1;
            if (joint.driven) driven[body] = 1;
            if (joint.stops)
                ball[body] = 0;  // its impacts are met at the step's start, as those of stops are
        }
}

double ContactBodies::slack(const Contact& contact) const noexcept {
    return slack_share * moving_size(contact);
}

double ContactBodies::gap(const Contact& contact) const noexcept {
    const double gap = contact.point.gap;
    return std::abs(gap) <= rounding * (norm(contact.point.position) + size(contact)) ? 0.0 : gap;
}

ContactSurfaces::ContactSurfaces(const std::vector<SurfaceMaterial>& materials,
                                 std::vector<PairFriction> given)
    : of(materials), pairs(std::move(given)) {
    for (PairFriction& pair : pairs) {
        if (pair.second < pair.first) std::swap(pair.first, pair.second);
        resists_turning = resists_turning || pair.resists_turning();
    }
    std::sort(pairs.begin(), pairs.end(), [](const PairFriction& a, const PairFriction& b) {
        return std::pair{a.first, a.second} < std::pair{b.first, b.second};
    });
    for (const SurfaceMaterial& material : of.distinct()) {
        conveys = conveys || norm(material.surface_velocity) > 0.0;
        oriented = oriented || material.is_oriented();
        resists_turning = resists_turning || material.resists_turning();
        rebounds = rebounds || material.restitution > 0.0;
    }
}

/// As their surfaces combine, but where a friction of the pair's own is given.
PairMaterial ContactSurfaces::pair_among_given(const Contact& contact) const noexcept {
    PairMaterial material = combined(of[contact.first], of[contact.second]);
    const std::pair wanted{contact.first, contact.second};  // the lower first
    const auto at = std::lower_bound(pairs.begin(), pairs.end(), wanted,
                                     [](const PairFriction& pair, const std::pair<int, int>& key) {
                                         return std::pair{pair.first, pair.second} < key;
                                     });
    if (at == pairs.end() || std::pair{at->first, at->second} != wanted) return material;
    material.friction = at->friction, material.rolling = at->rolling, material.torsional = at->torsional;
    return material;
}

}  // namespace spook
