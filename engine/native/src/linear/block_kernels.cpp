#include "linear/block_kernels.hpp"

#include <algorithm>
#include <cmath>

#include "linear/instruction_set.hpp"

#define SPOOK_ISA portable
#include "linear/block_kernels.inl"

namespace spook::kernel {

const Kernels& portable_kernels() noexcept { return portable::table; }

namespace {

ByMachine<Kernels> chosen(portable_kernels(), avx2_kernels());

}  // namespace

const Kernels& kernels() noexcept { return *chosen; }
void use_portable_kernels(bool portable) noexcept { chosen.use_portable(portable); }
void use_kernels(const Kernels& kernels) noexcept { chosen.use(kernels); }

}  // namespace spook::kernel
