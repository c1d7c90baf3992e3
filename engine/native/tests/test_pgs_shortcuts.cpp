// What iterations leave out must not be seen: islands that have settled, and in those at their limit whatever is not far off. Random
// contacts, islands that grow together, bodies that are met late, against the law and against iterations over everything.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <utility>

#include "contacts/pgs_solver.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

constexpr int forever = 1'000'000;  // iterations: no island has reached its limit
const std::function<bool(bool)> nothing_more = [](bool) { return false; };

Mat6 unit_mass() {
    Mat6 unit{};
    for (int i = 0; i < 6; ++i) unit[7 * i] = 1.0;
    return unit;
}

MixedSystem resting(int bodies) {
    MixedSystem system;
    system.mass.assign(bodies, unit_mass());
    system.momentum.assign(bodies, Vec6{});
    return system;
}

PgsContact between(int first, int second, Vec3 normal, double friction) {
    PgsContact contact;
    contact.first = first;
    contact.second = second;
    contact.normal = normal;
    const Vec3 aside = std::abs(normal.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 across = cross(normal, aside);
    contact.across = (1.0 / norm(across)) * across;
    contact.tangent = cross(contact.across, normal);
    contact.friction = friction;
    return contact;
}

/// What one unit of an impulse along `way` does to the contact's own slip along it, of unit masses.
double own(const PgsContact& contact, Vec3 way) {
    double sum = 0.0;
    if (contact.first >= 0) sum += 1.0 + dot(cross(contact.first_arm, way), cross(contact.first_arm, way));
    if (contact.second >= 0) sum += 1.0 + dot(cross(contact.second_arm, way), cross(contact.second_arm, way));
    return sum;
}

/// A solver, with all that it was given.
struct Heap {
    MixedSystem system;
    PgsSolver solver;
    std::vector<PgsContact> contacts;

    explicit Heap(const MixedSystem& given) : system(given) { solver.start(system, FrictionModel::cone); }
    void add(const PgsContact& contact) {
        EXPECT(solver.add(contact) == static_cast<int>(contacts.size()));
        contacts.push_back(contact);
    }
    Vec3 slip(const PgsContact& c) const {
        Vec3 u;
        if (c.first >= 0) {
            const Vec6& v = solver.velocity(c.first);
            u += Vec3{v[0], v[1], v[2]} + cross(Vec3{v[3], v[4], v[5]}, c.first_arm);
        }
        if (c.second >= 0) {
            const Vec6& v = solver.velocity(c.second);
            u += -1.0 * (Vec3{v[0], v[1], v[2]} + cross(Vec3{v[3], v[4], v[5]}, c.second_arm));
        }
        return u;
    }
    /// How far one contact is from Signorini's and Coulomb's law, m/s; the impulses as they are.
    double off(std::size_t k) const {
        const PgsContact& c = contacts[k];
        const double* const z = solver.impulse(static_cast<int>(k));
        const Vec3 u = slip(c);
        const double w = dot(c.normal, u) - c.right[0];
        const double normal = w > 0.0 ? std::min(w, z[0] * own(c, c.normal)) : -w;
        if (!(c.friction > 0.0)) return normal;
        const double bound = c.friction * z[0], used = std::hypot(z[1], z[2]);
        const double s1 = dot(c.tangent, u), s2 = dot(c.across, u), slip = std::hypot(s1, s2);
        EXPECT(used <= bound * (1.0 + 1e-12));
        // What is short of the cone, or not against the slip, may not slip.
        const double short_of = std::min(slip, (bound - used) * own(c, c.tangent)),
                     against = used > 0.0 ? -(z[1] * s1 + z[2] * s2) / used : slip,
                     askew = std::min(slip - std::max(0.0, against), 2.0 * bound * own(c, c.tangent));
        return std::max({normal, short_of, askew});
    }
    double worst() const {
        double sum = 0.0;
        for (std::size_t k = 0; k < contacts.size(); ++k) sum = std::max(sum, off(k));
        return sum;
    }
    /// The largest difference between the velocities and what the impulses make of the momenta.
    double unbalanced() const {
        std::vector<Vec6> made = system.momentum;
        for (std::size_t k = 0; k < contacts.size(); ++k) {
            const PgsContact& c = contacts[k];
            const double* const z = solver.impulse(static_cast<int>(k));
            const Vec3 p = z[0] * c.normal + z[1] * c.tangent + z[2] * c.across;
            for (const bool first : {true, false}) {
                const int body = first ? c.first : c.second;
                if (body < 0) continue;
                const Vec3 turn = cross(first ? c.first_arm : c.second_arm, p);
                const double all[6] = {p.x, p.y, p.z, turn.x, turn.y, turn.z};
                for (int i = 0; i < 6; ++i) made[body][i] += (first ? 1.0 : -1.0) * all[i];
            }
        }
        double most = 0.0;
        for (std::size_t b = 0; b < made.size(); ++b)
            for (int i = 0; i < 6; ++i)
                most = std::max(most, std::abs(made[b][i] - solver.velocity(static_cast<int>(b))[i]));
        return most;
    }
};

using Random = std::mt19937;
double uniform(Random& random, double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
}

/// Between two of the bodies, one of them the ground at times. All push up, so that there is an answer: rise fast.
PgsContact any_contact(Random& random, int bodies, double friction) {
    const int first = static_cast<int>(random() % bodies);
    int second = static_cast<int>(random() % bodies);
    if (second == first || random() % 3 == 0) second = -1;
    Vec3 normal{uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5), 1.0};
    normal = (1.0 / norm(normal)) * normal;
    PgsContact contact =
        first > second ? between(first, second, normal, friction) : between(second, first, normal, friction);
    contact.first_arm = {uniform(random, -0.3, 0.3), uniform(random, -0.3, 0.3), -0.5};
    contact.second_arm = {uniform(random, -0.3, 0.3), uniform(random, -0.3, 0.3), 0.5};
    return contact;
}

