// The scene as the particle pipeline takes it: plain data in SI units, already checked.
#pragma once

#include <vector>

#include "run/forces.hpp"

namespace spook {

struct ParticleBody {
    double mass = 1.0;  // kg
    Vec3 position;      // m
    Vec3 velocity;      // m/s
    Vec3 load;          // N
};

struct DistanceRow {
    End ends[2];
    double rest_length = 1.0;  // m
    double compliance = 0.0;   // m/N
    double damping = 0.0;      // s
};

enum class ParticleSolver { none, path, block, iterative };

struct ParticleMethod {
    double time_step = 0.0;  // s, of the caller: a reported step
    int substeps = 1;
    int corrections = 0;
    double correction_cap = 0.3;
    bool half_step_velocities = false;
    bool string_stiffness = false;
    bool iterative = false;
    bool force_block = false;  // solve_block although the rows form paths
    int iterations = 50;
    double residual_tolerance = 0.0;
    int refinements = 1;
    double floor = 0.0;
    int composition = 2;  // order: 2, 4, 6 or 8
};

struct ParticleScene {
    std::vector<ParticleBody> bodies;
    std::vector<DistanceRow> rows;
    std::vector<SpringForce> springs;
    std::vector<CentralField> fields;
    Vec3 gravity;               // m/s²
    bool loads_change = false;  // loads are set while it runs, whatever they are at the start
    ParticleMethod method;
};

}  // namespace spook
