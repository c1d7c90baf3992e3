// Particles without Python: no allocation in a step, one answer from every solver, failures found to the step.
#include <atomic>
#include <cstdlib>
#include <new>

#include "expect.hpp"
#include "particles/particle_program.hpp"
#include "particles/path_order.hpp"

namespace {
std::atomic<long> allocations{0};
}

void* operator new(std::size_t size) {
    ++allocations;
    if (void* p = std::malloc(size)) return p;
    throw std::bad_alloc{};
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

using namespace spook;

namespace {

ParticleScene chain(int links) {
    ParticleScene scene;
    scene.gravity = {0.0, 0.0, -9.81};
    scene.method.time_step = 1.0 / 60.0;
    for (int i = 0; i < links; ++i) {
        scene.bodies.push_back({1.0, {i + 1.0, 0.0, 0.0}, {}, {}});
        scene.rows.push_back({{{i - 1, {}}, {i, {}}}, 1.0, 1e-13, 1.0 / 60.0});
    }
    return scene;
}

ParticleSystem system_of(const ParticleScene& scene) {
    return {scene, StageList(choose_stages(scene, false))};
}

Vec3 tip_after(const ParticleScene& scene, int steps) {
    ParticleSystem system = system_of(scene);
    system.reset(nullptr);
    system.advance(steps);
    return system.readings().position(static_cast<int>(scene.bodies.size()) - 1);
}

void a_step_allocates_nothing() {
    for (const int kind : {0, 1, 2, 3, 4, 5, 6, 7}) {
        ParticleScene scene = chain(kind == 5 ? 1 : 8);
        scene.method.iterative = kind == 1;
        scene.method.force_block = kind == 2;
        scene.method.string_stiffness = kind == 3;
        scene.method.corrections = kind == 4 ? 2 : 0;
        if (kind == 5) scene.rows.clear();
        if (kind >= 6) scene.method.composition = 4;
        if (kind == 7) scene.method.time_step = 0.2;  // steps are halved
        ParticleProgram program(
            scene, {{"violation", -1, {}}, {"energy", -1, {}}},
            {{0, Reduction::maximum_absolute, 0, -1, false, 1}, {1, Reduction::final, 0, -1, false, 1}});
        ParticleSystem system = system_of(scene);
        system.reset(nullptr);
        system.advance(1);
        const long before = allocations;
        system.advance(500);
        EXPECT(allocations == before);
        long few, many;
        program.run(10, 0.0, false);
        {
            const long start = allocations;
            program.run(10, 0.0, false);
            few = allocations - start;
        }
        {
            const long start = allocations;
            program.run(1000, 0.0, false);
            many = allocations - start;
        }
        EXPECT(few == many);  // observing included: what is allocated does not grow with the steps
    }
}

void every_direct_solver_gives_one_answer() {
    ParticleScene scene = chain(6);
    const Vec3 path = tip_after(scene, 60);
    scene.method.force_block = true;
    EXPECT(norm(tip_after(scene, 60) - path) < 1e-11);
    scene.method.force_block = false;
    scene.method.iterative = true;
    scene.method.iterations = 5000;
    scene.method.residual_tolerance = 1e-13;
    EXPECT(norm(tip_after(scene, 60) - path) < 1e-8);
}

template <class Build> bool is_refused(Build build) {
    try {
        build();
    } catch (const std::invalid_argument&) {
        return true;
    }
    return false;
}

/// Nothing but the list decides: what it leaves out does not happen, what it cannot have is refused.
void only_the_listed_stages_run() {
    ParticleScene falling = chain(1);
    falling.rows.clear();
    falling.bodies[0].load = {3.0, 0.0, 0.0};
    const auto after = [&](StageList stages) {
        ParticleSystem system(falling, stages);
        system.reset(nullptr);
        system.advance(10);
        return system.readings().position(0) - falling.bodies[0].position;
    };
    const Stage fall = Stage::apply_gravity, load = Stage::apply_loads, move = Stage::integrate_positions;
    EXPECT(is_zero(after({move})));
    EXPECT(after({fall, move}).z < -0.1 && after({fall, move}).x == 0.0);
    EXPECT(after({load, move}).z == 0.0 && after({load, move}).x > 0.04);
    EXPECT(is_refused([&] { after({fall}); }));
    EXPECT(is_refused([&] { after({move, Stage::collision}); }));
    EXPECT(is_refused([&] { after({move, Stage::solve_path}); }));
    EXPECT(is_refused([&] { ParticleSystem(chain(2), {fall, move}); }));
    ParticleScene ring = chain(3);
    ring.rows[0].ends[0] = {2, {}};
    EXPECT(is_refused([&] { ParticleSystem(ring, {Stage::assemble_rows, Stage::solve_path, move}); }));
    const std::vector<Stage> all =
        ParticleSystem(ring, {move, Stage::solve_block, Stage::assemble_rows}).stages().taken();
    EXPECT((all == std::vector{Stage::assemble_rows, Stage::solve_block, move}));
}

void scattered_rows_are_put_in_order() {
    ParticleScene scene = chain(5), scattered = scene;
    std::swap(scattered.rows[0], scattered.rows[3]);
    std::swap(scattered.rows[2].ends[0], scattered.rows[2].ends[1]);
    EXPECT(system_of(scattered).solver() == ParticleSolver::path);
    EXPECT(norm(tip_after(scene, 60) - tip_after(scattered, 60)) < 1e-12);
}

void loops_and_branches_are_no_paths() {
    ParticleScene ring = chain(3);
    ring.rows[0].ends[0] = {2, {}};
    EXPECT(find_paths(ring).empty());
    EXPECT(system_of(ring).solver() == ParticleSolver::block);
    ParticleScene branch = chain(3);
    branch.rows[2].ends[0].body = 0;
    EXPECT(find_paths(branch).empty());
    ParticleScene two = chain(4);
    two.rows[2].ends[0] = {-1, {2.0, 0.0, 0.0}};
    EXPECT(find_paths(two).size() == 2);
}

void a_runaway_names_its_step_and_body() {
    // Symplectic Euler on a spring beyond h w = 2 grows by a known factor each step.
    ParticleScene scene = chain(2);
    scene.rows.clear();
    scene.gravity = {};
    scene.method.time_step = 1.0;
    scene.springs.push_back({{{-1, {}}, {1, {}}}, 100.0, 0.0, 0.0});
    ParticleProgram program(scene, {{"position", 1, {}}}, {{0, Reduction::trace, 0, -1, false, 1}});
    const RunReport ended = program.run(100000, 0.0, false);
    EXPECT(ended.status == Status::diverged);
    EXPECT(ended.failed_body == 1);
    EXPECT(ended.steps == ended.failed_step - 1);
    double x = 2.0, v = 0.0;
    std::int64_t step = 0;
    for (; std::fabs(x) <= RUNAWAY && std::fabs(v) <= RUNAWAY; ++step) {
        v -= 100.0 * x;
        x += v;
    }
    EXPECT(ended.failed_step == step);
    EXPECT(ended.recordings[0].samples == step);  // 0 … step − 1
}

void a_run_can_be_stopped() {
    ParticleProgram program(chain(100), {}, {});
    const RunReport ended = program.run(1'000'000'000, 0.05, false);
    EXPECT(ended.status == Status::timed_out);
    EXPECT(ended.steps > 0 && ended.seconds < 1.0);
}

/// The hot loops do the arithmetic of the stages: a timed run goes through the stages, one without observers through
/// the loops, and every bit must agree.
void every_way_through_a_step_gives_the_same_bits() {
    for (const int corrections : {0, 1, 2})
        for (const bool half : {false, true})
            for (const int composition : {2, 4})
                for (const int links : {1, 7}) {
                    ParticleScene scene = chain(links);
                    scene.bodies.push_back(
                        {2.0, {0.0, 5.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 3.0, 0.0}});  // without a row
                    scene.method.corrections = corrections;
                    scene.method.half_step_velocities = half;
                    scene.method.composition = composition;
                    ParticleProgram silent(scene, {}, {});
                    ParticleProgram program(scene, {{"energy", -1, {}}},
                                            {{0, Reduction::maximum, 0, -1, false, 1}});
                    const RunReport first = program.run(300, 0.0, false), again = program.run(300, 0.0, true);
                    EXPECT(first.state_hash == again.state_hash);
                    EXPECT(first.recordings[0].values == again.recordings[0].values);
                    EXPECT(first.counters == again.counters);
                    EXPECT(silent.run(300, 0.0, false).state_hash == first.state_hash);
                }
    ParticleScene orbit;
    orbit.method.time_step = 0.01;
    orbit.gravity = {0.0, 0.0, -0.1};
    orbit.fields.push_back({1.0, {0.1, 0.0, 0.0}});
    orbit.bodies.push_back({1.0, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {}});
    ParticleProgram program(orbit, {}, {});
    EXPECT(program.run(1000, 0.0, false).state_hash == program.run(1000, 0.0, true).state_hash);
}

}  // namespace

int main() {
    a_step_allocates_nothing();
    every_direct_solver_gives_one_answer();
    only_the_listed_stages_run();
    scattered_rows_are_put_in_order();
    loops_and_branches_are_no_paths();
    a_runaway_names_its_step_and_body();
    a_run_can_be_stopped();
    every_way_through_a_step_gives_the_same_bits();
    return report();
}