/// Islands settle, and then contacts found late join them to each other: all has to be updated again, and nothing lost.
/// A row's last change is at most the tolerance, and what came after it in that iteration are at most as many such.
void islands_that_grow_together_obey_the_law() {
    int late = 0, joined = 0;
    for (unsigned seed = 0; seed < 60; ++seed)
        for (const double friction : {0.0, 0.5}) {
            Random random(seed);
            const int bodies = 24;
            MixedSystem system = resting(bodies);
            for (Vec6& p : system.momentum)
                for (double& x : p) x = uniform(random, -1.0, 1.0);
            Heap heap(system);
            for (int k = 0; k < 12; ++k) heap.add(any_contact(random, bodies, friction));
            int left = 16;
            const double tolerance = 1e-11;
            const auto find = [&](bool) {
                if (left == 0) return false;
                for (int k = static_cast<int>(random() % 3); k >= 0 && left > 0; --k, --left) {
                    const PgsContact& found = any_contact(random, bodies, friction);
                    joined += found.second >= 0;
                    heap.add(found);
                    ++late;
                }
                return true;
            };
            bool converged = false;  // whatever is found at the end is, three times, then the next run's
            for (int turn = 0; turn < 16 && !converged; ++turn)
                converged = heap.solver.run(forever, tolerance, 1e-2, find).converged;
            EXPECT(converged && left == 0);
            EXPECT(heap.worst() <= 100.0 * heap.contacts.size() * tolerance);
            EXPECT(heap.unbalanced() <= 1e-12);
        }
    EXPECT(late > 500 && joined > 300);
}

/// Two that rest by themselves and one that is long in settling, then a contact between them: the one at rest has to rise.
void a_body_at_rest_is_woken_by_what_joins_it() {
    for (const bool backwards : {false, true}) {
        const int bodies = 8;
        MixedSystem system = resting(bodies);
        for (Vec6& p : system.momentum) p[2] = -1.0;
        const int still = backwards ? bodies - 1 : 0, foot = backwards ? 0 : 1;
        Heap heap(system);
        heap.add(between(still, -1, {0, 0, 1}, 0.0));
        for (int k = 0; k < bodies - 1; ++k)
            heap.add(between(foot + k, k == 0 ? -1 : foot + k - 1, {0, 0, 1}, 0.0));
        bool met = false;
        const FrictionReport report = heap.solver.run(forever, 1e-13, 1e-3, [&](bool) {
            if (met) return false;
            PgsContact push = between(still, foot, {0, 0, 1}, 0.0);
            push.right[0] = 0.25;
            heap.add(push);
            return met = true;
        });
        EXPECT(report.converged);
        for (int b = 0; b < bodies; ++b)
            EXPECT_NEAR(heap.solver.velocity(b)[2], b == still ? 0.25 : 0.0, 1e-10);
    }
}

