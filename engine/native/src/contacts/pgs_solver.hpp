// Projected Gauss–Seidel over contacts in compact form, with joints, for as many bodies as there are.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "contacts/friction_point.hpp"
#include "contacts/pgs_kernel.hpp"
#include "contacts/pgs_rows.hpp"
#include "linear/ahead.hpp"
#include "linear/disjoint_sets.hpp"
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
/// serves all three rows, their own 3×3 part of C M⁻¹ Cᵀ carries the normal's change over to the tangents.
/// Islands are updated until they have settled, each for itself. Contacts may be added between iterations, so that a pair
/// that meets only because of this step's impulses has its rows in the same solve; islands then grow together.
/// Rows are updated in the order they were given, or in an equivalent order with the same bits: four at once, where they share
/// no body. Equal input gives equal bits. Memory is kept.
class PgsSolver {
public:
    /// Takes mass, momentum and the rows of joints; no contacts yet. Masses are blocks: m·1 and the inertia.
    void start(MixedSystem& system, FrictionModel model);
    /// The same, with the masses that `other` was started with; each change of a normal impulse is `relaxation` times what
    /// its own row asks for, between 0 and 2: what is spread over many rows gets there sooner with a little more than 1. The
    /// last two iterations are plain, so that what was pushed too far comes back.
    void start_beside(const PgsSolver& other, MixedSystem& system, FrictionModel model, double relaxation);
    /// Announces a contact that add() will bring, in the same order; after arrange() those announced have their places, one
    /// behind the other as they are updated: memory at random is what large heaps cost.
    void announce(int first, int second) { link(first, second); }
    void arrange();
    /// Adds a contact; its index counts from 0. What was not announced is kept in the order it was given.
    int add(const PgsContact& contact);
    std::size_t count() const noexcept { return static_cast<std::size_t>(added_); }

    /// Iterates until no row changes by more than `tolerance` [m/s] in an iteration, or an island was updated `iterations`
    /// times: it has reached its limit then. `more` is called after the 2nd, 4th, 8th … iteration, and with true when all is done: it may
    /// add contacts and says whether it did; those that come after the last iteration get `iterations` more, three times at
    /// most. May be called again, to go on: then `more` is only asked in the end, and what has reached its limit is updated only where
    /// a body is new to its contacts, was found by worst(), or was just changed by more than `focus` [m/s]: in a large
    /// heap something somewhere always asks.
    FrictionReport run(int iterations, double tolerance, double focus, const std::function<bool(bool)>& more);

    /// What has been done since start(), in iterations over everything there is now; looking for the worst is work, too.
    double work() const noexcept {
        return bodies_of_.empty() ? 0.0 : done_ / static_cast<double>(bodies_of_.size());
    }

    const Vec6& velocity(int body) const noexcept { return joints_.bodies()[body].velocity; }
    /// Tells of every body that may have another velocity than at the last worst().
    template <class Visit> void visit_moved(const Visit& visit) const {
        if (all_touched_ || joint_count_ > 0)
            for (int body = 0; body < bodies_; ++body) visit(body);
        else
            for (const int body : now_.moved) visit(body);
    }
    const double* impulse(int contact) const noexcept { return contacts_[place_[contact]].impulse; }
    /// Multipliers of joints, and all velocities.
    void write(MixedSystem& system) const;
    /// The contact furthest from its law, as rows_residual() measures it; `row` is the contact's index. Those
    /// further off than `focus` [m/s] are where the next run goes on; where they are few, only those that are as far off
    /// as nearly what is `allowed`.
    RowsResidual worst(double focus, double allowed);
    RowsResidual worst(double focus) { return worst(focus, focus); }

private:
    struct Box {                    // what only boxes and anisotropic friction read
        double own[3] = {0, 0, 0};  // (t, t), (t, u), (u, u), with gamma/h
        bool anisotropic = false;
    };
    struct Both {
        int first, second;  // bodies; bodies_ for one that does not move
    };
    /// A contact in the order of an iteration.
    struct Scheduled {
        int item, first, second, island;  // joints and its place; its bodies and root
    };
    void begin(MixedSystem& system, FrictionModel model);
    Vec3 turned(int body, Vec3 moment) const noexcept;
    PgsBody& body(int at) noexcept { return joints_.bodies()[at]; }
    const PgsBody& body(int at) const noexcept { return joints_.bodies()[at]; }
    void add_slip(const PgsContact& given, int place);
    double update(std::size_t contact) noexcept;
    void push(const PackedContact& contact, Vec3 impulse) noexcept;
    int root(int body) noexcept { return sets_.root(body); }
    void link(int first, int second);
    void join(int first, int second);
    void schedule();
    void select();
    void fetch(const Scheduled& later, const Scheduled& soon) const noexcept;
    static constexpr unsigned char active_now = 2;  // and 1 in the iteration after
    void activate(int first, int second) noexcept;
    void mark(int body) noexcept;
    void mark_active();
    void iterate_active(double focus);
    void touch(int body) noexcept;
    void note(const Scheduled& scheduled, double change, double focus) noexcept;
    void solve(const Scheduled* const group[4], int size, double focus) noexcept;
    void solve_all(std::size_t begin, std::size_t end, double focus) noexcept;
    void solve_scheduled(std::size_t begin, std::size_t end, double focus) noexcept;
    void solve_picked(std::size_t picked, double focus) noexcept;
    void iterate(double focus) noexcept;
    void find_residuals();
    double residual_of(std::size_t contact) const noexcept;

