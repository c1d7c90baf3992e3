// Contact points of every pair of shapes against closed forms, from tiny to huge, and in degenerate positions.
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "collision/narrow_phase.hpp"
#include "collision/polytope.hpp"
#include "collision/shape_cast.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

Pose at(double x, double y, double z) { return {{x, y, z}, Mat3::identity()}; }
Pose turned(Vec3 position, Vec3 axis, double angle) {
    axis = (1.0 / norm(axis)) * axis;
    const double s = std::sin(0.5 * angle);
    return {position, rotation(Quat{std::cos(0.5 * angle), s * axis.x, s * axis.y, s * axis.z})};
}
void expect_vector(Vec3 v, Vec3 reference, double tolerance, int line) {
    if (norm(v - reference) <= tolerance) return;
    std::printf("line %d: (%g %g %g) is not (%g %g %g)\n", line, v.x, v.y, v.z, reference.x, reference.y,
                reference.z);
    ++failures;
}
/// All that is written of two manifolds: behind the points there is nothing.
bool same_bits(const Manifold& a, const Manifold& b) {
    bool same = a.count == b.count;
    for (std::size_t k = 0; same && k < static_cast<std::size_t>(a.count); ++k) {
        const ContactPoint &p = a.points[k], &q = b.points[k];
        const double one[] = {p.position.x, p.position.y, p.position.z, p.normal.x,
                              p.normal.y,   p.normal.z,   p.gap};
        const double two[] = {q.position.x, q.position.y, q.position.z, q.normal.x,
                              q.normal.y,   q.normal.z,   q.gap};
        same = std::memcmp(one, two, sizeof one) == 0 && p.feature == q.feature;
    }
    return same;
}
#define EXPECT_VECTOR(v, ...) expect_vector(v, __VA_ARGS__, __LINE__)

void spheres() {
    for (const double s : {1e-6, 1.0, 1e6}) {  // scale
        const Primitive one = Primitive::sphere(1.0 * s), two = Primitive::sphere(2.0 * s);
        Manifold m = collide(one, at(0, 0, 3.5 * s), two, at(0, 0, 0), 0.6 * s);
        EXPECT(m.count == 1);
        EXPECT_NEAR(m.points[0].gap, 0.5 * s, 1e-15 * s);
        EXPECT_VECTOR(m.points[0].normal, {0, 0, 1}, 1e-15);
        EXPECT_VECTOR(m.points[0].position, {0, 0, 2.25 * s}, 1e-15 * s);
        EXPECT(collide(one, at(0, 0, 3.5 * s), two, at(0, 0, 0), 0.4 * s).count == 0);
        EXPECT(collide(one, at(0, 3.0 * s, 0), two, at(0, 0, 0), 1e-15 * s).count == 1);  // touching
        m = collide(one, at(0, 0, 0), two, at(0, 0, 0), 0.0);  // coincident centres
        EXPECT(m.count == 1);
        EXPECT_NEAR(m.points[0].gap, -3.0 * s, 1e-15 * s);
        EXPECT_NEAR(norm(m.points[0].normal), 1.0, 1e-15);
    }
}

