// A test harness in a few lines: say what is expected, count what was not, return it from main.
#pragma once

#include <cmath>
#include <cstdio>

inline int failures = 0;

#define EXPECT(condition)                                                        \
    do {                                                                         \
        if (!(condition)) {                                                      \
            std::printf("%s:%d: expected %s\n", __FILE__, __LINE__, #condition); \
            ++failures;                                                          \
        }                                                                        \
    } while (0)

/// |value − reference| <= tolerance; a NaN fails.
#define EXPECT_NEAR(value, reference, tolerance)                                                       \
    do {                                                                                               \
        const double value_ = (value), reference_ = (reference);                                       \
        if (!(std::abs(value_ - reference_) <= (tolerance))) {                                         \
            std::printf("%s:%d: expected %s = %.17g near %.17g\n", __FILE__, __LINE__, #value, value_, \
                        reference_);                                                                   \
            ++failures;                                                                                \
        }                                                                                              \
    } while (0)

inline int report() {
    if (failures) std::printf("%d expectations failed\n", failures);
    return failures == 0 ? 0 : 1;
}
