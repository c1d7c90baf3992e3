// Contacts without joints against closed forms: impact, rest, overlap, stack, bounce.
#include <random>

#include "contact_world.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

constexpr double h = 1.0 / 60.0;
const Vec3 down{0, 0, -9.81};

ContactOptions options() {
    ContactOptions o;
    o.time_step = h;
    return o;
}
SurfaceMaterial material(double friction = 0.0, double restitution = 0.0, double compliance = 0.0) {
    return {friction, restitution, compliance, 4.5 * h, 0.0};
}
ContactBody ground(SurfaceMaterial m) { return {Primitive::plane({0, 0, 1}), 0.0, {}, {}, {}, {}, {}, m}; }
ContactBody ball(double radius, Vec3 position, SurfaceMaterial m, double mass = 1.0) {
    const double i = 0.4 * mass * radius * radius;
    return {Primitive::sphere(radius), mass, {i, i, i}, position, {}, {}, {}, m};
}
ContactBody box(Vec3 size, Vec3 position, SurfaceMaterial m, double mass = 1.0) {
    return {Primitive::box(size), mass, box_inertia(mass, size), position, {}, {}, {}, m};
}

void one_contact_reverses_its_velocity() {
    for (const double psi : {0.0, 0.3, 0.5, 1.0}) {
        ContactWorld world({ground(material(0, psi)), ball(0.5, {0, 0, 0.5}, material(0, psi))}, {0, 0, 0},
                           options());
        world.bodies[1].velocity = {0.7, 0, -3.0};
        world.step();
        EXPECT_NEAR(world.bodies[1].velocity.z, 3.0 * psi, 1e-14);
        EXPECT(world.bodies[1].velocity.x == 0.7);
    }
}

/// What flies is moved to the time of its impact, t = g/(V + a h) of the step's own fall. Stored velocities lag half a step: it
/// hits with V + a (h/2 + t), leaves with psi times that, and what is left of the step pulls at it again.
void what_flies_bounces_when_it_meets_the_surface() {
    const double speed = 3.0, a = -down.z;
    for (const double psi : {0.3, 0.5, 0.9, 1.0})
        for (const double gap : {1e-3, 0.01, 0.04})
            for (const bool round : {true, false}) {
                const SurfaceMaterial rebounds = material(0, psi);
                ContactWorld world({ground(rebounds), round ? ball(0.5, {0, 0, 0.5 + gap}, rebounds)
                                                            : box({1, 1, 1}, {0, 0, 0.5 + gap}, rebounds)},
                                   down, options());
                world.bodies[1].velocity = {0, 0, -speed};
                world.step();
                const double t = gap / (speed + a * h);
                EXPECT_NEAR(world.bodies[1].velocity.z, psi * (speed + a * (h / 2 + t)) - a * (h / 2 - t),
                            1e-12);
            }
}

void a_fast_body_lands_on_the_surface() {
    ContactWorld world({ground(material()), ball(0.5, {0, 0, 2.0}, material())}, down, options());
    world.bodies[1].velocity = {0, 0, -30.0};
    double lowest = 1e300, fastest = -1e300;
    for (int k = 0; k < 200; ++k) {
        world.step();
        lowest = std::min(lowest, world.bodies[1].position.z);
        fastest = std::max(fastest, world.bodies[1].velocity.z);
    }
    EXPECT_NEAR(lowest, 0.5, 1e-14);
    EXPECT(fastest < 1e-12);
    EXPECT_NEAR(world.stage.cache().force(1, 0, h).z, 9.81, 1e-12);
}

void impacts_never_raise_the_energy() {
    std::mt19937_64 random(17);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int trial = 0; trial < 200; ++trial) {
        std::vector<ContactBody> bodies{ground(material(0, 0.5 + 0.5 * unit(random)))};
        for (int k = 0; k < 6; ++k) {  // a cluster of touching boxes and balls
            const SurfaceMaterial m = material(0, 0.5 + 0.5 * unit(random));
            const Vec3 where{0.9 * (k % 3), 0.3 * unit(random), 0.5 + 0.95 * (k / 3)};
            bodies.push_back(k % 2 ? ball(0.5, where, m, std::exp(3 * unit(random)))
                                   : box({1, 1, 1}, where, m, std::exp(3 * unit(random))));
            bodies.back().velocity = {unit(random), unit(random), unit(random)};
            bodies.back().spin = {unit(random), unit(random), unit(random)};
        }
        ContactWorld world(bodies, {0, 0, 0}, options());
        const double before = world.energy();
        for (int k = 0; k < 3; ++k) world.step();
        EXPECT(world.energy() <= before * (1 + 1e-12));
    }
}

void overlapping_starts_are_not_launched() {
    for (const double depth : {1e-3, 0.1, 0.4}) {
        ContactWorld world({ball(0.5, {0, 0, 0}, material()), ball(0.5, {0, 0, 1.0 - depth}, material())},
                           {0, 0, 0}, options());
        for (int k = 0; k < 300; ++k) world.step();
        EXPECT_NEAR(world.bodies[1].velocity.z - world.bodies[0].velocity.z, 0.0, 1e-6);
        EXPECT_NEAR(world.bodies[1].position.z - world.bodies[0].position.z, 1.0, 1e-6);
    }
    ContactWorld world({ground(material(0.5)), box({1, 1, 1}, {0, 0, 0.3}, material(0.5)),
                        box({1, 1, 1}, {0.1, 0, 1.0}, material(0.5))},
                       down, options());
    double fastest = 0.0;
    for (int k = 0; k < 300; ++k) {
        world.step();
        fastest = std::max({fastest, norm(world.bodies[1].velocity), norm(world.bodies[2].velocity)});
    }
    EXPECT(fastest < 1e-5);
    EXPECT_NEAR(world.bodies[1].position.z, 0.5, 1e-6);
    EXPECT_NEAR(world.bodies[2].position.z, 1.5, 1e-6);
}