void planes() {
    const Primitive ground = Primitive::plane({0, 0, 1});
    Manifold m = collide(Primitive::sphere(1.0), at(5, 6, 0.9), ground, at(1, 2, 0), 0.0);
    EXPECT(m.count == 1);
    EXPECT_NEAR(m.points[0].gap, -0.1, 1e-15);
    EXPECT_VECTOR(m.points[0].position, {5, 6, -0.05}, 1e-15);
    m = collide(ground, at(0, 0, 0), Primitive::sphere(1.0), at(5, 6, 0.9),
                0.0);  // swapped: normal from second
    EXPECT_VECTOR(m.points[0].normal, {0, 0, -1}, 0.0);

    m = collide(Primitive::box({1, 2, 4}), at(0, 0, 2), ground, at(0, 0, 0), 0.0);
    EXPECT(m.count == 4);
    for (int k = 0; k < m.count; ++k) EXPECT(m.points[k].gap == 0.0 && m.points[k].normal.z == 1.0);
    m = collide(Primitive::box({1, 1, 1}), turned({0, 0, 0}, {1, 0, 0}, 0.25 * M_PI), ground, at(0, 0, 0),
                -0.5);
    EXPECT(m.count == 2);  // on its edge, √½ deep
    EXPECT_NEAR(m.points[0].gap, -std::sqrt(0.5), 1e-15);

    m = collide(Primitive::capsule(0.5, 2.0), turned({0, 0, 0.5}, {0, 1, 0}, 0.5 * M_PI), ground, at(0, 0, 0),
                1e-12);
    EXPECT(m.count == 2);
    m = collide(Primitive::capsule(0.5, 2.0), at(0, 0, 1.4), ground, at(0, 0, 0), 0.0);
    EXPECT(m.count == 1);
    EXPECT_NEAR(m.points[0].gap, -0.1, 1e-15);
    EXPECT(collide(ground, at(0, 0, 0), ground, at(0, 0, -1), 1.0).count == 0);
}

void sphere_and_box() {
    const Primitive ball = Primitive::sphere(0.5), box = Primitive::box({2, 2, 2});
    Manifold m = collide(ball, at(0.3, 0.4, 1.6), box, at(0, 0, 0), 0.2);
    EXPECT_NEAR(m.points[0].gap, 0.1, 1e-15);  // over a face
    EXPECT_VECTOR(m.points[0].normal, {0, 0, 1}, 0.0);
    m = collide(ball, at(2, 2, 2), box, at(0, 0, 0), 2.0);  // off a corner
    EXPECT_NEAR(m.points[0].gap, std::sqrt(3.0) - 0.5, 1e-15);
    EXPECT_VECTOR(m.points[0].normal, std::sqrt(1.0 / 3.0) * Vec3{1, 1, 1}, 1e-15);
    m = collide(ball, at(0, -0.9, 0.1), box, at(0, 0, 0),
                0.0);  // centre inside: out through the nearest face
    EXPECT_NEAR(m.points[0].gap, -0.6, 1e-15);
    EXPECT_VECTOR(m.points[0].normal, {0, -1, 0}, 0.0);
    m = collide(ball, at(0, 0, 0), box, at(0, 0, 0), 0.0);  // coincident centres
    EXPECT_NEAR(m.points[0].gap, -1.5, 1e-15);
}

void capsules() {
    const Primitive c = Primitive::capsule(0.5, 2.0);
    Manifold m = collide(c, turned({0, 0, 1.2}, {0, 1, 0}, 0.5 * M_PI), c,
                         turned({0, 0, 0}, {1, 0, 0}, 0.5 * M_PI), 0.5);
    EXPECT(m.count == 1);  // crossing
    EXPECT_NEAR(m.points[0].gap, 0.2, 1e-15);
    EXPECT_VECTOR(m.points[0].normal, {0, 0, 1}, 1e-15);
    m = collide(c, at(0.9, 0, 0.5), c, at(0, 0, 0), 0.0);  // side by side: both ends of the shared stretch
    EXPECT(m.count == 2);
    EXPECT_NEAR(m.points[0].gap, -0.1, 1e-15);
    EXPECT_NEAR(m.points[0].position.z + m.points[1].position.z, 0.5, 1e-15);
    EXPECT_NEAR(std::abs(m.points[0].position.z - m.points[1].position.z), 1.5, 1e-15);
    m = collide(c, at(0, 0, 2.8), c, at(0, 0, 0), 0.0);  // in line
    EXPECT(m.count == 1);
    EXPECT_VECTOR(m.points[0].normal, {0, 0, 1}, 1e-15);
    EXPECT_NEAR(m.points[0].gap, -0.2, 1e-15);
    m = collide(c, at(0, 0, 0), c, at(0, 0, 0), 0.0);  // coincident: pushed sideways
    EXPECT(m.count == 2);
    EXPECT_NEAR(m.points[0].normal.z, 0.0, 0.0);
    m = collide(Primitive::sphere(0.5), at(0.8, 0, 0.3), c, at(0, 0, 0), 0.0);
    EXPECT_NEAR(m.points[0].gap, -0.2, 1e-15);
    EXPECT_VECTOR(m.points[0].normal, {1, 0, 0}, 0.0);
}

