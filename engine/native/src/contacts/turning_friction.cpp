#include "contacts/turning_friction.hpp"

#include <algorithm>
#include <cmath>

#include "linear/elementary.hpp"

namespace spook {

namespace {

using Pair = std::array<double, 2>;
using Two = std::array<double, 4>;

Pair times(const Two& m, const Pair& x) noexcept {
    return {m[0] * x[0] + m[1] * x[1], m[2] * x[0] + m[3] * x[1]};
}

/// max(0, λ), smoothed by b: its value, its derivative, what that lacks to one, and the derivative by b.
struct Smoothed {
    double value, slope, rest, bend;
};

Smoothed smoothed(double lambda, double b) noexcept {
    const double root = std::sqrt(lambda * lambda + 4.0 * b * b);
    if (root == 0.0) return {0.0, 0.5, 0.5, 1.0};
    const double large = 0.5 * (std::abs(lambda) + root), small = b * b / large, bend = 2.0 * b / root;
    if (lambda > 0.0) return {large, large / root, small / root, bend};
    return {small, small / root, large / root, bend};
}

/// What the kink of |u_t| is rounded by, and the derivative by b.
double kink(double load, double b) noexcept { return b > 0.0 ? b * b / (b + load) : 0.0; }
double kink_slope(double load, double b) noexcept {
    return b > 0.0 ? b * (b + 2.0 * load) / ((b + load) * (b + load)) : 0.0;
}

}  // namespace

int TurningFriction::rows() const noexcept {
    int rows = 0;
    for (const Disc& disc : discs_) rows += disc.size;
    return rows;
}

void TurningFriction::read(const RowBlock& block, const FrictionPoint& point, const MassFactors& mass,
                           int four, int lane, int unit) {
    Disc& disc = discs_.emplace_back();
    disc.block = point.block, disc.row = point.row, disc.size = point.size;
    disc.four = four, disc.lane = lane, disc.unit = unit;
    disc.first = block.first, disc.second = block.second;
    disc.coefficient = point.coefficient;
    disc.softness = point.slip_softness;
    double own = 0.0, each[2] = {};
    for (int i = 0; i < disc.size; ++i) {
        disc.first_row[i] = block.first_jacobian[point.row + i];
        disc.second_row[i] = block.second_jacobian[point.row + i];
        disc.right[i] = block.right[point.row + i];
        disc.z[i] = block.multiplier[point.row + i];
    }
    const auto add_own = [&](int body, const Vec6* rows) {
        if (body < 0) return;
        own_inertias(mass[body], rows, disc.size, each);
        for (int i = 0; i < disc.size; ++i) own += each[i];
    };
    add_own(disc.first, disc.first_row.data());
    add_own(disc.second, disc.second_row.data());
    disc.root = own > 0.0 ? std::sqrt(disc.size / own) : 1.0;
}

TurningFriction::Pair TurningFriction::along(const Disc& disc, const Vec6* v) noexcept {
    Pair sum{};
    for (int i = 0; i < disc.size; ++i) {
        if (disc.first >= 0) sum[i] += dot(disc.first_row[i], v[disc.first]);
        if (disc.second >= 0) sum[i] += dot(disc.second_row[i], v[disc.second]);
    }
    return sum;
}

void TurningFriction::put(const Disc& disc, const Pair& z, Vec6* x) noexcept {
    for (int i = 0; i < disc.size; ++i)
        for (int a = 0; a < 6; ++a) {
            if (disc.first >= 0) x[disc.first][a] += z[i] * disc.first_row[i][a];
            if (disc.second >= 0) x[disc.second][a] += z[i] * disc.second_row[i][a];
        }
}

void TurningFriction::push(Vec6* momentum) const {
    for (const Disc& disc : discs_) put(disc, disc.z, momentum);
}

void TurningFriction::measure(const Vec6* velocity) {
    for (Disc& disc : discs_) {
        disc.u = along(disc, velocity);
        for (int i = 0; i < disc.size; ++i) disc.u[i] += disc.softness * disc.z[i] - disc.right[i];
    }
}

double TurningFriction::largest_right() const {
    double largest = 0.0;
    for (const Disc& disc : discs_)
        for (const double right : disc.right) largest = std::max(largest, std::abs(right));
    return largest;
}

/// y − P_b(y − w − hold (y − held)) at (z, u), its last two of three.
TurningFriction::Pair TurningFriction::natural(const Disc& disc, double normal, const Pair& z, const Pair& u,
                                               ConeAid aid) noexcept {
    const double w1 = disc.root * u[0], w2 = disc.root * u[1], rounded = kink(disc.load, aid.blur);
    const double slide = aid.frozen ? disc.slide : std::sqrt(w1 * w1 + w2 * w2 + rounded * rounded) - rounded;
    const double y1 = z[0] / disc.root, y2 = z[1] / disc.root;
    const double a0 = disc.coefficient * normal / disc.root - slide;
    const double a1 = y1 - w1 - aid.hold * (y1 - disc.held[0]), a2 = y2 - w2 - aid.hold * (y2 - disc.held[1]);
    const double reach = length(a1, a2);
    const double one = smoothed(a0 - reach, aid.blur).value, two = smoothed(a0 + reach, aid.blur).value;
    const double shrink = reach > 0.0 ? 0.5 * (two - one) / reach : 0.0;
    return {y1 - shrink * a1, y2 - shrink * a2};
}

ConeLaws::Left TurningFriction::worst(const Fours& fours, bool frozen) const {
    ConeLaws::Left largest;
    for (const Disc& disc : discs_) {
        const Pair map = natural(disc, fours[disc.four].z[0][disc.lane], disc.z, disc.u, {0.0, 0.0, frozen});
        const double size = length(map[0], map[1]);
        if (!(size <= largest.map)) largest.map = size;
        if (!(size / disc.root <= largest.speed)) largest.speed = size / disc.root;
    }
    return largest;
}

double TurningFriction::merit(const Fours& fours, ConeAid aid, double length, double along) const {
    double sum = 0.0;
    for (const Disc& disc : discs_) {
        const ConeFour& f = fours[disc.four];
        const int l = disc.lane;
        Pair z = disc.z, u = disc.u;
        for (int i = 0; i < disc.size; ++i) {
            z[i] += length * disc.newton.z[i] + along * disc.path.z[i];
            u[i] += length * disc.newton.u[i] + along * disc.path.u[i];
        }
        const Pair map = natural(disc, f.z[0][l] + (length * f.dz[0][l] + along * f.tz[0][l]), z, u, aid);
        sum += map[0] * map[0] + map[1] * map[1];
    }
    return sum;
}

void TurningFriction::hold(const Fours& fours) {
    for (Disc& disc : discs_) {
        for (int i = 0; i < disc.size; ++i) disc.held[i] = disc.z[i] / disc.root;
        disc.load = std::abs(disc.coefficient * fours[disc.four].z[0][disc.lane] / disc.root);
    }
}

void TurningFriction::freeze() {
    for (Disc& disc : discs_) disc.slide = disc.root * length(disc.u[0], disc.u[1]);
}

void TurningFriction::move(double length, double along) {
    for (Disc& disc : discs_)
        for (int i = 0; i < disc.size; ++i) disc.z[i] += length * disc.newton.z[i] + along * disc.path.z[i];
}

void TurningFriction::linearise(Disc& disc, double normal, ConeAid aid) noexcept {
    const double root = disc.root, w1 = root * disc.u[0], w2 = root * disc.u[1];
    const double rounded = kink(disc.load, aid.blur),
                 sliding = std::sqrt(w1 * w1 + w2 * w2 + rounded * rounded);
    const bool slides = !aid.frozen && sliding > 0.0;
    const double s1 = slides ? w1 / sliding : 0.0, s2 = slides ? w2 / sliding : 0.0;
    const double y1 = disc.z[0] / root, y2 = disc.z[1] / root;
    const double a0 = disc.coefficient * normal / root - (aid.frozen ? disc.slide : sliding - rounded);
    const double a1 = y1 - w1 - aid.hold * (y1 - disc.held[0]), a2 = y2 - w2 - aid.hold * (y2 - disc.held[1]);
    const double reach = length(a1, a2);
    const double t1 = reach > 0.0 ? a1 / reach : 1.0, t2 = reach > 0.0 ? a2 / reach : 0.0;
    const Smoothed one = smoothed(a0 - reach, aid.blur), two = smoothed(a0 + reach, aid.blur);
    const double value = 0.5 * (two.value - one.value), bend = 0.5 * (two.bend - one.bend);
    disc.law.map = {y1 - value * t1, y2 - value * t2};
    // P's derivative: along t, across it, and by c nu.
    const double even = 0.5 * (one.slope + two.slope), odd = 0.5 * (two.slope - one.slope);
    double across = even, rest_across = 0.5 * (one.rest + two.rest);
    if (reach > 1e-8 * std::abs(a0) && reach > 1e-8 * aid.blur) {
        across = std::clamp(value / reach, 0.0, 1.0), rest_across = 1.0 - across;
        if (rest_across < 0.25)  // without cancellation
            rest_across =
                std::max(0.0, (smoothed(reach - a0, aid.blur).value - smoothed(-a0 - reach, aid.blur).value) /
                                  (2.0 * reach));
    }
    const double stay = 0.5 * (one.rest + two.rest) + aid.hold * even,
                 stay_across = rest_across + aid.hold * across;
    const auto turned = [&](double f, double g) -> Two {  // f along t, g across it
        const double both = (f - g) * t1 * t2;
        return {f * t1 * t1 + g * t2 * t2, both, both, f * t2 * t2 + g * t1 * t1};
    };
    disc.law.stays = turned(stay, stay_across);
    disc.law.slips = turned(even, across);
    const Pair by0{odd * t1, odd * t2};
    disc.law.slips[0] += by0[0] * s1, disc.law.slips[1] += by0[0] * s2;
    disc.law.slips[2] += by0[1] * s1, disc.law.slips[3] += by0[1] * s2;
    disc.law.by_bound = by0;
    const double push = slides ? kink_slope(disc.load, aid.blur) * (1.0 - rounded / sliding) : 0.0;
    disc.law.bend = {-bend * t1 - by0[0] * push, -bend * t2 - by0[1] * push};
    if (disc.softness > 0.0) {
        Two m;
        for (int i = 0; i < 4; ++i)
            m[i] = disc.law.stays[i] / root + root * disc.softness * disc.law.slips[i];
        const double over = 1.0 / (m[0] * m[3] - m[1] * m[2]);
        disc.law.inverse = {over * m[3], -over * m[1], -over * m[2], over * m[0]};
    } else {
        disc.law.inverse = turned(root / stay, root / stay_across);
    }
    const Two &b = disc.law.slips, &m = disc.law.inverse;
    disc.law.k = {root * (m[0] * b[0] + m[1] * b[2]), root * (m[0] * b[1] + m[1] * b[3]),
                  root * (m[2] * b[0] + m[3] * b[2]), root * (m[2] * b[1] + m[3] * b[3])};
    const Pair n = times(m, by0);
    disc.law.n = {n[0] * disc.coefficient / root, n[1] * disc.coefficient / root};
}

void TurningFriction::linearise(const Fours& fours, ConeAid aid) {
    for (Disc& disc : discs_) linearise(disc, fours[disc.four].z[0][disc.lane], aid);
}

void TurningFriction::add(const Fours& fours, const Units& units) const {
    for (const Disc& disc : discs_) {
        const ConeUnit& unit = units[disc.unit];
        const ConeFour& f = fours[disc.four];
        for (const bool column : {true, false}) {
            if ((column ? disc.first : disc.second) < 0) continue;
            const auto& from = column ? disc.first_row : disc.second_row;
            const Vec6* point = column ? unit.first_row : unit.second_row;
            Vec6 push{}, image[2] = {};
            for (int k = 0; k < unit.size; ++k)
                for (int a = 0; a < 6; ++a) push[a] += f.k[k][disc.lane] * point[k][a];
            for (int i = 0; i < disc.size; ++i) {
                for (int a = 0; a < 6; ++a) image[i][a] = disc.law.n[i] * push[a];
                for (int j = 0; j < disc.size; ++j)
                    for (int a = 0; a < 6; ++a) image[i][a] += disc.law.k[2 * i + j] * from[j][a];
            }
            for (const bool row : {true, false}) {
                if ((row ? disc.first : disc.second) < 0) continue;
                const auto& to = row ? disc.first_row : disc.second_row;
                double* out = unit.matrix[row][column];
                for (int i = 0; i < disc.size; ++i)
                    for (int a = 0; a < 6; ++a)
                        for (int b = 0; b < 6; ++b) out[6 * a + b] += to[i][a] * image[i][b];
            }
        }
    }
}

void TurningFriction::ask(bool newton, double blur) {
    for (Disc& disc : discs_)
        for (int i = 0; i < disc.size; ++i)
            disc.lack[i] = newton ? -disc.law.map[i] : blur * disc.law.bend[i];
}

double TurningFriction::asked() const {
    double sum = 0.0;
    for (const Disc& disc : discs_) sum += disc.lack[0] * disc.lack[0] + disc.lack[1] * disc.lack[1];
    return sum;
}

void TurningFriction::respond(const Fours& fours, Vec6* image) {
    for (Disc& disc : discs_) {
        const double normal = fours[disc.four].c[0][disc.lane];
        disc.c = times(disc.law.inverse, disc.lack);
        Pair all{};
        for (int i = 0; i < disc.size; ++i) all[i] = disc.c[i] + disc.law.n[i] * normal;
        put(disc, all, image);
    }
}

void TurningFriction::turn(const Fours& fours, const Vec6* image, Vec6* change) {
    for (Disc& disc : discs_) {
        const double normal = fours[disc.four].c[0][disc.lane];
        const Pair by = times(disc.law.k, along(disc, image));
        for (int i = 0; i < disc.size; ++i) disc.c[i] += disc.law.n[i] * normal - by[i];
        put(disc, disc.c, change);
    }
}

double TurningFriction::remain(const Fours& fours, const Vec6* change) {
    double sum = 0.0;
    for (Disc& disc : discs_) {
        disc.image = along(disc, change);
        for (int i = 0; i < disc.size; ++i) disc.image[i] += disc.softness * disc.c[i];
        const double bound = disc.coefficient * fours[disc.four].c[0][disc.lane] / disc.root;
        const Pair y = times(disc.law.stays, disc.c), w = times(disc.law.slips, disc.image);
        for (int i = 0; i < disc.size; ++i) {
            disc.lack[i] -= y[i] / disc.root + disc.root * w[i] - disc.law.by_bound[i] * bound;
            sum += disc.lack[i] * disc.lack[i];
        }
    }
    return sum;
}

void TurningFriction::take(bool newton, bool first) {
    for (Disc& disc : discs_) {
        Way& way = newton ? disc.newton : disc.path;
        if (first) way = Way{};
        for (int i = 0; i < disc.size; ++i) way.z[i] += disc.c[i], way.u[i] += disc.image[i];
    }
}

void TurningFriction::forget_path() {
    for (Disc& disc : discs_) disc.path = Way{};
}

void TurningFriction::keep_best() {
    for (Disc& disc : discs_) disc.best = disc.z;
}

void TurningFriction::keep_met() {
    for (Disc& disc : discs_) disc.met = disc.z;
}

void TurningFriction::back_to_met() {
    for (Disc& disc : discs_) disc.z = disc.met;
}

void TurningFriction::back_to_best() {
    for (Disc& disc : discs_) disc.z = disc.best;
}

void TurningFriction::deliver(MixedSystem& system) {
    for (Disc& disc : discs_) {
        disc.z = disc.best;
        RowBlock& block = system.rows[disc.block];
        const double bound = disc.coefficient * std::max(0.0, block.multiplier[0]);
        const double size = length(disc.z[0], disc.z[1]);
        for (int i = 0; i < disc.size; ++i) {
            if (size > bound) disc.z[i] *= bound / size;
            block.multiplier[disc.row + i] = disc.z[i];
        }
    }
}

}  // namespace spook
