// The same loops in vectors of four. Not fused multiply-add: that would round differently.
#include "linear/block_kernels.hpp"

#include <algorithm>
#include <cmath>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2")
#define SPOOK_ISA avx2
#include "linear/block_kernels.inl"
#pragma GCC pop_options

namespace spook::kernel {
const Kernels& avx2_kernels() noexcept { return avx2::table; }
}  // namespace spook::kernel
#else
namespace spook::kernel {
const Kernels& avx2_kernels() noexcept { return portable_kernels(); }
}  // namespace spook::kernel
#endif