void capsule_and_box() {
    const Primitive c = Primitive::capsule(0.5, 2.0), box = Primitive::box({2, 2, 2});
    Manifold m = collide(c, turned({0, 0, 1.4}, {0, 1, 0}, 0.5 * M_PI), box, at(0, 0, 0), 0.0);
    EXPECT(m.count == 2);  // lying on a face
    for (int k = 0; k < m.count; ++k) {
        EXPECT_NEAR(m.points[k].gap, -0.1, 1e-14);
        EXPECT_VECTOR(m.points[k].normal, {0, 0, 1}, 1e-15);
    }
    m = collide(c, turned({0.7, 0, 1.4}, {0, 1, 0}, 0.5 * M_PI), box, at(0, 0, 0), 0.0);
    EXPECT(m.count == 2);  // hanging over: the stretch above the face ends at the edge
    EXPECT_NEAR(std::max(m.points[0].position.x, m.points[1].position.x), 1.0, 1e-8);
    m = collide(c, at(0, 0, 2.4), box, at(0, 0, 0), 0.0);  // upright: one point
    EXPECT(m.count == 1);
    EXPECT_NEAR(m.points[0].gap, -0.1, 1e-14);
    m = collide(c, at(1.3, 1.4, 0), box, at(0, 0, 0), 0.0);  // along a vertical edge: both ends
    EXPECT(m.count == 2);
    EXPECT_NEAR(m.points[0].gap, 0.0, 1e-14);
    EXPECT_VECTOR(m.points[1].normal, {0.6, 0.8, 0}, 1e-14);
    m = collide(c, turned({1.2, 0, 1.2}, {1, 0, -1}, 0.5 * M_PI), box, at(0, 0, 0), 0.0);  // across an edge
    EXPECT(m.count >= 1);
    m = collide(c, turned({0, 0, 0.8}, {0, 1, 0}, 0.5 * M_PI), box, at(0, 0, 0), 0.0);  // core cuts the box
    EXPECT(m.count == 2);
    EXPECT_NEAR(m.points[0].gap, -0.7, 1e-14);
    EXPECT_VECTOR(m.points[0].normal, {0, 0, 1}, 1e-15);
    EXPECT(collide(c, at(0, 0, 0), box, at(0, 0, 0), 0.0).count > 0);
}

