// What may do work on bodies from outside: surfaces that move along themselves, and bodies that move as they are told.
#pragma once

#include <vector>

#include "contacts/contact_bodies.hpp"
#include "contacts/pivot_system.hpp"

namespace spook {

class ExternalDrive {
public:
    /// Takes the velocities of bodies that do not move by themselves.
    void begin(const ContactBodies& bodies, const ContactSurfaces& surfaces,
               const std::vector<Vec6>& velocity) {
        prescribed_.resize(velocity.size());
        any_ = surfaces.conveys;
        for (std::size_t b = 0; b < velocity.size(); ++b) {
            prescribed_[b] = bodies.solver_index[b] < 0 ? velocity[b] : Vec6{};
            any_ = any_ || prescribed_[b] != Vec6{};
        }
    }
    bool any() const noexcept { return any_; }
    const std::vector<Vec6>& prescribed() const noexcept { return prescribed_; }
    /// Whether one may do work at a contact.
    bool acts_at(const Contact& contact, const ContactSurfaces& surfaces) const noexcept {
        if (!any_) return false;
        if (surfaces.is_conveyed(contact)) return true;
        const auto moves = [this](int body) {
            const Vec6& v = prescribed_[body];
            return norm(Vec3{v[0], v[1], v[2]}) > 0.0 || norm(Vec3{v[3], v[4], v[5]}) > 0.0;
        };
        return moves(contact.first) || moves(contact.second);
    }

private:
    std::vector<Vec6> prescribed_;  // per body, zero for those that move by themselves
    bool any_ = false;              // in this step
};

}  // namespace spook
