#include "particles/saddle_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "linear/disjoint_sets.hpp"
#include "run/quantities.hpp"

namespace spook {

namespace {

constexpr double DAMPED_ABOVE = 0.3;    // of T h²/(m l)
constexpr double STRING_DAMPING = 1.0;  // D̃/K̃ there: a damping time of h/4
constexpr double IN_A_ROW = 1e-14;  // of det J / (tr J)³: points that lie to 1e-7 of their extent on a line

void add(double* block, const Mat3& m, double sign) noexcept {
    for (int i = 0; i < 9; ++i) block[i] += sign * m.m[i];
}

/// w of J w = l for the inertia J of some points; of points in a row, that without a turn about it.
Vec3 turn_of(const Mat3& inertia, Vec3 l, Vec3 along) noexcept {
    const double* m = inertia.m;
    const Vec3 r0{m[0], m[1], m[2]}, r1{m[3], m[4], m[5]}, r2{m[6], m[7], m[8]};
    const double det = dot(r0, cross(r1, r2)), size = m[0] + m[4] + m[8];
    if (std::fabs(det) > IN_A_ROW * size * size * size)
        return (1.0 / det) * Vec3{dot(l, cross(r1, r2)), dot(r0, cross(l, r2)), dot(r0, cross(r1, l))};
    if (!(size > 0.0)) return {};
    return (2.0 / size) * (l - (dot(l, along) / dot(along, along)) * along);
}

}  // namespace

void SaddleBlocks::analyse(const Nodes& nodes, const DistanceRows& rows, const Options& options) {
    options_ = options;
    std::vector<int> sizes;
    std::vector<std::uint8_t> is_constraint;
    std::vector<BlockEdge> edges;
    block_of_node_.assign(nodes.x.size(), -1);
    for (const Row& row : rows.row)
        for (const int node : {row.a, row.b})
            if (nodes.w[node] > 0.0) block_of_node_[node] = 0;
    for (int& block : block_of_node_) {
        if (block < 0) continue;
        block = static_cast<int>(sizes.size());
        sizes.push_back(3);
        is_constraint.push_back(0);
    }
    std::map<std::pair<int, int>, int> between;
    for (const Row& row : rows.row) {
        RowBlocks at{static_cast<int>(sizes.size()), -1, -1, -1};
        sizes.push_back(1);
        is_constraint.push_back(1);
        const int a = block_of_node_[row.a], b = block_of_node_[row.b];
        const auto edge = [&](int first, int second) {
            edges.push_back({first, second});
            return static_cast<int>(edges.size()) - 1;
        };
        if (a >= 0) at.a = edge(a, at.row);
        if (b >= 0) at.b = edge(b, at.row);
        if (a >= 0 && b >= 0 && options_.stiff_strings) {
            const auto pair = std::minmax(a, b);
            const auto [found, fresh] = between.try_emplace(pair, -1);
            if (fresh) found->second = edge(pair.first, pair.second);
            at.between = found->second;
        }
        row_blocks_.push_back(at);
    }
    ldlt_.analyse(sizes, edges, is_constraint);
    rhs_.assign(static_cast<std::size_t>(ldlt_.unknowns()), 0.0);
    solution_ = rhs_;
    redundant_.prepare(ldlt_);
    if (options_.stiff_strings) find_islands(nodes, rows);
}

void SaddleBlocks::find_islands(const Nodes& nodes, const DistanceRows& rows) {
    const int count = static_cast<int>(nodes.size());  // which stands for all that does not float
    DisjointSets sets;
    sets.begin(nodes.size() + 1);
    const auto place = [&](int node) { return block_of_node_[node] < 0 ? count : node; };
    for (const Row& row : rows.row) sets.join(place(row.a), place(row.b));
    std::vector<std::vector<int>> members(nodes.size() + 1);
    for (int node = 0; node < count; ++node)
        if (block_of_node_[node] >= 0) members[sets.root(node)].push_back(node);
    const int held = sets.root(count);
    islands_.clear();
    for (int k = 0; k <= count; ++k)
        if (k != held && members[k].size() > 1) islands_.push_back(std::move(members[k]));
}

/// Σ x × m dv of what floats is 0 but for the forces across the rows, which leave a couple.
void SaddleBlocks::keep_angular_momentum(const Nodes& nodes) {
    for (const std::vector<int>& island : islands_) {
        Vec3 centre, missing, along;
        double mass = 0.0, farthest = -1.0;
        for (const int node : island) {
            centre += (1.0 / nodes.w[node]) * nodes.x[node];
            mass += 1.0 / nodes.w[node];
        }
        centre *= 1.0 / mass;
        Mat3 inertia;
        for (const int node : island) {
            const double m = 1.0 / nodes.w[node];
            const Vec3 r = nodes.x[node] - centre;
            const double r2 = dot(r, r);
            if (r2 > farthest) farthest = r2, along = r;
            missing -= m * cross(r, vec_at(solution_.data() + ldlt_.offset(block_of_node_[node])));
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) inertia(i, j) += m * ((i == j ? r2 : 0.0) - r[i] * r[j]);
        }
        const Vec3 turn = turn_of(inertia, missing, along);
        for (const int node : island) {
            double* dv = solution_.data() + ldlt_.offset(block_of_node_[node]);
            put(dv, vec_at(dv) + cross(turn, nodes.x[node] - centre));
        }
    }
}