void faces_of_boxes() {
    for (const double s : {1e-6, 1.0, 1e6}) {
        const Primitive box = Primitive::box({s, s, s});
        Manifold m = collide(box, at(0, 0, 0.99 * s), box, at(0, 0, 0), 0.0);
        EXPECT(m.count == 4);  // stacked: the four corners
        for (int k = 0; k < m.count; ++k) {
            EXPECT_NEAR(m.points[k].gap, -0.01 * s, 1e-15 * s);
            EXPECT_VECTOR(m.points[k].normal, {0, 0, 1}, 0.0);
            EXPECT_NEAR(std::abs(m.points[k].position.x), 0.5 * s, 1e-15 * s);
            EXPECT_NEAR(m.points[k].position.z, 0.495 * s, 1e-15 * s);
        }
        m = collide(box, at(0.25 * s, 0, s), box, at(0, 0, 0), 0.0);  // touching exactly, shifted
        EXPECT(m.count == 4);
        double low = 1e300, high = -1e300;
        for (int k = 0; k < m.count; ++k) {
            low = std::min(low, m.points[k].position.x);
            high = std::max(high, m.points[k].position.x);
        }
        EXPECT_NEAR(low, -0.25 * s, 1e-15 * s);
        EXPECT_NEAR(high, 0.5 * s, 1e-15 * s);
        m = collide(box, at(0, 0, 0), box, at(0, 0, 0), 0.0);  // coincident
        EXPECT(m.count == 4);
        EXPECT_NEAR(m.points[0].gap, -s, 1e-15 * s);
        EXPECT(collide(box, at(0, 0, 1.1 * s), box, at(0, 0, 0), 0.05 * s).count == 0);
        EXPECT(collide(box, at(0, 0, 1.1 * s), box, at(0, 0, 0), 0.2 * s).count == 4);
    }
    // Turned by 45 degrees the whole octagon is kept.
    const Primitive unit = Primitive::box({1, 1, 1});
    Manifold m = collide(unit, turned({0, 0, 1}, {0, 0, 1}, 0.25 * M_PI), unit, at(0, 0, 0), 1e-12);
    EXPECT(m.count == 8);
    for (int k = 0; k < m.count; ++k)
        for (int j = 0; j < k; ++j) EXPECT(m.points[k].feature != m.points[j].feature);
    // A small box in the middle of a huge one: its own four corners, whichever comes first.
    const Primitive huge = Primitive::box({1e4, 1e4, 1}), tiny = Primitive::box({1e-2, 1e-2, 1e-2});
    m = collide(tiny, at(3, 4, 0.505), huge, at(0, 0, 0), 1e-9);
    EXPECT(m.count == 4);
    EXPECT_NEAR(std::abs(m.points[0].position.x - 3), 5e-3, 1e-12);
    m = collide(huge, at(0, 0, 0), tiny, at(3, 4, 0.505), 1e-9);
    EXPECT(m.count == 4);
    EXPECT_VECTOR(m.points[0].normal, {0, 0, -1}, 1e-15);
}

void edges_of_boxes() {
    const Primitive unit = Primitive::box({1, 1, 1});
    const double r = std::sqrt(0.5);
    // Two boxes standing on edges, crossed: the upper one's lowest edge along y, the lower one's highest along x.
    Manifold m = collide(unit, turned({0, 0, 2 * r - 0.01}, {0, 1, 0}, 0.25 * M_PI), unit,
                         turned({0, 0, 0}, {1, 0, 0}, 0.25 * M_PI), 0.0);
    EXPECT(m.count == 1);
    EXPECT_NEAR(m.points[0].gap, -0.01, 1e-15);
    EXPECT_VECTOR(m.points[0].normal, {0, 0, 1}, 1e-15);
    EXPECT_VECTOR(m.points[0].position, {0, 0, r - 0.005}, 1e-15);
    // A corner on a face.
    const Pose corner =
        turned({0, 0, 0.5 + 0.5 * std::sqrt(3.0) - 0.01}, {1, -1, 0}, std::acos(std::sqrt(1.0 / 3.0)));
    m = collide(unit, corner, unit, at(0, 0, 0), 0.0);
    EXPECT(m.count == 1);
    EXPECT_NEAR(m.points[0].gap, -0.01, 1e-14);
    EXPECT_VECTOR(m.points[0].normal, {0, 0, 1}, 1e-14);
}

/// Largest separation of two boxes over many directions: an upper bound is exact for the right direction.
double separation(Vec3 half_a, const Pose& a, Vec3 half_b, const Pose& b, Vec3 n) {
    double reach = 0.0;
    for (int i = 0; i < 3; ++i)
        reach += half_a[i] * std::abs(dot(n, column(a.rotation, i))) +
                 half_b[i] * std::abs(dot(n, column(b.rotation, i)));
    return dot(n, a.position - b.position) - reach;
}

