// Projected Gauss–Seidel over contacts in compact form, with joints, for as many bodies as there are.
#pragma once

#include <functional>
#include <vector>

#include "contacts/friction_point.hpp"
#include "contacts/sweep_rows.hpp"
#include "linear/large_array.hpp"
#include "linear/vec.hpp"

namespace spook {

/// One contact as the sweeps take it. The rows are C v₊ + Sig nu >= right[0] ⟂ nu >= 0 along the normal, and
/// friction against the slip D v₊ + (gamma/h) beta − right[1 … 2] along the tangents.
struct SweepContact {
    int first = -1, second = -1;   // moving bodies, −1 for one that does not move
    Vec3 normal, tangent, across;  // orthogonal; unit, but the tangents of a friction that is stretched
    Vec3 first_arm, second_arm;    // from the centres of mass, m
    double right[3] = {0, 0, 0};   // m/s
    double softness = 0.0;         // Sig
    double slip_softness = 0.0;    // gamma/h
    double friction = 0.0;         // mu
    double normal_before = -1.0;  // nu of the step before, what the box bounds friction by; negative: unknown
    double impulse[3] = {0, 0, 0};  // nu, beta: the start, then the result
    bool stretched = false;         // see FrictionPoint
};

/// A contact costs one reading of its two bodies and one writing per sweep: the relative velocity at the point
/// serves all three rows, their own 3×3 part of C M⁻¹ Cᵀ carries the normal's change over to the tangents.
/// Islands are swept until they have settled, each for itself. Contacts may be added between sweeps, so that a pair
/// that meets only because of this step's impulses has its rows in the same solve; islands then grow together.
/// Rows are swept in the order they were given, on one thread: equal input gives equal bits. Memory is kept.
class ContactSweeps {
public:
    /// Takes mass, momentum and the rows of joints; no contacts yet. Masses are blocks: m·1 and the inertia.
    void start(MixedSystem& system, FrictionModel model);
    /// The same, with the masses that `other` was started with.
    void start_beside(const ContactSweeps& other, MixedSystem& system, FrictionModel model);
    /// Adds a contact; its index counts from 0.
    int add(const SweepContact& contact);

    /// Sweeps until no row changes by more than `tolerance` [m/s] in a sweep, or an island was swept `iterations`
    /// times: it is spent then. `more` is called after the 2nd, 4th, 8th … sweep and when all is done: it may add
    /// contacts and says whether it did; those that come after the last sweep get `iterations` more, three times at
    /// most. May be called again, to go on. What is spent is swept only where a body is new to its contacts, was
    /// found by worst(), or was just changed by more than `focus` [m/s]: in a large heap something somewhere always asks.
    FrictionReport run(int iterations, double tolerance, double focus, const std::function<bool()>& more);

    /// What has been done since start(), in sweeps over everything there is now; looking for the worst is work, too.
    double work() const noexcept { return next_.empty() ? 0.0 : done_ / static_cast<double>(next_.size()); }

    const Vec6& velocity(int body) const noexcept { return joints_.velocity()[body]; }
    const double* impulse(int contact) const noexcept { return contacts_[contact].impulse; }
    /// Multipliers of joints, and all velocities.
    void write(MixedSystem& system) const;
    /// The contact furthest from its law, as rows_residual() measures it; `row` is the contact's index. Those
    /// further off than `focus` [m/s] are where the next run goes on.
    RowsResidual worst(double focus);

private:
    struct Contact {
        int first, second;
        Vec3 normal, tangent, across, first_arm, second_arm;
        double right[3], softness, slip_softness, friction, normal_before, impulse[3];
        double own, own_inverse;  // of the normal, with Sig
        double coupling[2];       // between normal and tangents
        double step;              // 1/lambda_max of the tangents' part
        bool stretched;
    };
    static_assert(sizeof(Contact) == 256);  // what every sweep reads of every contact: four lines of a cache
    struct Slip {                           // what only boxes and stretched friction read
        double own[3];                      // (t, t), (t, u), (u, u), with gamma/h
    };
    struct Inertia {
        double inverse_mass = 0.0;
        Mat3 inverse;  // of the inertia, world axes, 1/(kg m²)
    };
    struct Both {
        int first, second;  // bodies; bodies_ for one that does not move
    };
    void begin(MixedSystem& system, FrictionModel model);
    double update(Contact& contact) noexcept;
    const double* slip(const Contact& contact) const noexcept {
        return slips_[static_cast<std::size_t>(&contact - contacts_.data())].own;
    }
    void push(const Contact& contact, Vec3 impulse) noexcept;
    int root(int body) noexcept;
    void link(int item, int first, int second);
    void join(int first, int second);
    void chain(int item);
    void fetch(int item) const noexcept;
    void heat(Both bodies) noexcept;
    double sweep_island(int root) noexcept;
    double sweep_hot(int root, double focus) noexcept;

    FrictionModel model_ = FrictionModel::cone;
    Sweeper joints_;
    int joint_count_ = 0, bodies_ = 0;
    std::vector<Inertia> inertia_;
    LargeArray<Contact> contacts_;
    LargeArray<Slip> slips_;  // of each
    // Islands: bodies joined by union-find; the items of one, joints first, are a chain in the order they came.
    std::vector<int> parent_, head_, tail_, next_;
    std::vector<Both> bodies_of_;
    std::vector<int> roots_;
    std::vector<char> active_, spent_;
    std::vector<double> left_;  // the last sweep's change, by root; the largest since it is spent
    std::vector<int> hot_;      // the last sweep that changed a body's rows much
    int stamp_ = 0;             // counts sweeps
    double done_ = 0.0;         // items swept, and looked at for less
    bool chained_ = false;
};

}  // namespace spook
