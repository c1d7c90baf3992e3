#include "contacts/sweep_kernel.hpp"

#include <cmath>

#define SPOOK_ISA portable
#include "contacts/contact_update.inl"

namespace spook {

void portable_sweep_four(const SweepGroup& group) {
    static constexpr SweptRest nothing{};
    for (int i = 0; i < 4; ++i) {
        SweptContact& c = *group.contacts[i];
        SweptRest rest = nothing;
        rest.across = cross(c.normal, c.tangent);
        group.change[i] =
            portable::solve_contact<double>(portable::Single{c, group.rests ? *group.rests[i] : rest,
                                                             group.velocity, group.bodies, group.nobody},
                                            portable::Disc{}, false);
    }
}

namespace {

SweepFour fastest() noexcept {
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2")) return avx2_sweep_four;
#endif
    return portable_sweep_four;
}

SweepFour chosen = fastest();

}  // namespace

SweepFour sweep_four() noexcept { return chosen; }
void use_portable_sweeps(bool portable) noexcept { chosen = portable ? portable_sweep_four : fastest(); }

}  // namespace spook
