// engine._core: conversions shared by all pipelines, and what was built from what.
#include "bindings/common.hpp"

#include <algorithm>
#include <stdexcept>

#include "run/build_info.hpp"
#include "run/run_loop.hpp"

namespace spook {

std::vector<Observation> to_observations(const std::vector<ObservationTuple>& tuples) {
    static constexpr const char* NAMES[] = {"trace", "final", "maximum", "minimum", "maximum_absolute",
                                            "mean"};
    std::vector<Observation> observations;
    for (const auto& [quantity, reduction, first, last, from_start, every] : tuples) {
        const auto name = std::find(std::begin(NAMES), std::end(NAMES), reduction);
        if (name == std::end(NAMES)) throw std::invalid_argument("there is no reduction " + reduction);
        observations.push_back(
            {quantity, static_cast<Reduction>(name - std::begin(NAMES)), first, last, from_start, every});
    }
    return observations;
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
    out["status"] = to_text(report.status);
    out["steps"] = report.steps;
    out["failed_step"] = report.failed_step;
    out["failed_body"] = report.failed_body;
    out["reason"] = report.reason;
    out["seconds"] = report.seconds;
    out["residual"] = report.residual;
    out["counters"] = counters;
    out["stage_seconds"] = stage_seconds;
    out["recordings"] = recordings;
    out["final_state"] = to_array(report.final_state, report.final_state.size() / 13, 13);
    out["state_hash"] = report.state_hash;
    return out;
}

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
    spook::bind_particles(m);
    spook::bind_rigid(m);
}
