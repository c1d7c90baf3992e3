// Which scenes are solved in joint coordinates, with how many unknowns, and the band solver beneath.
#include "rigid/joint_tree.hpp"

#include "expect.hpp"

using namespace spook;

namespace {

struct World {
    RigidScene scene;

    int body(Vec3 place, bool particle = false, Motion motion = Motion::dynamic) {
        RigidBodySpec spec;
        spec.motion = motion;
        spec.particle = particle;
        spec.mass = 2.0;
        spec.inertia = {0.1, 0.2, 0.15};
        spec.position = place;
        scene.bodies.push_back(spec);
        return static_cast<int>(scene.bodies.size()) - 1;
    }
    void joint(JointKind kind, int first, int second, Vec3 at, std::array<Vec3, 3> axes) {
        JointSpec spec;
        spec.kind = kind;
        spec.first = first;
        spec.second = second;
        spec.first_point = spec.second_point = at;
        spec.axes = axes;
        scene.joints.push_back(spec);
    }
    void hinge(int first, int second, Vec3 at) {  // about z
        joint(JointKind::hinge, first, second, at, {Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, 1, 0}});
    }
    int coordinates() const {
        const JointSet joints(scene, 0.01);
        std::vector<BodyConstants> constants;
        LargeArray<BodyState> start;
        std::vector<int> tied;
        for (const RigidBodySpec& spec : scene.bodies) {
            constants.push_back(constants_of(spec));
            start.push_back(start_of(spec, constants.back()));
            if (spec.motion == Motion::dynamic) tied.push_back(static_cast<int>(constants.size()) - 1);
        }
        JointTree tree;
        tree.analyse(constants, joints, tied, start);
        if (tree.coordinates() > 0) EXPECT(tree.holds(start));
        return tree.coordinates();
    }
};

void a_door_has_one_coordinate_however_many_hinges() {
    World world;
    const int door = world.body({0.5, 0, 0});
    for (double height : {-0.75, 0.0, 0.75}) world.hinge(-1, door, {0, 0, height});
    EXPECT(world.coordinates() == 1);
}

void loops_in_a_plane_keep_their_two_rows() {
    World world;
    const int left = world.body({0, 0.5, 0}), right = world.body({1, 0.5, 0}), top = world.body({0.5, 1, 0});
    world.hinge(-1, left, {0, 0, 0});
    world.hinge(-1, right, {1, 0, 0});
    world.hinge(left, top, {0, 1, 0});
    world.hinge(right, top, {1, 1, 0});
    EXPECT(world.coordinates() == 3);  // three hinges of the tree; the fourth closes the loop
}

void every_free_direction_is_a_coordinate() {
    const std::array<Vec3, 3> axes{Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, 1, 0}};
    const auto alone = [&](JointKind kind, bool backwards) {
        World world;
        const int body = world.body({0.5, 0.2, 0});
        world.joint(kind, backwards ? body : -1, backwards ? -1 : body, {0.1, 0, 0}, axes);
        return world.coordinates();
    };
    for (const bool backwards : {false, true}) {
        EXPECT(alone(JointKind::hinge, backwards) == 1);
        EXPECT(alone(JointKind::ball, backwards) == 3);
        EXPECT(alone(JointKind::prismatic, backwards) == 1);
        EXPECT(alone(JointKind::cylindrical, backwards) == 2);
        EXPECT(alone(JointKind::universal, backwards) == 0);  // not known to it
    }
    EXPECT(alone(JointKind::planar, false) == 3);
    EXPECT(alone(JointKind::planar, true) == 0);  // its slides turn with the body
    EXPECT(alone(JointKind::point_on_line, false) == 4);
}

void what_floats_has_six_coordinates_more() {
    World floating;
    for (double x : {0.0, 1.0, 2.0}) floating.body({x, 0, 0});
    floating.hinge(0, 1, {0.5, 0, 0});
    floating.hinge(2, 1, {1.5, 0, 0});
    EXPECT(floating.coordinates() == 8);

    // Held after all, by a joint not known here: left to the rows.
    floating.joint(JointKind::universal, -1, 2, {2, 0, 0}, {Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, 1, 0}});
    EXPECT(floating.coordinates() == 0);
}

void what_it_cannot_do_is_left_to_the_rows() {
    World point;
    point.body({0, 0, 0}, true);
    point.joint(JointKind::ball, -1, 0, {0, 0, 0}, {Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, 1, 0}});
    EXPECT(point.coordinates() == 0);

    World driven;
    driven.body({0, 0, 0}, false, Motion::kinematic);
    driven.body({1, 0, 0});
    driven.hinge(0, 1, {0.5, 0, 0});
    EXPECT(driven.coordinates() == 0);

    World anisotropic;  // both bars of a loop in one line: its rows depend on each other
    const int left = anisotropic.body({0.5, 0, 0}), right = anisotropic.body({1.5, 0, 0});
    anisotropic.hinge(-1, left, {0, 0, 0});
    anisotropic.hinge(left, right, {1, 0, 0});
    anisotropic.hinge(-1, right, {2, 0, 0});
    EXPECT(anisotropic.coordinates() == 0);
}

void a_band_is_solved_with_row_exchange() {
    constexpr int N = 23, REACH = 3;
    double matrix[N][N] = {}, x[N], right[N] = {};
    unsigned seed = 7;
    const auto random = [&seed] {
        seed = seed * 1664525u + 1013904223u;
        return static_cast<double>(seed) / 4294967296.0 - 0.5;
    };
    BandLu lu;
    lu.prepare(N, REACH);
    for (int round = 0; round < 2; ++round) {
        lu.clear();
        for (int i = 0; i < N; ++i) {
            x[i] = random();
            right[i] = 0.0;
            for (int j = 0; j < N; ++j)
                matrix[i][j] = std::abs(i - j) > REACH || (i == j && i % 3 == 0) ? 0.0 : random();
        }
        for (int i = 0; i < N; ++i)
            for (int j = 0; j < N; ++j) {
                right[i] += matrix[i][j] * x[j];
                if (std::abs(i - j) <= REACH) lu.at(i, j) = matrix[i][j];
            }
        EXPECT(lu.factor());
        lu.solve(right);
        for (int i = 0; i < N; ++i) EXPECT_NEAR(right[i], x[i], 1e-11);
    }
    lu.clear();
    EXPECT(!lu.factor());
}

}  // namespace

int main() {
    a_door_has_one_coordinate_however_many_hinges();
    loops_in_a_plane_keep_their_two_rows();
    every_free_direction_is_a_coordinate();
    what_floats_has_six_coordinates_more();
    what_it_cannot_do_is_left_to_the_rows();
    a_band_is_solved_with_row_exchange();
    return report();
}