/// A column of bodies on each other, all at rest by impulses that are known; one of them is hit.
Heap hit_column(int bodies, int hit, double impulse, bool upwards = true) {
    MixedSystem system = resting(bodies);
    for (Vec6& p : system.momentum) p[2] = -1.0;
    system.momentum[hit][2] -= impulse;
    Heap heap(system);
    for (int k = 0; k < bodies; ++k) {
        const int b = upwards ? k : bodies - 1 - k;
        PgsContact contact = between(b, b - 1, {0, 0, 1}, 0.0);
        contact.impulse[0] = bodies - b;
        heap.add(contact);
    }
    return heap;
}

/// Of a column one body in so many is hit so that an iteration leaves a contact off by so much. Iterations go on: whether
/// they move any body, and how many contacts were off by more than `focus` when that was asked.
std::pair<bool, int> moved_on(int one_in, double off, double focus, double allowed) {
    const int bodies = 60;
    const auto iterated_once = [&](double impulse) {
        MixedSystem system = resting(bodies);
        for (int b = 0; b < bodies; ++b)
            system.momentum[b][2] = -1.0 - (b % one_in == one_in / 2 ? impulse : 0.0);
        Heap heap(system);
        for (int b = 0; b < bodies; ++b) {
            PgsContact contact = between(b, b - 1, {0, 0, 1}, 0.0);
            contact.impulse[0] = bodies - b;
            heap.add(contact);
        }
        heap.solver.run(1, 1e-13, focus, nothing_more);
        return heap;
    };
    Heap heap =
        iterated_once(off / iterated_once(1.0).worst());  // all of it is linear, while all contacts push
    EXPECT_NEAR(heap.worst(), off, 1e-9);
    int many = 0;
    for (std::size_t k = 0; k < heap.contacts.size(); ++k) many += heap.off(k) > focus;
    heap.solver.worst(focus, allowed);
    std::vector<Vec6> before;
    for (int b = 0; b < bodies; ++b) before.push_back(heap.solver.velocity(b));
    heap.solver.run(1, 1e-13, focus, nothing_more);
    bool moved = false;
    for (int b = 0; b < bodies; ++b) moved = moved || heap.solver.velocity(b) != before[b];
    return {moved, many};
}

/// What is off by less than is allowed is left alone where it is rare, and taken along where much is off.
void what_is_nearly_off_is_left_alone_where_it_is_rare() {
    const double focus = 0.05, allowed = 0.1;
    EXPECT(moved_on(60, 0.08, focus, allowed) == std::pair(false, 1));
    EXPECT(moved_on(60, 0.095, focus, allowed) == std::pair(true, 1));  // may be too much in the next look
    EXPECT(moved_on(60, 0.08, focus, focus) == std::pair(true, 1));
    const auto [moved, many] = moved_on(4, 0.08, focus, allowed);
    EXPECT(moved && many > 60 / 16);
}

/// Goes on turn by turn as the contact stage does, until no contact is further off than `focus`; the iterations it took.
int go_on(Heap& heap, int iterations, double focus) {
    int done = 0;
    for (int turn = 0; turn < 1000; ++turn) {
        done += heap.solver.run(iterations, 1e-13, focus, nothing_more).pgs_iterations;
        if (!(heap.solver.worst(focus, focus).residual > focus)) return done;
    }
    return forever;
}

/// How many iterations over everything bring all contacts within `focus`.
int full_iterations(int bodies, int hit, double impulse, double focus, bool upwards) {
    for (int iterations = 1;; ++iterations) {
        Heap heap = hit_column(bodies, hit, impulse, upwards);
        heap.solver.run(iterations, 1e-13, focus, nothing_more);
        if (heap.worst() <= focus) return iterations;
    }
}

