// Reductions over samples, NaN and ranges included.
#include "run/recorder.hpp"

#include <limits>

#include "expect.hpp"
#include "run/state_hash.hpp"

using namespace spook;

namespace {

double now = 0.0;

Recorder recorder_of(std::vector<Observation> observations) {
    return Recorder({{1, [](double* out) { *out = now; }}}, std::move(observations));
}

void feed(Recorder& recorder, const std::vector<double>& samples) {
    const auto steps = static_cast<std::int64_t>(samples.size()) - 1;
    recorder.prepare(steps);
    for (std::int64_t n = recorder.next_wanted(0); n <= steps; n = recorder.next_wanted(n + 1)) {
        now = samples[static_cast<std::size_t>(n)];
        recorder.sample(n);
    }
}

void every_reduction_gives_its_number() {
    Recorder recorder = recorder_of({{0, Reduction::trace, 1, 3, false, 2},
                                     {0, Reduction::final, 0, -1, false, 1},
                                     {0, Reduction::maximum, 0, -1, false, 1},
                                     {0, Reduction::minimum, 0, -1, false, 1},
                                     {0, Reduction::maximum_absolute, 1, 3, false, 1},
                                     {0, Reduction::mean, 1, 2, false, 1},
                                     {0, Reduction::final, 2, 2, true, 1}});
    feed(recorder, {1.0, -5.0, 2.0, 4.0, 3.0});
    const auto got = recorder.recordings();
    EXPECT(got[0].samples == 2 && got[0].values[0] == -5.0 && got[0].values[1] == 4.0);
    EXPECT(got[1].values[0] == 3.0);
    EXPECT(got[2].values[0] == 4.0);
    EXPECT(got[3].values[0] == -5.0);
    EXPECT(got[4].values[0] == 5.0);
    EXPECT(got[5].values[0] == -1.5);
    EXPECT(got[6].values[0] == 1.0);
}

void a_nan_is_never_lost() {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Reduction reduction : {Reduction::maximum, Reduction::minimum, Reduction::maximum_absolute})
        for (const auto& samples : {std::vector{nan, 1.0}, std::vector{1.0, nan, 2.0}}) {
            Recorder recorder = recorder_of({{0, reduction, 0, -1, false, 1}});
            feed(recorder, samples);
            EXPECT(std::isnan(recorder.recordings()[0].values[0]));
        }
}

void only_wanted_samples_are_read() {
    Recorder recorder =
        recorder_of({{0, Reduction::final, 0, -1, false, 1}, {0, Reduction::final, 0, -1, false, 1}});
    feed(recorder, std::vector<double>(1000, 1.0));
    EXPECT(recorder.samples_read() == 1);
}

void a_restored_recorder_forgets_what_came_after() {
    Recorder recorder =
        recorder_of({{0, Reduction::maximum, 0, -1, false, 1}, {0, Reduction::trace, 0, -1, false, 1}});
    recorder.prepare(3);
    now = 1.0;
    recorder.sample(0);
    recorder.save();
    now = 9.0;
    recorder.sample(1);
    recorder.restore();
    now = 2.0;
    recorder.sample(1);
    const auto got = recorder.recordings();
    EXPECT(got[0].values[0] == 2.0);
    EXPECT(got[1].samples == 2 && got[1].values[1] == 2.0);
}

void equal_states_have_equal_hashes() {
    const double a[] = {0.0, 1.0}, b[] = {-0.0, 1.0}, c[] = {0.0, std::nextafter(1.0, 2.0)};
    EXPECT(state_hash(a) == state_hash(b));
    EXPECT(state_hash(a) != state_hash(c));
    EXPECT(state_hash(a).size() == 16);
}

}  // namespace

int main() {
    every_reduction_gives_its_number();
    a_nan_is_never_lost();
    only_wanted_samples_are_read();
    a_restored_recorder_forgets_what_came_after();
    equal_states_have_equal_hashes();
    return report();
}
