// The contact stage's part for bodies that are sunk into what holds them, and come to the side of its next part.
//
// A body that lies a micron deep in the first of two tiles, as compliance and overlaps make it, would be stopped by the side
// of the second. Swept as it would stand if it were lifted out of the first, it goes over the second. What does not lie
// beneath the surface it is lifted to is no such part: it is met where it stands, however deep the body is sunk elsewhere,
// or overlaps would breed others.
#include <algorithm>

#include "collision/sweep.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"

namespace spook {

namespace {

constexpr double share = 0.25;  // of the overlap at which pairs count as met: less is none

}  // namespace

/// How deep a closed point is at the start of the step, and what the velocity then adds to it before that is answered, m: as
/// much as sweeps that count as settled may have left, or as the depth.
double ContactStage::sunk_by(const Point& point) const {
    const double h = options_.time_step, depth = std::max(0.0, -point.contact.point.gap);
    const double sinking = -h * relative(point, point.contact.point.normal, velocity_, false);
    const double left = options_.solver == SolverKind::iterative ? h * options_.unsettled_residual : 0.0;
    return depth + std::clamp(sinking, 0.0, std::max(depth, left));
}

/// Whether `body`, that would meet another as they move, does not once it is lifted out of what holds it.
bool ContactStage::is_seam(const Mover& moving, int body, const Mover& other, const OpenPair& open) const {
    const ShapeKind kind = moving.shape.kind, next = other.shape.kind;
    if (kind == ShapeKind::plane || next == ShapeKind::plane) return false;  // they have no sides
    if (kind == ShapeKind::sphere && next == ShapeKind::sphere) return false;
    const double slop = this->slop(open), least = share * slop;
    if (!(depth_[body] > least)) return false;
    for (std::size_t k = 0; k < points_.size();) {
        const Contact& contact = points_[k].contact;
        if ((contact.first != body && contact.second != body) || points_[k].strike >= 0.0) {
            ++k;
            continue;
        }
        const std::uint64_t pair = contact.key >> feature_bits;
        const double side = contact.first == body ? 1.0 : -1.0;
        Vec3 n;
        double depth = least;
        for (; k < points_.size() && points_[k].contact.key >> feature_bits == pair; ++k) {
            const double deep = sunk_by(points_[k]);
            if (deep > depth) depth = deep, n = side * points_[k].contact.point.normal;
        }
        if (!(depth > least)) continue;
        Pose out = moving.body;
        out.position += depth * n;
        const Mover lifted{moving.shape, moving.part, out, moving.velocity, moving.spin};
        const double above =
            separation(moving.shape, lifted.at(0.0), Primitive::plane(n), {}).gap +
            separation(other.shape, other.at(0.0), Primitive::plane(-n), {}).gap;  // of a triangle: infinite
        if (above > -least && first_touch(lifted, other, options_.time_step, slop) < 0.0) return true;
    }
    return false;
}

}  // namespace spook