void SaddleBlocks::factor(const Nodes& nodes, const DistanceRows& rows) {
    for (std::size_t node = 0; node < nodes.x.size(); ++node) {
        const int block = block_of_node_[node];
        if (block < 0) continue;
        const Mat3 mass = Mat3::diagonal({1.0 / nodes.w[node], 1.0 / nodes.w[node], 1.0 / nodes.w[node]});
        std::copy(mass.m, mass.m + 9, ldlt_.diagonal(block));
    }
    for (std::size_t k = 0; k < rows.row.size(); ++k) {
        const RowBlocks& at = row_blocks_[k];
        *ldlt_.diagonal(at.row) = -rows.row[k].softness;
        if (at.a >= 0) put(ldlt_.coupling(at.a), -rows.link[k].u);
        if (at.b >= 0) put(ldlt_.coupling(at.b), rows.link[k].u);
    }
    std::fill(rhs_.begin(), rhs_.end(), 0.0);
    if (options_.stiff_strings) stiffen_strings(nodes, rows);
    redundant_.factor(ldlt_, options_.floor);
}

/// Adds K̃ + D̃ to M and −K̃ kick − D̃ (v + kick) to the right side.
void SaddleBlocks::stiffen_strings(const Nodes& nodes, const DistanceRows& rows) {
    for (const RowBlocks& at : row_blocks_)
        if (at.between >= 0) std::fill_n(ldlt_.coupling(at.between), 9, 0.0);
    for (std::size_t k = 0; k < rows.row.size(); ++k) {
        const Row& row = rows.row[k];
        const Link& link = rows.link[k];
        const double tension = std::max(0.0, -link.lambda / options_.time_step);
        const double stiffness = tension * options_.time_step * options_.time_step / link.length;  // kg
        const double damping =
            0.5 * stiffness * (nodes.w[row.a] + nodes.w[row.b]) > DAMPED_ABOVE ? STRING_DAMPING : 0.0;
        const double held = 0.25 * stiffness, damped = damping * held;
        const RowBlocks& at = row_blocks_[k];
        Mat3 across = Mat3::identity();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                across(i, j) = (held + damped) * (across(i, j) - link.u[i] * link.u[j]);
        const Vec3 kick = nodes.kick[row.b] - nodes.kick[row.a],
                   moving = nodes.v[row.b] - nodes.v[row.a] + kick;
        Vec3 push = held * kick + damped * moving;
        push -= dot(link.u, push) * link.u;
        for (const auto& [node, sign] : {std::pair{row.a, 1.0}, std::pair{row.b, -1.0}}) {
            const int block = block_of_node_[node];
            if (block < 0) continue;
            add(ldlt_.diagonal(block), across, 1.0);
            double* rhs = rhs_.data() + ldlt_.offset(block);
            put(rhs, vec_at(rhs) + sign * push);
        }
        if (at.between >= 0) add(ldlt_.coupling(at.between), across, -1.0);
    }
}

