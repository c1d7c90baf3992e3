// Iterations island by island: what has lost its number is not settled, what comes last is not either, all rows are updated.
#include <cmath>
#include <limits>

#include "contacts/pgs_solver.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

constexpr double NAN_ = std::numeric_limits<double>::quiet_NaN();

Mat6 unit_mass() {
    Mat6 unit{};
    for (int i = 0; i < 6; ++i) unit[7 * i] = 1.0;
    return unit;
}

MixedSystem falling(int bodies) {
    MixedSystem system;
    system.mass.assign(bodies, unit_mass());
    system.momentum.assign(bodies, Vec6{0, 0, -1, 0, 0, 0});
    return system;
}

/// A row that holds z of one or two bodies, bounded below or not.
RowBlock row(int first, int second, bool bounded) {
    RowBlock block;
    block.first = first;
    block.second = second;
    block.first_jacobian[0] = {0, 0, 1, 0, 0, 0};
    block.second_jacobian[0] = {0, 0, -1, 0, 0, 0};
    if (bounded) block.lower[0] = 0.0;
    return block;
}

PgsContact on_the_ground(int body, double friction) {
    PgsContact contact;
    contact.first = body;
    contact.normal = {0, 0, 1};
    contact.tangent = {1, 0, 0};
    contact.across = {0, 1, 0};
    contact.friction = friction;
    return contact;
}

const std::function<bool(bool)> nothing_more = [](bool) { return false; };

/// The first body's island is broken, the second's is not: whatever holds the first, the solve has not settled.
void an_island_that_is_no_number_has_not_settled() {
    for (const FrictionModel model : {FrictionModel::cone, FrictionModel::box})
        for (int kind = 0; kind < 4; ++kind)
            for (const int broken : {0, 2}) {  // an entry of the momentum: across what is held, and along it
                MixedSystem system = falling(2);
                system.momentum[0][broken] = NAN_;
                if (kind < 2) system.rows = {row(0, -1, kind == 1), row(1, -1, kind == 1)};
                PgsSolver solver;
                solver.start(system, model);
                const double friction = kind == 3 ? 0.5 : 0.0;
                if (kind >= 2) solver.add(on_the_ground(0, friction)), solver.add(on_the_ground(1, friction));
                const FrictionReport report = solver.run(20, 1e-9, 1e-9, nothing_more);
                EXPECT(!report.converged);
                EXPECT(!report.finite);
            }
}

/// Nor has one whose row is none.
void a_row_that_is_no_number_has_not_settled() {
    MixedSystem system = falling(2);
    system.rows = {row(0, -1, true), row(1, -1, true)};
    system.rows[0].first_jacobian[0][1] = NAN_;
    PgsSolver solver;
    solver.start(system, FrictionModel::cone);
    const FrictionReport report = solver.run(20, 1e-9, 1e-9, nothing_more);
    EXPECT(!report.converged);
    EXPECT(!report.finite);
}

/// Each time all is settled another body turns out to touch: after three late rounds the last one was never updated.
void what_is_found_last_leaves_it_open() {
    for (const int late : {1, 2, 3, 4, 9}) {
        MixedSystem system = falling(12);
        PgsSolver solver;
        solver.start(system, FrictionModel::cone);
        solver.add(on_the_ground(0, 0.0));
        int known = 1, asked = 0;
        const FrictionReport report = solver.run(4, 1e-9, 1e-9, [&](bool) {
            if (++asked > late) return false;
            solver.add(on_the_ground(known++, 0.0));
            return true;
        });
        EXPECT(report.converged == (late <= 3));
        for (int body = 0; body < known; ++body) {
            const bool updated = body < known - 1 || late <= 3;
            EXPECT_NEAR(solver.velocity(body)[2], updated ? 0.0 : -1.0, 1e-15);
        }
    }
}

/// A row whose first two bodies do not move, and one or two beyond them that do: it is updated with their contacts.
void a_row_that_begins_with_what_does_not_move_is_updated() {
    for (const bool two : {false, true}) {
        MixedSystem system = falling(3);
        std::vector<FurtherBody> beyond{{1, {0, 0, 1, 0, 0, 0}}};
        if (two) beyond.push_back({2, {0, 0, 1, 0, 0, 0}});
        RowBlock wide = row(-1, -1, false);
        wide.further = beyond;
        wide.right[0] = 0.25;
        system.rows = {wide};
        PgsSolver solver;
        solver.start(system, FrictionModel::cone);
        solver.add(on_the_ground(0, 0.0));
        solver.add(on_the_ground(1, 0.0));
        const FrictionReport report = solver.run(200, 1e-13, 1e-13, nothing_more);
        EXPECT(report.converged);
        solver.write(system);
        EXPECT_NEAR(system.velocity[0][2], 0.0, 1e-12);
        EXPECT_NEAR(system.velocity[1][2] + (two ? system.velocity[2][2] : 0.0), 0.25, 1e-12);
        EXPECT(system.velocity[1][2] > -1e-12);
        if (!two) EXPECT_NEAR(system.velocity[2][2], -1.0, 0.0);
    }
}

}  // namespace

int main() {
    an_island_that_is_no_number_has_not_settled();
    a_row_that_is_no_number_has_not_settled();
    what_is_found_last_leaves_it_open();
    a_row_that_begins_with_what_does_not_move_is_updated();
    return report();
}
