// A small dense system of rows, G M⁻¹ Gᵀ = L D Lᵀ, where blocks would cost more than they save.
#pragma once

#include <vector>

namespace spook {

/// Symmetric and positive, up to rows that are redundant: those the factor leaves out, and their unknowns are zero.
/// Nothing is allocated after prepare().
class DenseRows {
public:
    void prepare(int rows) {
        const std::size_t count = static_cast<std::size_t>(rows);
        rows_ = rows;
        values_.assign(count * count, 0.0);
        inverse_.assign(count, 0.0);
    }
    /// The lower triangle, row-major; to be filled before factor().
    double* row(int i) noexcept { return values_.data() + i * rows_; }

    /// A pivot below floor × its diagonal entry belongs to a redundant row. False when a value is not finite.
    bool factor(double floor) noexcept {
        for (int i = 0; i < rows_; ++i) {
            double* a = row(i);
            const double entry = a[i];
            double pivot = entry;
            for (int j = 0; j < i; ++j) {  // a becomes L D, then L
                const double* b = row(j);
                double sum = a[j];
                for (int k = 0; k < j; ++k) sum -= a[k] * b[k];
                a[j] = sum;
            }
            for (int j = 0; j < i; ++j) {
                const double scaled = a[j] * inverse_[j];
                pivot -= a[j] * scaled;
                a[j] = scaled;
            }
            if (!(pivot - pivot == 0.0)) return false;
            inverse_[i] = pivot > floor * entry ? 1.0 / pivot : 0.0;
        }
        return true;
    }

    /// x ← (L D Lᵀ)⁻¹ x.
    void solve(double* x) const noexcept {
        for (int i = 0; i < rows_; ++i) {
            const double* a = values_.data() + i * rows_;
            double sum = x[i];
            for (int j = 0; j < i; ++j) sum -= a[j] * x[j];
            x[i] = sum;
        }
        for (int i = 0; i < rows_; ++i) x[i] *= inverse_[i];
        for (int i = rows_ - 1; i >= 0; --i) {
            if (inverse_[i] == 0.0) continue;
            const double* a = values_.data() + i * rows_;
            for (int j = 0; j < i; ++j) x[j] -= a[j] * x[i];
        }
        for (int i = 0; i < rows_; ++i)
            if (inverse_[i] == 0.0) x[i] = 0.0;
    }

private:
    int rows_ = 0;
    std::vector<double> values_, inverse_;  // L below the diagonal; 1/D, 0 where a row is left out
};

}  // namespace spook
