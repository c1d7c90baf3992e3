#include "rigid/joint_forest.hpp"

#include <algorithm>

namespace spook {

JointForest::JointForest(std::span<const BodyConstants> constants, const JointSet& joints)
    : constants_(constants),
      joints_(joints),
      held_by_(constants.size() + 1),
      place_(constants.size(), -1),
      floats_(constants.size(), 0) {
    const auto blocks = joints.blocks();
    for (int k = 0; k < static_cast<int>(blocks.size()); ++k) {
        if (blocks[k].axial) continue;
        for (const bool backwards : {false, true}) {
            const int holder = backwards ? blocks[k].second : blocks[k].first,
                      body = backwards ? blocks[k].first : blocks[k].second;
            if (!moves(body)) continue;
            const int parent = moves(holder) ? holder : -1;
            (parent < 0 ? held_by_.back() : held_by_[parent]).push_back({body, k, parent, backwards});
        }
    }
}

bool JointForest::grow(std::span<const int> tied, const Holds& holds) {
    hang_on(held_by_.back(), holds);
    follow(holds);
    for (const int body : tied) {
        if (place_[body] >= 0) continue;
        take({body, -1, -1, false});
        follow(holds);
    }
    if (found_.size() != tied.size()) return false;
    for (const Hung& held : held_by_.back())  // by a joint that does not do, perhaps
        if (floats_[held.body]) return false;
    return true;
}

void JointForest::take(const Hung& one) {
    place_[one.body] = static_cast<int>(found_.size());
    floats_[one.body] = one.parent < 0 ? one.block < 0 : floats_[one.parent];
    found_.push_back(one);
}

void JointForest::follow(const Holds& holds) {
    for (; next_ < found_.size(); ++next_) hang_on(held_by_[found_[next_].body], holds);
}

void JointForest::hang_on(const std::vector<Hung>& candidates, const Holds& holds) {
    for (const Hung& one : candidates)
        if (place_[one.body] < 0 && holds(joints_.blocks()[one.block], one.backwards)) take(one);
}

std::vector<Hung> JointForest::by_branches(bool heaviest_last) const {
    const std::size_t count = found_.size();
    std::vector<int> weight(count, 1);
    std::vector<std::vector<int>> held(count + 1);  // by each; the last ones by nothing
    for (std::size_t k = count; k-- > 0;)
        if (found_[k].parent >= 0) weight[place_[found_[k].parent]] += weight[k];
    for (std::size_t k = 0; k < count; ++k)
        held[found_[k].parent < 0 ? count : place_[found_[k].parent]].push_back(static_cast<int>(k));
    std::vector<Hung> order;
    std::vector<int> stack(held[count].rbegin(), held[count].rend());
    while (!stack.empty()) {
        const int at = stack.back();
        stack.pop_back();
        order.push_back(found_[at]);
        if (heaviest_last)
            std::stable_sort(held[at].begin(), held[at].end(),
                             [&](int a, int b) { return weight[a] < weight[b]; });
        stack.insert(stack.end(), held[at].rbegin(), held[at].rend());
    }
    return order;
}

bool JointForest::has_loops() const noexcept {
    const auto blocks = joints_.blocks();
    const auto joins = [this](const JointBlock& block) {
        return !block.axial && (moves(block.first) || moves(block.second));
    };
    return std::ranges::count_if(blocks, joins) !=
           std::ranges::count_if(found_, [](const Hung& one) { return one.block >= 0; });
}

}  // namespace spook
