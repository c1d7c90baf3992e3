// The numbers that collision is tuned by: each with its unit, and what it stands for. A part is the file that reads it.
// `make tolerances` multiplies and divides one at a time by ten, and tells which test goes red and whether any bit changes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace spook {

// broad_phase.cpp
namespace tolerances::broad_phase {
inline constexpr int most_levels = 31;   // what is larger than the cells of the last is compared with all
inline constexpr double furthest = 1e9;  // cells from the origin; what lies further counts as there
inline constexpr double fatness =
    0.1;                             // of the cells of level 0: by so much bounds are enlarged on every side,
inline constexpr double fast = 1.0;  //   but for those that got further out than this part of it in one call
inline constexpr double loose = 4.0;      // times that much: bounds as far inside theirs get new ones
inline constexpr std::size_t few_of = 2;  // those that escape are searched for alone up to one in so many
inline constexpr int most_coarse = 8;     // of them that are to be compared with all
}  // namespace tolerances::broad_phase

// detection.cpp
namespace tolerances::detection {
inline constexpr std::size_t most_grown = 256;  // bodies looked for one by one: beyond, all anew is cheaper
}

// frustum.cpp
namespace tolerances::frustum {
inline constexpr double parallel = 1e-9;  // sine of an angle that is none
inline constexpr double surely = 1e-11;   // of the size: what is less than the best by more is so exactly
}  // namespace tolerances::frustum

// overlay.cpp
namespace tolerances::overlay {
inline constexpr double level =
    1e-12;  // sine of a slope that is rounding: of a line far longer than thick more than the slop
}

// Read by several parts
// Flats win near ties, so that what rests on one does not jump to its edge: within this part of the thickness.
inline constexpr double prefer_flat = 1e-5;
inline constexpr double overlay_slop = 1e-7;  // of the thickness

// rotation.cpp
namespace tolerances::rotation {
inline constexpr double series_angle = 0x1p-4;  // rad: up to here series and quadrature are exact to rounding
inline constexpr double short_angle = 0x1p-10;  // rad: up to here with two nodes
inline constexpr double piece_angle = 4.0;      // rad: what its start's invariants serve for
inline constexpr double tumbling_angle = 1000.0;    // rad
inline constexpr double steady_squared = 0x1p-106;  // square of the rounding of a direction
}  // namespace tolerances::rotation

// solid_pairs.cpp
namespace tolerances::solid_pairs {
inline constexpr double near_tie =
    0.01;  // of the smaller thickness: edges so much deeper than faces are found, too
}

// triangle.cpp
namespace tolerances::triangle {
inline constexpr double level = 1e-9;  // sine of a slope that is none
inline constexpr double bent = 1e-7;   // sine from which two faces are no longer one
}  // namespace tolerances::triangle

}  // namespace spook
