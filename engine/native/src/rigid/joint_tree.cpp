// Which scenes are forests of joint coordinates, and what closes their loops; see joint_tree_stage.cpp for the stages.
#include "rigid/joint_tree.hpp"

#include <algorithm>
#include <cmath>

#include "collision/rotation.hpp"
#include "rigid/joint_forest.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::joint_tree;

/// Whether the joint holds both bodies where they are at the start.
bool at_one_place(const JointConstants& joint) noexcept {
    return norm(joint.span) <= 1e-12 * (norm(joint.first_arm) + norm(joint.second_arm));
}

/// What a joint lets its bodies do. False: not known here.
bool freedom(const JointConstants& joint, bool backwards, int& turns, int& slides, Vec3* slide_axes) {
    const JointHolds holds = joint.holds;
    if (holds.rows() == 0 || holds.turning == Turning::cross) return false;
    turns = holds.turning == Turning::free ? 3 : holds.turning == Turning::swing ? 1 : 0;
    slides = 0;
    for (int k = 0; k < 3; ++k)
        if (k < holds.linear_first || k >= holds.linear_end) slide_axes[slides++] = joint.axes[k];
    // Slides are along the first body's axes, which the second carries as well if it cannot turn off them.
    const bool along_axis = slides == 0 || (holds.linear_first == 1 && turns == 1);
    return !backwards || turns == 0 || along_axis;
}

/// Whether every joint may be one of a forest or close a loop of it.
bool may_be_a_forest(std::span<const BodyConstants> constants, const JointSet& joints) noexcept {
    for (const JointBlock& block : joints.blocks()) {
        if (block.axial && block.size == 1 && block.rotor == 0) continue;
        const JointKind kind = joints.constants(block.joint).kind;
        if (block.axial || kind == JointKind::relation || kind == JointKind::wire) return false;
        for (int body : {block.first, block.second})
            if (body >= 0 && constants[body].motion == Motion::kinematic) return false;
    }
    return true;
}

}  // namespace

Refusal JointTree::analyse(std::span<const BodyConstants> constants, const JointSet& joints,
                           std::span<const int> tied, const LargeArray<BodyState>& start) {
    constants_ = constants;
    joints_ = &joints;
    coordinates_ = 0;
    plane_.clear();
    pivots_.clear();
    const Refusal refusal = attach(tied, start);
    if (refusal) coordinates_ = 0;
    else flatten(), free_pivots();
    return refusal;
}

bool JointTree::hang(std::span<const BodyConstants> constants, const JointSet& joints,
                     std::span<const int> bodies) {
    constants_ = constants;
    joints_ = &joints;
    coordinates_ = 0;
    if (!hang_up(bodies, true) || !has_all_rotors()) return false;
    const auto attaches = [](const Node& node) { return node.joint >= 0; };
    const auto holds = [](const JointBlock& block) { return !block.axial; };
    return std::count_if(nodes_.begin(), nodes_.end(), attaches) ==
           std::count_if(joints.blocks().begin(), joints.blocks().end(), holds);
}

Refusal JointTree::attach(std::span<const int> tied, const LargeArray<BodyState>& start) {
    if (!hang_up(tied, false)) return "joints do not hang up all bodies in trees";
    if (!has_all_rotors()) return "a joint that closes a loop has a rotor";
    if (!has_small_trees()) return "some tree is too large";
    if (!close(start)) return "rows that close loops are too many, or depend on each other";
    return order() ? nullptr : "its band is too wide";
}

