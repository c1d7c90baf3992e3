// What BlockLu does with its numbers, for one instruction set each: the bits are the same.
#pragma once

#include <cstddef>
#include <cstdint>

namespace spook {

/// A view of a BlockLu: see there.
struct LuFactor {
    int blocks;
    const int* order;
    const std::int64_t* column_start;
    const int* column_rows;
    const std::int64_t* targets;
    double *pivot, *lower, *upper;

    double* lower_at(std::int64_t at) const noexcept { return lower + 36 * at; }
    double* upper_at(std::int64_t at) const noexcept { return upper + 36 * at; }
};

struct LuKernels {
    bool (*factor)(const LuFactor&);
    void (*solve)(const LuFactor&, double* x) noexcept;
};

const LuKernels& portable_lu() noexcept;
const LuKernels& avx2_lu() noexcept;  // the portable ones where the compiler cannot build them

/// The fastest ones this machine runs.
const LuKernels& lu_kernels() noexcept;
/// For tests: from now on the portable ones, or the fastest again. Not for use between threads.
void use_portable_lu(bool portable) noexcept;

}  // namespace spook
