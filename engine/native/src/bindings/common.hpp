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

namespace spook {

namespace nb = nanobind;

using Point = std::tuple<double, double, double>;

inline Vec3 to_vec(const Point& t) { return {std::get<0>(t), std::get<1>(t), std::get<2>(t)}; }

/// A float64 array that owns a copy of the values.
nb::object to_array(const std::vector<double>& values, std::size_t rows, std::size_t columns);

/// {status, steps, failed_step, failed_body, seconds, residual, counters, stage_seconds, recordings: list of
/// (samples, width) arrays, final_state: (bodies, 13), state_hash}
nb::dict to_dict(const RunReport& report);

/// [(stage, kept, reason)] for every stage there is, in the order of the step.
nb::list to_list(const StageChoices& choices);
nb::list to_list(const std::vector<Stage>& stages);

/// Reads every entry of a dict of options, and refuses those nobody reads.
class Options {
public:
    explicit Options(const nb::dict& options) : options_(options) {}
    template <class T> void read(const char* name, T& value) {
        value = nb::cast<T>(options_[name]);
        ++read_;
    }
    template <class Enum> void read_kind(const char* name, Enum& value) {
        std::string text;
        read(name, text);
        value = from_text<Enum>(text, name);
    }
    void expect_all_read() const {
        if (read_ != nb::len(options_)) throw std::invalid_argument("method: an option means nothing here");
    }

private:
    nb::dict options_;
    std::size_t read_ = 0;
};

/// A pipeline's program as a Python class; `make` is its __init__.
template <class System, class Make, class... Extra>
void bind_program(nb::module_& m, const char* name, const char* doc, Make make, const Extra&... extra) {
    using Compiled = Program<System>;
    nb::class_<Compiled>(m, name, doc)
        .def("__init__", make, extra...)
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
