// Pebble: a small engine of particles and rods, as a team of its own might have it. SI units, world axes.
#pragma once

#include <cstddef>

extern "C" {

struct PebbleRod {
    int first, second;  // particles it joins
    double length;      // m
};

/// Take `steps` steps of `time_step` [s]: gravity into velocities, velocities into positions, then rods put right
/// by moving both ends, `iterations` times over. An inverse mass of 0 [1/kg] holds a particle where it is.
/// Reads and writes positions [m] and velocities [m/s], three numbers a particle; allocates nothing else than one
/// copy of the positions.
void pebble_step(double* positions, double* velocities, const double* inverse_masses, int particles,
                 const PebbleRod* rods, int rod_count, const double gravity[3], double time_step,
                 int iterations, int steps);
}
