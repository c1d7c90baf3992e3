#include "pebble.hpp"

#include <cmath>
#include <vector>

namespace {

/// Move both ends of a rod along it, each by its share of the inverse mass, until it has its length.
void put_right(const PebbleRod& rod, double* positions, const double* inverse_masses) {
    double* a = positions + 3 * rod.first;
    double* b = positions + 3 * rod.second;
    const double d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    const double share = inverse_masses[rod.first] + inverse_masses[rod.second];
    if (share == 0.0 || length == 0.0) return;
    const double pull = (length - rod.length) / (length * share);
    for (int i = 0; i < 3; ++i) {
        a[i] += inverse_masses[rod.first] * pull * d[i];
        b[i] -= inverse_masses[rod.second] * pull * d[i];
    }
}

}  // namespace

void pebble_step(double* positions, double* velocities, const double* inverse_masses, int particles,
                 const PebbleRod* rods, int rod_count, const double gravity[3], double time_step,
                 int iterations, int steps) {
    std::vector<double> before(3 * static_cast<std::size_t>(particles));
    for (int step = 0; step < steps; ++step) {
        for (int p = 0; p < 3 * particles; ++p) {
            before[p] = positions[p];
            if (inverse_masses[p / 3] == 0.0) continue;
            velocities[p] += time_step * gravity[p % 3];
            positions[p] += time_step * velocities[p];
        }
        for (int iteration = 0; iteration < iterations; ++iteration)
            for (int r = 0; r < rod_count; ++r) put_right(rods[r], positions, inverse_masses);
        if (rod_count > 0)
            for (int p = 0; p < 3 * particles; ++p) velocities[p] = (positions[p] - before[p]) / time_step;
    }
}
