// The loops over the columns of a block factor, compiled for each instruction set with bitwise equal results.
#pragma once

#include <cstdint>

namespace spook::kernel {

/// One column of the factor. In `values` from `at` on: U above its unit diagonal, row by row; 1/D (n); then for
/// each coupled row block its n × n_r block Z = D⁻¹ U⁻ᵀ A. In `work` from `work` on, while the column is being
/// summed up: the pivot block (n × n), then the row blocks. Columns that are done give their room in `work` to
/// later ones: of a chain, all of it stays in the nearest cache.
struct Column {
    std::int64_t at, work, first_row, first_target;
    std::int32_t offset;  // of its unknowns
    std::int32_t row_count;
    std::uint8_t size, is_constraint;
};

/// Where a block of the matrix goes in `work`. Blocks are taken when a column first needs them, so that the
/// factor is written once while the matrix is read once.
struct Load {
    enum Kind : std::uint8_t { direct, transposed, diagonal, zero };
    std::int64_t from, to;
    std::int32_t offset;  // of the unknowns of a diagonal block
    std::uint8_t rows, columns;
    Kind kind;
    // Of diagonal blocks:
    bool constraint = false;  // −Sig, which may get a shift in the factor
    bool thin = false;        // only the diagonal of the block is stored
    bool raw = false;         // its scale has been started already
};

struct Factor {
    const Column* columns;
    std::int64_t column_count;
    const std::uint8_t* row_size;
    const std::int32_t* row_offset;
    const std::int64_t*
        targets;  // per column, for each pair of its rows r ≤ s: where in `work` the update goes
    const double* matrix;
    const Load* loads;
    const std::int64_t* load_start;  // per column: loads[load_start[k]] … before loads[load_start[k + 1]]
    double* values;
    double* work;
    double* scale;  // per unknown: sum of magnitudes a pivot came from
    double shift;   // taken from the diagonal of every constraint, in the factor only
};

/// What a pass over the columns needs, for one instruction set.
struct Kernels {
    /// Loads and factors; counts replaced pivots; −1 when a pivot is not finite (or vanishes with floor 0).
    /// With x not null it is carried through the forward substitution on the way.
    std::int64_t (*factor)(const Factor&, int uniform_size, double floor, double* x);
    void (*forward)(const Factor&, int uniform_size, double* x);
    void (*backward)(const Factor&, int uniform_size, double* x);
    /// y −= B x₂ and z −= Bᵀ x₁ for a row-major rows × columns block B.
    void (*subtract_product)(int rows, int columns, const double* b, const double* x2, double* y);
    void (*subtract_coupling)(int rows, int columns, const double* b, const double* x1, const double* x2,
                              double* y, double* z);
};

const Kernels& portable_kernels() noexcept;
const Kernels& avx2_kernels() noexcept;  // the portable ones where the compiler cannot build them

/// The fastest ones this machine runs.
const Kernels& kernels() noexcept;
/// For tests: from now on the portable ones everywhere, or the fastest again. Not for use between threads.
void use_portable_kernels(bool portable) noexcept;
/// For tests: from now on these everywhere; they outlive their use. Not for use between threads.
void use_kernels(const Kernels& kernels) noexcept;

}  // namespace spook::kernel