/// One body far off in an island that has settled else: the impact spreads from it, up and down the column, whatever the
/// order of its contacts, in about as many iterations as if all were updated; what it does not reach is not touched.
void what_is_far_off_in_a_spent_island_is_brought_home() {
    const int bodies = 60;
    const double focus = 0.05;
    for (const bool upwards : {true, false})
        for (const int hit : {0, 30, 59}) {
            const double impulse = 3.0;
            const int needed = full_iterations(bodies, hit, impulse, focus, upwards);
            for (const int iterations : {1, 3, 10}) {
                Heap heap = hit_column(bodies, hit, impulse, upwards);
                EXPECT(go_on(heap, iterations, focus) <= 2 * needed + iterations);
                EXPECT(heap.worst() <= focus);
                EXPECT(heap.unbalanced() <= 1e-12);
            }
            // Full iterations would go on moving what is nearer to its law than that.
            Heap small = hit_column(bodies, hit, 0.5 * focus, upwards);
            small.solver.run(1, 1e-13, focus, nothing_more);
            std::vector<double> before;
            for (int b = 0; b < bodies; ++b) before.push_back(small.solver.velocity(b)[2]);
            EXPECT(go_on(small, 10, focus) <= 1);
            for (int b = 0; b < bodies; ++b) EXPECT(small.solver.velocity(b)[2] == before[b]);
        }
}

/// What was left when an island had reached its limit stays said, though the iterations after it touched nothing of it.
void a_spent_island_is_not_called_settled_for_being_left_alone() {
    Heap heap = hit_column(40, 20, 1.0);
    EXPECT(!heap.solver.run(3, 1e-9, 0.5, nothing_more).converged);
    const FrictionReport report = heap.solver.run(3, 1e-9, 0.5, nothing_more);
    EXPECT(!report.converged);
    EXPECT(report.residual > 1e-9);
    EXPECT(heap.worst() > 1e-9);
}

/// A contact that is new to an island at its limit is updated at once, before it is known which row is furthest off.
void a_contact_that_is_new_to_a_island_at_its_limit_is_updated() {
    for (const int met : {0, 20, 39}) {
        Heap heap = hit_column(40, 20, 1.0);
        heap.solver.run(3, 1e-9, 0.05, nothing_more);
        PgsContact wall = between(met, -1, {0, 1, 0}, 0.0);
        wall.right[0] = 2.0;
        heap.add(wall);
        heap.solver.run(3, 1e-9, 0.05, nothing_more);
        EXPECT_NEAR(heap.solver.velocity(met)[1], 2.0, 1e-12);
    }
}

/// Two islands, one at its limit and far from settled, one not yet; then they are one.
void a_spent_island_takes_in_another() {
    for (const int joining : {0, 10, 19})
        for (unsigned seed = 0; seed < 10; ++seed) {
            Random random(seed);
            MixedSystem system = resting(40);
            for (Vec6& p : system.momentum) p[2] = uniform(random, -3.0, 0.0);
            Heap heap(system);
            for (int b = 0; b < 20; ++b) heap.add(between(b, b - 1, {0, 0, 1}, 0.0));
            const double focus = 0.05;
            heap.solver.run(2, 1e-12, focus, nothing_more);
            for (int b = 20; b < 40; ++b) heap.add(between(b, b == 20 ? -1 : b - 1, {0, 0, 1}, 0.0));
            PgsContact push = between(joining, 20 + joining, {0, 0, 1}, 0.0);
            push.right[0] = 1.0;
            heap.add(push);
            EXPECT(go_on(heap, 5, focus) < forever);
            EXPECT(heap.worst() <= focus);
            EXPECT(heap.unbalanced() <= 1e-12);
        }
}

