// Conversions every binding shares. Only this room knows Python.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>

#include "linear/vec.hpp"
#include "run/program.hpp"
#include "run/state_bytes.hpp"

namespace spook {

namespace nb = nanobind;

using Point = std::tuple<double, double, double>;

inline Vec3 to_vec(const Point& t) { return {std::get<0>(t), std::get<1>(t), std::get<2>(t)}; }

/// A float64 array that owns a copy of the values.
nb::object to_array(const std::vector<double>& values, std::size_t rows, std::size_t columns);

/// {status, steps, failed_step, failed_body, failed_joints, reason, seconds, residual, counters, stage_seconds,
/// recordings: list of (samples, width) arrays, final_state: (bodies, 13), state_hash,
/// broken: [(joint, step, time, force, torque)]}
nb::dict to_dict(const RunReport& report);

/// [(stage, kept, reason)] for every stage there is, in the order of the step.
nb::list to_list(const StageChoices& choices);
nb::list to_list(const std::vector<Stage>& stages);

/// A run one holds, for bind_program().
template <class System>
void bind_held(nb::module_& m, nb::class_<Program<System>>& program, const char* snapshot) {
    using Compiled = Program<System>;
    nb::class_<typename Compiled::Snapshot>(m, snapshot, "Where a held run is; only a run can make one.")
        .def_ro("steps", &Compiled::Snapshot::steps, "steps from the start")
        .def(
            "bytes",
            [](const typename Compiled::Snapshot& kept) {
                const std::string bytes = to_bytes(kept);
                return nb::bytes(bytes.data(), bytes.size());
            },
            "The same for another process of this build.")
        .def_static(
            "of_bytes",
            [](const nb::bytes& bytes) {
                return from_bytes<typename Compiled::Snapshot>({bytes.c_str(), bytes.size()});
            },
            nb::arg("bytes"), "Raises ValueError for what bytes() of this build has not made.");
    program
        .def(
            "start",
            [](Compiled& held, const std::vector<double>& state) {
                try {
                    nb::gil_scoped_release release;
                    held.start(state);
                } catch (const Stopped&) {
                    throw nb::python_error();  // interrupted from the keyboard
                }
            },
            nb::arg("state"), "Back to the start, or to a flat (bodies, 13) state; empty: the scene's own.")
        .def(
            "advance",
            [](Compiled& held, std::int64_t steps, double time_limit) {
                RunReport report;
                {
                    nb::gil_scoped_release release;
                    report = held.advance(steps, time_limit);
                }
                return to_dict(report);
            },
            nb::arg("steps"), nb::arg("time_limit"),
            "So many steps on, the GIL released; a dict as of run().")
        .def(
            "read",
            [](Compiled& held, double time_limit) {
                RunReport report;
                {
                    nb::gil_scoped_release release;
                    held.read(report, time_limit);
                }
                return to_dict(report);
            },
            nb::arg("time_limit"),
            "The observables, final_state and counters as they are now; changes nothing.")
        .def("keep", &Compiled::keep, "Where the run is, to go back to.")
        .def("go_back", &Compiled::go_back, nb::arg("snapshot"), "Go on from there, with the same bits.")
        .def(
            "set_load",
            [](Compiled& held, int body, const Point& force, const Point& torque) {
                if constexpr (requires { held.system().set_motor(0, 0.0, 0.0); })
                    held.system().set_load(body, to_vec(force), to_vec(torque));
                else held.system().set_load(body, to_vec(force));
            },
            nb::arg("body"), nb::arg("force"), nb::arg("torque"), "The whole load on a body from now on.");
    if constexpr (requires(Compiled& held) { held.system().set_motor(0, 0.0, 0.0); })
        program
            .def(
                "set_motor",
                [](Compiled& held, int joint, double speed, double max_force) {
                    held.system().set_motor(joint, speed, max_force);
                },
                nb::arg("joint"), nb::arg("speed"), nb::arg("max_force"), "What a motor does from now on.")
            .def(
                "set_rest",
                [](Compiled& held, int joint, double rest) { held.system().set_rest(joint, rest); },
                nb::arg("joint"), nb::arg("rest"), "Where a joint's spring pulls from now on.")
            .def(
                "set_velocity",
                [](Compiled& held, int body, const Point& velocity, const Point& angular_velocity) {
                    held.system().set_velocity(body, to_vec(velocity), to_vec(angular_velocity));
                },
                nb::arg("body"), nb::arg("velocity"), nb::arg("angular_velocity"),
                "How a kinematic body moves from now on.");
}

/// Makes a program where Python keeps it; TimeoutError where that takes longer than `time_left` [s, 0 for no limit].
template <class Compiled, class Scene>
void make_in_time(Compiled* self, const Scene& scene, const std::vector<QuantityRequest>& quantities,
                  const std::vector<Observation>& observations, double time_left) {
    try {
        nb::gil_scoped_release release;
        const Watch watch(time_left);
        new (self) Compiled(scene, quantities, observations);
    } catch (const Stopped&) {
        if (!PyErr_Occurred()) PyErr_SetNone(PyExc_TimeoutError);  // else it was the keyboard
        throw nb::python_error();
    }
}

/// A pipeline's program as a Python class; `make` is its __init__.
template <class System, class Make, class... Extra>
void bind_program(nb::module_& m, const char* name, const char* snapshot, const char* doc, Make make,
                  const Extra&... extra) {
    using Compiled = Program<System>;
    nb::class_<Compiled> program(m, name, doc);
    bind_held<System>(m, program, snapshot);
    program.def("__init__", make, extra...)
        .def(
            "run",
            [](Compiled& program, std::int64_t steps, double time_limit, bool timed) {
                RunReport report;
                {
                    nb::gil_scoped_release release;
                    report = program.run(steps, time_limit, timed);
                }
                return to_dict(report);
            },
            nb::arg("steps"), nb::arg("time_limit"), nb::arg("timed"),
            "Run from the start, the GIL released; a dict with status, recordings, counters, final_state, ...")
        .def_prop_ro(
            "choices", [](const Compiled& program) { return to_list(program.choices()); },
            "(stage, kept, reason) for every stage there is, in the order of the step")
        .def_prop_ro(
            "stages", [](const Compiled& program) { return to_list(program.stages()); },
            "the stages that some part of the program runs, in the order of the step");
}

void bind_particles(nb::module_& m);
void bind_rigid(nb::module_& m);

}  // namespace spook
