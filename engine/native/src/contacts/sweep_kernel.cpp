#include "contacts/sweep_kernel.hpp"

#include <cmath>

#include "linear/instruction_set.hpp"

#define SPOOK_ISA portable
#include "contacts/contact_update.inl"

namespace spook {

void portable_sweep_four(const SweepGroup& group) {
    static constexpr SweptSlip smooth{};
    for (int i = 0; i < 4; ++i) {
        const portable::Single contact{*group.contacts[i],
                                       group.slips ? *group.slips[i] : smooth,
                                       group.rests ? group.rests[i] : nullptr,
                                       group.bodies,
                                       group.inertia,
                                       group.nobody};
        group.change[i] = portable::solve_contact<double>(contact, portable::Disc{}, false);
    }
}

namespace {

SweepFour fastest() noexcept { return has_avx2() ? avx2_sweep_four : portable_sweep_four; }

SweepFour chosen = fastest();

}  // namespace

SweepFour sweep_four() noexcept { return chosen; }
void use_portable_sweeps(bool portable) noexcept { chosen = portable ? portable_sweep_four : fastest(); }

}  // namespace spook
