#include "linear/block_ldlt.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "linear/pieces.hpp"

namespace spook {

namespace {

constexpr std::int64_t operations_a_piece = 50'000;  // of blocks: some milliseconds

/// CSR lists of small numbers: counted, then filled.
struct Buckets {
    std::vector<std::int64_t> start;  // of each list in `items`
    std::vector<int> items;
    void count(std::size_t lists) { start.assign(lists + 2, 0); }
    void seen(std::int64_t list) noexcept { ++start[list + 2]; }
    void ready() {
        for (std::size_t k = 2; k < start.size(); ++k) start[k] += start[k - 1];
        items.resize(static_cast<std::size_t>(start.back()));
    }
    void put(std::int64_t list, int item) noexcept { items[start[list + 1]++] = item; }
    std::span<const int> operator[](std::int64_t list) const noexcept {
        return {items.data() + start[list], static_cast<std::size_t>(start[list + 1] - start[list])};
    }
};

}  // namespace

/// What an analysis needs besides what it gives. One per thread: its memory outlives an analysis, its values do not.
struct BlockLdlt::Analysis {
    Ordering ordering;
    std::vector<std::int64_t> touched;   // by which column first: pivot blocks, then rows
    std::vector<std::int64_t> block_at;  // of the same, in work_
    std::vector<std::int64_t> edge_of, next, rooms, sizes;
    std::vector<int> vacant, behind;  // the last place of each size that is free, and the one below it
    std::vector<std::uint8_t> flags;
    Buckets buckets;
};

void BlockLdlt::analyse(std::span<const int> sizes, std::span<const BlockEdge> edges,
                        std::span<const std::uint8_t> is_constraint, bool thin_constraints) {
    const int count = static_cast<int>(sizes.size());
    if (is_constraint.size() != sizes.size())
        throw std::invalid_argument("block LDLT: every block needs a size and a sign");
    for (int size : sizes)
        if (size < 1 || size > 6) throw std::invalid_argument("block LDLT: blocks have 1 to 6 unknowns");
    for (const BlockEdge& edge : edges)
        if (edge.first < 0 || edge.first >= edge.second || edge.second >= count)
            throw std::invalid_argument("block LDLT: an edge joins two different blocks, the smaller first");

    size_.assign(sizes.begin(), sizes.end());
    edges_.assign(edges.begin(), edges.end());
    is_constraint_.assign(is_constraint.begin(), is_constraint.end());
    offset_.resize(count);
    diagonal_at_.resize(count);
    coupling_at_.resize(edges.size());
    thin_ = thin_constraints;
    unknowns_ = 0;
    uniform_size_ = count ? size_[0] : 0;
    std::int64_t at = 0;
    for (int i = 0; i < count; ++i) {
        offset_[i] = unknowns_;
        unknowns_ += size_[i];
        diagonal_at_[i] = at;
        at += thin_ && is_constraint_[i] ? size_[i] : size_[i] * size_[i];
        if (size_[i] != uniform_size_) uniform_size_ = 0;
    }
    for (std::size_t e = 0; e < edges.size(); ++e) {
        coupling_at_[e] = at;
        at += size_[edges[e].first] * size_[edges[e].second];
    }
    values_.assign(at, 0.0);

    static thread_local Analysis analysis;
    order_blocks(size_, edges_, is_constraint_, analysis.ordering);
    order_ = analysis.ordering.order;
    column_of_.resize(count);
    for (int k = 0; k < count; ++k) column_of_[order_[k]] = k;
    parent_.assign(count, -1);
    for (int k = 0; k < count; ++k)
        if (const std::int64_t first = analysis.ordering.column_start[k];
            first < analysis.ordering.column_start[k + 1])
            parent_[k] = column_of_[analysis.ordering.column_rows[first]];
    place_columns(analysis);
    scale_.assign(unknowns_, 0.0);
    residual_.assign(unknowns_, 0.0);
    counters_ = {};
}

void BlockLdlt::place_columns(Analysis& analysis) {
    const int count = block_count();
    const Ordering& ordering = analysis.ordering;
    const std::vector<int>& position = column_of_;
    columns_.resize(count);
    row_size_.resize(ordering.column_rows.size());
    row_offset_.resize(ordering.column_rows.size());
    std::int64_t at = 0, target_count = 0;
    operations_per_factor_ = 0;
    piece_ends_.clear();
    std::int64_t piece = 0;
    for (int k = 0; k < count; ++k) {
        const int block = order_[k], n = size_[block];
        const std::int64_t first = ordering.column_start[k], last = ordering.column_start[k + 1],
                           d = last - first;
        columns_[k] = {at,
                       0,
                       first,
                       target_count,
                       offset_[block],
                       static_cast<std::int32_t>(d),
                       static_cast<std::uint8_t>(n),
                       is_constraint_[block]};
        at += n * (n + 1) / 2;
        for (std::int64_t r = first; r < last; ++r) {
            const int row = ordering.column_rows[r];
            row_size_[r] = static_cast<std::uint8_t>(size_[row]);
            row_offset_[r] = offset_[row];
            at += n * size_[row];
        }
        target_count += d * (d + 1) / 2;
        const std::int64_t operations = 1 + d + d * (d + 1) / 2;
        operations_per_factor_ += operations;
        piece += operations;
        if (piece < operations_a_piece && k + 1 < count) continue;
        piece_ends_.push_back(k + 1);
        piece = 0;
    }
    factor_.assign(at, 0.0);

    // Blocks are numbered: pivot blocks in order of elimination, then the rows. Each is touched first by its own
    // column, or by the first one that updates it.
    std::vector<std::int64_t>& touched = analysis.touched;
    touched.resize(count + ordering.column_rows.size());
    for (int k = 0; k < count; ++k) {
        touched[k] = k;
        for (std::int64_t r = ordering.column_start[k]; r < ordering.column_start[k + 1]; ++r)
            touched[count + r] = k;
    }
    targets_.resize(target_count);
    std::int64_t next = 0;
    for (int k = 0, end = 0; k < count; ++k) {
        if (k == piece_ends_[end]) end_piece(), ++end;
        const std::int64_t last = ordering.column_start[k + 1];
        const auto aim = [&](std::int64_t block) {
            targets_[next++] = block;
            touched[block] = std::min<std::int64_t>(touched[block], k);
        };
        for (std::int64_t r = ordering.column_start[k]; r < last; ++r) {
            const int p = position[ordering.column_rows[r]];
            aim(p);
            // Both lists are in order of elimination, and the later one contains the rest of this one.
            std::int64_t q = ordering.column_start[p];
            for (std::int64_t s = r + 1; s < last; ++s) {
                while (ordering.column_rows[q] != ordering.column_rows[s]) ++q;
                aim(count + q);
            }
        }
    }
    place_work(analysis);
    for (std::int64_t& target : targets_) target = analysis.block_at[target];
    place_loads(analysis);
}

/// Columns take the places of those of their size that are done.
void BlockLdlt::place_work(Analysis& analysis) {
    const int count = block_count();
    const std::vector<std::int64_t>& touched = analysis.touched;
    std::vector<std::int64_t>& block_at = analysis.block_at;
    std::vector<std::int64_t>&rooms = analysis.rooms, &sizes = analysis.sizes;
    Buckets& born = analysis.buckets;
    block_at.resize(touched.size());
    rooms.resize(count);
    born.count(count);
    std::vector<std::int64_t>& first = analysis.next;
    first.resize(count);
    for (int k = 0; k < count; ++k) {
        const kernel::Column& column = columns_[k];
        first[k] = touched[k];
        rooms[k] = column.size * column.size;
        for (std::int64_t r = column.first_row; r < column.first_row + column.row_count; ++r) {
            first[k] = std::min(first[k], touched[count + r]);
            rooms[k] += column.size * row_size_[r];
        }
        born.seen(first[k]);
    }
    born.ready();
    for (int k = 0; k < count; ++k) born.put(first[k], k);
    sizes = rooms;
    std::sort(sizes.begin(), sizes.end());
    sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
    const auto vacant = [&](int column) -> int& {
        return analysis.vacant[std::lower_bound(sizes.begin(), sizes.end(), rooms[column]) - sizes.begin()];
    };
    analysis.vacant.assign(sizes.size(), -1);
    analysis.behind.resize(count);
    std::int64_t end = 0;
    for (int k = 0; k < count; ++k) {
        for (int c : born[k]) {
            kernel::Column& column = columns_[c];
            if (int& free = vacant(c); free < 0) {
                column.work = end;
                end += rooms[c];
            } else {
                column.work = columns_[free].work;
                free = analysis.behind[free];
            }
            block_at[c] = column.work;
            std::int64_t at = column.work + column.size * column.size;
            for (std::int64_t r = column.first_row; r < column.first_row + column.row_count; ++r) {
                block_at[count + r] = at;
                at += column.size * row_size_[r];
            }
        }
        analysis.behind[k] = std::exchange(vacant(k), k);
    }
    work_.assign(end, 0.0);
}

void BlockLdlt::place_loads(Analysis& analysis) {
    const int count = block_count();
    const Ordering& ordering = analysis.ordering;
    const std::vector<int>& position = column_of_;
    const std::vector<std::int64_t>&touched = analysis.touched, &block_at = analysis.block_at;

    // The edge that a block of the factor comes from; the rest is fill.
    std::vector<std::int64_t>& edge_of = analysis.edge_of;
    edge_of.assign(ordering.column_rows.size(), -1);
    for (std::size_t e = 0; e < edges_.size(); ++e) {
        const auto [i, j] = edges_[e];
        const bool later = position[i] > position[j];
        const int early = later ? j : i, late = later ? i : j;
        const auto first = ordering.column_rows.begin() + ordering.column_start[position[early]];
        const auto last = ordering.column_rows.begin() + ordering.column_start[position[early] + 1];
        const auto found =
            std::lower_bound(first, last, late, [&](int a, int b) { return position[a] < position[b]; });
        std::int64_t& edge = edge_of[found - ordering.column_rows.begin()];
        if (edge >= 0) throw std::invalid_argument("block LDLT: two edges join the same pair of blocks");
        edge = static_cast<std::int64_t>(e);
    }
    find_raw(analysis);
    std::vector<std::uint8_t>& raw = analysis.flags;
    raw.assign(count, 0);
    for (int block : raw_blocks_) raw[block] = 1;

    load_start_.assign(count + 1, 0);
    for (std::int64_t column : touched) ++load_start_[column + 1];
    for (int k = 0; k < count; ++k) load_start_[k + 1] += load_start_[k];
    std::vector<std::int64_t>& next = analysis.next;
    next.assign(load_start_.begin(), load_start_.end() - 1);
    loads_.resize(touched.size());
    for (int block = 0; block < count; ++block) {
        const auto n = static_cast<std::uint8_t>(size_[block]);
        const int k = position[block];
        loads_[next[touched[k]]++] = {diagonal_at_[block],
                                      block_at[k],
                                      offset_[block],
                                      n,
                                      n,
                                      kernel::Load::diagonal,
                                      is_constraint_[block] != 0,
                                      thin_ && is_constraint_[block],
                                      raw[block] != 0};
    }
    for (int k = 0; k < count; ++k)
        for (std::int64_t r = ordering.column_start[k]; r < ordering.column_start[k + 1]; ++r) {
            const int early = order_[k], late = ordering.column_rows[r];
            kernel::Load& item = loads_[next[touched[count + r]]++];
            item = {0,
                    block_at[count + r],
                    0,
                    static_cast<std::uint8_t>(size_[early]),
                    static_cast<std::uint8_t>(size_[late]),
                    kernel::Load::zero};
            if (edge_of[r] < 0) continue;
            item.from = coupling_at_[edge_of[r]];
            item.kind = early < late ? kernel::Load::direct : kernel::Load::transposed;
            if (early > late) std::swap(item.rows, item.columns);
        }
}

void BlockLdlt::find_raw(Analysis& analysis) {
    // A constraint eliminated before all its bodies has no Schur complement to measure its pivot by.
    const int count = block_count();
    const std::vector<int>& position = column_of_;
    raw_blocks_.clear();
    raw_edges_.clear();
    raw_start_.assign(1, 0);
    std::vector<std::uint8_t>& early_body = analysis.flags;
    early_body.assign(count, 0);
    for (const auto& [i, j] : edges_) {
        const int constraint = is_constraint_[i] ? i : j, body = is_constraint_[i] ? j : i;
        if (position[body] < position[constraint]) early_body[constraint] = 1;
    }
    Buckets& raw = analysis.buckets;
    raw.count(count);
    const auto each = [&](const auto& take) {
        for (std::size_t e = 0; e < edges_.size(); ++e)
            for (int block : {edges_[e].first, edges_[e].second})
                if (is_constraint_[block] && !early_body[block]) take(block, static_cast<int>(e));
    };
    each([&](int block, int) { raw.seen(block); });
    raw.ready();
    each([&](int block, int edge) { raw.put(block, edge); });
    for (int i = 0; i < count; ++i) {
        if (raw[i].empty()) continue;
        raw_blocks_.push_back(i);
        raw_edges_.insert(raw_edges_.end(), raw[i].begin(), raw[i].end());
        raw_start_.push_back(static_cast<int>(raw_edges_.size()));
    }
}

void BlockLdlt::raw_scales() {
    for (std::size_t k = 0; k < raw_blocks_.size(); ++k) {
        const int block = raw_blocks_[k], n = size_[block];
        double* scale = scale_.data() + offset_[block];
        std::fill_n(scale, n, 0.0);
        for (int at = raw_start_[k]; at < raw_start_[k + 1]; ++at) {
            const auto [i, j] = edges_[raw_edges_[at]];
            const double* b = coupling(raw_edges_[at]);
            const int other = i == block ? j : i, m = size_[other];
            if (is_constraint_[other]) continue;
            const double* d = diagonal(other);
            for (int a = 0; a < n; ++a)
                for (int c = 0; c < m; ++c) {
                    const double entry = i == block ? b[a * m + c] : b[c * n + a],
                                 mass = std::abs(d[c * m + c]);
                    if (mass > 0.0) scale[a] += entry * entry / mass;
                }
        }
    }
}

kernel::Factor BlockLdlt::view() const noexcept {
    auto* self = const_cast<BlockLdlt*>(this);  // the passes of a solve only read
    return {columns_.data(),      static_cast<std::int64_t>(columns_.size()),
            row_size_.data(),     row_offset_.data(),
            targets_.data(),      values_.data(),
            loads_.data(),        load_start_.data(),
            self->factor_.data(), self->work_.data(),
            self->scale_.data(),  shift_};
}

bool BlockLdlt::factor_with(double floor, double* x) {
    if (!raw_blocks_.empty()) raw_scales();
    ++counters_.factorisations;
    counters_.block_operations += static_cast<std::uint64_t>(operations_per_factor_);
    kernel::Factor piece = view();
    for (std::size_t k = 0; k < piece_ends_.size(); ++k) {
        if (k > 0) end_piece();
        const std::int64_t from = k > 0 ? piece_ends_[k - 1] : 0;
        piece.columns = columns_.data() + from;
        piece.load_start = load_start_.data() + from;
        piece.column_count = piece_ends_[k] - from;
        const std::int64_t replaced = kernel::kernels().factor(piece, uniform_size_, floor, x);
        if (replaced < 0) return false;
        counters_.floored_pivots += static_cast<std::uint64_t>(replaced);
    }
    return true;
}

bool BlockLdlt::factor(double floor) { return factor_with(floor, nullptr); }

void BlockLdlt::solve(double* x) const {
    kernel::kernels().forward(view(), uniform_size_, x);
    kernel::kernels().backward(view(), uniform_size_, x);
}

void BlockLdlt::reach(std::span<const int> blocks, std::vector<int>& columns) const {
    columns.clear();
    for (const int block : blocks)
        for (int k = column_of_[block]; k >= 0; k = parent_[k]) columns.push_back(k);
    std::sort(columns.begin(), columns.end());
    columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
}

void BlockLdlt::forward(std::span<const int> columns, double* x) const {
    kernel::Factor piece = view();
    for (std::size_t from = 0, to = 0; from < columns.size(); from = to) {  // neighbours in one go
        for (to = from + 1; to < columns.size() && columns[to] == columns[to - 1] + 1;) ++to;
        piece.columns = columns_.data() + columns[from];
        piece.column_count = static_cast<std::int64_t>(to - from);
        kernel::kernels().forward(piece, uniform_size_, x);
    }
}

BlockLdlt::Pivots BlockLdlt::pivots(int column) const noexcept {
    const kernel::Column& k = columns_[column];
    const int n = k.size;
    return {k.offset, {factor_.data() + k.at + n * (n - 1) / 2, static_cast<std::size_t>(n)}};
}

double BlockLdlt::largest_constraint_scale() const noexcept {
    double largest = 0.0;
    for (int i = 0; i < block_count(); ++i)
        if (is_constraint_[i])
            for (int k = 0; k < size_[i]; ++k) largest = std::max(largest, scale_[offset_[i] + k]);
    return largest;
}

void BlockLdlt::residual(const double* rhs, const double* x, double* r) const {
    const kernel::Kernels& fast = kernel::kernels();
    if (r != rhs) std::copy_n(rhs, unknowns_, r);
    for (int i = 0; i < block_count(); ++i) {
        const double *d = diagonal(i), *from = x + offset_[i];
        double* to = r + offset_[i];
        if (thin_ && is_constraint_[i])
            for (int k = 0; k < size_[i]; ++k) to[k] -= d[k] * from[k];
        else fast.subtract_product(size_[i], size_[i], d, from, to);
    }
    for (std::size_t e = 0; e < edges_.size(); ++e) {
        const auto [i, j] = edges_[e];
        fast.subtract_coupling(size_[i], size_[j], coupling(static_cast<int>(e)), x + offset_[i],
                               x + offset_[j], r + offset_[i], r + offset_[j]);
    }
}

void BlockLdlt::refine(const double* rhs, double* x, int refinements) {
    ++counters_.solves;
    for (int round = 0; round < refinements; ++round) {
        residual(rhs, x, residual_.data());
        solve(residual_.data());
        ++counters_.solves;
        for (int i = 0; i < unknowns_; ++i) x[i] += residual_[i];
    }
}

void BlockLdlt::solve_refined(const double* rhs, double* x, int refinements) {
    std::copy_n(rhs, unknowns_, x);
    solve(x);
    refine(rhs, x, refinements);
}

bool BlockLdlt::factor_and_solve(double floor, const double* rhs, double* x, int refinements) {
    std::copy_n(rhs, unknowns_, x);
    if (!factor_with(floor, x)) return false;
    kernel::kernels().backward(view(), uniform_size_, x);
    refine(rhs, x, refinements);
    return true;
}

}  // namespace spook
