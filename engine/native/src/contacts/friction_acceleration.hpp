// Faster fixed points for the normal forces that bound friction.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace spook {

/// Anderson's acceleration of x ← G(x) with the last few rounds: where friction and load pull at each other the
/// plain repetition converges slowly or not at all.
class Acceleration {
public:
    /// The next x from this round's x and G(x); both lists have the same length in every call.
    std::vector<double> next(const std::vector<double>& x, const std::vector<double>& g) {
        const std::size_t n = x.size();
        std::vector<double> f(n), result = g;
        for (std::size_t i = 0; i < n; ++i) f[i] = g[i] - x[i];
        if (!last_f_.empty()) {
            std::vector<double> df(n), dg(n);
            for (std::size_t i = 0; i < n; ++i) df[i] = f[i] - last_f_[i], dg[i] = g[i] - last_g_[i];
            if (df_.size() == window) df_.erase(df_.begin()), dg_.erase(dg_.begin());
            df_.push_back(std::move(df));
            dg_.push_back(std::move(dg));
            const std::vector<double> weight = least_squares(f);
            for (std::size_t j = 0; j < weight.size(); ++j)
                for (std::size_t i = 0; i < n; ++i) result[i] -= weight[j] * dg_[j][i];
        }
        last_f_ = std::move(f);
        last_g_ = g;
        for (double& value : result) value = std::max(0.0, value);
        return result;
    }

private:
    static constexpr std::size_t window = 5;

    /// The weights w of least |f − Σ w df|, by the normal equations with a touch of ridge.
    std::vector<double> least_squares(const std::vector<double>& f) const {
        const std::size_t m = df_.size();
        std::vector<std::vector<double>> a(m, std::vector<double>(m + 1, 0.0));
        for (std::size_t r = 0; r < m; ++r) {
            for (std::size_t c = 0; c < m; ++c)
                for (std::size_t i = 0; i < f.size(); ++i) a[r][c] += df_[r][i] * df_[c][i];
            for (std::size_t i = 0; i < f.size(); ++i) a[r][m] += df_[r][i] * f[i];
            a[r][r] *= 1.0 + 1e-10;
            if (a[r][r] == 0.0) a[r][r] = 1.0;
        }
        for (std::size_t k = 0; k < m; ++k)
            for (std::size_t r = k + 1; r < m; ++r) {
                const double factor = a[r][k] / a[k][k];
                for (std::size_t c = k; c <= m; ++c) a[r][c] -= factor * a[k][c];
            }
        std::vector<double> w(m, 0.0);
        for (std::size_t k = m; k-- > 0;) {
            w[k] = a[k][m];
            for (std::size_t c = k + 1; c < m; ++c) w[k] -= a[k][c] * w[c];
            w[k] /= a[k][k];
            if (!std::isfinite(w[k])) return std::vector<double>(m, 0.0);
        }
        return w;
    }

    std::vector<double> last_f_, last_g_;
    std::vector<std::vector<double>> df_, dg_;
};

}  // namespace spook
