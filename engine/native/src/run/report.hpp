// What a run hands back, the same for every pipeline.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "run/named_enum.hpp"

namespace spook {

/// |x| [m] or |v| [m/s] beyond this is a runaway: the run ends as diverged.
inline constexpr double RUNAWAY = 1e100;

/// unsettled: all steps done, but some solve left more than its method allows; the values are kept.
SPOOK_NAMED_ENUM(Status, completed, diverged, not_finite, timed_out, unsettled)

/// One observable: `samples` rows of `width` values (one row for a reduction).
struct Recording {
    int width = 0;
    std::int64_t samples = 0;
    std::vector<double> values;
};

/// A joint that broke.
struct Broken {
    int joint = 0;
    std::int64_t step = 0;             // counted from 1
    double time = 0.0;                 // at the end of the step h, or part of one, it broke in, s
    double force = 0.0, torque = 0.0;  // what its rows held in it, N and N m
};

struct RunReport {
    Status status = Status::completed;
    std::int64_t steps = 0;          // steps done; of a failed run, those before the failing step
    std::int64_t failed_step = -1;   // counted from 1
    int failed_body = -1;            // index in the scene
    std::string reason;              // what is wrong with that body, when the status does not say it
    std::vector<int> failed_joints;  // indices: what {joints} stands for in the reason
    double seconds = 0.0;            // wall time of the native loop
    double cpu_seconds = 0.0;        // processor time of it; 0 where it cannot be told
    double residual = 0.0;           // largest row residual an iterative solve stopped at, m/s
    std::map<std::string, std::int64_t> counters;
    std::map<std::string, double> stage_seconds;
    std::vector<Broken> broken;         // in the order they broke
    std::vector<Recording> recordings;  // in the order the observables were given
    std::vector<double> final_state;    // bodies × 13: position, orientation, velocity, angular velocity
    std::string state_hash;

    /// All steps done, and the values are kept, but they are not right, and it is seen in that body.
    void leave_unsettled(int body, std::string why) {
        status = Status::unsettled;
        failed_step = steps;
        failed_body = body;
        reason = std::move(why);
    }
};

}  // namespace spook
