#include "contacts/pgs_kernel.hpp"

#include <cmath>

#include "linear/instruction_set.hpp"

#define SPOOK_ISA portable
#include "contacts/pgs_contact.inl"

namespace spook {

void portable_solve_four(const PgsGroup& group) {
    static constexpr PackedFriction smooth{};
    for (int i = 0; i < 4; ++i) {
        const portable::Single contact{*group.contacts[i],
                                       group.slips ? *group.slips[i] : smooth,
                                       group.extras ? group.extras[i] : nullptr,
                                       group.bodies,
                                       group.inertia,
                                       group.fixed_body};
        group.change[i] = portable::solve_contact<double>(contact, portable::Disc{}, false);
    }
}

namespace {

SolveFour fastest() noexcept { return has_avx2() ? avx2_solve_four : portable_solve_four; }

SolveFour chosen = fastest();

}  // namespace

SolveFour solve_four() noexcept { return chosen; }
void use_portable_pgs(bool portable) noexcept { chosen = portable ? portable_solve_four : fastest(); }

}  // namespace spook
