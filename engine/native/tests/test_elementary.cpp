// Sine, cosine, arc and hyperbolic tangent and length against long double, over random, special and hard arguments.
#include "linear/elementary.hpp"

#include <bit>
#include <cfloat>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

#include "expect.hpp"

using namespace spook;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double smallest = std::numeric_limits<double>::denorm_min();

/// Error in units of the last place of `found`'s binade.
double ulps(double found, long double right) {
    if (found == static_cast<double>(right) && !std::isfinite(found)) return 0.0;
    const int exponent = right == 0.0L ? -1022 : std::max(std::ilogb(right), -1022);
    return static_cast<double>(std::fabs(std::scalbn(found - right, 52 - exponent)));
}

/// The largest seen, and where.
struct Worst {
    double error = 0.0, at = 0.0, other = 0.0;
    void see(double e, double a, double b = 0.0) {
        if (!(e <= error)) error = e, at = a, other = b;
    }
    bool within(double limit, const char* name) const {
        if (!(error <= limit)) std::printf("%s: %.4f ULP at (%a, %a)\n", name, error, at, other);
        return error <= limit;
    }
};

std::mt19937_64 draw(20240229);

double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(draw() >> 11) * 0x1p-53;
}
/// Any finite double, every exponent as likely as another.
double any_double() {
    for (;;) {
        const double x = std::bit_cast<double>(static_cast<std::uint64_t>(draw()));
        if (std::isfinite(x)) return x;
    }
}

Worst sine_error, cosine_error;
void turn(double x) {
    const SineCosine r = sine_cosine(x);
    sine_error.see(ulps(r.sine, std::sin(static_cast<long double>(x))), x);
    cosine_error.see(ulps(r.cosine, std::cos(static_cast<long double>(x))), x);
    const SineCosine back = sine_cosine(-x);
    EXPECT(back.sine == -r.sine && back.cosine == r.cosine);
}

void sine_and_cosine_are_within_0_9_ulp() {
    for (int i = 0; i < 300'000; ++i) turn(uniform(-0.8, 0.8));
    for (int i = 0; i < 300'000; ++i) turn(uniform(-50.0, 50.0));
    for (int i = 0; i < 300'000; ++i) turn(any_double());
    for (int k = 1; k < 700'000;
         k += k < 20'000 ? 1 : 97) {  // the doubles around the zeros, where the reductions begin
        const double near = k * (0.25 * std::numbers::pi);
        for (const double x : {std::nextafter(near, 0.0), near, std::nextafter(near, infinite)}) turn(x);
    }
    // The double nearest to a multiple of pi/2 of all: 2^-61 away.
    for (const double x : {0x1.6ac5b262ca1ffp+849, 0x1p1023, DBL_MAX, DBL_MIN, smallest, 0x1p-27, 1e22})
        turn(x);
    EXPECT(sine_error.within(0.9, "sine"));
    EXPECT(cosine_error.within(0.9, "cosine"));
}

void sine_and_cosine_of_what_has_none() {
    for (const double x : {infinite, -infinite, std::nan("")}) {
        EXPECT(std::isnan(sine_cosine(x).sine));
        EXPECT(std::isnan(sine_cosine(x).cosine));
    }
    EXPECT(std::signbit(sine_cosine(-0.0).sine) && sine_cosine(-0.0).sine == 0.0);
    EXPECT(sine_cosine(0.0).cosine == 1.0);
}

void the_arc_tangent_is_within_0_6_ulp() {
    Worst worst;
    const auto see = [&](double y, double x) {
        const double found = arc_tangent(y, x);
        worst.see(ulps(found, std::atan2(static_cast<long double>(y), static_cast<long double>(x))), y, x);
        EXPECT(arc_tangent(-y, x) == -found);
    };
    for (int i = 0; i < 500'000; ++i) see(uniform(-1.0, 1.0), uniform(-1.0, 1.0));
    for (int i = 0; i < 300'000; ++i) see(any_double(), any_double());
    for (int i = 0; i < 200'000; ++i) {  // the angle of a small turn, and of one near a half turn
        const double small = uniform(0.0, 1.0) * std::exp2(-uniform(0.0, 80.0));
        for (const double x : {1.0, -1.0, std::sqrt(1.0 - small * small)}) see(small, x), see(x, small);
    }
    for (int k = 0; k <= 32; ++k)  // where one constant of the table takes over from the next
        for (int i = -2; i <= 2; ++i)
            see(k / 32.0 + i * 0x1p-53, 1.0), see(3.0 * k / 32.0 + i * 0x1p-52, 3.0);
    for (const double a : {smallest, DBL_MIN, 1.0, DBL_MAX})
        for (const double b : {smallest, -smallest, DBL_MIN, -1.0, 1.0, -DBL_MAX}) see(a, b);
    EXPECT(worst.within(0.6, "arc tangent"));
}

void the_arc_tangent_of_zeros_and_infinities() {
    for (const double y : {0.0, -0.0, 1.0, -1.0, infinite, -infinite})
        for (const double x : {0.0, -0.0, 1.0, -1.0, infinite, -infinite}) {
            const double found = arc_tangent(y, x), right = std::atan2(y, x);
            EXPECT(found == right && std::signbit(found) == std::signbit(right));
        }
    EXPECT(std::isnan(arc_tangent(std::nan(""), 1.0)) && std::isnan(arc_tangent(1.0, std::nan(""))));
}

void the_hyperbolic_tangent_is_within_4_ulp() {
    Worst worst;
    const auto see = [&](double x) {
        const double found = hyperbolic_tangent(x);
        worst.see(ulps(found, std::tanh(static_cast<long double>(x))), x);
        EXPECT(hyperbolic_tangent(-x) == -found && std::abs(found) <= 1.0);
    };
    for (int i = 0; i < 100'000; ++i) see(uniform(0.0, 1.0)), see(uniform(0.0, 25.0));
    for (int k = -60; k < 10; ++k) see(std::exp2(k)), see(std::nextafter(std::exp2(k), 0.0));
    EXPECT(worst.within(4.0, "hyperbolic tangent"));
    EXPECT(std::isnan(hyperbolic_tangent(std::nan(""))));
    EXPECT(hyperbolic_tangent(infinite) == 1.0 && hyperbolic_tangent(0.0) == 0.0);
}

void a_length_has_a_relative_error_below_2_to_the_minus_52() {
    double worst = 0.0;
    for (int i = 0; i < 500'000; ++i) {
        const double a = uniform(-1.0, 1.0), b = uniform(-1.0, 1.0) * std::exp2(-uniform(0.0, 30.0));
        const long double right =
            std::sqrt(static_cast<long double>(a) * a + static_cast<long double>(b) * b);
        worst = std::max(worst, static_cast<double>(std::fabs(length(a, b) - right) / right));
    }
    EXPECT(worst <= 0x1p-52);
    EXPECT(length(3.0, 4.0) == 5.0 && length(0.0, -2.0) == 2.0 && length(0.0, 0.0) == 0.0);
}

}  // namespace

int main() {
    a_length_has_a_relative_error_below_2_to_the_minus_52();
    sine_and_cosine_of_what_has_none();
    the_arc_tangent_of_zeros_and_infinities();
    if constexpr (LDBL_MANT_DIG > DBL_MANT_DIG) {  // else there is no finer ruler here
        sine_and_cosine_are_within_0_9_ulp();
        the_arc_tangent_is_within_0_6_ulp();
        the_hyperbolic_tangent_is_within_4_ulp();
    }
    if (failures == 0)
        std::printf("worst: sine %.3f, cosine %.3f ULP\n", sine_error.error, cosine_error.error);
    return report();
}
