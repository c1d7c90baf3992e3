// A team does every part once, waits for all, and lets a later level begin when the one before it is done.
#include <atomic>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "expect.hpp"
#include "run/team.hpp"

#if !defined(__wasi__) && !defined(__SANITIZE_THREAD__)  // which forbids a fork between threads
#include <sys/wait.h>
#include <unistd.h>
#endif

using namespace spook;

namespace {

void every_part_once(Team& team) {
    std::vector<int> done(static_cast<std::size_t>(team.size()), 0);
    for (int round = 0; round < 300; ++round) team.each([&](int part) { ++done[part]; });
    for (const int times : done) EXPECT(times == 300);
}

/// Each level reads what all wrote in the one before.
void levels_wait(Team& team) {
    constexpr int levels = 150;
    const int size = team.size();
    std::vector<long> now(size, 1), next(size, 0);
    team.each([&](int part) {
        for (int level = 0; level < levels; ++level) {
            std::vector<long>&from = level % 2 ? next : now, &to = level % 2 ? now : next;
            to[part] = std::accumulate(from.begin(), from.end(), 0L) % 1'000'003;
            team.meet();
        }
    });
    long alone = 1;
    for (int level = 0; level < levels; ++level) alone = alone * size % 1'000'003;
    for (const long number : now) EXPECT(number == alone);
}

void shares_cover(Team& team) {
    for (const std::size_t count : {0u, 1u, 3u, 4u, 17u, 1000u})
        for (const std::size_t grain : {1u, 4u}) {
            std::size_t at = 5;
            for (int part = 0; part < team.size(); ++part) {
                const auto [begin, end] = team.share(part, 5, 5 + count, grain);
                EXPECT(begin == at && end >= begin);
                EXPECT(end == 5 + count || (end - 5) % grain == 0);
                at = end;
            }
            EXPECT(at == 5 + count);
        }
}

}  // namespace

int main() {
    for (const int size : {1, 2, 4}) {
        Team team(size);
        EXPECT(team.size() == size);
        every_part_once(team);
        levels_wait(team);
        shares_cover(team);
#if !defined(__wasi__) && !defined(__SANITIZE_THREAD__)  // which forbids a fork between threads
        const pid_t child = ::fork();                    // which has none of the threads
        if (child == 0) {
            team.refresh();
            int sum = 0;
            std::vector<int> one(static_cast<std::size_t>(size), 0);
            team.each([&](int part) { one[part] = 1; });
            for (const int done : one) sum += done;
            ::_exit(sum == size ? 0 : 1);
        }
        int ended = 0;
        EXPECT(::waitpid(child, &ended, 0) == child && ended == 0);
        every_part_once(team);
#endif
    }
    return report();
}
