#include <cmath>
#include <limits>

#include "contacts/cone_unit.hpp"
#include "linear/instruction_set.hpp"
#include "linear/six.hpp"

#define SPOOK_ISA portable
#include "contacts/cone_laws.inl"

namespace spook {

const ConeLaws& portable_cone_laws() noexcept { return portable::cone_table; }

namespace {

ByMachine<ConeLaws> chosen(portable_cone_laws(), avx2_cone_laws());

}  // namespace

const ConeLaws& cone_laws() noexcept { return *chosen; }
void use_portable_cone_laws(bool portable) noexcept { chosen.use_portable(portable); }

}  // namespace spook