void resting_depth_is_compliance_times_load() {
    for (const double theta : {0.5, 4.5}) {
        SurfaceMaterial m = material(0, 0, 1e-4);
        m.damping = theta * h;
        ContactWorld world({ground({0, 0, 0, theta * h, 0}), box({1, 1, 1}, {0, 0, 0.5}, m, 3.0)}, down,
                           options());
        for (int k = 0; k < 600; ++k) world.step();
        EXPECT_NEAR(world.bodies[1].position.z - 0.5, -1e-4 * 3.0 * 9.81 / 4.0, 1e-13);
        EXPECT_NEAR(world.stage.cache().force(1, -1, h).z, 3.0 * 9.81, 1e-9);
        EXPECT_NEAR(world.stage.cache().penetration(), 1e-4 * 3.0 * 9.81 / 4.0, 1e-13);
        EXPECT(world.stage.cache().count() == 4);
    }
}

void every_contact_of_a_stack_carries_what_stands_on_it() {
    const int count = 20;
    std::vector<ContactBody> bodies{ground(material(0.5))};
    for (int k = 0; k < count; ++k) bodies.push_back(box({1, 1, 1}, {0, 0, 0.5 + k}, material(0.5), 2.0));
    ContactWorld world(bodies, down, options());
    const double start = world.energy();
    double highest = start, worst = 0.0;
    for (int k = 0; k < 600; ++k) {
        world.step();
        highest = std::max(highest, world.energy());
        for (int i = 1; i <= count; ++i)
            worst = std::max(
                worst,
                std::abs(world.stage.cache().force(i, i - 1, h).z / ((count - i + 1) * 2.0 * 9.81) - 1.0));
    }
    std::printf("stack: load error %.2g, energy gained %.2g J of %.4g J\n", worst, highest - start, start);
    EXPECT(worst < 1e-9);
    EXPECT(highest - start < 1e-9);
}

void a_ball_bounces_lower_and_stops() {
    const double e = 0.5, g = 9.81, height = 1.0;
    for (const double fine : {1.0, 16.0}) {  // first order: each bounce loses about a g h of speed
        ContactOptions o = options();
        o.time_step = h / fine;
        ContactWorld world({ground(material(0, e)), ball(0.1, {0, 0, 0.1 + height}, material(0, e))}, down,
                           o);
        const double stop = std::sqrt(2.0 * height / g) * (1.0 + e) / (1.0 - e);
        double top = 0.0, before = -1.0, time = 0.0, rest = -1.0;
        int bounces = 0;
        std::vector<double> tops;
        while (time < 2.0 * stop) {
            world.step();
            time += o.time_step;
            const double v = world.bodies[1].velocity.z, z = world.bodies[1].position.z - 0.1;
            if (v > 0.0) top = std::max(top, z);
            if (v <= 0.0 && before > 0.0 && bounces++ < 3) tops.push_back(top), top = 0.0;
            before = v;
            if (z < 1e-9 && std::abs(v) < 1e-9 && rest < 0.0) rest = time;
            if (std::abs(v) > 1e-9) rest = -1.0;
        }
        std::printf("bounce h=%g: heights", o.time_step);
        for (double t : tops) std::printf(" %.5f", t);
        std::printf(" (exact .25 .0625 .015625), stop %.4f (exact %.4f)\n", rest, stop);
        for (std::size_t k = 0; k < tops.size(); ++k)
            EXPECT_NEAR(tops[k], height * std::pow(e, 2.0 * (k + 1)), 2.0 * o.time_step);
        EXPECT_NEAR(rest, stop, 6.0 * o.time_step * (1.0 + std::log2(4.43 / (g * o.time_step)) / 2.0));
        EXPECT(tops.size() == 3);
    }
}

void a_perfect_bounce_goes_on() {
    ContactOptions o = options();
    o.time_step = h / 16;
    ContactWorld world({ground(material(0, 1)), ball(0.1, {0, 0, 1.1}, material(0, 1))}, down, o);
    const double start = world.energy();
    double highest = 0.0;
    for (int k = 0; k < 16 * 60 * 4; ++k) {
        world.step();
        highest = std::max(highest, world.energy());
    }
    std::printf("perfect bounce: energy %.4f of %.4f after 4 s, at most %.4f\n", world.energy(), start,
                highest);
}

}  // namespace

int main() {
    one_contact_reverses_its_velocity();
    what_flies_bounces_when_it_meets_the_surface();
    a_fast_body_lands_on_the_surface();
    impacts_never_raise_the_energy();
    overlapping_starts_are_not_launched();
    resting_depth_is_compliance_times_load();
    every_contact_of_a_stack_carries_what_stands_on_it();
    a_ball_bounces_lower_and_stops();
    a_perfect_bounce_goes_on();
    return report();
}