    /// What an iteration counts and keeps.
    struct Iteration {
        // Items updated of fresh islands; of those at their limit seen, and updated.
        std::size_t updated = 0, seen = 0, active_done = 0;
        std::vector<double> change;  // by root
        std::vector<const Scheduled*> picked;
        std::vector<int> moved;  // bodies, see touched_
        PackedContact none{};    // fills a group
    };
    Iteration now_;
    FrictionModel model_ = FrictionModel::cone;
    PgsRows joints_;
    int joint_count_ = 0, bodies_ = 0;
    LargeArray<PgsInertia> inertia_;
    bool round_ = true;  // all bodies are
    double relaxation_ = 1.0;
    std::vector<int> place_;  // of each contact, by index, in the arrays that follow
    int added_ = 0;
    LargeArray<PackedContact> contacts_;
    // Of each, from where some contact has it on: in large heaps memory is what iterating costs.
    LargeArray<PackedFriction> slips_;
    LargeArray<PackedExtras> extras_;
    LargeArray<Box> boxes_;
    PackedFriction no_slip_{};
    PackedExtras no_extras_{};
    // Islands: bodies joined by union-find.
    DisjointSets sets_;            // bodies of an island
    std::vector<Both> bodies_of_;  // of every item, joints first
    std::vector<int> roots_;       // of items
    std::vector<char> known_;      // those that are in the list, or were before they joined another
    std::vector<char> active_, limit_reached_;
    std::vector<double>
        last_change_;  // the last iteration's change, by root; the largest since it has reached its limit
    std::vector<unsigned char>
        active_bodies_;  // bodies whose rows were changed much: 2 in this iteration, 1 in the one before
    // Where few are scheduled: the contacts of active bodies by their place in order_, a bit each, in this iteration and the next.
    std::vector<std::uint64_t> marked_now_, marked_next_;
    std::vector<int> first_marked_,
        next_marked_;         // of each body a list of twice those places, plus one for the second body
    std::size_t listed_ = 0;  // places in those lists
    bool marked_ = false, marking_ = false;  // these are right; an iteration goes by them
    std::vector<int> size_;                  // contacts, by root, of so many in order_
    std::size_t sized_ = 0;
    // What worst() found of each contact, by place, and whose velocities have changed since.
    std::vector<double> residual_;
    std::vector<int> off_;
    std::vector<unsigned char> touched_;
    bool all_touched_ = true;
    double done_ = 0.0;     // items updated, and looked at for less
    bool started_ = false;  // since start()
    // The order of an iteration: levels, in each of them contacts that share no moving body, and every contact in a later one
    // than those before it that share one. Whatever is done at a level together, the bits are those of one after the other.
    std::size_t scheduled_ = 0;  // items; those that come late have levels of their own, behind
    bool joined_ = false;        // islands have, since
    LargeArray<Scheduled> order_, active_order_;
    std::vector<std::size_t> level_end_, active_level_end_;
    bool whole_ = true;  // all islands are active
    const LargeArray<Scheduled>& scheduled() const noexcept { return whole_ ? order_ : active_order_; }
    const std::vector<std::size_t>& scheduled_end() const noexcept {
        return whole_ ? level_end_ : active_level_end_;
    }
    std::vector<int> level_, next_level_;  // of items, and of bodies
};

}  // namespace spook
