// Finds out whether the distance rows form open paths: chains without branches and without loops.
#pragma once

#include <vector>

#include "particles/particle_scene.hpp"

namespace spook {

/// Nodes of a path in order: body index, or −1 − (2 row + end) for that row's own world point.
/// rows[k] joins nodes[k] and nodes[k + 1].
struct Path {
    std::vector<int> nodes, rows;
};

/// The open paths in the order of their lowest row, or nothing if a body has three rows or a loop closes.
/// Every row is in exactly one path; bodies without rows are in none.
inline std::vector<Path> find_paths(const ParticleScene& scene) {
    const int rows = static_cast<int>(scene.rows.size());
    std::vector<std::vector<int>> of_body(scene.bodies.size());
    for (int row = 0; row < rows; ++row)
        for (const End& end : scene.rows[row].ends)
            if (end.body >= 0) of_body[end.body].push_back(row);
    for (const auto& list : of_body)
        if (list.size() > 2) return {};
    std::vector<char> done(scene.rows.size(), 0);
    std::vector<Path> paths;
    // From `row`, leaving through its end `side`, to the end of the path; returns the last row and side.
    const auto walk = [&](int row, int side, Path* path) {
        for (int travelled = 0; travelled <= rows; ++travelled) {
            const int body = scene.rows[row].ends[side].body;
            if (path) {
                done[row] = 1;
                path->rows.push_back(row);
                path->nodes.push_back(body >= 0 ? body : -1 - (2 * row + side));
            }
            if (body < 0 || of_body[body].size() < 2) return std::pair{row, side};
            const int next = of_body[body][0] == row ? of_body[body][1] : of_body[body][0];
            side = scene.rows[next].ends[0].body == body ? 1 : 0;
            row = next;
        }
        return std::pair{-1, 0};  // came round: a loop
    };
    for (int row = 0; row < rows; ++row) {
        if (done[row]) continue;
        const auto [first, side] = walk(row, 0, nullptr);
        if (first < 0) return {};
        Path path;
        const int body = scene.rows[first].ends[side].body;
        path.nodes.push_back(body >= 0 ? body : -1 - (2 * first + side));
        walk(first, 1 - side, &path);
        paths.push_back(std::move(path));
    }
    return paths;
}

}  // namespace spook