void random_boxes_keep_their_promises() {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    auto vector = [&] { return Vec3{unit(random), unit(random), unit(random)}; };
    int touching = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        const Vec3 half_a{0.2 + std::abs(unit(random)), 0.2 + std::abs(unit(random)),
                          0.2 + std::abs(unit(random))};
        const Vec3 half_b{0.2 + std::abs(unit(random)), 0.2 + std::abs(unit(random)),
                          0.2 + std::abs(unit(random))};
        const Primitive a = Primitive::box(2.0 * half_a), b = Primitive::box(2.0 * half_b);
        const Pose pa = turned(1.5 * vector(), vector(), 3.0 * unit(random)),
                   pb = turned(vector(), vector(), 3.0 * unit(random));
        const Manifold m = collide(a, pa, b, pb, 0.0), again = collide(a, pa, b, pb, 0.0),
                       swapped = collide(b, pb, a, pa, 0.0);
        EXPECT(same_bits(m, again));
        EXPECT((m.count > 0) == (swapped.count > 0));
        double best = -1e300;  // along sampled directions, faces included
        for (int i = 0; i < 3; ++i)
            for (const double sign : {-1.0, 1.0}) {
                best = std::max(best, separation(half_a, pa, half_b, pb, sign * column(pa.rotation, i)));
                best = std::max(best, separation(half_a, pa, half_b, pb, sign * column(pb.rotation, i)));
            }
        if (m.count == 0) {
            // Nothing was found: then some direction must separate them, a face or a cross of edges.
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) {
                    const Vec3 axis = cross(column(pa.rotation, i), column(pb.rotation, j));
                    if (norm(axis) < 1e-6) continue;
                    for (const double sign : {-1.0, 1.0})
                        best = std::max(best, separation(half_a, pa, half_b, pb, (sign / norm(axis)) * axis));
                }
            EXPECT(best >= 0.0);
            continue;
        }
        ++touching;
        double deepest = 0.0;
        for (int k = 0; k < m.count; ++k) {
            EXPECT_NEAR(norm(m.points[k].normal), 1.0, 1e-12);
            deepest = std::min(deepest, m.points[k].gap);
        }
        // The depth is that of the axis, the least of all up to the preference for faces; moving the first
        // along the normal by the depth frees it.
        const double along = separation(half_a, pa, half_b, pb, m.points[0].normal);
        EXPECT(deepest >= along - 1e-12);
        EXPECT(along >= best - 1e-4);
        Pose moved = pa;
        moved.position += (1e-9 - along) * m.points[0].normal;
        EXPECT(collide(a, moved, b, pb, 0.0).count == 0);
    }
    EXPECT(touching > 5000);
}

/// A prism over five to twelve corners, pulled and sheared in all directions.
Primitive sheared_prism(std::mt19937_64& random) {
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const int n = 5 + static_cast<int>(random() % 8);
    Mat3 pull = Mat3::identity();
    for (double& x : pull.m) x += 0.4 * unit(random);
    std::vector<Vec3> corners;
    std::vector<int> loops, counts;
    for (const double z : {-0.7, 0.7})
        for (int k = 0; k < n; ++k)
            corners.push_back(pull * Vec3{std::cos(2.0 * M_PI * k / n), std::sin(2.0 * M_PI * k / n), z});
    for (int k = n - 1; k >= 0; --k) loops.push_back(k);
    for (int k = 0; k < n; ++k) loops.push_back(n + k);
    counts = {n, n};
    for (int k = 0; k < n; ++k) {
        const int next = (k + 1) % n;
        for (const int corner : {k, next, n + next, n + k}) loops.push_back(corner);
        counts.push_back(4);
    }
    return Primitive::convex(std::make_shared<const Polytope>(corners, loops, counts));
}

