// A few threads that share one piece of work after the other, for loops of some ten microseconds.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <utility>
#include <vector>

#if !defined(__wasi__)
#include <thread>
#endif

namespace spook {

/// Threads that wait for work: shortly awake, then asleep. Of one size it has none but the caller's, and where the system
/// has no threads every team is of that size. Used by one caller at a time.
class Team {
public:
    explicit Team(int size);
    ~Team();
    Team(const Team&) = delete;
    Team& operator=(const Team&) = delete;

    int size() const noexcept { return size_; }

    /// Calls work(part) for every part from 0 to size() − 1, each on a thread of its own, part 0 on the caller's.
    /// Returns when all are done; what one of them throws ends the program.
    template <class Work> void each(const Work& work) {
        each(work, [] {});
    }

    /// The same; `waiting` is called again and again while the caller waits for the others. It must not throw.
    template <class Work, class Waiting> void each(const Work& work, const Waiting& waiting) {
        begin([](const void* what, int part) noexcept { (*static_cast<const Work*>(what))(part); }, &work);
        work(0);
        while (!done()) waiting();
    }

    /// Within each(): waits until every part has come here as often.
    void meet() noexcept;

    /// The share of `part` in the indices from `begin` to before `end`: in order, and in multiples of `grain`.
    std::pair<std::size_t, std::size_t> share(int part, std::size_t begin, std::size_t end,
                                              std::size_t grain = 1) const noexcept {
        const std::size_t grains = (end - begin + grain - 1) / grain, parts = static_cast<std::size_t>(size_);
        const auto at = [&](std::size_t k) { return std::min(end, begin + grains * k / parts * grain); };
        return {at(static_cast<std::size_t>(part)), at(static_cast<std::size_t>(part) + 1)};
    }

    /// To be called before a run: threads do not outlive a fork of the process.
    void refresh();

private:
    using Call = void (*)(const void*, int) noexcept;
    void begin(Call call, const void* work) noexcept;
    bool done() noexcept;  // after a while of waiting for it
    void start();
    void serve(int part) noexcept;

    int size_ = 1;
    Call call_ = nullptr;
    const void* work_ = nullptr;
    bool ending_ = false;
    long process_ = 0;                              // whose threads they are
    alignas(64) std::atomic<unsigned> round_{0};    // pieces of work begun
    alignas(64) std::atomic<int> busy_{0};          // threads at the present one
    alignas(64) std::atomic<unsigned> arrived_{0};  // at meetings of this piece of work
#if !defined(__wasi__)
    std::vector<std::thread> threads_;
#endif
};

/// work(part, begin, end) for all indices up to `count`, on the team where there is one and enough to do.
template <class Work> void share_out(Team* team, std::size_t count, std::size_t enough, const Work& work) {
    if (team == nullptr || team->size() == 1 || count < enough) {
        work(0, std::size_t{0}, count);
        return;
    }
    team->each([&](int part) {
        const auto [begin, end] = team->share(part, 0, count);
        work(part, begin, end);
    });
}

}  // namespace spook