/// The forest, its nodes by branches.
bool JointTree::hang_up(std::span<const int> tied, bool particles) {
    if (!may_be_a_forest(constants_, *joints_) || tied.size() > 2000) return false;
    JointForest forest(constants_, *joints_);
    const auto holds = [this](const JointBlock& block, bool backwards) {
        int turns = 0, slides = 0;
        Vec3 axes[3];
        const JointConstants& joint = joints_->constants(block.joint);
        return at_one_place(joint) && freedom(joint, backwards, turns, slides, axes);
    };
    if (!forest.grow(tied, holds)) return false;
    nodes_.clear();
    node_of_.assign(constants_.size(), -1);
    trees_ = 0;
    double scale = 0.0;
    for (const Hung& one : forest.by_branches(false)) {
        if (constants_[one.body].particle && (!particles || one.block >= 0)) return false;
        Node node = node_held_by(one.block, one.body);
        node.parent = one.parent < 0 ? -1 : node_of_[one.parent];
        node.tree = one.parent < 0 ? trees_++ : nodes_[static_cast<std::size_t>(node.parent)].tree;
        node.first = coordinates_;
        coordinates_ += node.coordinates();
        const Vec3 i = node.inertia;
        scale += (i.x + i.y + i.z) / 3.0 + node.mass * dot(node.arm, node.arm);
        node_of_[one.body] = static_cast<int>(nodes_.size());
        nodes_.push_back(node);
        for (int at = node_of_[one.body]; at >= 0; at = nodes_[at].parent)
            nodes_[at].end = static_cast<int>(nodes_.size());
    }
    scale_ = scale / static_cast<double>(std::max<std::size_t>(1, nodes_.size()));
    courses_.assign(nodes_.size(), Course{});
    pushes_.assign(nodes_.size(), {});
    twists_.assign(nodes_.size(), {});
    return true;
}

/// A body with its way to move: by the joint of a block, or floating (−1).
JointTree::Node JointTree::node_held_by(int block, int body) const noexcept {
    Node node;
    node.body = body;
    if (block < 0) {
        node.turns = constants_[body].particle ? 0 : 3;
        node.slides = 3;
        node.slide_axes[0] = {1, 0, 0}, node.slide_axes[1] = {0, 1, 0}, node.slide_axes[2] = {0, 0, 1};
    } else {
        const auto blocks = joints_->blocks();
        node.joint = blocks[block].joint;
        const JointConstants& joint = joints_->constants(node.joint);
        node.backwards = blocks[block].first == body;
        freedom(joint, node.backwards, node.turns, node.slides, node.slide_axes);
        node.axis = joint.axes[0];
        node.parent_arm = node.backwards ? joint.second_arm : joint.first_arm;
        node.arm = node.backwards ? joint.first_arm : joint.second_arm;
        if (const std::size_t own = static_cast<std::size_t>(block) + 1;
            own < blocks.size() && blocks[own].joint == node.joint)
            node.armature = 1.0 / blocks[own].softness[0];
    }
    const double arms = norm(node.parent_arm) + norm(node.arm);
    node.extent = arms > 0.0 ? arms : 1.0;
    node.mass = constants_[body].mass;
    node.inertia = constants_[body].inertia;
    return node;
}

/// Whether no joint that closes a loop has a rotor.
bool JointTree::has_all_rotors() const noexcept {
    const auto has_one = [](const Node& node) { return node.armature > 0.0; };
    const auto with_rotor = std::count_if(nodes_.begin(), nodes_.end(), has_one);
    return static_cast<std::size_t>(with_rotor) >= joints_->rotors().size();
}

/// Whether something moves, and no tree is dearer than rows.
bool JointTree::has_small_trees() const {
    std::vector<int> in_tree(static_cast<std::size_t>(trees_), 0);
    for (const Node& node : nodes_) in_tree[node.tree] += node.coordinates();
    const int most = has_light() ? max_coordinates_with_light : max_coordinates_per_tree;
    return coordinates_ > 0 && *std::max_element(in_tree.begin(), in_tree.end()) <= most;
}

/// Whether some body is far lighter than another.
bool JointTree::has_light() const noexcept {
    const auto [least, most] = std::minmax_element(
        nodes_.begin(), nodes_.end(), [](const Node& a, const Node& b) { return a.mass < b.mass; });
    return least != nodes_.end() && least->mass < light_mass_ratio * most->mass;
}