void solids_are_as_far_apart_as_their_best_axis_says() {
    std::mt19937_64 random(9);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    auto vector = [&] { return Vec3{unit(random), unit(random), unit(random)}; };
    int apart = 0, overlapping = 0, edges = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const Primitive one = sheared_prism(random), two = sheared_prism(random);
        const Pose here = turned({}, vector(), 3.0 * unit(random)),
                   there =
                       turned((1.0 + 1.5 * std::abs(unit(random))) * vector(), vector(), 3.0 * unit(random));
        double faces = -1e300, best = -1e300;
        // Of two edges only where they are what lies nearest along the axis.
        const auto look = [&](Vec3 n, const Vec3* on = nullptr, const Vec3* other = nullptr) {
            double lowest = 1e300, highest = -1e300;
            for (const Vec3& c : one.hull->corners) lowest = std::min(lowest, dot(n, apply(here, c)));
            for (const Vec3& c : two.hull->corners) highest = std::max(highest, dot(n, apply(there, c)));
            if (on && dot(n, apply(here, *on)) > lowest + 1e-12) return;
            if (other && dot(n, apply(there, *other)) < highest - 1e-12) return;
            best = std::max(best, lowest - highest);
        };
        for (const Polytope::Face& face : one.hull->faces) look(-(here.rotation * face.normal));
        for (const Polytope::Face& face : two.hull->faces) look(there.rotation * face.normal);
        faces = best;
        for (const Polytope::Edge& a : one.hull->edges)
            for (const Polytope::Edge& b : two.hull->edges) {
                const Vec3 &from = one.hull->corners[a.from], &other_from = two.hull->corners[b.from];
                const Vec3 axis = cross(here.rotation * (one.hull->corners[a.to] - from),
                                        there.rotation * (two.hull->corners[b.to] - other_from));
                if (norm(axis) < 1e-3) continue;
                for (const double sign : {-1.0, 1.0}) look((sign / norm(axis)) * axis, &from, &other_from);
            }
        const Separation found = spook::separation(one, here, two, there);
        EXPECT_NEAR(found.gap, best, 1e-12);
        ++(best > 0.0 ? apart : overlapping);
        edges += best > faces;
        const Separation near =
            spook::separation(one, here, two, there, 0.2);  // no further than it must look
        EXPECT(faces > 0.2 ? near.gap > 0.2 && near.gap <= best + 1e-12 : near.gap == found.gap);
    }
    EXPECT(apart > 500 && overlapping > 500 && edges > 500);
}

/// The distance from the capsule's core to the box, by sampling: never below what the pair says.
void random_capsules_match_sampling() {
    std::mt19937_64 random(8);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    auto vector = [&] { return Vec3{unit(random), unit(random), unit(random)}; };
    int apart = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const Primitive c = Primitive::capsule(0.3, 2.0), box = Primitive::box({1.0, 1.4, 0.8});
        const Pose pc = turned(2.0 * vector(), vector(), 3.0 * unit(random)),
                   pb = turned({}, vector(), 3.0 * unit(random));
        const Manifold m = collide(c, pc, box, pb, 100.0);
        EXPECT(m.count >= 1);
        double sampled = 1e300;
        for (int k = 0; k <= 2000; ++k) {
            const Vec3 p =
                local(pb.rotation, pc.position + (k / 1000.0 - 1.0) * column(pc.rotation, 2) - pb.position);
            Vec3 out;
            for (int i = 0; i < 3; ++i) out[i] = std::max(0.0, std::abs(p[i]) - box.half[i]);
            sampled = std::min(sampled, norm(out));
        }
        double gap = 1e300;
        for (int k = 0; k < m.count; ++k) gap = std::min(gap, m.points[k].gap);
        if (sampled > 1e-3) {
            ++apart;
            EXPECT(gap + 0.3 <= sampled + 1e-9);
            EXPECT(gap + 0.3 >= sampled - 1e-3);
        } else if (sampled == 0.0) {
            EXPECT(gap <= -0.3);
        }
    }
    EXPECT(apart > 500);
}

}  // namespace

int main() {
    spheres();
    planes();
    sphere_and_box();
    capsules();
    capsule_and_box();
    faces_of_boxes();
    edges_of_boxes();
    random_boxes_keep_their_promises();
    solids_are_as_far_apart_as_their_best_axis_says();
    random_capsules_match_sampling();
    return report();
}
