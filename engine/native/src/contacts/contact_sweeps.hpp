// Projected Gauss–Seidel over contacts in compact form, with joints, for as many bodies as there are.
#pragma once

#include <functional>
#include <vector>

#include "contacts/due_items.hpp"
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
    /// times: it is spent then. `more` is called after the 2nd, 4th, 8th … sweep, while some island is not spent, and when
    /// all is done: it may add contacts and says whether it did; those that come after the last sweep get `iterations`
    /// more, three times at most. May be called again, to go on. What is spent is swept only where a contact is new, was
    /// found by worst(), or where a body was just changed by more than half of `focus` [m/s]: in a large heap something
    /// somewhere always asks.
    FrictionReport run(int iterations, double tolerance, double focus, const std::function<bool()>& more);

    /// What has been done since start(), in sweeps over everything there is now; looking for the worst is work, too.
    double work() const noexcept { return next_.empty() ? 0.0 : done_ / static_cast<double>(next_.size()); }

    const Vec6& velocity(int body) const noexcept { return joints_.velocity()[body]; }
    const double* impulse(int contact) const noexcept { return contacts_[contact].impulse; }
    /// Multipliers of joints, and all velocities.
    void write(MixedSystem& system) const;
    /// Whose velocity the sweeps may have changed since forget_moves(): everybody's, or that of moved() at most.
    bool all_moved() const noexcept { return all_moved_; }
    const std::vector<int>& moved() const noexcept { return moved_; }
    void forget_moves();

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
    void ask_for_bodies(int item) const noexcept;
    void fetch(int item) const noexcept;
    void warm(int item);
    void heat(int item, double change, double focus) noexcept;
    void note_moved(int body);
    double sweep_item(int item) noexcept;
    double sweep_island(int root) noexcept;
    void sweep_hot(double focus);
    double residual(const Contact& contact) const noexcept;

    FrictionModel model_ = FrictionModel::cone;
    Sweeper joints_;
    int joint_count_ = 0, bodies_ = 0;
    std::vector<Inertia> inertia_;
    LargeArray<Contact> contacts_;
    LargeArray<Slip> slips_;  // of each
    // Islands: bodies joined by union-find; the items of one, joints first, are a chain in the order they came.
    std::vector<int> parent_, head_, tail_, size_, next_;
    std::vector<Both> bodies_of_;
    std::vector<int> roots_;
    std::vector<char> active_, spent_;
    std::vector<double> left_;  // the last sweep's change, by root; the largest since it is spent
    std::vector<int> hot_;      // the last sweep that changed a body much
    DueItems due_;              // the items of hot bodies, from the first sweep on that leaves others alone
    std::vector<int> warm_;     // items that are to be swept because of what was found between two sweeps
    int warm_at_ = 0;           // after this one
    std::vector<double> worst_of_;         // a spent island's change in this sweep, by root
    int stamp_ = 0, last_hot_ = 0;         // counts sweeps; the last that left out what is not hot
    double done_ = 0.0;                    // items swept, and looked at for less
    bool chained_ = false, wide_ = false;  // rows of more than two bodies
    bool all_moved_ = true;
    std::vector<int> moved_;
    std::vector<char> moves_;  // who is in it
    // How far each contact was off when it was last measured; since then, whose bodies have moved, in which sweep.
    std::vector<double> off_;
    std::vector<int> moved_at_;
    int all_moved_at_ = 0, measured_at_ = 0;
};

}  // namespace spook
