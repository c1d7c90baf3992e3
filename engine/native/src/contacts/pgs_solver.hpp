// Projected Gauss–Seidel over contacts in compact form, with joints, for as many bodies as there are.
#pragma once

#include <functional>
#include <vector>

#include "contacts/active_bodies.hpp"
#include "contacts/pgs_contacts.hpp"
#include "contacts/pgs_schedule.hpp"

namespace spook {

/// Islands are updated until they have settled, each for itself. Contacts may be added between iterations: what meets only
/// because of this step's impulses has its rows in the same solve. Rows are updated in the order they were given, or in one
/// with the same bits: four at once, where they share no body. The kernel, with the friction cone's bound: pgs_contact.inl.
class PgsSolver {
public:
    /// Takes mass, momentum and the rows of joints; no contacts yet. Masses are blocks: m·1 and the inertia.
    void start(MixedSystem& system, FrictionModel model);
    /// The same, with the masses that `other` was started with, over-relaxed: each change of a normal impulse is `relaxation`
    /// times what its own row asks for (0 … 2), but for the last two iterations.
    void start_beside(const PgsSolver& other, MixedSystem& system, FrictionModel model, double relaxation);
    /// Announces a contact that add() will bring, in the same order; after arrange() those announced have their places, one
    /// behind the other as they are updated: memory at random is what large heaps cost.
    void announce(int first, int second) { schedule_.link(first, second, started_); }
    void arrange();
    /// Adds a contact; its index counts from 0. What was not announced is kept in the order it was given.
    int add(const PgsContact& contact);
    std::size_t count() const noexcept { return static_cast<std::size_t>(added_); }

    /// Iterates until no row changes by more than `tolerance` [m/s] in an iteration, or an island has reached its limit of
    /// `iterations`. `more` is called after the 2nd, 4th, 8th … iteration, and with true when all is done: it may add contacts and
    /// says whether it did; those after the last iteration get `iterations` more, three times at most. Called again, it goes on:
    /// `more` is only asked in the end, and what has reached its limit is updated only where a body is new to its contacts, was
    /// found by worst(), or was just changed by more than `focus` [m/s].
    FrictionReport run(int iterations, double tolerance, double focus, const std::function<bool(bool)>& more);

    /// What has been done since start(), in iterations over everything there is now; looking for the worst is work, too.
    double work() const noexcept {
        return schedule_.items.empty() ? 0.0 : done_ / static_cast<double>(schedule_.items.size());
    }

    const Vec6& velocity(int body) const noexcept { return contacts_.velocity(body); }
    /// Tells of every body that may have another velocity than at the last worst().
    template <class Visit> void visit_moved(const Visit& visit) const {
        if (all_touched_ || schedule_.joints > 0)
            for (int body = 0; body < contacts_.bodies(); ++body) visit(body);
        else
            for (const int body : now_.moved) visit(body);
    }
    const double* impulse(int contact) const noexcept {
        return contacts_[static_cast<std::size_t>(schedule_.place[contact])].impulse;
    }
    /// Multipliers of joints, and all velocities.
    void write(MixedSystem& system) const { contacts_.write(system, schedule_.joints > 0); }
    /// The contact furthest from its law, as rows_residual() measures it; `row` is the contact's index. The next run goes on at
    /// those further off than `focus` [m/s], or, where these are few, than nearly what is `allowed`.
    RowsResidual worst(double focus, double allowed);

private:
    using Scheduled = PgsSchedule::Scheduled;
    void begin(const MixedSystem& system);
    void complete_order();
    void fetch(const Scheduled& later, const Scheduled& soon) const noexcept;
    void iterate_active(double focus);
    void touch(int body) noexcept;
    void note(const Scheduled& scheduled, double change, double focus) noexcept;
    void solve(const Scheduled* const group[4], int size, double focus) noexcept;
    void solve_all(std::size_t begin, std::size_t end, double focus) noexcept;
    void solve_scheduled(std::size_t begin, std::size_t end, double focus) noexcept;
    void solve_picked(std::size_t picked, double focus) noexcept;
    void iterate(double focus) noexcept;
    void find_residuals();

    /// What an iteration counts and keeps.
    struct Iteration {
        // Items updated of fresh islands; of those at their limit seen, and updated.
        std::size_t updated = 0, seen = 0, active_done = 0;
        std::vector<double> change;  // by root
        std::vector<const Scheduled*> picked;
        std::vector<int> moved;  // bodies, see touched_
    };
    Iteration now_;
    PgsContacts contacts_;
    PgsSchedule schedule_;
    ActiveBodies active_;
    int added_ = 0;
    // What worst() found of each contact, by place, and whose velocities have changed since.
    std::vector<double> residual_;
    std::vector<int> off_;
    std::vector<unsigned char> touched_;
    bool all_touched_ = true;
    double done_ = 0.0;     // items updated, and looked at for less
    bool started_ = false;  // since start()
};

}  // namespace spook