/// Work is counted in iterations over everything: of an island at its limit what is updated, and for the rest the cost of a look; to ask which row is
/// furthest off is half an iteration, so that turns which iterate little come to an end, too.
void work_is_what_was_updated() {
    const int bodies = 40;
    Heap heap = hit_column(bodies, 20, 1.0);
    EXPECT(heap.solver.work() == 0.0);
    heap.solver.run(3, 1e-9, 0.5, nothing_more);
    EXPECT_NEAR(heap.solver.work(), 3.0, 1e-12);
    heap.solver.run(3, 1e-9, 0.5, nothing_more);  // finds none, once
    EXPECT_NEAR(heap.solver.work(), 3.0 + 1.0 / 16.0, 1e-12);
    PgsContact wall = between(20, -1, {0, 1, 0}, 0.0);
    heap.add(wall);
    heap.solver.run(1, 1e-9, 0.5, nothing_more);  // body 20 stands on one, carries one, and meets the wall
    EXPECT_NEAR(heap.solver.work() * (bodies + 1), (3.0 + 1.0 / 16.0) * bodies + 3.0 + (bodies - 2) / 16.0,
                1e-9);
    const double before = heap.solver.work();
    heap.solver.worst(0.5, 0.5);
    EXPECT_NEAR(heap.solver.work(), before + 0.5, 1e-12);
    MixedSystem again = heap.system;
    heap.solver.start(again, FrictionModel::cone);
    EXPECT(heap.solver.work() == 0.0);
}

/// What is left of an island at its limit is left of the one it joins, whichever of both is named first; the rest of it is still
/// left alone.
void a_spent_island_stays_spent_in_another() {
    for (const bool spent_first : {true, false}) {
        MixedSystem system = resting(42);
        for (int b = 0; b < 41; ++b) system.momentum[b][2] = -1.0;
        const int beside = 41, foot = spent_first ? 0 : 1, still = spent_first ? 40 : 0;
        Heap heap(system);
        for (int k = 0; k < 40; ++k) heap.add(between(foot + k, k == 0 ? -1 : foot + k - 1, {0, 0, 1}, 0.0));
        heap.add(between(beside, foot, {0, 1, 0}, 0.0));  // touches, and pushes no body
        EXPECT(!heap.solver.run(3, 1e-9, 0.5, nothing_more).converged);
        heap.add(between(still, -1, {0, 0, 1}, 0.0));
        EXPECT(!heap.solver.run(3, 1e-9, 0.5, nothing_more).converged);
        EXPECT_NEAR(heap.solver.velocity(still)[2], 0.0, 0.0);
        const double far = heap.solver.velocity(foot + 30)[2];
        heap.add(between(still, beside, {0, 1, 0}, 0.0));
        const FrictionReport report = heap.solver.run(3, 1e-9, 0.5, nothing_more);
        EXPECT(!report.converged);
        EXPECT(report.residual > 1e-9);
        EXPECT(heap.solver.velocity(foot + 30)[2] == far);
    }
}

/// The same solver, step after step: islands that were, what had reached its limit, active or joined in them is forgotten, and a number
/// that is used again means the new one.
void a_step_knows_nothing_of_the_one_before() {
    Heap used = hit_column(40, 20, 3.0);
    for (unsigned seed = 0; seed < 40; ++seed) {
        Random random(seed);
        const int bodies = 10 + static_cast<int>(random() % 40);
        MixedSystem system = resting(bodies);
        for (Vec6& p : system.momentum)
            for (double& x : p) x = uniform(random, -1.0, 1.0);
        std::vector<PgsContact> contacts;
        for (int k = 0; k < bodies; ++k) contacts.push_back(any_contact(random, bodies, 0.3));
        Heap fresh(system);
        MixedSystem same = system;
        used.solver.start(same, FrictionModel::cone);
        std::vector<double> said;
        for (PgsSolver* const solver : {&fresh.solver, &used.solver}) {
            const auto run = [&](int iterations) {
                const FrictionReport report = solver->run(iterations, 1e-12, 0.05, nothing_more);
                said.insert(said.end(),
                            {report.residual, double(report.pgs_iterations), double(report.converged)});
            };
            for (int k = 0; k + 5 < bodies; ++k) solver->add(contacts[k]);
            run(2);
            for (int k = bodies - 5; k < bodies; ++k) solver->add(contacts[k]);
            run(4);
        }
        for (std::size_t k = 0; k < said.size() / 2; ++k) EXPECT(said[k] == said[k + said.size() / 2]);
        for (int b = 0; b < bodies; ++b) EXPECT(fresh.solver.velocity(b) == used.solver.velocity(b));
        for (int k = 0; k < bodies; ++k)
            EXPECT(std::equal(fresh.solver.impulse(k), fresh.solver.impulse(k) + 3, used.solver.impulse(k)));
    }
}

