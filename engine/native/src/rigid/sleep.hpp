// What falling asleep asks of a scene, and which bodies sleep.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/broad_phase.hpp"

namespace spook {

/// Does not change during a run.
struct SleepRules {
    std::vector<char> may;        // per body; empty where none ever sleeps
    std::vector<double> reach;    // per body: what its turning is measured at, m
    std::vector<IndexPair> ties;  // of joints and springs
    std::int64_t after = 0;       // steps at rest

    bool on() const noexcept { return !may.empty(); }
};

/// Changes from step to step.
struct Sleep {
    std::vector<int> island;          // per body: of sleepers, one more than its first body; 0: awake
    std::vector<std::int64_t> quiet;  // per body: steps it has been at rest, at most what is asked
    std::vector<double> since;        // per body: how fast its surface was in the first of them, m/s
    std::size_t sleepers = 0;
    std::int64_t slept = 0;  // steps of h, of all bodies
};

}  // namespace spook
