// Which bodies are supported: the step's forces press them, from one to the next, onto what does not move by itself.
#pragma once

#include <vector>

#include "contacts/contact_bodies.hpp"
#include "contacts/contact_cache.hpp"
#include "contacts/islands.hpp"
#include "contacts/step_contact.hpp"

namespace spook {

class SupportedBodies {
public:
    void begin(std::size_t bodies);
    /// Takes down which way the forces press the bodies of a closed point, if they do not part faster; measures the point.
    void note(StepContact& point, const ContactBodies& bodies, const std::vector<Vec6>& velocity,
              const std::vector<Vec6>& dv_ext);
    /// Leaves those that are supported.
    void find(const ContactBodies& bodies);
    bool operator[](std::size_t body) const noexcept { return supported_[body] != 0; }

    /// Lets a body go that had this part [1] of its kick from its support until now.
    void release(int body, double part, const Vec6& dv_ext);
    /// Books what supports took of the kicks of those they let go: forces add up to the momentum where an island leans on
    /// what does not move by itself.
    bool has_released() const noexcept;
    void book(const MixedSystem& system, const Islands& islands, const ContactBodies& bodies,
              std::vector<CachedContact>& cache) const;

private:
    /// Of a closed point: which body the forces press on the other.
    struct Pair {
        int first, second;
        bool first_presses, second_presses, both;  // on each other, supported or not
    };
    std::vector<char> supported_;
    std::vector<Pair> pairs_;
    std::vector<Vec6> impulse_dv_;  // what supports took of a body's kick until they let it go
};

/// Whether a body's velocity, or a change of it, is along its kick, or against it.
bool is_along(Vec3 kick, Vec3 velocity);
/// Whether a point is an impact of what stands still that pushes the other one against the forces.
bool pushes_against_forces(const StepContact& point, const ContactBodies& bodies,
                           const std::vector<Vec6>& dv_ext);

}  // namespace spook
