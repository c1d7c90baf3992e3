// Four contacts solved side by side get the bits they get one after the other; and so does a heap.
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "contacts/pgs_kernel.hpp"
#include "contacts/pgs_solver.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

constexpr int bodies = 8, fixed_body = bodies;

/// What an iteration leaves out: friction; what else a contact may have; inertia that differs with the axis.
struct Kind {
    bool smooth, plain, isotropic;
};

struct Four {
    std::vector<PackedContact> contacts = std::vector<PackedContact>(4);
    std::vector<PackedFriction> slips = std::vector<PackedFriction>(4);
    std::vector<PackedExtras> rests = std::vector<PackedExtras>(4);
    std::vector<PgsBody> masses = std::vector<PgsBody>(bodies + 1);
    std::vector<PgsInertia> inertia = std::vector<PgsInertia>(bodies + 1);
    double change[4] = {};

    void solve(SolveFour with, Kind kind) {
        PackedContact* to[4];
        const PackedFriction* slip[4];
        const PackedExtras* rest[4];
        for (int i = 0; i < 4; ++i) to[i] = &contacts[i], slip[i] = &slips[i], rest[i] = &rests[i];
        with({to, kind.smooth ? nullptr : slip, kind.plain ? nullptr : rest, masses.data(),
              kind.isotropic ? nullptr : inertia.data(), fixed_body, change});
    }
    /// The same but for the sign of zeros.
    bool equals(const Four& other) const {
        const auto equal = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
        bool all = true;
        for (int i = 0; i < 4; ++i) {
            for (int k = 0; k < 3; ++k)
                all = all && equal(contacts[i].impulse[k], other.contacts[i].impulse[k]);
            all = all && equal(change[i], other.change[i]);
        }
        for (int b = 0; b < bodies; ++b)
            for (int k = 0; k < 6; ++k)
                all = all && equal(masses[b].velocity[k], other.masses[b].velocity[k]);
        return all;
    }
    bool same_as(const Four& other) const {
        const auto equal = [](const auto& a, const auto& b) {
            return std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
        };
        for (int i = 0; i < 4; ++i)
            for (int k = 0; k < 3; ++k)
                if (std::memcmp(&contacts[i].impulse[k], &other.contacts[i].impulse[k], sizeof(double)) != 0)
                    return false;
        return equal(masses, other.masses) && std::memcmp(change, other.change, sizeof change) == 0;
    }
};

/// Contacts as they come: pressed and open, smooth and rough, one body of them fixed, some numbers that are none.
Four random_four(std::mt19937& random, Kind kind) {
    std::uniform_real_distribution<double> number(-1.0, 1.0), positive(0.1, 2.0);
    const auto one_in = [&](unsigned n) { return random() % n == 0; };
    const auto vec = [&] { return Vec3{number(random), number(random), number(random)}; };
    Four f;
    for (int b = 0; b < bodies; ++b) {
        PgsBody& body = f.masses[b];
        for (double& v : body.velocity) v = one_in(6) ? 0.0 : number(random);
        body.inverse_mass = positive(random), body.inverse_inertia = positive(random);
        f.inertia[b] = {positive(random), 0.1 * number(random), 0.1 * number(random),
                        positive(random), 0.1 * number(random), positive(random)};
        if (kind.isotropic)
            f.inertia[b] = {body.inverse_inertia, 0.0, 0.0, body.inverse_inertia, 0.0, body.inverse_inertia};
    }
    for (int i = 0; i < 4; ++i) {
        PackedContact& c = f.contacts[i];
        PackedFriction& slip = f.slips[i];
        PackedExtras& rest = f.rests[i];
        c.first = 2 * i, c.second = one_in(3) ? fixed_body : 2 * i + 1;
        const Vec3 n = vec();
        c.normal = (1.0 / norm(n)) * n;
        const Vec3 t = cross(c.normal, vec());
        slip.tangent = (1.0 / norm(t)) * t;
        rest.across = cross(c.normal, slip.tangent);
        c.first_arm = vec(), c.second_arm = vec();
        c.right = one_in(3) ? 0.0 : number(random);
        c.diagonal = positive(random), c.inverse_diagonal = 1.0 / c.diagonal;
        slip.friction = kind.smooth || one_in(3) ? 0.0 : positive(random);
        c.impulse[0] = one_in(2) ? 0.0 : positive(random);
        for (int k = 1; k < 3; ++k) c.impulse[k] = kind.smooth || one_in(2) ? 0.0 : 0.3 * number(random);
        for (double& coupling : slip.coupling) coupling = number(random);
        slip.step = positive(random);
        if (!kind.plain)
            rest.right_along = number(random), rest.right_across = number(random),
            rest.softness = positive(random), rest.slip_softness = positive(random);
    }
    if (one_in(20))
        f.masses[random() % bodies].velocity[random() % 6] = std::numeric_limits<double>::quiet_NaN();
    if (one_in(20)) f.contacts[random() % 4].impulse[0] = std::numeric_limits<double>::infinity();
    return f;
}

