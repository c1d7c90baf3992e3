#include "linear/block_lu_kernels.hpp"

#include <algorithm>
#include <cmath>

#include "linear/instruction_set.hpp"
#include "linear/pieces.hpp"
#include "linear/six.hpp"

#define SPOOK_ISA portable
#include "linear/block_lu.inl"

namespace spook {

const LuKernels& portable_lu() noexcept { return portable::lu_table; }

namespace {

ByMachine<LuKernels> chosen(portable_lu(), avx2_lu());

}  // namespace

const LuKernels& lu_kernels() noexcept { return *chosen; }
void use_portable_lu(bool portable) noexcept { chosen.use_portable(portable); }

}  // namespace spook
