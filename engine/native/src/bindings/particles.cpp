// The particle pipeline for Python: arrays in, a report out.
#include "bindings/common.hpp"

#include <stdexcept>

#include "particles/particle_program.hpp"

namespace spook {

namespace {

/// (kind, index or −1, point)
using QuantityTuple = std::tuple<std::string, int, std::tuple<double, double, double>>;

Vec3 to_vec(const std::tuple<double, double, double>& t) {
    return {std::get<0>(t), std::get<1>(t), std::get<2>(t)};
}

void expect_columns(const Table& table, std::size_t columns, const char* name) {
    if (table.shape(1) != columns)
        throw std::invalid_argument(std::string(name) + " needs " + std::to_string(columns) + " columns");
}

End end_of(const IndexTable& ends, std::size_t row, int side, const double* point) {
    return {static_cast<int>(ends.data()[2 * row + side]), vec3(point)};
}

ParticleMethod to_method(const nb::dict& method) {
    ParticleMethod out;
    out.time_step = nb::cast<double>(method["time_step"]);
    out.substeps = nb::cast<int>(method["substeps"]);
    out.corrections = nb::cast<int>(method["corrections"]);
    out.correction_cap = nb::cast<double>(method["correction_cap"]);
    out.half_step_velocities = nb::cast<bool>(method["half_step_velocities"]);
    out.string_stiffness = nb::cast<bool>(method["string_stiffness"]);
    out.iterative = nb::cast<bool>(method["iterative"]);
    out.force_block = nb::cast<bool>(method["force_block"]);
    out.iterations = nb::cast<int>(method["iterations"]);
    out.residual_tolerance = nb::cast<double>(method["residual_tolerance"]);
    out.refinements = nb::cast<int>(method["refinements"]);
    out.floor = nb::cast<double>(method["floor"]);
    out.composition = nb::cast<int>(method["composition"]);
    return out;
}

void make(ParticleProgram* self, Table bodies, IndexTable row_ends, Table rows, IndexTable spring_ends,
          Table springs, Table fields, std::tuple<double, double, double> gravity, const nb::dict& method,
          const std::vector<QuantityTuple>& quantities, const std::vector<ObservationTuple>& observations) {
    expect_columns(bodies, 10, "bodies");
    expect_columns(rows, 9, "rows");
    expect_columns(springs, 9, "springs");
    expect_columns(fields, 4, "fields");
    ParticleScene scene;
    scene.gravity = to_vec(gravity);
    scene.method = to_method(method);
    for (std::size_t i = 0; i < bodies.shape(0); ++i) {
        const double* b = bodies.data() + 10 * i;
        scene.bodies.push_back({b[0], vec3(b + 1), vec3(b + 4), vec3(b + 7)});
    }
    for (std::size_t i = 0; i < rows.shape(0); ++i) {
        const double* r = rows.data() + 9 * i;
        scene.rows.push_back({{end_of(row_ends, i, 0, r), end_of(row_ends, i, 1, r + 3)}, r[6], r[7], r[8]});
    }
    for (std::size_t i = 0; i < springs.shape(0); ++i) {
        const double* s = springs.data() + 9 * i;
        scene.springs.push_back(
            {{end_of(spring_ends, i, 0, s), end_of(spring_ends, i, 1, s + 3)}, s[6], s[7], s[8]});
    }
    for (std::size_t i = 0; i < fields.shape(0); ++i)
        scene.fields.push_back({fields.data()[4 * i], vec3(fields.data() + 4 * i + 1)});
    std::vector<QuantityRequest> requests;
    for (const auto& [kind, index, point] : quantities) requests.push_back({kind, index, to_vec(point)});
    new (self) ParticleProgram(scene, requests, to_observations(observations));
}

nb::dict run(ParticleProgram& program, std::int64_t steps, double time_limit, bool timed) {
    RunReport report;
    {
        nb::gil_scoped_release release;
        report = program.run(steps, time_limit, timed);
    }
    return to_dict(report);
}

}  // namespace

void bind_particles(nb::module_& m) {
    nb::class_<ParticleProgram>(m, "ParticleProgram", "A compiled scene of particles.")
        .def(
            "__init__", &make, nb::arg("bodies"), nb::arg("row_ends"), nb::arg("rows"),
            nb::arg("spring_ends"), nb::arg("springs"), nb::arg("fields"), nb::arg("gravity"),
            nb::arg("method"), nb::arg("quantities"), nb::arg("observations"),
            "bodies (n, 10): mass, position, velocity, load. rows (m, 9): world points of both ends, rest length,\n"
            "compliance, damping; springs (k, 9): points, stiffness, rest length, viscosity; ends are body indices\n"
            "or -1 for the point. fields (f, 4): strength, centre. quantities: (kind, index or -1, point).\n"
            "observations: (quantity, reduction, first, last or -1, from_start, every).")
        .def(
            "run", &run, nb::arg("steps"), nb::arg("time_limit"), nb::arg("timed"),
            "Run from the start, the GIL released; a dict with status, recordings, counters, final_state, ...")
        .def_prop_ro("solver", &ParticleProgram::solver, "none, path, block or iterative")
        .def_prop_ro("held_twice", &ParticleProgram::held_twice,
                     "whether a path of rows without compliance is held by the world at both ends");
}

}  // namespace spook
