// The same laws in vectors of four. Not fused multiply-add: that would round differently.
#include <cmath>
#include <limits>

#include "contacts/cone_unit.hpp"
#include "linear/six.hpp"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2")
#define SPOOK_ISA avx2
#define SPOOK_FOURS
#include "contacts/cone_laws.inl"
#pragma GCC pop_options

namespace spook {
const ConeLaws& avx2_cone_laws() noexcept { return avx2::cone_table; }
}  // namespace spook
#else
namespace spook {
const ConeLaws& avx2_cone_laws() noexcept { return portable_cone_laws(); }
}  // namespace spook
#endif