void SaddleBlocks::substitute(const Nodes& nodes, DistanceRows& rows) {
    for (std::size_t k = 0; k < rows.row.size(); ++k)
        rhs_[ldlt_.offset(row_blocks_[k].row)] = rows.link[k].rhs;
    const bool doubtful =
        redundant_.solve(ldlt_, options_.floor, rhs_.data(), solution_.data(), options_.refinements,
                         [&](std::span<const double> left) { return rows_hold(nodes, rows, left); });
    if (doubtful && options_.may_contradict) find_contradiction(nodes, rows);
    if (options_.stiff_strings && redundant_.finite()) keep_angular_momentum(nodes);
    for (std::size_t k = 0; k < rows.row.size(); ++k)
        rows.link[k].lambda = redundant_.finite() ? -solution_[ldlt_.offset(row_blocks_[k].row)]
                                                  : std::numeric_limits<double>::quiet_NaN();
}

/// Whether every row holds to rounding: of the speeds in the system, and of a length in a step.
bool SaddleBlocks::rows_hold(const Nodes& nodes, const DistanceRows& rows,
                             std::span<const double> residuals) const {
    double speed = 0.0, left = 0.0, resolution = 0.0;
    for (std::size_t node = 0; node < nodes.v.size(); ++node) {
        if (block_of_node_[node] < 0) continue;
        const Vec3 change = vec_at(solution_.data() + ldlt_.offset(block_of_node_[node]));
        speed = std::max({speed, norm(nodes.v[node]), norm(nodes.kick[node]), norm(change)});
    }
    for (std::size_t k = 0; k < rows.row.size(); ++k) {
        const double residual = std::fabs(residuals[ldlt_.offset(row_blocks_[k].row)]);
        if (!(residual <= left)) left = residual;
        speed = std::max(speed, std::fabs(rows.link[k].rhs));
        resolution = std::max(resolution, rows.row[k].violation_gain * rows.row[k].rest);
    }
    return left <= 1e-13 * speed + 1e-15 * resolution;
}

/// Redundant rows agree with the others but for the curvature of their motion, which a linearised step leaves as
/// violation: a few times (h v)²/l. Rows that cannot hold together keep a residual of the size of the speeds they ask
/// for, and larger than that.
void SaddleBlocks::find_contradiction(const Nodes& nodes, const DistanceRows& rows) {
    const std::vector<double>& residuals = redundant_.residual(ldlt_, rhs_.data(), solution_.data());
    double speed = 0.0, largest = 0.0, curved = 0.0;
    std::size_t worst = 0;
    for (const Vec3& kick : nodes.kick) speed = std::max(speed, norm(kick));
    for (std::size_t k = 0; k < rows.row.size(); ++k) {
        speed = std::max(speed, std::fabs(rows.link[k].rhs));
        const Vec3 moved = options_.time_step * (nodes.v[rows.row[k].b] - nodes.v[rows.row[k].a]);
        const double unseen =
            1e-9 * rows.row[k].rest + 10.0 * curvature(rows.link[k].u, rows.link[k].length, moved);
        curved = std::max(curved, rows.row[k].violation_gain * unseen);
        const double residual = std::fabs(residuals[ldlt_.offset(row_blocks_[k].row)]);
        if (residual <= largest) continue;
        largest = residual;
        worst = k;
    }
    if (!(largest > 1e-3 * speed && largest > curved)) return;
    const int second = nodes.body[rows.row[worst].b];
    contradicted_ = second >= 0 ? second : nodes.body[rows.row[worst].a];
}

void SaddleBlocks::factor_rigidly(const Nodes& nodes, const DistanceRows& rows) {
    factor(nodes, rows);
    for (const RowBlocks& at : row_blocks_) *ldlt_.diagonal(at.row) = -0.0;
    redundant_.factor(ldlt_, options_.floor);
    std::fill(rhs_.begin(), rhs_.end(), 0.0);
}

void SaddleBlocks::add_moves(std::vector<Vec3>& v) const noexcept {
    for (std::size_t node = 0; node < v.size(); ++node)
        if (block_of_node_[node] >= 0)
            v[node] += vec_at(solution_.data() + ldlt_.offset(block_of_node_[node]));
}

}  // namespace spook
