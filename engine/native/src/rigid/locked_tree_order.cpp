// In which order the links of locked bodies are taken, and whether they are a tree at all.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "rigid/locked_tree.hpp"

namespace spook {

bool LockedTree::analyse(std::span<const BodyConstants> constants, const JointSet& joints,
                         std::span<const int> tied) {
    const auto blocks = joints.blocks();
    const int bodies = static_cast<int>(constants.size()), none = -1;
    const auto moves = [&](int body) { return body >= 0 && constants[body].moves(); };
    struct Edge {
        int joint, other;
        bool child_is_first;
    };
    std::vector<std::vector<Edge>> edges(bodies);
    for (const JointBlock& block : blocks) {
        const JointConstants& joint = joints.constants(block.joint);
        if (block.axial || joint.kind != JointKind::lock || block.first == block.second) return false;
        for (int body : {block.first, block.second})
            if (moves(body) && constants[body].particle) return false;
        for (int i = 1; i < 6; ++i) {
            if (i != 3 && !(joints.law(block.joint, i) == joints.law(block.joint, i - 1))) return false;
        }
        if (moves(block.first)) edges[block.first].push_back({block.joint, block.second, true});
        if (moves(block.second)) edges[block.second].push_back({block.joint, block.first, false});
    }

    // Every tree from its root on: what is held by the world, or the first of a floating one.
    std::vector<int> parent(bodies, none), order, joint_of(bodies, none), other_of(bodies, none);
    std::vector<std::uint8_t> seen(bodies, 0), first(bodies, 0);
    const auto walk = [&](int root) {
        std::vector<int> queue{root};
        seen[root] = 1;
        for (std::size_t at = 0; at < queue.size(); ++at) {
            const int body = queue[at];
            for (const Edge& edge : edges[body]) {
                if (edge.joint == joint_of[body]) continue;
                if (!moves(edge.other) || seen[edge.other]) return false;
                seen[edge.other] = 1;
                parent[edge.other] = body;
                joint_of[edge.other] = edge.joint;
                other_of[edge.other] = body;
                first[edge.other] = !edge.child_is_first;
                queue.push_back(edge.other);
            }
        }
        order.insert(order.end(), queue.begin(), queue.end());
        return true;
    };
    for (const bool held : {true, false})
        for (int body : tied) {
            if (seen[body]) continue;
            for (const Edge& edge : edges[body])
                if (!moves(edge.other) && joint_of[body] < 0)
                    joint_of[body] = edge.joint, other_of[body] = edge.other,
                    first[body] = edge.child_is_first;
            if (held && joint_of[body] < 0) continue;
            if (!walk(body)) return false;
        }

    // Leaves first, the heaviest branch first of all: what waits for the others is then never much.
    std::vector<int> weight(bodies, 1);
    std::vector<std::vector<int>> children(bodies);
    std::vector<int> roots;
    for (auto body = order.rbegin(); body != order.rend(); ++body) {
        if (parent[*body] < 0) {
            roots.push_back(*body);
            continue;
        }
        weight[parent[*body]] += weight[*body];
        children[parent[*body]].push_back(*body);
    }
    std::vector<int> preorder, stack;
    for (int root : roots) {
        stack.push_back(root);
        while (!stack.empty()) {
            const int body = stack.back();
            stack.pop_back();
            preorder.push_back(body);
            std::vector<int>& mine = children[body];
            std::stable_sort(mine.begin(), mine.end(), [&](int a, int b) { return weight[a] > weight[b]; });
            stack.insert(stack.end(), mine.begin(), mine.end());
        }
    }
    std::vector<int> link_of(bodies, none);
    const int count = static_cast<int>(preorder.size());
    for (int k = 0; k < count; ++k) link_of[preorder[count - 1 - k]] = k;
    links_.assign(preorder.size(), {});
    holds_.assign(preorder.size(), {});
    std::vector<std::uint8_t> waits_for(bodies, 0);
    std::size_t depth = 0, deepest = 0;
    operations_ = 0;
    gains_.clear();
    for (int k = 0; k < count; ++k) {
        Link& link = links_[k];
        link.body = preorder[count - 1 - k];
        link.mass = constants[link.body].mass;
        Hold& hold = holds_[k];
        hold.joint = joint_of[link.body];
        link.leaf = children[link.body].empty();
        link.takes = children[link.body].size() > 1;
        if (link.takes) --depth;
        operations_ += 2;
        if (hold.joint < 0) continue;
        const JointConstants& joint = joints.constants(hold.joint);
        hold.child_is_first = first[link.body] != 0;
        hold.arm = hold.child_is_first ? joint.first_arm : joint.second_arm;
        hold.other_arm = hold.child_is_first ? joint.second_arm : joint.first_arm;
        const JointSet::RowLaw along = joints.law(hold.joint, 0), about = joints.law(hold.joint, 3);
        const Gain gain{{along.upsilon, about.upsilon},
                        {along.violation, about.violation},
                        {along.softness, about.softness}};
        if (gains_.empty() || !(gains_.back() == gain)) gains_.push_back(gain);
        link.gain = static_cast<int>(gains_.size()) - 1;
        hold.other = other_of[link.body];
        operations_ += 1;
        if (parent[link.body] < 0) continue;
        link.parent = link_of[parent[link.body]];
        if (link.parent == k + 1) continue;
        // The first of several children opens a place, the others add to it.
        link.next = waits_for[parent[link.body]] ? Link::joins : Link::waits;
        waits_for[parent[link.body]] = 1;
        if (link.next == Link::waits) deepest = std::max(deepest, ++depth);
    }
    waiting_.resize(deepest);
    works_.assign(links_.size(), {});
    return true;
}

}  // namespace spook
