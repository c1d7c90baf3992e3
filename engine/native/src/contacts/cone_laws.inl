// The laws of Newton's method on the cone, over single numbers or over vectors of them. Included once per instruction
// set, with SPOOK_ISA naming it. Only elementwise operations in a fixed order, sums over units one after the other, and
// contraction is off: all round alike.

#define SPOOK_ALWAYS inline __attribute__((always_inline))

namespace spook::SPOOK_ISA {
namespace {

using Each = ConeFour::Each;

#include "linear/six.inl"

#ifdef SPOOK_FOURS
using Number = Four;
constexpr int lanes = 4;

SPOOK_ALWAYS Four get(const Each& each, int) { return *reinterpret_cast<const FourInMemory*>(each); }
SPOOK_ALWAYS void put(Each& each, int, const Four& x) { *reinterpret_cast<FourInMemory*>(each) = x; }
#else
using Number = double;
constexpr int lanes = 1;

SPOOK_ALWAYS double get(const Each& each, int i) { return each[i]; }
SPOOK_ALWAYS void put(Each& each, int i, double x) { each[i] = x; }
#endif

constexpr double no_bound = std::numeric_limits<double>::infinity();

SPOOK_ALWAYS Number all(double x) { return Number{} + x; }
SPOOK_ALWAYS Number long_as(const Number& a, const Number& b) { return root_of(a * a + b * b); }
SPOOK_ALWAYS Number not_below(const Number& x, const Number& low) { return low < x ? x : low; }  // std::max

/// max(0, λ), smoothed by b: its derivative, what that lacks to one, and the derivative by b.
struct Positive {
    Number value, slope, rest, bend;
};
SPOOK_ALWAYS Positive positive(const Number& lambda, double b) {
    const Number root = root_of(lambda * lambda + 4.0 * b * b), half = all(0.5);
    const Number large = 0.5 * (magnitude(lambda) + root), small = b * b / large, over = 1.0 / root;
    const Number more = large * over, less = small * over, bend = 2.0 * b * over;
    const auto none = root == 0.0;
    const auto above = lambda > 0.0;
    Positive p;
    p.value = none ? Number{} : above ? large : small;
    p.slope = none ? half : above ? more : less;
    p.rest = none ? half : above ? less : more;
    p.bend = none ? all(1.0) : bend;
    return p;
}

/// Its value alone.
SPOOK_ALWAYS Number positive_part(const Number& lambda, double b) {
    const Number large = 0.5 * (magnitude(lambda) + root_of(lambda * lambda + 4.0 * b * b));
    return lambda > 0.0 ? large : large > 0.0 ? b * b / large : Number{};
}

/// Σ fᵢ eᵢ eᵢᵀ x, with eᵢ = (1, −t)/√2, (1, t)/√2, (0, t⊥).
SPOOK_ALWAYS void spectral(const Number* f, const Number& t1, const Number& t2, const Number* x, Number* y) {
    const Number even = 0.5 * (f[0] + f[1]), odd = 0.5 * (f[1] - f[0]);
    const Number radial = t1 * x[1] + t2 * x[2], across = f[2] * (t1 * x[2] - t2 * x[1]);
    const Number forth = odd * x[0] + even * radial;
    y[0] = even * x[0] + odd * radial;
    y[1] = forth * t1 - across * t2;
    y[2] = forth * t2 + across * t1;
}

SPOOK_ALWAYS Number kink(const ConeFour& f, int i, double blur) {
    return blur > 0.0 ? blur * blur / (blur + get(f.load, i)) : Number{};
}

/// A row's natural map at (z, u).
SPOOK_ALWAYS Number natural_row(const ConeFour& f, int i, const Number& z, const Number& u, ConeAid aid) {
    const Number y = z * get(f.over, i), lower = get(f.lower, i);
    const Number w = get(f.root, i) * u + aid.hold * (y - get(f.held[0], i)), a = y - w;
    if (f.pushing) return y - (lower + positive_part(a - lower, aid.blur));
    const Number upper = get(f.upper, i);
    const auto below = lower > -no_bound, above = upper < no_bound;
    Number p = below ? lower + positive_part(a - lower, aid.blur) : a;
    p = above ? (below ? p - positive_part(a - upper, aid.blur) : upper - positive_part(upper - a, aid.blur))
              : p;
    p = lower == upper ? lower : p;
    return below | above ? y - p : w;
}

/// A point's natural map at (z, u); returns its square.
SPOOK_ALWAYS Number natural_point(const ConeFour& f, int i, const Number* z, const Number* u, ConeAid aid) {
    const double blur = aid.blur, hold = aid.hold;
    const Number root = get(f.root, i), mu = get(f.friction, i), along = get(f.along, i);
    const Number w1 = root * mu * u[1], w2 = root * mu * u[2], rounded = kink(f, i, blur);
    const Number slide =
        aid.frozen ? get(f.slide, i) : root_of(w1 * w1 + w2 * w2 + rounded * rounded) - rounded;
    const Number y0 = z[0] * get(f.over, i), y1 = z[1] * along, y2 = z[2] * along;
    const Number a0 = y0 - (root * u[0] + slide) - hold * (y0 - get(f.held[0], i));
    const Number a1 = y1 - w1 - hold * (y1 - get(f.held[1], i)),
                 a2 = y2 - w2 - hold * (y2 - get(f.held[2], i));
    const Number reach = long_as(a1, a2);
    const Number one = positive_part(a0 - reach, blur), two = positive_part(a0 + reach, blur);
    const Number shrink = reach > 0.0 ? 0.5 * (two - one) / reach : Number{};
    const Number m0 = y0 - 0.5 * (one + two), m1 = y1 - shrink * a1, m2 = y2 - shrink * a2;
    return m0 * m0 + m1 * m1 + m2 * m2;
}

SPOOK_ALWAYS Number natural(const ConeFour& f, int i, const Number* z, const Number* u, ConeAid aid) {
    if (f.size == 3) return natural_point(f, i, z, u, aid);
    const Number map = natural_row(f, i, z[0], u[0], aid);
    return map * map;
}

double merit(const ConeLaws::Fours& fours, ConeAid aid, double length, double along, double enough) {
    double sum = 0.0;
    for (const ConeFour& f : fours) {
        Each square;
        for (int i = 0; i < f.count; i += lanes) {
            Number z[3], u[3];
            for (int k = 0; k < f.size; ++k) {
                z[k] = get(f.z[k], i) + (length * get(f.dz[k], i) + along * get(f.tz[k], i));
                u[k] = get(f.u[k], i) + (length * get(f.du[k], i) + along * get(f.tu[k], i));
            }
            put(square, i, natural(f, i, z, u, aid));
        }
        for (int i = 0; i < f.count; ++i) {
            sum += square[i];
            if (sum > enough) return sum;
        }
    }
    return sum;
}

ConeLaws::Left worst(const ConeLaws::Fours& fours, bool frozen) {
    ConeLaws::Left largest;
    for (const ConeFour& f : fours) {
        Each map, speed;
        for (int i = 0; i < f.count; i += lanes) {
            Number z[3], u[3];
            for (int k = 0; k < f.size; ++k) z[k] = get(f.z[k], i), u[k] = get(f.u[k], i);
            const Number size = root_of(natural(f, i, z, u, {0.0, 0.0, frozen}));
            put(map, i, size);
            put(speed, i, size / get(f.root, i));
        }
        for (int i = 0; i < f.count; ++i) {
            if (!(map[i] <= largest.map)) largest.map = map[i];
            if (!(speed[i] <= largest.speed)) largest.speed = speed[i];
        }
    }
    return largest;
}

SPOOK_ALWAYS void linearise_rows(ConeFour& f, int i, ConeAid aid) {
    const double blur = aid.blur, hold = aid.hold;
    const Number z = get(f.z[0], i), u = get(f.u[0], i), root = get(f.root, i), lower = get(f.lower, i);
    const Number y = z * get(f.over, i), a = y - root * u - hold * (y - get(f.held[0], i));
    put(f.map[0], i, natural_row(f, i, z, u, aid));
    const Positive low = positive(a - lower, blur);
    Number slope = low.slope, rest = low.rest, bend = -low.bend;
    if (!f.pushing) {
        const Number upper = get(f.upper, i), none{};
        const auto below = lower > -no_bound, above = upper < no_bound, fixed = lower == upper;
        const Positive high = positive(upper - a, blur);
        slope = above ? (below ? not_below(slope - high.rest, none) : high.slope) : below ? slope : all(1.0);
        rest = above ? (below ? rest + high.rest : high.rest) : below ? rest : none;
        bend = above ? (below ? bend + high.bend : high.bend) : below ? bend : none;
        slope = fixed ? none : slope, rest = fixed ? all(1.0) : rest, bend = fixed ? none : bend;
    }
    rest += hold * slope;
    const Number over_rest = 1.0 / rest, stiffness = root * root * slope * over_rest;
    const Number g = 1.0 / (1.0 + stiffness * get(f.softness[0], i));
    put(f.slope[0], i, slope), put(f.rest[0], i, rest), put(f.bend[0], i, bend);
    put(f.over_rest[0], i, over_rest);
    put(f.g[0], i, g), put(f.k[0], i, g * stiffness);
}

SPOOK_ALWAYS void linearise_points(ConeFour& f, int i, ConeAid aid) {
    const double blur = aid.blur, hold = aid.hold;
    const Number none{}, root = get(f.root, i), mu = get(f.friction, i), along = get(f.along, i);
    const Number w1 = root * mu * get(f.u[1], i), w2 = root * mu * get(f.u[2], i), rounded = kink(f, i, blur);
    const Number sliding = root_of(w1 * w1 + w2 * w2 + rounded * rounded);
    const auto slides = aid.frozen ? sliding < 0.0 : sliding > 0.0;
    const Number normal = root * get(f.u[0], i);
    const Number opening = aid.frozen ? normal + get(f.slide, i) : normal + sliding - rounded;
    const Number s1 = slides ? w1 / sliding : none, s2 = slides ? w2 / sliding : none;
    const Number y0 = get(f.z[0], i) * get(f.over, i), y1 = get(f.z[1], i) * along,
                 y2 = get(f.z[2], i) * along;
    const Number a0 = y0 - opening - hold * (y0 - get(f.held[0], i));
    const Number a1 = y1 - w1 - hold * (y1 - get(f.held[1], i)),
                 a2 = y2 - w2 - hold * (y2 - get(f.held[2], i));

    // P_b on L and its derivative by eigenvalues: along (1, −t), (1, t) and across.
    const Number reach = long_as(a1, a2);
    const auto far = reach > 0.0;
    const Number t1 = far ? a1 / reach : all(1.0), t2 = far ? a2 / reach : none;
    const Positive one = positive(a0 - reach, blur), two = positive(a0 + reach, blur);
    const Number value0 = 0.5 * (one.value + two.value), value1 = 0.5 * (two.value - one.value);
    const Number bend0 = 0.5 * (one.bend + two.bend), bend1 = 0.5 * (two.bend - one.bend);
    const Number turning = (two.value - one.value) / (2.0 * reach);
    Number slope2 = turning < 0.0 ? none : 1.0 < turning ? all(1.0) : turning, rest2 = 1.0 - slope2;
    const auto near_one = rest2 < 0.25;
    if (any(near_one)) {  // without cancellation: max(0, λ) − max(0, −λ) = λ
        const Number un_one = positive_part(reach - a0, blur), un_two = positive_part(-a0 - reach, blur);
        rest2 = near_one ? not_below((un_one - un_two) / (2.0 * reach), none) : rest2;
    }
    const auto apart = (reach > 1e-8 * magnitude(a0)) & (reach > 1e-8 * blur);
    slope2 = apart ? slope2 : 0.5 * (one.slope + two.slope);
    rest2 = apart ? rest2 : 0.5 * (one.rest + two.rest);

    put(f.s1, i, s1), put(f.s2, i, s2), put(f.t1, i, t1), put(f.t2, i, t2);
    put(f.map[0], i, y0 - value0), put(f.map[1], i, y1 - value1 * t1), put(f.map[2], i, y2 - value1 * t2);
    const Number slope[3] = {one.slope, two.slope, slope2}, own_rest[3] = {one.rest, two.rest, rest2};
    Number ratio[3];
    for (int k = 0; k < 3; ++k) {
        const Number rest = own_rest[k] + hold * slope[k], over_rest = 1.0 / rest;
        ratio[k] = slope[k] * over_rest;
        put(f.slope[k], i, slope[k]), put(f.rest[k], i, rest), put(f.over_rest[k], i, over_rest);
    }
    // K = rho E (1 − D)⁻¹ D E': Q is the middle, by its eigenvalues, and E' adds mu s of its first column to the others.
    const Number even = 0.5 * (ratio[0] + ratio[1]), odd = 0.5 * (ratio[1] - ratio[0]),
                 cross = even - ratio[2];
    const Number q01 = odd * t1, q02 = odd * t2, q12 = cross * t1 * t2;
    const Number q11 = even * t1 * t1 + ratio[2] * t2 * t2, q22 = even * t2 * t2 + ratio[2] * t1 * t1;
    const Number rho = root * root, rho_mu = rho * mu, rho_mu2 = rho_mu * mu;
    put(f.k[0], i, rho * even);
    put(f.k[1], i, rho_mu * (s1 * even + q01)), put(f.k[2], i, rho_mu * (s2 * even + q02));
    put(f.k[3], i, rho_mu * q01);
    put(f.k[4], i, rho_mu2 * (s1 * q01 + q11)), put(f.k[5], i, rho_mu2 * (s2 * q01 + q12));
    put(f.k[6], i, rho_mu * q02);
    put(f.k[7], i, rho_mu2 * (s1 * q02 + q12)), put(f.k[8], i, rho_mu2 * (s2 * q02 + q22));
    const Number load = get(f.load, i);
    const Number by_blur = blur > 0.0 ? blur * (blur + 2.0 * load) / ((blur + load) * (blur + load)) : none;
    const Number push[3] = {slides ? by_blur * (1.0 - rounded / sliding) : none, none, none};
    Number image[3];
    spectral(slope, t1, t2, push, image);
    put(f.bend[0], i, -bend0 - image[0]);
    put(f.bend[1], i, -bend1 * t1 - image[1]), put(f.bend[2], i, -bend1 * t2 - image[2]);
}

void linearise(ConeLaws::Fours& fours, ConeAid aid) {
    for (ConeFour& f : fours) {
        for (int i = 0; i < f.count; i += lanes)
            if (f.size == 3) linearise_points(f, i, aid);
            else linearise_rows(f, i, aid);
        for (int i = 0; f.soft && f.size == 3 && i < f.count; ++i)
            if (f.is_soft(i)) f.soften(i);
    }
}

/// x += Gᵀ z of the unit `i` of four.
template <int N> SPOOK_ALWAYS void push_unit(const ConeUnit& unit, const Each* z, int i, Vec6* x) {
    for (const bool first : {true, false}) {
        const int body = first ? unit.first : unit.second;
        if (body < 0) continue;
        const Vec6* rows = first ? unit.first_row : unit.second_row;
        Six sum = Six::load(x[body].data());
        for (int k = 0; k < N; ++k) sum.add(z[k][i], Six::load(rows[k].data()));
        sum.store(x[body].data());
    }
}
SPOOK_ALWAYS void push_units(const ConeFour& f, const ConeUnit* unit, const Each* z, Vec6* x) {
    if (f.size == 3)
        for (int i = 0; i < f.count; ++i) push_unit<3>(unit[i], z, i, x);
    else
        for (int i = 0; i < f.count; ++i) push_unit<1>(unit[i], z, i, x);
}

/// w = G v of the unit `i` of four.
template <int N> SPOOK_ALWAYS void along_unit(const ConeUnit& unit, const Vec6* v, Each* w, int i) {
    double sum[N] = {};
    for (const bool first : {true, false}) {
        const int body = first ? unit.first : unit.second;
        if (body < 0) continue;
        const Vec6* rows = first ? unit.first_row : unit.second_row;
        const Six speed = Six::load(v[body].data());
        for (int k = 0; k < N; ++k) sum[k] += speed.dot(Six::load(rows[k].data()));
    }
    for (int k = 0; k < N; ++k) w[k][i] = sum[k];
}
SPOOK_ALWAYS void along_units(const ConeFour& f, const ConeUnit* unit, const Vec6* v, Each* w) {
    if (f.size == 3)
        for (int i = 0; i < f.count; ++i) along_unit<3>(unit[i], v, w, i);
    else
        for (int i = 0; i < f.count; ++i) along_unit<1>(unit[i], v, w, i);
}

SPOOK_ALWAYS void respond_to(ConeFour& f, int i) {
    const Number root = get(f.root, i);
    if (f.size == 1) {
        put(f.c[0], i, get(f.g[0], i) * root * get(f.lack[0], i) * get(f.over_rest[0], i));
        return;
    }
    const Number over_rest[3] = {get(f.over_rest[0], i), get(f.over_rest[1], i), get(f.over_rest[2], i)};
    const Number lack[3] = {get(f.lack[0], i), get(f.lack[1], i), get(f.lack[2], i)};
    const Number mu = get(f.friction, i);
    Number image[3];
    spectral(over_rest, get(f.t1, i), get(f.t2, i), lack, image);
    image[0] *= root, image[1] *= root * mu, image[2] *= root * mu;
    for (int k = 0; k < 3; ++k) {
        put(f.c[k], i, image[k]);
        if (!f.soft) continue;
        const auto soft = (get(f.softness[0], i) > 0.0) | (get(f.softness[1], i) > 0.0);
        const Number answer = get(f.g[3 * k], i) * image[0] + get(f.g[3 * k + 1], i) * image[1] +
                              get(f.g[3 * k + 2], i) * image[2];
        put(f.c[k], i, soft ? answer : image[k]);
    }
}

void respond(ConeLaws::Fours& fours, const ConeLaws::Units& units, Vec6* to) {
    for (ConeFour& f : fours) {
        for (int i = 0; i < f.count; i += lanes) respond_to(f, i);
        push_units(f, units.data() + f.begin, f.c, to);
    }
}

void turn(ConeLaws::Fours& fours, const ConeLaws::Units& units, const Vec6* by, Vec6* change) {
    for (ConeFour& f : fours) {
        along_units(f, units.data() + f.begin, by, f.turn);
        for (int i = 0; i < f.count; i += lanes) {
            if (f.size == 1) {
                put(f.c[0], i, get(f.c[0], i) - get(f.k[0], i) * get(f.turn[0], i));
                continue;
            }
            for (int k = 0; k < 3; ++k) {
                Number c = get(f.c[k], i);
                for (int j = 0; j < 3; ++j) c -= get(f.k[3 * k + j], i) * get(f.turn[j], i);
                put(f.c[k], i, c);
            }
        }
        push_units(f, units.data() + f.begin, f.c, change);
    }
}

/// What changes of z and u change in the law: (1 − D) dy + D dw, taken from what is missing. Returns the square.
SPOOK_ALWAYS Number take_law(ConeFour& f, int i) {
    const Number root = get(f.root, i);
    if (f.size == 1) {
        const Number lack = get(f.lack[0], i) - (get(f.rest[0], i) * get(f.c[0], i) * get(f.over, i) +
                                                 get(f.slope[0], i) * root * get(f.turn[0], i));
        put(f.lack[0], i, lack);
        return lack * lack;
    }
    const Number mu = get(f.friction, i), along = get(f.along, i), t1 = get(f.t1, i), t2 = get(f.t2, i);
    const Number u1 = get(f.turn[1], i), u2 = get(f.turn[2], i);
    const Number dy[3] = {get(f.c[0], i) * get(f.over, i), get(f.c[1], i) * along, get(f.c[2], i) * along};
    const Number dw[3] = {root * (get(f.turn[0], i) + mu * (get(f.s1, i) * u1 + get(f.s2, i) * u2)),
                          root * mu * u1, root * mu * u2};
    const Number rest[3] = {get(f.rest[0], i), get(f.rest[1], i), get(f.rest[2], i)};
    const Number slope[3] = {get(f.slope[0], i), get(f.slope[1], i), get(f.slope[2], i)};
    Number one[3], two[3], lack[3];
    spectral(rest, t1, t2, dy, one);
    spectral(slope, t1, t2, dw, two);
    for (int k = 0; k < 3; ++k) {
        lack[k] = get(f.lack[k], i) - (one[k] + two[k]);
        put(f.lack[k], i, lack[k]);
    }
    return lack[0] * lack[0] + lack[1] * lack[1] + lack[2] * lack[2];
}

double remain(ConeLaws::Fours& fours, const ConeLaws::Units& units, const Vec6* change) {
    double left = 0.0;
    for (ConeFour& f : fours) {
        Each square;
        along_units(f, units.data() + f.begin, change, f.turn);
        for (int i = 0; i < f.count; i += lanes) {
            for (int k = 0; k < f.size; ++k)
                put(f.turn[k], i, get(f.turn[k], i) + get(f.softness[k], i) * get(f.c[k], i));
            put(square, i, take_law(f, i));
        }
        for (int i = 0; i < f.count; ++i) left += square[i];
    }
    return left;
}

/// What one unit adds to the matrix: Gᵀ K G.
template <int N> SPOOK_ALWAYS void add_unit(const ConeUnit& unit, const ConeFour& f, int at) {
    double k[N * N];
    for (int i = 0; i < N * N; ++i) k[i] = f.k[i][at];
    for (const bool column : {true, false}) {
        if ((column ? unit.first : unit.second) < 0) continue;
        const Vec6* from = column ? unit.first_row : unit.second_row;
        Six image[N];
        for (int i = 0; i < N; ++i) {
            image[i] = Six::zero();
            for (int j = 0; j < N; ++j) image[i].add(k[N * i + j], Six::load(from[j].data()));
        }
        for (const bool row : {true, false}) {
            if ((row ? unit.first : unit.second) < 0) continue;
            const Vec6* to = row ? unit.first_row : unit.second_row;
            double* out = unit.matrix[row][column];
            for (int a = 0; a < 6; ++a) {
                Six sum = Six::load(out + 6 * a);
                for (int i = 0; i < N; ++i) sum.add(to[i][a], image[i]);
                sum.store(out + 6 * a);
            }
        }
    }
}

void add(const ConeLaws::Fours& fours, const ConeLaws::Units& units) {
    for (const ConeFour& f : fours)
        for (int i = 0; i < f.count; ++i)
            if (f.size == 3) add_unit<3>(units[f.begin + i], f, i);
            else add_unit<1>(units[f.begin + i], f, i);
}

void map_bodies(const std::vector<Mat6>& by, Vec6* x) {
    for (std::size_t b = 0; b < by.size(); ++b)
        image(by[b].data(), Six::load(x[b].data())).store(x[b].data());
}

void push(const ConeLaws::Fours& fours, const ConeLaws::Units& units, Vec6* v) {
    for (const ConeFour& f : fours) push_units(f, units.data() + f.begin, f.z, v);
}

void measure(ConeLaws::Fours& fours, const ConeLaws::Units& units, const Vec6* v) {
    for (ConeFour& f : fours) {
        along_units(f, units.data() + f.begin, v, f.u);
        for (int i = 0; i < f.count; i += lanes)
            for (int k = 0; k < f.size; ++k)
                put(f.u[k], i, get(f.u[k], i) + get(f.softness[k], i) * get(f.z[k], i) - get(f.right[k], i));
    }
}

}  // namespace

constexpr ConeLaws cone_table = {merit, worst,      linearise, add,  respond,
                                 turn,  map_bodies, remain,    push, measure};

}  // namespace spook::SPOOK_ISA
