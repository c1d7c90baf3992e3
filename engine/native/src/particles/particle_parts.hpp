// What a particle system is made of: each part owns its data, and works on nodes and rows that it is given.
#pragma once

#include <vector>

#include "particles/distance_rows.hpp"
#include "particles/open_paths.hpp"
#include "particles/particle_forces.hpp"
#include "particles/particle_nodes.hpp"
#include "particles/row_pgs.hpp"
#include "particles/saddle_blocks.hpp"

namespace spook {

struct ParticleParts {
    double h = 0.0;  // s, of a substep
    ParticleSolver solver = ParticleSolver::none;
    Nodes nodes;
    DistanceRows rows;
    ParticleForces forces;
    OpenPaths paths;      // if the rows form open paths, and nothing couples them otherwise
    SaddleBlocks saddle;  // if they branch, close loops or stiffen strings
    RowPgs pgs;           // if they are solved iteratively
};

/// What samplers read at the current sample.
struct Seen {
    std::vector<Vec3> v;         // m/s, per node
    std::vector<double> lambda;  // N s, per row
};

}  // namespace spook
