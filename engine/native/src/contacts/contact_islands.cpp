#include "contacts/contact_islands.hpp"

#include <algorithm>
#include <span>

namespace spook {

IslandSolver::Own& IslandSolver::own_of(int first_body) {
    Own& own = own_[first_body];
    own.solver.pivot.floor = floor;
    own.solver.pivot.refinements = refinements;
    return own;
}

/// Fills the parts of open islands. Bodies without rows fly freely.
void IslandSolver::take_apart(MixedSystem& system, const Islands& islands,
                              std::vector<FrictionPoint>& points) {
    const int bodies = static_cast<int>(system.mass.size());
    parts_.assign(islands.count, nullptr);
    open_parts_.clear();
    place_.resize(bodies);
    system.velocity.resize(bodies);
    for (int b = 0; b < bodies; ++b) {
        const int island = islands.of_body[b];
        if (island < 0) {
            system.velocity[b] = system.momentum[b];
            solve_six(factor_six(system.mass[b]), system.velocity[b]);
            continue;
        }
        if (!open_[island]) continue;
        Own*& part = parts_[island];
        if (part == nullptr) {
            part = &own_of(b);
            open_parts_.push_back(part);
            part->points.clear();
            part->system.mass.clear(), part->system.momentum.clear();
            part->system.velocity.clear(), part->system.rows.clear();
        }
        place_[b] = static_cast<int>(part->system.mass.size());
        part->system.mass.push_back(system.mass[b]);
        part->system.momentum.push_back(system.momentum[b]);
        part->system.velocity.push_back(system.velocity[b]);
    }
    row_island_.resize(system.rows.size());
    row_place_.resize(system.rows.size());
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        const int island = islands.of(block);
        row_island_[k] = island;
        if (!open_[island]) continue;
        std::vector<RowBlock>& rows = parts_[island]->system.rows;
        row_place_[k] = static_cast<int>(rows.size());
        rows.push_back(block);
        if (block.first >= 0) rows.back().first = place_[block.first];
        if (block.second >= 0) rows.back().second = place_[block.second];
    }
    for (Own* part : open_parts_) copy_rows(*part);
    for (FrictionPoint& point : points) {
        const int island = row_island_[point.block];
        if (!open_[island]) {
            if (point.normal < 0.0) point.normal = system.rows[point.block].multiplier[0];
            continue;
        }
        parts_[island]->points.push_back(point);
        parts_[island]->points.back().block = row_place_[point.block];
    }
}

/// Gives a part its own list of the bodies beyond the first two of its rows.
void IslandSolver::copy_rows(Own& own) const {
    std::size_t count = 0;
    for (const RowBlock& block : own.system.rows) count += block.further.size();
    own.further.resize(count);
    auto at = own.further.begin();
    for (RowBlock& block : own.system.rows) {
        if (block.further.empty()) continue;
        const auto begin = at;
        for (const FurtherBody& other : block.further) *at++ = {place_[other.body], other.jacobian};
        block.further = {begin, at};
    }
}

/// Takes over what the parts have found.
void IslandSolver::put_together(MixedSystem& system, const Islands& islands,
                                std::vector<FrictionPoint>& points) {
    for (std::size_t b = 0; b < system.mass.size(); ++b)
        if (const int island = islands.of_body[b]; island >= 0 && open_[island])
            system.velocity[b] = parts_[island]->system.velocity[place_[b]];
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        if (!open_[row_island_[k]]) continue;
        const int first = system.rows[k].first, second = system.rows[k].second;
        const std::span<const FurtherBody> others = system.rows[k].further;
        system.rows[k] = parts_[row_island_[k]]->system.rows[row_place_[k]];
        system.rows[k].first = first;
        system.rows[k].second = second;
        system.rows[k].further = others;
    }
    next_.assign(islands.count, 0);
    for (FrictionPoint& point : points) {
        const int island = row_island_[point.block], block = point.block;
        if (!open_[island]) continue;
        point = parts_[island]->points[next_[island]++];
        point.block = block;
    }
}

FrictionReport IslandSolver::run(MixedSystem& system, std::vector<FrictionPoint>& points, const Solve& solve,
                                 const std::vector<char>* answered) {
    const Islands& islands = finder_.find(system);
    if (islands.count <= 1) return solve(system, points, own_of(0).solver);
    open_.assign(islands.count, answered == nullptr);
    for (std::size_t k = 0; answered && k < system.rows.size(); ++k)
        if (!(*answered)[k]) open_[islands.of(system.rows[k])] = 1;
    take_apart(system, islands, points);
    for (Own* part : open_parts_) part->report = solve(part->system, part->points, part->solver);
    FrictionReport sum;
    for (const Own* part : open_parts_) {
        const FrictionReport& report = part->report;
        sum.rounds += report.rounds;
        sum.pivots += report.pivots;
        sum.pgs_iterations += report.pgs_iterations;
        sum.residual = std::max(sum.residual, report.residual);
        sum.converged = sum.converged && report.converged;
        sum.finite = sum.finite && report.finite;
    }
    put_together(system, islands, points);
    return sum;
}

void IslandSolver::backoff(BackoffOf& found) const {
    found.clear();
    for (const auto& [body, own] : own_) found.emplace_back(body, own.solver.backoff);
}

void IslandSolver::set_backoff(const BackoffOf& backoff) {
    for (auto& [body, own] : own_) own.solver.backoff = {};
    for (const auto& [body, known] : backoff) own_[body].solver.backoff = known;
}

BlockLdlt::Counters IslandSolver::counters() const noexcept {
    BlockLdlt::Counters sum;
    for (const auto& [body, own] : own_) {
        sum.add(own.solver.pivot.counters());
        sum.factorisations += own.solver.newton.factorisations();
        sum.block_operations += own.solver.newton.block_operations();
    }
    return sum;
}

}  // namespace spook