PgsContact between(int first, int second, std::mt19937& random) {
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    const Vec3 n{number(random), number(random), number(random)};
    PgsContact c;
    c.first = first, c.second = second;
    c.normal = (1.0 / norm(n)) * n;
    const Vec3 t = cross(c.normal, {0.3, 0.2, 0.9});
    c.tangent = (1.0 / norm(t)) * t;
    c.across = cross(c.normal, c.tangent);
    c.first_arm = -0.5 * c.normal, c.second_arm = 0.5 * c.normal;
    c.friction = 0.5;
    return c;
}

/// Velocities and counts after iterations over a large random heap, in which some contacts come late.
std::vector<double> heap(bool portable, FrictionModel model) {
    constexpr int count = 3000, all = 9000, late = 200;
    std::mt19937 random(5);
    MixedSystem system;
    Mat6 unit{};
    for (int i = 0; i < 6; ++i) unit[7 * i] = 1.0;
    system.mass.assign(count, unit);
    system.momentum.assign(count, Vec6{});
    for (Vec6& p : system.momentum)
        for (double& x : p) x = 1e-3 * static_cast<double>(random() % 2001) - 1.0;
    use_portable_pgs(portable);
    PgsSolver solver;
    solver.start(system, model);
    const auto add = [&] {
        const int first = static_cast<int>(random() % count);
        solver.add(between(
            first, random() % 10 == 0 ? -1 : (first + 1 + static_cast<int>(random() % 40)) % count, random));
    };
    for (int k = 0; k < all; ++k) add();
    int left = 2;
    std::vector<double> out;
    const auto more = [&](bool) {
        if (left-- <= 0) return false;
        for (int k = 0; k < late; ++k) add();
        return true;
    };
    for (int turn = 0; turn < 3; ++turn) {
        const FrictionReport report = solver.run(12, 1e-10, 0.02, more);
        const RowsResidual worst = solver.worst(0.02, 0.02);
        out.insert(out.end(), {report.residual, static_cast<double>(report.pgs_iterations), worst.residual,
                               static_cast<double>(worst.row), solver.work()});
    }
    for (int b = 0; b < count; ++b)
        out.insert(out.end(), solver.velocity(b).begin(), solver.velocity(b).end());
    use_portable_pgs(false);
    return out;
}

}  // namespace

int main() {
    std::mt19937 random(1);
    for (int round = 0; round < 24'000; ++round) {
        const bool plain = round % 3 != 0;
        const Kind kind{plain && round % 2 == 0, plain, round % 4 < 2}, whole{false, false, false};
        const Four start = random_four(random, kind);
        Four portable = start, fastest = start, vectors = start;
        portable.solve(portable_solve_four, kind);
        fastest.solve(solve_four(), kind);
        EXPECT(fastest.same_as(portable));
        vectors.solve(solve_four(), whole);  // what is left out is nothing
        EXPECT(vectors.equals(portable));
    }
    for (const FrictionModel model : {FrictionModel::cone, FrictionModel::box}) {
        EXPECT(heap(false, model) == heap(true, model));
    }
    return report();
}
