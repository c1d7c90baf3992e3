// Conversions every binding shares. Only bindings*.cpp know Python.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>

#include "linear/vec.hpp"
#include "run/recorder.hpp"
#include "run/report.hpp"

namespace spook {

namespace nb = nanobind;

using Table = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using IndexTable = nb::ndarray<const std::int64_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// (quantity, reduction, first, last or −1, from_start, every)
using ObservationTuple = std::tuple<int, std::string, std::int64_t, std::int64_t, bool, std::int64_t>;

inline Vec3 vec3(const double* p) noexcept { return {p[0], p[1], p[2]}; }

std::vector<Observation> to_observations(const std::vector<ObservationTuple>& tuples);

/// A float64 array that owns a copy of the values.
nb::object to_array(const std::vector<double>& values, std::size_t rows, std::size_t columns);

/// {status, steps, failed_step, failed_body, seconds, residual, counters, stage_seconds, recordings: list of
/// (samples, width) arrays, final_state: (bodies, 13), state_hash}
nb::dict to_dict(const RunReport& report);

void bind_particles(nb::module_& m);
void bind_rigid(nb::module_& m);

}  // namespace spook
