// In which order the rows of a mechanism in a plane are eliminated, and where they meet.
#include <algorithm>
#include <numeric>
#include <utility>

#include "rigid/plane_step.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::plane_step_order;

/// Joints that follow each other along the mechanism have their rows near each other: Cuthill and McKee's order. False if
/// the envelope is too wide all the same.
bool PlaneStep::order_rows(const JointSet& joints) {
    const int count = static_cast<int>(joints_.size()), fixed = static_cast<int>(nodes_.size()) - 1;
    std::vector<std::vector<int>> at(nodes_.size());
    for (int k = 0; k < count; ++k)
        for (const int node : {joints_[k].first, joints_[k].second})
            if (node != fixed) at[node].push_back(k);
    const auto degree = [&](int k) {
        std::size_t sum = 0;
        for (const int node : {joints_[k].first, joints_[k].second})
            if (node != fixed) sum += at[node].size();
        return sum;
    };
    std::vector<int> order, free(static_cast<std::size_t>(count));
    std::vector<char> met(static_cast<std::size_t>(count), 0);
    std::iota(free.begin(), free.end(), 0);
    const auto lighter = [&](int a, int b) { return degree(a) < degree(b); };
    std::stable_sort(free.begin(), free.end(), lighter);
    for (const int begin : free) {
        if (met[begin]) continue;
        met[begin] = 1;
        order.push_back(begin);
        for (std::size_t next = order.size() - 1; next < order.size(); ++next) {
            std::vector<int> around;
            for (const int node : {joints_[order[next]].first, joints_[order[next]].second})
                if (node != fixed)
                    for (const int k : at[node])
                        if (!met[k]) met[k] = 1, around.push_back(k);
            std::stable_sort(around.begin(), around.end(), lighter);
            order.insert(order.end(), around.begin(), around.end());
        }
    }
    std::vector<Joint> sorted;
    std::vector<Row> rows;
    for (auto k = order.rbegin(); k != order.rend(); ++k) {
        Joint joint = joints_[*k];
        const int size = joint.linear + (joint.sense != 0.0 ? 1 : 0), from = joint.row;
        joint.row = static_cast<int>(rows.size());
        rows.insert(rows.end(), rows_.begin() + from, rows_.begin() + from + size);
        joint_at_[joint.joint] = static_cast<int>(sorted.size());
        sorted.push_back(joint);
    }
    joints_ = std::move(sorted);
    rows_ = std::move(rows);

    return place_rows(joints);
}

/// Where the rows stand in the envelope, and which of them meet on a body that moves. False if it is too wide.
bool PlaneStep::place_rows(const JointSet& joints) {
    const int count = static_cast<int>(joints_.size()), n = static_cast<int>(rows_.size());
    std::vector<std::vector<std::pair<int, int>>> at(nodes_.size() - 1);  // joints, which end
    const auto end_of = [this](int k) {
        return k + 1 < static_cast<int>(joints_.size()) ? joints_[k + 1].row : static_cast<int>(rows_.size());
    };
    first_.assign(rows_.size(), n), start_.assign(rows_.size(), 0);
    int size = 0;
    for (int k = 0; k < count; ++k) {
        int first = joints_[k].row;
        for (const int end : {0, 1}) {
            const int node = end ? joints_[k].second : joints_[k].first;
            if (node == static_cast<int>(at.size())) continue;
            at[node].emplace_back(k, end);
            first = std::min(first, joints_[at[node].front().first].row);
        }
        for (int r = joints_[k].row; r < end_of(k); ++r) {
            first_[r] = first;
            start_[r] = size - first;
            size += r - first + 1;
        }
    }
    if (n == 0 || static_cast<std::size_t>(size) > max_mean_width * rows_.size()) return false;
    std::vector<std::pair<int, int>> met;
    couplings_.clear();
    for (const auto& ends : at)
        for (std::size_t one = 0; one < ends.size(); ++one)
            for (std::size_t two = 0; two <= one; ++two) {
                const auto [k, end] = ends[one];
                const auto [j, other] = ends[two];
                met.emplace_back(k, j);
                for (int r = joints_[k].row; r < end_of(k); ++r)
                    for (int s = joints_[j].row; s < end_of(j) && s <= r; ++s)
                        couplings_.push_back({start_[r] + s, 2 * r + end, 2 * s + other});
            }
    std::stable_sort(couplings_.begin(), couplings_.end(),
                     [](const Coupling& a, const Coupling& b) { return a.to < b.to; });
    std::sort(met.begin(), met.end());
    blocks_ = static_cast<std::uint64_t>(std::unique(met.begin(), met.end()) - met.begin());
    blank_.assign(static_cast<std::size_t>(size), 0.0);
    for (int r = 0; r < n; ++r) blank_[start_[r] + r] = joints.law(rows_[r].joint, rows_[r].index).softness;
    envelope_ = blank_;
    levers_.assign(2 * rows_.size(), {}), shares_.assign(2 * rows_.size(), {});
    inverse_.assign(rows_.size(), 0.0), multiplier_ = right_ = asked_ = inverse_;
    violation_ = rate_ = last_violation_ = first_asked_ = ahead_ = inverse_;
    softness_.clear();
    for (const Row& row : rows_) softness_.push_back(joints.law(row.joint, row.index).softness);
    for (int k = 0; k < count; ++k) joints_[k].end = end_of(k);
    return true;
}

}  // namespace spook
