// Faster fixed points for the normal forces that bound friction.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace spook {

/// Anderson's acceleration of x ← G(x) with the last few rounds: where friction and load pull at each other the
/// plain repetition converges slowly or not at all.
class Acceleration {
public:
    /// Forgets the rounds before, and keeps their memory.
    void begin() noexcept { known_ = 0; }

    /// The next x from this round's x and G(x); both lists have the same length in every call since begin().
    const std::vector<double>& next(const std::vector<double>& x, const std::vector<double>& g) {
        const std::size_t n = x.size();
        f_.resize(n);
        result_ = g;
        for (std::size_t i = 0; i < n; ++i) f_[i] = g[i] - x[i];
        if (known_ > 0) {
            if (known_ > window) {
                std::rotate(df_.begin(), df_.begin() + 1, df_.end());
                std::rotate(dg_.begin(), dg_.begin() + 1, dg_.end());
                known_ = window;
            }
            std::vector<double>&df = df_[known_ - 1], &dg = dg_[known_ - 1];
            df.resize(n), dg.resize(n);
            for (std::size_t i = 0; i < n; ++i) df[i] = f_[i] - last_f_[i], dg[i] = g[i] - last_g_[i];
            const std::array<double, window> weight = least_squares(known_);
            for (std::size_t j = 0; j < known_; ++j)
                for (std::size_t i = 0; i < n; ++i) result_[i] -= weight[j] * dg_[j][i];
        }
        ++known_;
        last_f_ = f_;
        last_g_ = g;
        for (double& value : result_) value = std::max(0.0, value);
        return result_;
    }

private:
    static constexpr std::size_t window = 5;

    /// The weights w of least |f − Σ w df| over m differences, by the normal equations with a touch of ridge.
    std::array<double, window> least_squares(std::size_t m) const {
        std::array<std::array<double, window + 1>, window> a{};
        for (std::size_t r = 0; r < m; ++r) {
            for (std::size_t c = 0; c < m; ++c)
                for (std::size_t i = 0; i < f_.size(); ++i) a[r][c] += df_[r][i] * df_[c][i];
            for (std::size_t i = 0; i < f_.size(); ++i) a[r][m] += df_[r][i] * f_[i];
            a[r][r] *= 1.0 + 1e-10;
            if (a[r][r] == 0.0) a[r][r] = 1.0;
        }
        for (std::size_t k = 0; k < m; ++k)
            for (std::size_t r = k + 1; r < m; ++r) {
                const double factor = a[r][k] / a[k][k];
                for (std::size_t c = k; c <= m; ++c) a[r][c] -= factor * a[k][c];
            }
        std::array<double, window> w{};
        for (std::size_t k = m; k-- > 0;) {
            w[k] = a[k][m];
            for (std::size_t c = k + 1; c < m; ++c) w[k] -= a[k][c] * w[c];
            w[k] /= a[k][k];
            if (!std::isfinite(w[k])) return {};
        }
        return w;
    }

    std::vector<double> f_, result_, last_f_, last_g_;
    std::array<std::vector<double>, window> df_, dg_;
    std::size_t known_ = 0;  // rounds; differences are one less, at most `window`
};

}  // namespace spook
