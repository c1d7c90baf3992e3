// In which order the links of locked bodies are taken, and whether they are a tree at all.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "rigid/joint_forest.hpp"
#include "rigid/locked_tree.hpp"

namespace spook {

namespace {

/// Refuses a joint that is no lock, or one whose coefficients depend on the direction.
Refusal refuses_joints(std::span<const BodyConstants> constants, const JointSet& joints) {
    for (const JointBlock& block : joints.blocks()) {
        if (block.axial || joints.constants(block.joint).kind != JointKind::lock ||
            block.first == block.second)
            return "some joint is no lock";
        for (int body : {block.first, block.second})
            if (body >= 0 && constants[body].moves() && constants[body].particle)
                return "some body cannot turn";
        for (int i = 1; i < 6; ++i)
            if (i != 3 && !(joints.law(block.joint, i) == joints.law(block.joint, i - 1)))
                return "some lock gives way otherwise in one direction than in another";
    }
    return nullptr;
}

}  // namespace

Refusal LockedTree::analyse(std::span<const BodyConstants> constants, const JointSet& joints,
                            std::span<const int> tied) {
    if (const Refusal refusal = refuses_joints(constants, joints)) return refusal;
    JointForest forest(constants, joints);
    if (!forest.grow(tied, [](const JointBlock&, bool) { return true; }) || forest.has_loops())
        return "locks close a loop";
    // Leaves first, the heaviest branch first of all: what waits for the others is then never much.
    std::vector<Hung> order = forest.by_branches(true);
    std::reverse(order.begin(), order.end());
    const int count = static_cast<int>(order.size());
    std::vector<int> link_of(constants.size(), -1), carries(constants.size(), 0);
    for (int k = 0; k < count; ++k) {
        link_of[order[k].body] = k;
        if (order[k].parent >= 0) ++carries[order[k].parent];
    }
    links_.assign(order.size(), {});
    holds_.assign(order.size(), {});
    std::vector<std::uint8_t> waits_for(constants.size(), 0);
    std::size_t depth = 0, deepest = 0;
    operations_ = 0;
    gains_.clear();
    for (int k = 0; k < count; ++k) {
        Link& link = links_[k];
        const auto& [body, block, parent, backwards] = order[k];
        link.body = body;
        link.mass = constants[body].mass;
        link.leaf = carries[body] == 0;
        link.takes = carries[body] > 1;
        if (link.takes) --depth;
        operations_ += 2;
        if (block < 0) continue;
        const JointBlock& edge = joints.blocks()[block];
        const JointConstants& joint = joints.constants(edge.joint);
        holds_[k] = {edge.joint, backwards ? edge.second : edge.first, backwards,
                     backwards ? joint.first_arm : joint.second_arm,
                     backwards ? joint.second_arm : joint.first_arm};
        link.gain = gain_of(joints, edge.joint);
        operations_ += 1;
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
