// Memory that will be read soon: in large heaps what a loop over contacts reads of their bodies has left the caches since
// the loop before.
#pragma once

#include <cstddef>
#include <cstdint>

namespace spook {

inline constexpr std::size_t ahead = 8;  // passes of such a loop

/// Asks for all lines of it; of what does not begin where a line does, for all but what the last may hold of it.
template <class T> void prefetch(const T& what) noexcept {
    const char* const at = reinterpret_cast<const char*>(&what);
    for (std::size_t byte = 0; byte < sizeof(what); byte += 64) __builtin_prefetch(at + byte);
}

/// The same of the bodies of such a pair, in arrays of all bodies.
template <class Pair, class... Arrays>
void prefetch_bodies(const Pair& later, const Arrays&... arrays) noexcept {
    for (const int body : {later.first, later.second}) (prefetch(arrays[body]), ...);
}

}  // namespace spook
