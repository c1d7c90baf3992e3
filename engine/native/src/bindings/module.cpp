// engine._core: conversions shared by all pipelines, and what was built from what.
#include "bindings/common.hpp"

#include <algorithm>
#include <stdexcept>

#include "run/build_info.hpp"
#include "run/run_loop.hpp"

namespace spook {

nb::list to_list(const StageChoices& choices) {
    nb::list list;
    for (std::size_t k = 0; k < STAGES; ++k) {
        const Stage stage = static_cast<Stage>(k), other = choices[k].kept ? host(stage, choices) : stage;
        list.append(nb::make_tuple(to_text(stage), choices[k].kept, choices[k].told(),
                                   other == stage ? std::string() : to_text(other)));
    }
    return list;
}

nb::list to_list(const std::vector<Stage>& stages) {
    nb::list list;
    for (const Stage stage : stages) list.append(to_text(stage));
    return list;
}

nb::object to_array(const std::vector<double>& values, std::size_t rows, std::size_t columns) {
    auto* data = new double[std::max<std::size_t>(1, values.size())];
    std::copy(values.begin(), values.end(), data);
    nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    return nb::ndarray<nb::numpy, double>(data, {rows, columns}, owner).cast();
}

nb::dict to_dict(const RunReport& report) {
    if (PyErr_Occurred()) throw nb::python_error();  // the run was interrupted from the keyboard
    nb::dict counters, stage_seconds, out;
    for (const auto& [name, count] : report.counters) counters[name.c_str()] = count;
    for (const auto& [name, seconds] : report.stage_seconds) stage_seconds[name.c_str()] = seconds;
    nb::list recordings;
    for (const Recording& recording : report.recordings)
        recordings.append(to_array(recording.values, static_cast<std::size_t>(recording.samples),
                                   static_cast<std::size_t>(recording.width)));
    nb::list broken;
    for (const Broken& joint : report.broken)
        broken.append(nb::make_tuple(joint.joint, joint.step, joint.time, joint.force, joint.torque));
    out["broken"] = broken;
    out["status"] = to_text(report.status);
    out["steps"] = report.steps;
    out["failed_step"] = report.failed_step;
    out["failed_body"] = report.failed_body;
    out["reason"] = report.reason;
    nb::list joints;
    for (const int joint : report.failed_joints) joints.append(joint);
    out["failed_joints"] = joints;
    out["seconds"] = report.seconds;
    out["cpu_seconds"] = report.cpu_seconds;
    out["residual"] = report.residual;
    out["counters"] = counters;
    out["stage_seconds"] = stage_seconds;
    out["recordings"] = recordings;
    out["final_state"] = to_array(report.final_state, report.final_state.size() / 13, 13);
    out["state_hash"] = report.state_hash;
    return out;
}

namespace {

void bind_observing(nb::module_& m) {
    nb::class_<QuantityRequest>(m, "QuantityRequest", "A quantity of the state, by name.")
        .def(
            "__init__",
            [](QuantityRequest* self, const std::string& kind, int index, const Point& point, int other) {
                from_text<Quantity>(kind, "quantity");
                new (self) QuantityRequest{kind, index, to_vec(point), other};
            },
            nb::arg("kind"), nb::arg("index"), nb::arg("point"), nb::arg("other"),
            "index: of a body, row or joint, -1 for all; point: centre of an angular momentum;\n"
            "other: the other body of a contact force, -1 for all.");
    nb::class_<Observation>(m, "Observation", "How a quantity is reduced over samples first to last.")
        .def(
            "__init__",
            [](Observation* self, int quantity, const std::string& reduction, std::int64_t first,
               std::int64_t last, bool from_start, std::int64_t every) {
                const Reduction kind = from_text<Reduction>(reduction, "reduction");
                new (self) Observation{quantity, kind, first, last, from_start, every};
            },
            nb::arg("quantity"), nb::arg("reduction"), nb::arg("first"), nb::arg("last"),
            nb::arg("from_start"), nb::arg("every"),
            "quantity: index of its request; last: -1 for the last step; every: traces only.");
}

}  // namespace
}  // namespace spook

NB_MODULE(_core, m) {
    m.doc() = "The native SPOOK engine. Use the names of the package `engine`; this module is a detail.";
    m.def(
        "build_facts",
        [] {
            nanobind::dict facts;
            for (const auto& [name, text] : spook::build_facts()) facts[name] = text;
            return facts;
        },
        "What was baked in at build time, all texts; empty where it was not known.");
    spook::interrupted = [] {
        nanobind::gil_scoped_acquire hold;
        return PyErr_CheckSignals() != 0;
    };
    spook::bind_observing(m);
    spook::bind_particles(m);
    spook::bind_rigid(m);
}
