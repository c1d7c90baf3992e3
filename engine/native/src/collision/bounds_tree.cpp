#include "collision/bounds_tree.hpp"

#include <algorithm>
#include <numeric>

namespace spook {

namespace {

constexpr int leaf = 4;

}  // namespace

void BoundsTree::build(std::vector<Bounds> bounds) {
    bounds_ = std::move(bounds);
    order_.resize(bounds_.size());
    std::iota(order_.begin(), order_.end(), 0);
    nodes_.clear();
    if (!bounds_.empty()) split(0, static_cast<int>(bounds_.size()));
}

int BoundsTree::split(int begin, int end) {
    const auto of = [this](int k) -> const Bounds& {
        return bounds_[static_cast<std::size_t>(order_[static_cast<std::size_t>(k)])];
    };
    Bounds box = of(begin);
    for (int k = begin + 1; k < end; ++k)
        for (int i = 0; i < 3; ++i) {
            box.low[i] = std::min(box.low[i], of(k).low[i]);
            box.high[i] = std::max(box.high[i], of(k).high[i]);
        }
    const int here = static_cast<int>(nodes_.size());
    nodes_.push_back({box, begin, end, -1});
    if (end - begin <= leaf) return here;
    const Vec3 size = box.high - box.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const int middle = begin + (end - begin) / 2;
    const auto place = [this, axis](int k) {
        const Bounds& b = bounds_[static_cast<std::size_t>(k)];
        return b.low[axis] + b.high[axis];
    };
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](int a, int b) { return place(a) < place(b) || (place(a) == place(b) && a < b); });
    split(begin, middle);
    const int right = split(middle, end);
    nodes_[static_cast<std::size_t>(here)].right = right;
    return here;
}

void BoundsTree::overlapping(const Bounds& box, std::vector<int>& out) const {
    if (nodes_.empty()) return;
    int waiting[64], count = 0;
    waiting[count++] = 0;
    while (count > 0) {
        const int here = waiting[--count];
        const Node& node = nodes_[static_cast<std::size_t>(here)];
        if (!overlap(node.box, box)) continue;
        if (node.right >= 0) {
            waiting[count++] = node.right;
            waiting[count++] = here + 1;
            continue;
        }
        for (int k = node.begin; k < node.end; ++k) {
            const int index = order_[static_cast<std::size_t>(k)];
            if (overlap(bounds_[static_cast<std::size_t>(index)], box)) out.push_back(index);
        }
    }
}

}  // namespace spook
