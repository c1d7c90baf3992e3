#include "contacts/contact_points.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/contact_arrays.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

using namespace tolerances::contact_points;

StepContact& ContactPoints::add(const ContactModel& model, const Contact& contact, const Pose& first,
                                const Pose& second, double toi) {
    StepContact& point = all.emplace_back();
    point.contact = contact;
    point.friction = model.surfaces.pair(contact).friction;
    point.first_arm = contact.point.position - first.position;
    point.second_arm = contact.point.position - second.position;
    point.tangent = world_tangent(contact.point.normal);
    point.toi = toi;
    point.begun = contact.point.gap;
    if (model.surfaces.oriented) orient(model, point, first, second);
    return point;
}

/// Where friction differs with the direction its bound is an ellipse about the direction's projection onto the surface. In rows
/// stretched by mu over the smaller mu it is the smaller one's disc, which every solver sees; the slip's work is the same, so
/// energy is only lost. A direction askew on the surface counts less, by the square of its projection.
void ContactPoints::orient(const ContactModel& model, StepContact& point, const Pose& first,
                           const Pose& second) {
    const Contact& contact = point.contact;
    const bool of_first = model.surfaces[contact.first].is_oriented();
    const SurfaceMaterial& own = model.surfaces[of_first ? contact.first : contact.second];
    const SurfaceMaterial& other = model.surfaces[of_first ? contact.second : contact.first];
    const double mu = point.friction;
    if (!own.is_oriented() || !(mu > 0.0)) return;
    const Vec3 n = contact.point.normal, whole = (of_first ? first : second).rotation * own.direction;
    const Vec3 shadow = whole - dot(whole, n) * n;
    const double length = norm(shadow), across = std::sqrt(own.friction_across * other.friction);
    if (length > vanishing) {
        point.tangent = (1.0 / length) * shadow;
        point.tangent = point.tangent - dot(point.tangent, n) * n;
    }
    const double along = std::sqrt(across * across + (mu * mu - across * across) * length * length);
    point.friction = std::min(along, across);
    ContactExtras& extras = own_extras(point);
    extras.axis_scale[0] = along / point.friction;
    extras.axis_scale[1] = across / point.friction;
}

void ContactPoints::order(const ContactCache& before, bool resists_turning) {
    order_by_key(all, rest_, places_);
    const std::vector<CachedContact>& cached = before.points;
    std::size_t old = 0;
    for (StepContact& point : all) {
        while (old < cached.size() && cached[old].contact.key < point.contact.key) ++old;
        if (old == cached.size() || cached[old].contact.key != point.contact.key) continue;
        remember(point, cached[old], resists_turning);
    }
    ordered = all.size();
}

void ContactPoints::remember(StepContact& point, const CachedContact& before, bool resists_turning) {
    point.before = std::max(0.0, before.normal);  // what carries nothing may be rounded below it
    point.compression_before = before.compression;
    if (point.solved) return;
    std::copy_n(before.tangent, 2, point.tangents);
    if (resists_turning) std::copy_n(before.turning, 3, own_extras(point).turning);
}

void ContactPoints::forget(const ContactBodies& bodies, const std::vector<char>& marked) {
    if (marked.empty()) return;
    for (StepContact& point : all) {
        const auto [first, second] = bodies.solver_pair(point.contact);
        if (!marked[std::max(first, second)]) continue;
        point.solved = true;
        point.normal = point.tangents[0] = point.tangents[1] = 0.0;
        if (point.extras >= 0) std::fill_n(extras_[point.extras].turning, 3, 0.0);
    }
}

}  // namespace spook
