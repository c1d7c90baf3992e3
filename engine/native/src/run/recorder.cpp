#include "run/recorder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spook {

namespace {

/// What a reduction has found with one more value, the `first` or after what it found `before`; a mean is divided at
/// the end. A NaN is taken and then stays: every comparison with it is false.
double reduced(Reduction reduction, bool first, double before, double value) noexcept {
    const double size = std::fabs(value);
    switch (reduction) {
        case Reduction::maximum: return first || value > before || value != value ? value : before;
        case Reduction::minimum: return first || value < before || value != value ? value : before;
        case Reduction::maximum_absolute: return first || size > before || size != size ? size : before;
        case Reduction::mean: return first ? value : before + value;
        case Reduction::trace:
        case Reduction::final: break;
    }
    return value;
}

}  // namespace

Recorder::Recorder(std::vector<Sampler> samplers, std::vector<Observation> observations)
    : samplers_(std::move(samplers)) {
    for (const Observation& what : observations) {
        channels_.emplace_back();
        channels_.back().what = what;
    }
    for (const Sampler& sampler : samplers_) read_.emplace_back(sampler.width, 0.0);
    read_at_.assign(samplers_.size(), -1);
}

void Recorder::prepare(std::int64_t steps) {
    steps_ = steps;
    samples_read_ = 0;
    std::fill(read_at_.begin(), read_at_.end(), -1);
    for (Channel& channel : channels_) {
        const auto width = static_cast<std::size_t>(samplers_[channel.what.quantity].width);
        channel.last = channel.what.last < 0 ? steps : channel.what.last;
        channel.count = 0;
        channel.start.assign(width, 0.0);
        std::size_t rows = 1;
        if (channel.what.reduction == Reduction::trace && channel.last >= channel.what.first)
            rows = static_cast<std::size_t>((channel.last - channel.what.first) / channel.what.every + 1);
        channel.values.assign(rows * width, std::numeric_limits<double>::quiet_NaN());
    }
    saved_ = channels_;
    for (Channel& channel : saved_)
        if (channel.what.reduction == Reduction::trace) channel.values.clear();
}

bool Recorder::wants(const Channel& channel, std::int64_t n) const noexcept {
    const Observation& what = channel.what;
    if (n < what.first || n > channel.last) return false;
    if (what.reduction == Reduction::trace) return (n - what.first) % what.every == 0;
    return what.reduction != Reduction::final || n == channel.last;
}

std::int64_t Recorder::next_wanted(std::int64_t from) const noexcept {
    std::int64_t next = steps_ + 1;
    for (const Channel& channel : channels_) {
        const Observation& what = channel.what;
        if (what.from_start && from == 0) return 0;
        std::int64_t wanted = std::max(from, what.first);
        if (what.reduction == Reduction::final) wanted = std::max(from, channel.last);
        if (what.reduction == Reduction::trace)
            wanted = what.first + (wanted - what.first + what.every - 1) / what.every * what.every;
        if (wanted <= channel.last && wanted <= steps_) next = std::min(next, wanted);
    }
    return next;
}

void Recorder::sample(std::int64_t n) {
    for (Channel& channel : channels_) {
        const Observation& what = channel.what;
        const bool wanted = wants(channel, n), starting = what.from_start && n == 0;
        if (!wanted && !starting) continue;
        std::vector<double>& now = read_[what.quantity];
        if (read_at_[what.quantity] != n) {
            samplers_[what.quantity].read(now.data());
            read_at_[what.quantity] = n;
            ++samples_read_;
        }
        if (starting) channel.start = now;
        if (!wanted) continue;
        const bool first = channel.count++ == 0;
        const std::size_t width = now.size();
        double* out = channel.values.data();
        if (what.reduction == Reduction::trace) out += (channel.count - 1) * static_cast<std::int64_t>(width);
        for (std::size_t i = 0; i < width; ++i) {
            const double value = now[i] - (what.from_start ? channel.start[i] : 0.0);
            out[i] = reduced(what.reduction, first, out[i], value);
        }
    }
}

void Recorder::save() {
    for (std::size_t i = 0; i < channels_.size(); ++i) {
        saved_[i].count = channels_[i].count;  // samples of a trace need no copy: later ones overwrite
        if (channels_[i].what.reduction != Reduction::trace) saved_[i].values = channels_[i].values;
    }
    saved_samples_read_ = samples_read_;
}

void Recorder::restore() {
    for (std::size_t i = 0; i < channels_.size(); ++i) {
        channels_[i].count = saved_[i].count;
        if (channels_[i].what.reduction != Reduction::trace) channels_[i].values = saved_[i].values;
    }
    std::fill(read_at_.begin(), read_at_.end(), -1);
    samples_read_ = saved_samples_read_;
}

std::vector<Recording> Recorder::recordings() const {
    std::vector<Recording> all;
    for (const Channel& channel : channels_) {
        Recording recording;
        recording.width = samplers_[channel.what.quantity].width;
        recording.values = channel.values;
        recording.samples = 1;
        if (channel.what.reduction == Reduction::trace) {
            recording.samples = channel.count;
            recording.values.resize(static_cast<std::size_t>(channel.count * recording.width));
        }
        if (channel.what.reduction == Reduction::mean && channel.count > 0)
            for (double& value : recording.values) value /= static_cast<double>(channel.count);
        all.push_back(std::move(recording));
    }
    return all;
}

}  // namespace spook
