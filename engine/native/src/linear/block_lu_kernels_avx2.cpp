// The same loops in vectors of four. Not fused multiply-add: that would round differently.
#include <algorithm>
#include <cmath>

#include "linear/block_lu_kernels.hpp"
#include "linear/pieces.hpp"
#include "linear/six.hpp"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2")
#define SPOOK_ISA avx2
#define SPOOK_FOURS
#include "linear/block_lu.inl"
#pragma GCC pop_options

namespace spook {
const LuKernels& avx2_lu() noexcept { return avx2::lu_table; }
}  // namespace spook
#else
namespace spook {
const LuKernels& avx2_lu() noexcept { return portable_lu(); }
}  // namespace spook
#endif
