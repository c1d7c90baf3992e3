// Distance rows that branch or close loops, and strings made stiff: the saddle system in blocks.
//
// Unknowns are the change of velocity beyond the kick, dv, and μ = −λ:
//     [ M̃  Gᵀ  ] [ dv ]   [ −K̃ kick − D̃ (v + kick) ]      M̃ = M + K̃ + D̃
//     [ G  −Sig ] [ μ  ] = [ rhs of the Schur form     ]
// Without string stiffness K̃ = D̃ = 0. With it K̃ = (h²/4) Σ (T/l)(I − u uᵀ), T the tension of the step before:
// the transverse stiffness of a taut row averaged over ¼ (x₊ + 2x + x₋) like a compliance, and D̃ a damping only
// where the explicit step would be near its limit T h²/(m l) = 1.
#include "particles/particle_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace spook {

namespace {

constexpr double DAMPED_ABOVE = 0.3;    // of T h²/(m l)
constexpr double STRING_DAMPING = 1.0;  // D̃/K̃ there: a damping time of h/4

void put(double* out, Vec3 v) noexcept {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

void add(double* block, const Mat3& m, double sign) noexcept {
    for (int i = 0; i < 9; ++i) block[i] += sign * m.m[i];
}

}  // namespace

void ParticleSystem::analyse_blocks() {
    std::vector<int> sizes;
    std::vector<std::uint8_t> is_constraint;
    std::vector<BlockEdge> edges;
    block_of_node_.assign(x_.size(), -1);
    for (const Row& row : row_)
        for (const int node : {row.a, row.b})
            if (w_[node] > 0.0) block_of_node_[node] = 0;
    for (int& block : block_of_node_) {
        if (block < 0) continue;
        block = static_cast<int>(sizes.size());
        sizes.push_back(3);
        is_constraint.push_back(0);
    }
    std::map<std::pair<int, int>, int> between;
    for (const Row& row : row_) {
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
        if (a >= 0 && b >= 0 && stiff_strings_) {
            const auto pair = std::minmax(a, b);
            const auto [found, fresh] = between.try_emplace(pair, -1);
            if (fresh) found->second = edge(pair.first, pair.second);
            at.between = found->second;
        }
        row_blocks_.push_back(at);
    }
    ldlt_.analyse(sizes, edges, is_constraint);
    saddle_rhs_.assign(static_cast<std::size_t>(ldlt_.unknowns()), 0.0);
    saddle_ = saddle_rhs_;
    redundant_.prepare(ldlt_);
}

void ParticleSystem::factor_blocks() {
    for (std::size_t node = 0; node < x_.size(); ++node) {
        const int block = block_of_node_[node];
        if (block < 0) continue;
        const Mat3 mass = Mat3::diagonal({1.0 / w_[node], 1.0 / w_[node], 1.0 / w_[node]});
        std::copy(mass.m, mass.m + 9, ldlt_.diagonal(block));
    }
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const RowBlocks& at = row_blocks_[k];
        *ldlt_.diagonal(at.row) = -row_[k].softness;
        if (at.a >= 0) put(ldlt_.coupling(at.a), -link_[k].u);
        if (at.b >= 0) put(ldlt_.coupling(at.b), link_[k].u);
    }
    std::fill(saddle_rhs_.begin(), saddle_rhs_.end(), 0.0);
    if (stiff_strings_) stiffen_strings();
    redundant_.factor(ldlt_, scene_.method.floor);
}

