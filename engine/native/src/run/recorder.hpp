// Reductions inside the native loop: a pipeline hands in samplers, the recorder keeps what was asked for.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "run/named_enum.hpp"
#include "run/report.hpp"

namespace spook {

/// One quantity of a pipeline: `read` writes `width` numbers, the quantity's value at the current sample.
struct Sampler {
    int width = 1;
    std::function<void(double*)> read;
};

SPOOK_NAMED_ENUM(Reduction, trace, final, maximum, minimum, maximum_absolute, mean)

/// One observable: how to reduce a quantity over samples first … last, both included.
struct Observation {
    int quantity = 0;  // index of the sampler
    Reduction reduction = Reduction::final;
    std::int64_t first = 0;
    std::int64_t last = -1;   // −1: the last step
    bool from_start = false;  // subtract the value at sample 0 from every sample
    std::int64_t every = 1;   // traces only
};

/// Usage: prepare(steps); for every n = next_wanted(n') in order: sample(n); then recordings().
/// sample() allocates nothing; a quantity shared by several observables is read once per sample.
class Recorder {
public:
    Recorder() = default;
    Recorder(std::vector<Sampler> samplers, std::vector<Observation> observations);

    /// Reserve everything for a run of that many steps and forget earlier samples.
    void prepare(std::int64_t steps);

    /// The first sample number >= from that is wanted; steps + 1 if none is.
    std::int64_t next_wanted(std::int64_t from) const noexcept;

    /// Read the quantities wanted at sample n and reduce them.
    void sample(std::int64_t n);

    /// Remember and go back: a block of steps that failed is replayed step by step.
    void save();
    void restore();

    std::int64_t samples_read() const noexcept { return samples_read_; }
    std::vector<Recording> recordings() const;

private:
    struct Channel {
        Observation what;
        std::int64_t last = 0;
        std::int64_t count = 0;
        std::vector<double> start, values;  // trace: all samples; else the running reduction
    };

    bool wants(const Channel& channel, std::int64_t n) const noexcept;

    std::vector<Sampler> samplers_;
    std::vector<Channel> channels_, saved_;
    std::vector<std::vector<double>> read_;  // per sampler, the current sample
    std::vector<std::int64_t> read_at_;      // per sampler, which sample `read_` holds
    std::int64_t steps_ = 0, samples_read_ = 0, saved_samples_read_ = 0;
};

}  // namespace spook
