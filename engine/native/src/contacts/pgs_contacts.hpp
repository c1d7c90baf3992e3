// Contacts and bodies as iterations of PGS read and write them: bodies in a line each, contacts one behind the other.
#pragma once

#include "contacts/friction_point.hpp"
#include "contacts/pgs_kernel.hpp"
#include "contacts/pgs_rows.hpp"
#include "linear/ahead.hpp"
#include "linear/large_array.hpp"
#include "linear/vec.hpp"

namespace spook {

/// One contact as the iterations take it. The rows are C v₊ + Sig nu >= right[0] ⟂ nu >= 0 along the normal, and
/// friction against the slip D v₊ + (gamma/h) beta − right[1 … 2] along the tangents.
struct PgsContact {
    int first = -1, second = -1;   // moving bodies, −1 for one that does not move
    Vec3 normal, tangent, across;  // orthogonal; unit, but the tangents of a friction that is anisotropic
    Vec3 first_arm, second_arm;    // from the centres of mass, m
    double right[3] = {0, 0, 0};   // m/s
    double softness = 0.0;         // Sig
    double slip_softness = 0.0;    // gamma/h
    double friction = 0.0;         // mu
    double normal_before = -1.0;  // nu of the step before, what the box bounds friction by; negative: unknown
    double impulse[3] = {0, 0, 0};  // nu, beta: the start, then the result
    bool anisotropic = false;       // see FrictionPoint
};

/// A contact costs one reading of its two bodies and one writing per iteration: the relative velocity at the point
/// serves all three rows, their own 3×3 part of C M⁻¹ Cᵀ carries the normal's change over to the tangents. Memory is kept.
class PgsContacts {
public:
    /// Takes mass, momentum and the rows of joints; no contacts yet. Masses are blocks: m·1 and the inertia.
    void begin(MixedSystem& system, FrictionModel model);
    /// The same, with the masses that `other` has; see PgsSolver::start_beside().
    void begin_beside(const PgsContacts& other, MixedSystem& system, FrictionModel model, double relaxation);
    void resize(std::size_t count) { contacts_.resize(count); }
    std::size_t size() const noexcept { return contacts_.size(); }
    /// Lays a contact out at its place, and lets its start act.
    void put(const PgsContact& given, int place);

    /// Updates up to four contacts that share no moving body; `change` is the largest of a row of each, as a velocity.
    template <class PlaceOf> void update(int size, const PlaceOf& place_of, double* change) noexcept {
        if (size == 1 || !boxes_.empty()) {
            for (int k = 0; k < size; ++k) change[k] = update(place_of(k));
            return;
        }
        PackedContact* four[4] = {&none_, &none_, &none_, &none_};
        const PackedFriction* slips[4] = {&no_slip_, &no_slip_, &no_slip_, &no_slip_};
        const PackedExtras* extras[4] = {&no_extras_, &no_extras_, &no_extras_, &no_extras_};
        for (int k = 0; k < size; ++k) {
            four[k] = &contacts_[place_of(k)];
            if (!slips_.empty()) slips[k] = &slips_[place_of(k)];
            if (!extras_.empty()) extras[k] = &extras_[place_of(k)];
        }
        solve_four()({four, slips_.empty() ? nullptr : slips, extras_.empty() ? nullptr : extras,
                      joints_.bodies().data(), isotropic_ ? nullptr : inertia_.data(), bodies_, change});
    }
    double update_joint(std::size_t block) noexcept { return joints_.update_joint(block); }
    /// Asks for what later contacts will read: in large heaps it comes from far away.
    void fetch(std::size_t later, int first, int second) const noexcept {
        prefetch(contacts_[later]);
        if (!slips_.empty()) prefetch(slips_[later]);
        for (const int at : {first, second}) {
            prefetch(body(at));
            if (!isotropic_) prefetch(inertia_[at]);
        }
    }
    void relax_no_more();
    /// How far a contact is from its law, as rows_residual() measures it, m/s.
    double residual(std::size_t place) const noexcept;

    const PackedContact& operator[](std::size_t place) const noexcept { return contacts_[place]; }
    const Vec6& velocity(int at) const noexcept { return body(at).velocity; }
    /// How many bodies there are, and the index of the one that does not move.
    int bodies() const noexcept { return bodies_; }
    /// All velocities, and multipliers of joints if there are any.
    void write(MixedSystem& system, bool joints) const {
        if (joints) joints_.write(system);
        else joints_.write_velocities(system);
    }

private:
    struct Box {                         // what only boxes and anisotropic friction read
        double tangents[3] = {0, 0, 0};  // (t, t), (t, u), (u, u), with gamma/h
        bool anisotropic = false;
    };
    void take_momenta(MixedSystem& system, FrictionModel model);
    PgsBody& body(int at) noexcept { return joints_.bodies()[at]; }
    const PgsBody& body(int at) const noexcept { return joints_.bodies()[at]; }
    Vec3 turned(int body, Vec3 moment) const noexcept;
    void add_slip(const PgsContact& given, int place);
    void push(const PackedContact& contact, Vec3 impulse) noexcept;
    double update(std::size_t place) noexcept;

    FrictionModel model_ = FrictionModel::cone;
    PgsRows joints_;
    int bodies_ = 0;
    LargeArray<PgsInertia> inertia_;
    bool isotropic_ = true;  // all inertias are
    double relaxation_ = 1.0;
    LargeArray<PackedContact> contacts_;
    // Of each, from where some contact has it on: in large heaps memory is what iterating costs.
    LargeArray<PackedFriction> slips_;
    LargeArray<PackedExtras> extras_;
    LargeArray<Box> boxes_;
    PackedContact none_{};  // fills a group
    PackedFriction no_slip_{};
    PackedExtras no_extras_{};
};

}  // namespace spook
