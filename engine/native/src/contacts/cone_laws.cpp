#include <cmath>
#include <limits>

#include "contacts/cone_unit.hpp"
#include "linear/six.hpp"

#define SPOOK_ISA portable
#include "contacts/cone_laws.inl"

namespace spook {

const ConeLaws& portable_cone_laws() noexcept { return portable::cone_table; }

namespace {

const ConeLaws& fastest() noexcept {
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2")) return avx2_cone_laws();
#endif
    return portable_cone_laws();
}

const ConeLaws* chosen = &fastest();

}  // namespace

const ConeLaws& cone_laws() noexcept { return *chosen; }
void use_portable_cone_laws(bool portable) noexcept {
    chosen = portable ? &portable_cone_laws() : &fastest();
}

}  // namespace spook
