#include "contacts/contact_islands.hpp"

#include <algorithm>
#include <atomic>
#include <deque>
#include <exception>
#include <numeric>
#include <optional>
#include <utility>

#include "run/watch.hpp"

namespace spook {

namespace {

constexpr std::size_t few_blocks = 48;  // blocks in all: not worth other threads

}  // namespace

void add_ties(const RowBlock& block, std::vector<Islands::Tie>& ties) {
    ties.push_back({block.first, block.second});
    for (const Beyond& other : block.beyond)
        ties.push_back({std::max(block.first, block.second), other.body});
}

Islands find_islands(const MixedSystem& system) {
    std::vector<Islands::Tie> ties;
    ties.reserve(system.rows.size());
    for (const RowBlock& block : system.rows) add_ties(block, ties);
    return find_islands(static_cast<int>(system.mass.size()), ties);
}

Islands find_islands(int bodies, const std::vector<Islands::Tie>& ties) {
    std::vector<int> parent(bodies);
    std::iota(parent.begin(), parent.end(), 0);
    auto root = [&](int b) {
        while (parent[b] != b) b = parent[b] = parent[parent[b]];
        return b;
    };
    std::vector<char> has_rows(bodies, 0);
    for (const auto [first, second] : ties) {
        if (first >= 0) has_rows[first] = 1;
        if (second >= 0) has_rows[second] = 1;
        if (first < 0 || second < 0) continue;
        const int a = root(first), b = root(second);
        parent[std::max(a, b)] = std::min(a, b);  // the root is the island's first body
    }
    Islands islands;
    islands.of_body.assign(bodies, -1);
    for (int b = 0; b < bodies; ++b) {
        if (!has_rows[b]) continue;
        const int r = root(b);
        islands.of_body[b] = r == b ? islands.count++ : islands.of_body[r];
    }
    return islands;
}

/// Islands one after the other; on several threads each takes the next one that nobody has.
void IslandSolver::solve_all(std::vector<Part>& parts, const Solve& solve) const {
    std::size_t rows = 0;
    for (const Part& part : parts) rows += part.system->rows.size();
    if (team == nullptr || parts.size() == 1 || rows < few_blocks) {
        for (Part& part : parts) part.report = solve(*part.system, *part.points, *part.solver);
        return;
    }
    std::atomic<std::size_t> next{0};
    std::atomic<bool> ended{false};
    std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(team->size()) + 1);
    const auto guarded = [&](std::size_t who, const auto& work) noexcept {
        try {
            work();
        } catch (...) {
            if (!thrown[who]) thrown[who] = std::current_exception();
            ended = true;
        }
    };
    team->each(
        [&](int index) {
            guarded(static_cast<std::size_t>(index), [&] {
                std::optional<Watch::Helper> helper;
                if (index > 0) helper.emplace(ended);
                for (std::size_t k = next++; k < parts.size() && !ended; k = next++)
                    parts[k].report = solve(*parts[k].system, *parts[k].points, *parts[k].solver);
            });
        },
        [&] {
            if (!ended) guarded(static_cast<std::size_t>(team->size()), [] { Watch::look(); });
        });
    for (const std::exception_ptr& what : thrown)
        if (what) std::rethrow_exception(what);
}

