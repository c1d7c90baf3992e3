// A tree over boxes that stay where they are: which of them does another overlap?
#pragma once

#include <vector>

#include "collision/bounds.hpp"

namespace spook {

class BoundsTree {
public:
    void build(std::vector<Bounds> bounds);
    /// Appends the indices of all that overlap `box`, in no particular order.
    void overlapping(const Bounds& box, std::vector<int>& out) const;

private:
    struct Node {
        Bounds box;
        int begin, end;  // in order_
        int right;       // the left one follows; none: a leaf
    };
    int split(int begin, int end);

    std::vector<Bounds> bounds_;
    std::vector<int> order_;
    std::vector<Node> nodes_;
};

}  // namespace spook
