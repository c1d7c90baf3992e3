// Surfaces as the narrow phase sees them: a convex primitive in its own axes, and where it stands.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "collision/mesh.hpp"
#include "collision/polytope.hpp"
#include "linear/vec.hpp"
#include "run/named_enum.hpp"

namespace spook {

/// The order matters: the narrow phase knows each pair with the lower kind first.
SPOOK_NAMED_ENUM(ShapeKind, sphere, capsule, box, hull, cylinder, cone, plane, triangle)

struct Pose {
    Vec3 position;                     // m
    Mat3 rotation = Mat3::identity();  // body axes to world axes
    bool operator==(const Pose&) const noexcept = default;
};

/// One convex primitive; fields not named for a kind are ignored.
struct Primitive {
    ShapeKind kind = ShapeKind::sphere;
    double radius = 0.0;  // sphere, capsule, cylinder, a cone's base, m
    double half_length =
        0.0;    // half of a cylinder, also of a capsule's, or of a cone's height, along local z, m
    Vec3 half;  // box: half its edges, m
    Vec3 normal{0.0, 0.0, 1.0};  // plane: unit, out of the solid half-space, local axes
    std::shared_ptr<const Polytope> hull{};
    std::shared_ptr<const Mesh> mesh{};
    int triangle = 0;  // of the mesh

    bool operator==(const Primitive&) const noexcept = default;

    static Primitive sphere(double radius) noexcept { return {ShapeKind::sphere, radius, 0.0, {}, {}, {}}; }
    static Primitive capsule(double radius, double length) noexcept {
        return {ShapeKind::capsule, radius, 0.5 * length, {}, {}, {}};
    }
    static Primitive box(Vec3 size) noexcept { return {ShapeKind::box, 0.0, 0.0, 0.5 * size, {}, {}}; }
    static Primitive cylinder(double radius, double length) noexcept {
        return {ShapeKind::cylinder, radius, 0.5 * length, {}, {}, {}};
    }
    /// Its apex lies up local z, its centre of mass in the origin.
    static Primitive cone(double radius, double height) noexcept {
        return {ShapeKind::cone, radius, 0.5 * height, {}, {}, {}};
    }
    static Primitive plane(Vec3 normal) noexcept { return {ShapeKind::plane, 0.0, 0.0, {}, normal, {}}; }
    static Primitive convex(std::shared_ptr<const Polytope> hull) noexcept {
        return {ShapeKind::hull, 0.0, 0.0, {}, {}, std::move(hull)};
    }
    static Primitive sheet(std::shared_ptr<const Mesh> mesh, int triangle) noexcept {
        Primitive made{ShapeKind::triangle, 0.0, 0.0, {}, {}, {}};
        made.mesh = std::move(mesh), made.triangle = triangle;
        return made;
    }
    /// Whether its surface is flat faces: it has corners, and sides that others can meet.
    bool faceted() const noexcept { return kind == ShapeKind::box || kind == ShapeKind::hull; }
    /// Whether it is the hull of two discs on its axis, one of which may be a point.
    bool has_rims() const noexcept { return kind == ShapeKind::cylinder || kind == ShapeKind::cone; }
};

constexpr Vec3 column(const Mat3& a, int i) noexcept { return {a.m[i], a.m[3 + i], a.m[6 + i]}; }
/// aᵀ v: a world vector in the axes of `a`.
constexpr Vec3 local(const Mat3& a, Vec3 v) noexcept {
    return {dot(column(a, 0), v), dot(column(a, 1), v), dot(column(a, 2), v)};
}
constexpr Vec3 apply(const Pose& pose, Vec3 point) noexcept { return pose.position + pose.rotation * point; }

/// The pose of a part placed in the axes of a body that stands at `body`.
constexpr Pose placed(const Pose& body, const Pose& part) noexcept {
    return {apply(body, part.position), body.rotation * part.rotation};
}

/// A unit vector normal to the unit vector `n`, the same for the same bits of `n`.
inline Vec3 any_normal_to(Vec3 n) noexcept {
    const Vec3 least = std::abs(n.x) <= std::abs(n.y) && std::abs(n.x) <= std::abs(n.z) ? Vec3{1, 0, 0}
                       : std::abs(n.y) <= std::abs(n.z)                                 ? Vec3{0, 1, 0}
                                                                                        : Vec3{0, 0, 1};
    const Vec3 t = cross(n, least);
    return (1.0 / norm(t)) * t;
}

}  // namespace spook
