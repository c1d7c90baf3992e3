// In which order the links of locked bodies are taken, and whether they are a tree at all.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "rigid/locked_tree.hpp"

namespace spook {

namespace {

constexpr int none = -1;

bool moves(std::span<const BodyConstants> constants, int body) noexcept {
    return body >= 0 && constants[body].moves();
}

/// A lock as one of its bodies, the child, sees it.
struct Edge {
    int joint, other;
    bool child_is_first;
};

/// Of every body. Refuses a joint that is no lock, or one whose coefficients depend on the direction.
Refusal find_edges(std::span<const BodyConstants> constants, const JointSet& joints,
                   std::vector<std::vector<Edge>>& edges) {
    for (const JointBlock& block : joints.blocks()) {
        const JointConstants& joint = joints.constants(block.joint);
        if (block.axial || joint.kind != JointKind::lock || block.first == block.second)
            return "some joint is no lock";
        for (int body : {block.first, block.second})
            if (moves(constants, body) && constants[body].particle) return "some body cannot turn";
        for (int i = 1; i < 6; ++i) {
            if (i != 3 && !(joints.law(block.joint, i) == joints.law(block.joint, i - 1)))
                return "some lock gives way otherwise in one direction than in another";
        }
        if (moves(constants, block.first)) edges[block.first].push_back({block.joint, block.second, true});
        if (moves(constants, block.second)) edges[block.second].push_back({block.joint, block.first, false});
    }
    return nullptr;
}

/// Every tree from its root on: what is held by the world, or the first of a floating one.
struct Forest {
    explicit Forest(std::size_t bodies)
        : parent(bodies, none), hold(bodies, {none, none, false}), children(bodies), seen(bodies, 0) {}

    std::vector<int> order, parent;          // parent: a body that moves
    std::vector<Edge> hold;                  // to its parent, or of a root to what does not move
    std::vector<std::vector<int>> children;  // the heaviest first, with all that they hold
    std::vector<std::uint8_t> seen;

    /// False if two ways lead from body to body, or to what does not move.
    bool grow(std::span<const BodyConstants> constants, const std::vector<std::vector<Edge>>& edges,
              std::span<const int> tied) {
        for (const bool held : {true, false})
            for (int body : tied) {
                if (seen[body]) continue;
                for (const Edge& edge : edges[body])
                    if (!moves(constants, edge.other) && hold[body].joint < 0) hold[body] = edge;
                if (held && hold[body].joint < 0) continue;
                if (!walk(constants, edges, body)) return false;
            }
        return true;
    }

    /// The heaviest branch last of all.
    std::vector<int> heaviest_last() {
        std::vector<int> weight(parent.size(), 1), roots, found, stack;
        for (auto body = order.rbegin(); body != order.rend(); ++body) {
            if (parent[*body] < 0) {
                roots.push_back(*body);
                continue;
            }
            weight[parent[*body]] += weight[*body];
            children[parent[*body]].push_back(*body);
        }
        for (int root : roots) {
            stack.push_back(root);
            while (!stack.empty()) {
                const int body = stack.back();
                stack.pop_back();
                found.push_back(body);
                std::vector<int>& mine = children[body];
                std::stable_sort(mine.begin(), mine.end(),
                                 [&](int a, int b) { return weight[a] > weight[b]; });
                stack.insert(stack.end(), mine.begin(), mine.end());
            }
        }
        return found;
    }

private:
    bool walk(std::span<const BodyConstants> constants, const std::vector<std::vector<Edge>>& edges,
              int root) {
        std::vector<int> queue{root};
        seen[root] = 1;
        for (std::size_t at = 0; at < queue.size(); ++at) {
            const int body = queue[at];
            for (const Edge& edge : edges[body]) {
                if (edge.joint == hold[body].joint) continue;
                if (!moves(constants, edge.other) || seen[edge.other]) return false;
                seen[edge.other] = 1;
                parent[edge.other] = body;
                hold[edge.other] = {edge.joint, body, !edge.child_is_first};
                queue.push_back(edge.other);
            }
        }
        order.insert(order.end(), queue.begin(), queue.end());
        return true;
    }
};

}  // namespace

Refusal LockedTree::analyse(std::span<const BodyConstants> constants, const JointSet& joints,
                            std::span<const int> tied) {
    std::vector<std::vector<Edge>> edges(constants.size());
    Forest forest(constants.size());
    if (const Refusal refusal = find_edges(constants, joints, edges)) return refusal;
    if (!forest.grow(constants, edges, tied)) return "locks close a loop";
    // Leaves first, the heaviest branch first of all: what waits for the others is then never much.
    std::vector<int> order = forest.heaviest_last();
    std::reverse(order.begin(), order.end());
    const int count = static_cast<int>(order.size());
    std::vector<int> link_of(constants.size(), none);
    for (int k = 0; k < count; ++k) link_of[order[k]] = k;
    links_.assign(order.size(), {});
    holds_.assign(order.size(), {});
    std::vector<std::uint8_t> waits_for(constants.size(), 0);
    std::size_t depth = 0, deepest = 0;
    operations_ = 0;
    gains_.clear();
    for (int k = 0; k < count; ++k) {
        Link& link = links_[k];
        link.body = order[k];
        link.mass = constants[link.body].mass;
        const std::size_t carried = forest.children[link.body].size();
        link.leaf = carried == 0;
        link.takes = carried > 1;
        if (link.takes) --depth;
        operations_ += 2;
        const Edge& edge = forest.hold[link.body];
        if (edge.joint < 0) continue;
        const JointConstants& joint = joints.constants(edge.joint);
        holds_[k] = {edge.joint, edge.other, edge.child_is_first,
                     edge.child_is_first ? joint.first_arm : joint.second_arm,
                     edge.child_is_first ? joint.second_arm : joint.first_arm};
        link.gain = gain_of(joints, edge.joint);
        operations_ += 1;
        const int parent = forest.parent[link.body];
        if (parent < 0) continue;
        link.parent = link_of[parent];
        if (link.parent == k + 1) continue;
        // The first of several children opens a place, the others add to it.
        link.next = waits_for[parent] ? Link::joins : Link::waits;
        waits_for[parent] = 1;
        if (link.next == Link::waits) deepest = std::max(deepest, ++depth);
    }
    waiting_.resize(deepest);
    works_.assign(links_.size(), {});
    return nullptr;
}

/// The place of a lock's coefficients among those of all; neighbours of equal ones share it.
int LockedTree::gain_of(const JointSet& joints, int joint) {
    const JointSet::RowLaw along = joints.law(joint, 0), about = joints.law(joint, 3);
    const Gain gain{
        {along.upsilon, about.upsilon}, {along.violation, about.violation}, {along.softness, about.softness}};
    if (gains_.empty() || !(gains_.back() == gain)) gains_.push_back(gain);
    return static_cast<int>(gains_.size()) - 1;
}

}  // namespace spook