FrictionReport IslandSolver::run(MixedSystem& system, std::vector<FrictionPoint>& points, const Solve& solve,
                                 const std::vector<char>* answered) {
    const Islands islands = find_islands(system);
    auto solver_of = [&](int first_body) -> DirectSolver& {
        DirectSolver& solver = solvers_[first_body];
        solver.pivot.floor = floor;
        solver.pivot.refinements = refinements;
        return solver;
    };
    if (islands.count <= 1) return solve(system, points, solver_of(0));
    std::vector<char> open(islands.count, answered == nullptr);
    for (std::size_t k = 0; answered && k < system.rows.size(); ++k)
        if (!(*answered)[k]) open[islands.of_body[std::max(system.rows[k].first, system.rows[k].second)]] = 1;

    const int bodies = static_cast<int>(system.mass.size());
    std::vector<MixedSystem> parts(islands.count);
    std::vector<std::vector<FrictionPoint>> part_points(islands.count);
    std::vector<int> first_body(islands.count, -1), place(bodies, -1), row_island(system.rows.size()),
        row_place(system.rows.size());
    std::deque<std::vector<Beyond>> beyond;  // with the places of their bodies
    system.velocity.resize(bodies);
    for (int b = 0; b < bodies; ++b) {
        const int island = islands.of_body[b];
        if (island < 0) {
            system.velocity[b] = system.momentum[b];
            solve_six(factor_six(system.mass[b]), system.velocity[b]);
            continue;
        }
        if (!open[island]) continue;
        if (first_body[island] < 0) first_body[island] = b;
        place[b] = static_cast<int>(parts[island].mass.size());
        parts[island].mass.push_back(system.mass[b]);
        parts[island].momentum.push_back(system.momentum[b]);
        parts[island].velocity.push_back(system.velocity[b]);
    }
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        const int island = islands.of_body[std::max(block.first, block.second)];
        row_island[k] = island;
        if (!open[island]) continue;
        row_place[k] = static_cast<int>(parts[island].rows.size());
        parts[island].rows.push_back(block);
        RowBlock& copy = parts[island].rows.back();
        if (copy.first >= 0) copy.first = place[copy.first];
        if (copy.second >= 0) copy.second = place[copy.second];
        if (copy.beyond.empty()) continue;
        std::vector<Beyond>& own = beyond.emplace_back(copy.beyond.begin(), copy.beyond.end());
        for (Beyond& other : own) other.body = place[other.body];
        copy.beyond = own;
    }
    for (FrictionPoint& point : points) {
        if (!open[row_island[point.block]]) {
            if (point.normal < 0.0) point.normal = system.rows[point.block].multiplier[0];
            continue;
        }
        part_points[row_island[point.block]].push_back(point);
        part_points[row_island[point.block]].back().block = row_place[point.block];
    }

    std::vector<Part> open_parts;
    for (int island = 0; island < islands.count; ++island)
        if (open[island])
            open_parts.push_back({&parts[island], &part_points[island], &solver_of(first_body[island]), {}});
    solve_all(open_parts, solve);
    FrictionReport sum;
    for (const Part& part : open_parts) {
        const FrictionReport& report = part.report;
        sum.rounds += report.rounds;
        sum.pivots += report.pivots;
        sum.sweeps += report.sweeps;
        sum.residual = std::max(sum.residual, report.residual);
        sum.converged = sum.converged && report.converged;
        sum.finite = sum.finite && report.finite;
    }
    for (int b = 0; b < bodies; ++b)
        if (islands.of_body[b] >= 0 && open[islands.of_body[b]])
            system.velocity[b] = parts[islands.of_body[b]].velocity[place[b]];
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        if (!open[row_island[k]]) continue;
        const int first = system.rows[k].first, second = system.rows[k].second;
        const std::span<const Beyond> others = system.rows[k].beyond;
        system.rows[k] = parts[row_island[k]].rows[row_place[k]];
        system.rows[k].first = first;
        system.rows[k].second = second;
        system.rows[k].beyond = others;
    }
    std::vector<std::size_t> next(islands.count, 0);
    for (FrictionPoint& point : points) {
        const int island = row_island[point.block], block = point.block;
        if (!open[island]) continue;
        point = part_points[island][next[island]++];
        point.block = block;
    }
    return sum;
}

std::map<int, Patience> IslandSolver::patience() const {
    std::map<int, Patience> found;
    for (const auto& [body, solver] : solvers_) found[body] = solver.patience;
    return found;
}

void IslandSolver::be_patient(const std::map<int, Patience>& patience) {
    for (auto& [body, solver] : solvers_) solver.patience = {};
    for (const auto& [body, known] : patience) solvers_[body].patience = known;
}

BlockLdlt::Counters IslandSolver::counters() const noexcept {
    BlockLdlt::Counters sum;
    for (const auto& [body, solver] : solvers_) {
        const BlockLdlt::Counters more = solver.pivot.counters();
        sum.factorisations += more.factorisations + solver.newton.factorisations();
        sum.block_operations += more.block_operations + solver.newton.block_operations();
        sum.floored_pivots += more.floored_pivots;
        sum.solves += more.solves;
    }
    return sum;
}

}  // namespace spook