/// Which contact is furthest off, and which is far off at all, is said of every contact, in whichever island.
void the_worst_contact_is_found_where_it_is() {
    for (unsigned seed = 0; seed < 30; ++seed)
        for (const double friction : {0.0, 0.5}) {
            Random random(seed);
            MixedSystem system = resting(20);
            for (Vec6& p : system.momentum)
                for (double& x : p) x = uniform(random, -1.0, 1.0);
            Heap heap(system);
            for (int k = 0; k < 30; ++k) heap.add(any_contact(random, 20, friction));
            heap.solver.run(static_cast<int>(1 + seed % 4), 1e-13, 0.0, nothing_more);
            const RowsResidual found = heap.solver.worst(1.0, 1.0);
            // Both measure the same law, friction from another side: nothing may be off by more than the figure says.
            if (friction == 0.0) {
                EXPECT_NEAR(found.residual, heap.worst(), 1e-12);
                EXPECT_NEAR(heap.off(static_cast<std::size_t>(found.row)), heap.worst(), 1e-12);
            } else {
                EXPECT((found.residual > 1e-9) == (heap.worst() > 1e-9));
            }
        }
}

/// A column is pushed up from below: over-relaxed iterations are nearer to the answer after as many, and it is the same answer.
void over_relaxation_gets_there_sooner() {
    const int bodies = 30;
    MixedSystem system = resting(bodies);
    PgsSolver other;
    other.start(system, FrictionModel::cone);
    const auto off_after = [&](int iterations, double relaxation) {
        PgsSolver projection;
        projection.start_beside(other, system, FrictionModel::cone, relaxation);
        for (int b = 0; b < bodies; ++b) {
            PgsContact contact = between(b, b - 1, {0, 0, 1}, 0.0);
            if (b == 0) contact.right[0] = 0.1;
            projection.add(contact);
        }
        projection.run(iterations, 0.0, 0.0, nothing_more);
        double off = 0.0;
        for (int b = 0; b < bodies; ++b) off = std::max(off, std::abs(projection.velocity(b)[2] - 0.1));
        return off;
    };
    EXPECT(off_after(200, 1.25) < 0.7 * off_after(200, 1.0));
    EXPECT(off_after(20'000, 1.25) < 1e-12);
}

/// One row alone, over-relaxed, swings about its answer; the last two of four iterations are plain, and end on it.
void what_over_relaxed_iterations_push_too_far_comes_back() {
    MixedSystem system = resting(1);
    PgsSolver other, projection;
    other.start(system, FrictionModel::cone);
    projection.start_beside(other, system, FrictionModel::cone, 1.25);
    PgsContact contact = between(0, -1, {0, 0, 1}, 0.0);
    contact.right[0] = 0.1;
    projection.add(contact);
    projection.run(4, 0.0, 0.0, nothing_more);
    EXPECT(std::abs(projection.velocity(0)[2] - 0.1) < 1e-15);
}

}  // namespace

int main() {
    islands_that_grow_together_obey_the_law();
    a_body_at_rest_is_woken_by_what_joins_it();
    what_is_far_off_in_a_spent_island_is_brought_home();
    a_spent_island_is_not_called_settled_for_being_left_alone();
    a_contact_that_is_new_to_a_island_at_its_limit_is_updated();
    a_spent_island_takes_in_another();
    work_is_what_was_updated();
    a_spent_island_stays_spent_in_another();
    a_step_knows_nothing_of_the_one_before();
    the_worst_contact_is_found_where_it_is();
    what_is_nearly_off_is_left_alone_where_it_is_rare();
    over_relaxation_gets_there_sooner();
    what_over_relaxed_iterations_push_too_far_comes_back();
    return report();
}
