// Bodies hung up by their joints. Trees of locks (locked_tree.hpp) and joint coordinates (joint_tree.hpp) are eliminated in its order.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "rigid/joint_set.hpp"

namespace spook {

/// A body, with the block of the joint that holds it (−1: it floats) to another (−1: to what does not move by itself).
struct Hung {
    int body, block, parent;
    bool backwards;  // the body is the joint's first
};

/// Every body as near to what does not move as it can be.
class JointForest {
public:
    JointForest(std::span<const BodyConstants> constants, const JointSet& joints);

    /// By the joints that can hold their second body (`backwards`: their first) to the other. What nothing holds to the world
    /// floats with the first of its bodies. False if bodies `tied` are not all taken so.
    using Holds = std::function<bool(const JointBlock&, bool backwards)>;
    bool grow(std::span<const int> tied, const Holds& holds);
    /// By breadth: parents stand first.
    std::span<const Hung> by_breadth() const noexcept { return found_; }
    /// One branch after the other, parents first; `heaviest_last`: from every body, the one that holds the most comes last.
    std::vector<Hung> by_branches(bool heaviest_last) const;
    /// Whether some joint closes a loop.
    bool has_loops() const noexcept;

private:
    bool moves(int body) const noexcept { return body >= 0 && constants_[body].moves(); }
    void take(const Hung& one);
    void follow(const Holds& holds);
    void hang_on(const std::vector<Hung>& candidates, const Holds& holds);

    std::span<const BodyConstants> constants_;
    const JointSet& joints_;
    std::vector<std::vector<Hung>> held_by_;  // per body; the last one: by what does not move
    std::vector<int> place_;                  // of a body in found_
    std::vector<char> floats_;                // per body: with its tree
    std::vector<Hung> found_;
    std::size_t next_ = 0;
};

}  // namespace spook
