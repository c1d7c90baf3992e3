#include "linear/block_lu_kernels.hpp"

#include <algorithm>
#include <cmath>

#include "linear/pieces.hpp"
#include "linear/six.hpp"

#define SPOOK_ISA portable
#include "linear/block_lu.inl"

namespace spook {

const LuKernels& portable_lu() noexcept { return portable::lu_table; }

namespace {

const LuKernels& fastest() noexcept {
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2")) return avx2_lu();
#endif
    return portable_lu();
}

const LuKernels* chosen = &fastest();

}  // namespace

const LuKernels& lu_kernels() noexcept { return *chosen; }
void use_portable_lu(bool portable) noexcept { chosen = portable ? &portable_lu() : &fastest(); }

}  // namespace spook