/// The joints that are left, and which of their rows say more than the forest does.
bool JointTree::close(const LargeArray<BodyState>& start) {
    const auto blocks = joints_->blocks();
    loops_.clear();
    ahead_ = start;
    take(start);
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const JointBlock& block = blocks[k];
        if (block.axial) continue;
        Closing loop{};
        loop.block = static_cast<int>(k);
        loop.first = block.first < 0 ? -1 : node_of_[block.first];
        loop.second = block.second < 0 ? -1 : node_of_[block.second];
        const auto is_attached = [&](int node) { return node >= 0 && nodes_[node].joint == block.joint; };
        if (is_attached(loop.first) || is_attached(loop.second) || (loop.first < 0 && loop.second < 0))
            continue;
        loop.rows = loop.kept = block.size;
        for (int i = 0; i < block.size; ++i) {
            loop.row[i] = i;
            loop.extent[i] = joints_->gain(loop.block, i).extent;
        }
        for (int node = 0; node < static_cast<int>(nodes_.size()); ++node) {
            const auto moves = [&](int end) { return end >= node && end < nodes_[node].end; };
            if (moves(loop.first) == moves(loop.second)) continue;
            for (int i = 0; i < nodes_[node].coordinates(); ++i) loop.columns.push_back({node, i});
        }
        loops_.push_back(loop);
    }
    drop_fulfilled_rows();
    rows_ = 0;
    int reduced = 0;
    for (Closing& loop : loops_) {
        loop.at = rows_;
        loop.reduced = reduced;
        rows_ += loop.kept;
        reduced += loop.kept * static_cast<int>(loop.columns.size());
    }
    if (rows_ > std::min(max_loop_rows, coordinates_ - 1)) return false;
    start_rows_.assign(static_cast<std::size_t>(reduced), 0.0);
    end_rows_ = start_rows_;
    multiplier_.assign(static_cast<std::size_t>(rows_), 0.0);
    const int unknowns = coordinates_ + rows_;
    right_.assign(static_cast<std::size_t>(unknowns), 0.0);
    step_.assign(static_cast<std::size_t>(coordinates_), 0.0);
    return independent(start);
}

/// A row is an analytic function of the joint coordinates: where it vanishes at places picked blindly it always does.
void JointTree::drop_fulfilled_rows() {
    if (loops_.empty()) return;
    constexpr int PLACES = 3;
    constexpr double GOLDEN = 0.6180339887498949;
    for (Closing& loop : loops_) loop.kept = 0;
    double number = 0.0;
    for (int round = 0; round < PLACES; ++round) {
        for (std::size_t k = 0; k < nodes_.size(); ++k) {
            const auto pick = [&number] {
                number += GOLDEN;
                number -= std::floor(number);
                return number - 0.5;
            };
            const Node& node = nodes_[k];
            const Vec3 e = node.turns == 1   ? pick() * node.axis
                           : node.turns == 3 ? Vec3{pick(), pick(), pick()}
                                             : Vec3{};
            courses_[k].moved = {std::sqrt(1.0 - dot(e, e)), e.x, e.y, e.z};
            for (int i = 0; i < node.slides; ++i) courses_[k].slid[i] = pick() * node.extent;
        }
        place();
        for (Closing& loop : loops_) {
            const JointBlock& block = joints_->blocks()[loop.block];
            double violation[6];
            joint_violation(joints_->constants(block.joint), state(block.first, ahead_),
                            state(block.second, ahead_), violation);
            for (int i = 0; i < loop.rows; ++i) {
                const bool known = std::find(loop.row, loop.row + loop.kept, i) != loop.row + loop.kept;
                if (!known && !(std::fabs(violation[i]) < 1e-12 * loop.extent[i])) loop.row[loop.kept++] = i;
            }
        }
    }
    for (Closing& loop : loops_) std::sort(loop.row, loop.row + loop.kept);
    std::erase_if(loops_, [](const Closing& loop) { return loop.kept == 0; });
}

/// Whether the rows that close loops are independent of each other at the start.
bool JointTree::independent(const LargeArray<BodyState>& start) {
    const std::size_t width = static_cast<std::size_t>(coordinates_);
    std::vector<double> known;  // orthonormal
    for (const Closing& loop : loops_) {
        double* reduced = start_rows_.data() + loop.reduced;
        LoopRows rows;
        find_rows(loop, start, rows);
        reduce(loop, rows, false, reduced);
        for (int i = 0; i < loop.kept; ++i) {
            std::vector<double> row(width, 0.0);
            for (const Closing::Column& column : loop.columns) {
                const int place = nodes_[column.node].first + column.coordinate;
                row[static_cast<std::size_t>(place)] = *reduced++;
            }
            const auto size = [&] {
                double sum = 0.0;
                for (double entry : row) sum += entry * entry;
                return std::sqrt(sum);
            };
            const double whole = size();
            for (int again = 0; again < 2; ++again)
                for (std::size_t at = 0; at < known.size(); at += width) {
                    double share = 0.0;
                    for (std::size_t j = 0; j < width; ++j) share += known[at + j] * row[j];
                    for (std::size_t j = 0; j < width; ++j) row[j] -= share * known[at + j];
                }
            const double left = size();
            if (!(left > 1e-6 * whole) || !(whole > 1e-9 * loop.extent[loop.row[i]])) return false;
            for (double entry : row) known.push_back(entry / left);
        }
    }
    return true;
}

