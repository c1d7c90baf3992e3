#include "linear/block_kernels.hpp"

#include <algorithm>
#include <cmath>

#define SPOOK_ISA portable
#include "linear/block_kernels.inl"

namespace spook::kernel {

const Kernels& portable_kernels() noexcept { return portable::table; }

namespace {

const Kernels& fastest() noexcept {
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2")) return avx2_kernels();
#endif
    return portable_kernels();
}

const Kernels* chosen = &fastest();

}  // namespace

const Kernels& kernels() noexcept { return *chosen; }
void use_portable_kernels(bool portable) noexcept { chosen = portable ? &portable_kernels() : &fastest(); }
void use_kernels(const Kernels& kernels) noexcept { chosen = &kernels; }

}  // namespace spook::kernel
