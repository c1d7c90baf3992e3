// The particle pipeline for Python: tables in, a report out.
#include "bindings/forces.hpp"
#include "particles/particle_program.hpp"
#include "run/composition.hpp"

namespace spook {

namespace {

ParticleMethod to_method(Entries& in) {
    ParticleMethod out;
    Entries options(in.dict("method"), "method: the option");
    options.read("time_step", out.time_step);
    options.read("substeps", out.substeps);
    options.read("corrections", out.corrections);
    options.read("correction_cap", out.correction_cap);
    options.read("half_step_velocities", out.half_step_velocities);
    options.read("string_stiffness", out.string_stiffness);
    options.read("iterative", out.iterative);
    options.read("force_block", out.force_block);
    options.read("iterations", out.iterations);
    options.read("residual_tolerance", out.residual_tolerance);
    options.read("refinements", out.refinements);
    options.read("floor", out.floor);
    Composition composition{};
    options.read_kind("composition", composition);
    out.composition = order_of(composition);
    options.expect_all_read();
    return out;
}

void read_bodies(Entries& in, ParticleScene& scene) {
    Columns table(in, "bodies");
    const Numbers mass = table.numbers("mass"), position = table.numbers("position", 3),
                  velocity = table.numbers("velocity", 3), load = table.numbers("load", 3);
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.bodies.push_back({mass[i], position.vec(i), velocity.vec(i), load.vec(i)});
    table.expect_all_read();
}

void read_rows(Entries& in, ParticleScene& scene) {
    Columns table(in, "rows");
    const Ends end(table, scene.bodies.size());
    const Numbers length = table.numbers("rest_length"), compliance = table.numbers("compliance"),
                  damping = table.numbers("damping");
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.rows.push_back({{end(i, 0), end(i, 1)}, length[i], compliance[i], damping[i]});
    table.expect_all_read();
}

void make(ParticleProgram* self, const nb::dict& tables, const std::vector<QuantityRequest>& quantities,
          const std::vector<Observation>& observations, double time_left) {
    ParticleScene scene;
    Entries in(tables, "scene: the table");
    read_settings(in, scene);
    scene.method = to_method(in);
    read_bodies(in, scene);
    read_rows(in, scene);
    scene.springs = read_springs(in, scene.bodies.size());
    scene.fields = read_fields(in);
    in.expect_all_read();
    make_in_time(self, scene, quantities, observations, time_left);
}

}  // namespace

void bind_particles(nb::module_& m) {
    bind_program<ParticleSystem>(
        m, "ParticleProgram", "ParticleSnapshot", "A compiled scene of particles.", &make, nb::arg("scene"),
        nb::arg("quantities"), nb::arg("observations"), nb::arg("time_left") = 0.0,
        "`scene` has tables, dicts of columns, a row each. bodies: mass, position, velocity, load. rows and\n"
        "springs: first, second (body or -1), first_point, second_point (of ends that are no body), rest_length,\n"
        "and compliance, damping, or stiffness, viscosity. fields: strength, centre. Beside them method, gravity\n"
        "and loads_change. Raises TimeoutError where making it takes longer than `time_left` [s, 0 for no limit].");
}

}  // namespace spook