/// Trees and loops next to each other where they meet (Cuthill and McKee 1969), so that the system is a band.
bool JointTree::order() {
    const std::size_t trees = static_cast<std::size_t>(trees_), count = trees + loops_.size();
    std::vector<std::vector<int>> met(count);
    for (std::size_t l = 0; l < loops_.size(); ++l)
        for (const Closing::Column& column : loops_[l].columns) {
            const int tree = nodes_[column.node].tree;
            if (std::find(met[trees + l].begin(), met[trees + l].end(), tree) != met[trees + l].end())
                continue;
            met[trees + l].push_back(tree);
            met[static_cast<std::size_t>(tree)].push_back(static_cast<int>(trees + l));
        }
    std::vector<char> seen(count, 0);
    const auto spread = [&](int from) {
        std::vector<int> found{from};
        std::vector<char> here(count, 0);
        here[static_cast<std::size_t>(from)] = 1;
        for (std::size_t next = 0; next < found.size(); ++next) {
            std::vector<int> around = met[static_cast<std::size_t>(found[next])];
            std::stable_sort(around.begin(), around.end(), [&](int a, int b) {
                return met[static_cast<std::size_t>(a)].size() < met[static_cast<std::size_t>(b)].size();
            });
            for (int other : around)
                if (!here[static_cast<std::size_t>(other)]) {
                    here[static_cast<std::size_t>(other)] = 1;
                    found.push_back(other);
                }
        }
        return found;
    };
    std::vector<int> first(count, 0);
    std::vector<std::vector<int>> numbers(count);  // coordinates, or rows after all coordinates
    for (const Node& node : nodes_)
        for (int i = 0; i < node.coordinates(); ++i)
            numbers[static_cast<std::size_t>(node.tree)].push_back(node.first + i);
    for (std::size_t l = 0; l < loops_.size(); ++l)
        for (int i = 0; i < loops_[l].kept; ++i)
            numbers[trees + l].push_back(coordinates_ + loops_[l].at + i);
    const int unknowns = coordinates_ + rows_;
    place_of_.assign(static_cast<std::size_t>(unknowns), 0);
    int next = 0;
    for (std::size_t from = 0; from < count; ++from) {
        if (seen[from]) continue;
        for (int one : spread(spread(static_cast<int>(from)).back())) {
            seen[static_cast<std::size_t>(one)] = 1;
            for (int number : numbers[static_cast<std::size_t>(one)])
                place_of_[static_cast<std::size_t>(number)] = next++;
        }
    }
    int reach = 0;
    const auto meet = [&](int a, int b) { reach = std::max(reach, std::abs(place_of_[a] - place_of_[b])); };
    for (std::size_t t = 0; t < trees; ++t)
        for (int a : numbers[t])
            for (int b : numbers[t]) meet(a, b);
    for (const Closing& loop : loops_)
        for (const Closing::Column& column : loop.columns)
            for (int i = 0; i < loop.kept; ++i)
                meet(nodes_[column.node].first + column.coordinate, coordinates_ + loop.at + i);
    for (Closing& loop : loops_)
        for (const Closing::Column& column : loop.columns)
            loop.places.push_back(place_of_[nodes_[column.node].first + column.coordinate]);
    system_.prepare(coordinates_ + rows_, reach);
    return reach <= (has_light() ? max_coordinates_with_light : max_bandwidth);
}

