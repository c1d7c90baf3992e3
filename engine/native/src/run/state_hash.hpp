// A hash of the bits of a state: equal runs give equal text on every machine.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string>

namespace spook {

/// FNV-1a, 64 bit, over the little-endian bytes of each double, as 16 hexadecimal digits.
/// −0.0 counts as 0.0 and every NaN as one NaN, because they print and compare as the same state.
inline std::string state_hash(std::span<const double> values) {
    std::uint64_t hash = 0xcbf29ce484222325ULL;
    for (double value : values) {
        std::uint64_t bits = value != value ? 0x7ff8000000000000ULL : std::bit_cast<std::uint64_t>(value);
        if (bits == 0x8000000000000000ULL) bits = 0;
        for (int byte = 0; byte < 8; ++byte, bits >>= 8) {
            hash ^= bits & 0xffU;
            hash *= 0x100000001b3ULL;
        }
    }
    std::string text(16, '0');
    for (int digit = 15; digit >= 0; --digit, hash >>= 4) text[digit] = "0123456789abcdef"[hash & 15U];
    return text;
}

}  // namespace spook
