// Steps with contacts allocate nothing once the arrays have their size: what a run has needed, its repetition finds.
#include <atomic>
#include <cstdlib>
#include <new>

#include "expect.hpp"
#include "rigid/rigid_stages.hpp"
#include "rigid/rigid_system.hpp"

namespace {

std::atomic<long> allocations{0};

void* counted(std::size_t size, std::size_t alignment) {
    ++allocations;
    void* p = nullptr;
    if (alignment <= alignof(std::max_align_t)) p = std::malloc(size);
    else if (posix_memalign(&p, alignment, size) != 0) p = nullptr;
    if (p == nullptr) throw std::bad_alloc{};
    return p;
}

}  // namespace

void* operator new(std::size_t size) { return counted(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
    return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {  // sorting asks for memory so
    ++allocations;
    return std::malloc(size);
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

using namespace spook;

namespace {

constexpr SolverKind every[] = {SolverKind::direct, SolverKind::iterative};
const char* name(SolverKind solver) { return to_text(solver).c_str(); }

RigidScene ground(SolverKind solver) {
    RigidScene scene;
    scene.gravity = {0, 0, -9.81};
    scene.method.time_step = 1.0 / 60.0;
    scene.method.solver = solver;
    scene.method.iterations = 10;
    RigidBodySpec floor;
    floor.motion = Motion::fixed;
    floor.material.friction = 0.5;
    scene.bodies.push_back(floor);
    scene.colliders.push_back({0, Primitive::plane({0, 0, 1}), {}});
    return scene;
}

void add(RigidScene& scene, const Primitive& shape, Vec3 position, double inertia, double restitution = 0.0) {
    RigidBodySpec body;
    body.mass = 1.0;
    body.inertia = {inertia, inertia, inertia};
    body.position = position;
    body.material.friction = 0.5;
    body.material.restitution = restitution;
    scene.colliders.push_back({static_cast<int>(scene.bodies.size()), shape, {}});
    scene.bodies.push_back(body);
}

/// Edges of .5 m, each on the one before.
RigidScene stack(SolverKind solver, int boxes) {
    RigidScene scene = ground(solver);
    for (int k = 0; k < boxes; ++k)
        add(scene, Primitive::box({0.5, 0.5, 0.5}), {0.0, 0.0, 0.25 + 0.5 * k}, 1.0 / 24.0);
    return scene;
}

/// In layers of four by four, none straight over another; of every third shape, or of spheres.
RigidScene heap(SolverKind solver, int count, bool mixed, double restitution = 0.0) {
    RigidScene scene = ground(solver);
    const Primitive shapes[] = {Primitive::sphere(0.25), Primitive::box({0.4, 0.4, 0.4}),
                                Primitive::capsule(0.15, 0.4)};
    for (int k = 0; k < count; ++k) {
        const Vec3 jitter{0.017 * (k * 7 % 5 - 2), 0.013 * (k * 5 % 7 - 3), 0.0};
        const Vec3 place{0.55 * (k % 4), 0.55 * (k / 4 % 4), 0.3 + 0.55 * (k / 16)};
        add(scene, shapes[mixed ? k % 3 : 0], place + jitter, 0.025, restitution);
    }
    return scene;
}

/// Where `steps` steps have led, so many more allocate nothing.
void rests_without_allocating(const char* what, const RigidScene& scene, int steps, int more) {
    RigidSystem system(scene, StageList(choose_stages(scene, false)));
    system.reset(nullptr);
    system.advance(steps);
    const long before = allocations;
    system.advance(more);
    const long found = allocations - before;
    if (found != 0)
        std::printf("%s, %s: %.1f allocations a step at rest\n", what, name(scene.method.solver),
                    static_cast<double>(found) / more);
    EXPECT(found == 0);
}

/// A fall taken back and done again: every array has the size it needs. Eight times before, since the search for pairs goes on from
/// what it has kept, where the fall has led.
void falls_again_without_allocating(const char* what, const RigidScene& scene, int steps) {
    RigidSystem system(scene, StageList(choose_stages(scene, false)));
    system.reset(nullptr);
    system.save();
    for (int fall = 0; fall < 8; ++fall) {
        system.advance(steps);
        system.restore();
    }
    const long before = allocations;
    system.advance(steps);
    const long found = allocations - before;
    if (found != 0)
        std::printf("%s, %s: %.1f allocations a step in a fall that is repeated\n", what,
                    name(scene.method.solver), static_cast<double>(found) / steps);
    EXPECT(found == 0);
}

void what_rests_allocates_nothing() {
    for (const SolverKind solver : every) {
        rests_without_allocating("one box", stack(solver, 1), 60, 60);
        rests_without_allocating("stack", stack(solver, 20), 100, 60);
        rests_without_allocating("heap of spheres", heap(solver, 48, false), 900, 60);
        rests_without_allocating("mixed heap", heap(solver, 12, true), 900, 60);
    }
}

void what_falls_grows_arrays_and_no_more() {
    for (const SolverKind solver : every) {
        falls_again_without_allocating("heap of spheres", heap(solver, 48, false), 60);
        falls_again_without_allocating("mixed heap", heap(solver, 24, true), 60);
        falls_again_without_allocating("mixed heap that rebounds", heap(solver, 24, true, 0.4), 60);
    }
}

/// What keeps a run for taking it back writes over what it kept before.
void keeping_a_run_allocates_nothing() {
    for (const SolverKind solver : every) {
        const RigidScene scene = stack(solver, 20);
        RigidSystem system(scene, StageList(choose_stages(scene, false)));
        system.reset(nullptr);
        system.advance(100);
        system.save();
        const long before = allocations;
        system.advance(1);
        system.save();
        EXPECT(allocations == before);
    }
}

}  // namespace

int main() {
    what_rests_allocates_nothing();
    what_falls_grows_arrays_and_no_more();
    keeping_a_run_allocates_nothing();
    return report();
}
