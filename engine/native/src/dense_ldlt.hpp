// Dense LDLᵀ of a small symmetric positive matrix, with a pivot floor and refinement against the matrix itself.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace spook {

class DenseLdlt {
public:
    void resize(int n) {
        n_ = n;
        a_.assign(static_cast<std::size_t>(n) * n, 0.0);
        l_ = a_;
        step_.assign(n, 0.0);
    }
    void clear() noexcept { std::fill(a_.begin(), a_.end(), 0.0); }
    double& at(int i, int j) noexcept { return a_[static_cast<std::size_t>(i) * n_ + j]; }

    /// Lower triangle of `at` is read. A pivot under floor × diagonal is lifted to it, in the factor only.
    void factor(double floor) noexcept {
        for (int i = 0; i < n_; ++i) {
            for (int j = 0; j <= i; ++j) {
                double sum = a_[i * n_ + j];
                for (int k = 0; k < j; ++k) sum -= l_[i * n_ + k] * l_[j * n_ + k] * l_[k * n_ + k];
                if (i == j) l_[i * n_ + i] = std::max(sum, floor * a_[i * n_ + i]);
                else l_[i * n_ + j] = sum / l_[j * n_ + j];
            }
        }
    }

    /// x = A⁻¹ b with that many refinements. Allocates nothing.
    void solve(const double* b, double* x, int refinements) noexcept {
        std::copy(b, b + n_, x);
        substitute(x);
        for (int round = 0; round < refinements; ++round) {
            for (int i = 0; i < n_; ++i) {
                double sum = b[i];
                for (int j = 0; j < n_; ++j) sum -= (j <= i ? a_[i * n_ + j] : a_[j * n_ + i]) * x[j];
                step_[i] = sum;
            }
            substitute(step_.data());
            for (int i = 0; i < n_; ++i) x[i] += step_[i];
        }
    }

private:
    void substitute(double* x) const noexcept {
        for (int i = 0; i < n_; ++i)
            for (int k = 0; k < i; ++k) x[i] -= l_[i * n_ + k] * x[k];
        for (int i = 0; i < n_; ++i) x[i] /= l_[i * n_ + i];
        for (int i = n_ - 1; i >= 0; --i)
            for (int k = i + 1; k < n_; ++k) x[i] -= l_[k * n_ + i] * x[k];
    }

    int n_ = 0;
    std::vector<double> a_, l_, step_;
};

}  // namespace spook