/// Adds K̃ + D̃ to M and −K̃ kick − D̃ (v + kick) to the right side.
void ParticleSystem::stiffen_strings() {
    for (const RowBlocks& at : row_blocks_)
        if (at.between >= 0) std::fill_n(ldlt_.coupling(at.between), 9, 0.0);
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Row& row = row_[k];
        const Link& link = link_[k];
        const double tension = std::max(0.0, -link.lambda / h_);
        const double stiffness = tension * h_ * h_ / link.length;  // kg
        const double damping =
            0.5 * stiffness * (w_[row.a] + w_[row.b]) > DAMPED_ABOVE ? STRING_DAMPING : 0.0;
        const double held = 0.25 * stiffness, damped = damping * held;
        const RowBlocks& at = row_blocks_[k];
        Mat3 across = Mat3::identity();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                across(i, j) = (held + damped) * (across(i, j) - link.u[i] * link.u[j]);
        const Vec3 kick = kick_[row.b] - kick_[row.a], moving = v_[row.b] - v_[row.a] + kick;
        Vec3 push = held * kick + damped * moving;
        push -= dot(link.u, push) * link.u;
        for (const auto& [node, sign] : {std::pair{row.a, 1.0}, std::pair{row.b, -1.0}}) {
            const int block = block_of_node_[node];
            if (block < 0) continue;
            add(ldlt_.diagonal(block), across, 1.0);
            double* rhs = saddle_rhs_.data() + ldlt_.offset(block);
            put(rhs, vec_at(rhs) + sign * push);
        }
        if (at.between >= 0) add(ldlt_.coupling(at.between), across, -1.0);
    }
}

void ParticleSystem::substitute_blocks() {
    for (std::size_t k = 0; k < row_.size(); ++k)
        saddle_rhs_[ldlt_.offset(row_blocks_[k].row)] = link_[k].rhs;
    const bool doubtful = redundant_.solve(ldlt_, scene_.method.floor, saddle_rhs_.data(), saddle_.data(),
                                           scene_.method.refinements,
                                           [this](std::span<const double> left) { return rows_hold(left); });
    if (doubtful && !composed_) find_contradiction();  // a composition starts with lengths that agree
    for (std::size_t k = 0; k < row_.size(); ++k)
        link_[k].lambda = redundant_.finite() ? -saddle_[ldlt_.offset(row_blocks_[k].row)]
                                              : std::numeric_limits<double>::quiet_NaN();
}

/// Whether every row holds to rounding: of the speeds in the system, and of a length in a step.
bool ParticleSystem::rows_hold(std::span<const double> residuals) const {
    double speed = 0.0, left = 0.0, resolution = 0.0;
    for (std::size_t node = 0; node < v_.size(); ++node) {
        if (block_of_node_[node] < 0) continue;
        const Vec3 change = vec_at(saddle_.data() + ldlt_.offset(block_of_node_[node]));
        speed = std::max({speed, norm(v_[node]), norm(kick_[node]), norm(change)});
    }
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const double residual = std::fabs(residuals[ldlt_.offset(row_blocks_[k].row)]);
        if (!(residual <= left)) left = residual;
        speed = std::max(speed, std::fabs(link_[k].rhs));
        resolution = std::max(resolution, row_[k].violation_gain * row_[k].rest);
    }
    return left <= 1e-13 * speed + 1e-15 * resolution;
}

/// Redundant rows agree with the others but for the curvature of their motion, which a linearised step leaves as
/// violation: a few times (h v)²/l. Rows that cannot hold together keep a residual of the size of the speeds they ask
/// for, and larger than that.
void ParticleSystem::find_contradiction() {
    const std::vector<double>& residuals = redundant_.residual(ldlt_, saddle_rhs_.data(), saddle_.data());
    double speed = 0.0, largest = 0.0, curved = 0.0;
    std::size_t worst = 0;
    for (const Vec3& kick : kick_) speed = std::max(speed, norm(kick));
    for (std::size_t k = 0; k < row_.size(); ++k) {
        speed = std::max(speed, std::fabs(link_[k].rhs));
        const Vec3 moved = h_ * (v_[row_[k].b] - v_[row_[k].a]);
        const double unseen = 1e-9 * row_[k].rest + 10.0 * curvature(link_[k].u, link_[k].length, moved);
        curved = std::max(curved, row_[k].violation_gain * unseen);
        const double residual = std::fabs(residuals[ldlt_.offset(row_blocks_[k].row)]);
        if (residual <= largest) continue;
        largest = residual;
        worst = k;
    }
    if (!(largest > 1e-3 * speed && largest > curved)) return;
    const int second = body_of_node_[row_[worst].b];
    contradicted_ = second >= 0 ? second : body_of_node_[row_[worst].a];
}

}  // namespace spook