/// Takes the scene into a plane if nothing in it leaves one that two axes of the world span.
void JointTree::flatten() {
    constexpr double rounding = 4e-16;  // of a unit vector
    int normal = -1;
    for (const Node& node : nodes_)
        for (int i = 0; i < 3 && normal < 0 && node.turns == 1; ++i)
            if (std::fabs(node.axis[i]) > 0.9) normal = i;
    if (normal < 0 || !joints_->rotors().empty()) return;
    const Plane3 flat{normal};
    const auto lies = [&](Vec3 axis) { return std::fabs(axis[normal]) <= rounding; };
    const auto stands = [&](Vec3 axis) {
        return std::fabs(axis[flat.first()]) <= rounding && std::fabs(axis[flat.second()]) <= rounding;
    };
    std::vector<PlaneTree::Node> nodes;
    for (const Node& node : nodes_) {
        if (node.coordinates() != 1 || !(node.turns == 1 ? stands(node.axis) : lies(node.slide_axes[0])))
            return;
        const BodyConstants& body = constants_[node.body];
        const Vec3 axis{body.start_rotation(normal, 0), body.start_rotation(normal, 1),
                        body.start_rotation(normal, 2)};
        const Vec3 spin{body.inertia.x * axis.x, body.inertia.y * axis.y, body.inertia.z * axis.z};
        const double inertia = dot(axis, spin);
        if (!(norm(spin - inertia * axis) <= 4.0 * rounding * inertia)) return;  // it would wobble
        const Vec3 from_parent =
            node.parent < 0 ? Vec3{} : body.start - constants_[nodes_[node.parent].body].start;
        nodes.push_back({node.body, node.parent, node.end, node.slides == 1, place_of_[node.first],
                         flat(node.parent_arm), flat(node.arm), flat(node.slide_axes[0]), flat(body.start),
                         flat(from_parent), node.mass, inertia, node.extent});
    }
    std::vector<PlaneTree::Closing> closings;
    for (const Closing& loop : loops_) {
        const JointBlock& block = joints_->blocks()[loop.block];
        const JointConstants& joint = joints_->constants(block.joint);
        if (loop.kept != 2 || loop.row[1] >= joint.holds.linear() || !at_one_place(joint)) return;
        for (int r = 0; r < 2; ++r)
            if (!lies(joint.axes[joint.holds.linear_first + loop.row[r]])) return;
        const auto end = [&](int node, int body, Vec3 arm) -> PlaneTree::Closing::End {
            const Vec3 start = body < 0 ? Vec3{} : constants_[body].start;
            return {node, body, flat(arm), flat(start + arm)};
        };
        PlaneTree::Closing closing;
        closing.first = end(loop.first, block.first, joint.first_arm);
        closing.second = end(loop.second, block.second, joint.second_arm);
        closing.at = loop.at;
        for (int r = 0; r < 2; ++r) closing.places[r] = place_of_[coordinates_ + loop.at + r];
        for (const Closing::Column& column : loop.columns) {
            const Node& node = nodes_[column.node];
            closing.columns.push_back(
                {column.node, place_of_[node.first], loop.second >= column.node && loop.second < node.end});
        }
        closings.push_back(closing);
    }
    plane_.take(flat, std::move(nodes), std::move(closings), system_.reach(), scale_);
}

/// Takes bodies that only turn about a point of the world.
void JointTree::free_pivots() {
    for (const Node& node : nodes_)
        if (node.parent >= 0 || node.turns != 3 || node.slides != 0 || node.end != node_of_[node.body] + 1)
            return;
    if (!loops_.empty()) return;
    for (const Node& node : nodes_) pivots_.add(node.body, constants_[node.body], node.arm);
}

bool JointTree::holds(const LargeArray<BodyState>& bodies) {
    take(bodies);
    for (Course& motion : courses_) {
        motion.moved = {};
        motion.slid[0] = motion.slid[1] = motion.slid[2] = 0.0;
    }
    place();
    for (const Node& node : nodes_) {
        const BodyState &is = bodies[node.body], &held = ahead_[node.body];
        const Quat off = conjugate(held.turn) * is.turn;
        if (!(norm(is.displacement - held.displacement) <= 1e-9 * node.extent) ||
            !(norm({off.x, off.y, off.z}) <= 1e-9))
            return false;
    }
    return true;
}

}  // namespace spook
