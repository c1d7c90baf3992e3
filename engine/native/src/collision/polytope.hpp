// Convex polytopes: corners and flat faces, in their own axes.
#pragma once

#include <vector>

#include "linear/vec.hpp"

namespace spook {

struct Polytope {
    static constexpr int most_corners = 64, most_round_a_face = 16;
    static constexpr int most_faces = 2 * most_corners - 4;  // all of them triangles (Euler)

    struct Face {
        int begin, count;  // its corners in `loops`, anticlockwise seen from outside
        Vec3 normal;       // unit, outwards
        double offset;     // normal · corner, m
        double area;       // m²
    };
    struct Edge {
        int from, to;     // corners
        int left, right;  // the faces it parts
    };

    std::vector<Vec3> corners;  // m
    std::vector<int> loops;
    std::vector<Face> faces;
    std::vector<Edge> edges;
    double reach = 0.0;      // of the farthest corner from the origin, m
    double thickness = 0.0;  // least over the faces: how far the corner opposite lies below, m
    double volume = 0.0;     // m³

    /// From corners and the loops of faces, `counts[k]` indices each. Throws std::invalid_argument where an edge does
    /// not part two faces, or there are more corners or faces than the limits above.
    Polytope(std::vector<Vec3> corners, std::vector<int> loops, const std::vector<int>& counts);

    /// The corner k of a face, 0 … count − 1 and round again.
    Vec3 corner_of(const Face& face, int k) const noexcept {
        const int place = face.begin + k % face.count;
        return corners[static_cast<std::size_t>(loops[static_cast<std::size_t>(place)])];
    }
};

/// The cube of edges 2 about the origin: a box is it, stretched.
const Polytope& cube();

/// The point of a polytope nearest to `p`; inside, the nearest face decides and the height is negative.
struct Nearest {
    Vec3 on, normal;  // normal: unit, from the polytope to p
    double height;    // m
};
Nearest nearest(const Polytope& polytope, Vec3 p) noexcept;

/// Largest n · corner.
double farthest(const Polytope& polytope, Vec3 n) noexcept;

}  // namespace spook
