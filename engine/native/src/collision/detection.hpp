// The collision stage: from where the bodies stand to the list of contact points.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/bounds_tree.hpp"
#include "collision/broad_phase.hpp"
#include "collision/manifold.hpp"
#include "collision/shape.hpp"
#include "linear/shared_values.hpp"

namespace spook {

/// One primitive of a body; a compound gives several.
struct Collider {
    int body = 0;
    Primitive shape;
    Pose part;  // in body axes
    struct View;
};

/// The same as it is kept: its body, and a form that it may share with others.
struct Collider::View {
    int body;
    const Primitive& shape;
    const Pose& part;
};

constexpr int feature_bits = 16,
              collider_bits = 24;  // of a contact's key: the pair's colliders, then the feature

inline std::uint64_t pair_of(IndexPair pair) noexcept {
    return (static_cast<std::uint64_t>(pair.first) << collider_bits) |
           static_cast<std::uint64_t>(pair.second);
}

/// One contact point between two bodies; the normal points from second to first.
struct Contact {
    int first = 0, second = 0;  // body indices, first < second
    ContactPoint point;
    std::uint64_t key = 0;  // colliders and feature: the same point has the same key from step to step
};

inline std::uint64_t pair_of(const Contact& contact) noexcept { return contact.key >> feature_bits; }

/// The colliders of a contact.
inline IndexPair colliders_of(const Contact& contact) noexcept {
    constexpr std::uint64_t second = (std::uint64_t{1} << collider_bits) - 1;
    const std::uint64_t pair = pair_of(contact);
    return {static_cast<int>(pair >> collider_bits), static_cast<int>(pair & second)};
}

/// Finds contacts among a fixed set of colliders. Pairs of one body, pairs in which neither body is dynamic and
/// excluded pairs never touch; a dynamic body that sleeps counts as one that is not, but for those told to stir.
class Detection {
public:
    /// `dynamic` has one entry per body; `excluded` lists pairs of body indices in either order.
    Detection(std::vector<Collider> colliders, const std::vector<char>& dynamic,
              const std::vector<IndexPair>& excluded);

    /// Whether any pair of colliders could ever touch; if not, the stage can be left out.
    bool possible() const noexcept { return possible_; }

    /// Replaces `out` by all points with a gap of at most margin[first] + margin[second] [m], in ascending order
    /// of key (so by body, collider and feature). `bodies` and `margin` have one entry per body.
    void detect(const std::vector<Pose>& bodies, const std::vector<double>& margin,
                std::vector<Contact>& out);

    /// The same in two calls, for a stage that looks at pairs: the colliders that may come as near as that, as
    /// indices (i, j), i < j, in ascending order; then the points of one pair, in order of feature.
    const std::vector<IndexPair>& near(const std::vector<Pose>& bodies, const std::vector<double>& margin);
    /// The same of these bodies alone, whose margins have grown since; at a cost proportional to all for each of them.
    /// False if that does not do and near() is to be asked again.
    bool near_again(const std::vector<int>& grown, const std::vector<double>& margin,
                    std::vector<IndexPair>& out);
    void collide_pair(IndexPair pair, double margin, std::vector<Contact>& out) const;
    /// As collide_pair(), with the bodies of the pair elsewhere.
    void collide_pair(IndexPair pair, const Pose& first, const Pose& second, double margin,
                      std::vector<Contact>& out) const;
    Collider::View collider(int index) const noexcept {
        return {body_of_[index], forms_[index].shape, forms_[index].part};
    }
    /// Where a collider stood in the last near(), world axes.
    const Pose& pose(int index) const noexcept { return poses_[index]; }
    /// Of a collider, see turning_arm().
    double arm(int index) const noexcept { return arms_[index]; }

    /// Largest distance [m] of any surface of a body from its centre; 0 without a bounded shape.
    const std::vector<double>& radius() const noexcept { return radius_; }

    /// A dynamic body sleeps, or is awake again.
    void set_asleep(int body, bool asleep) noexcept { role_[body] = asleep ? sleeps : awake; }
    bool is_asleep(int body) const noexcept { return role_[body] == sleeps; }
    /// A body that moves as it is told does so, or stands still: then no sleeper need be told from it.
    void mark_moving(int body, bool moves) noexcept { role_[body] = moves ? is_moving : none; }

    /// Per body: whether a sphere round its centre is all its surface, so that its orientation does not matter.
    std::vector<char> balls() const;

    /// Whether every surface is a sphere's or a plane's: two of them touch at one point, wherever they turn.
    bool single_points() const noexcept;

private:
    bool may_touch(int i, int j) const noexcept;
    bool reaches(int plane, int k, const std::vector<double>& margin) const noexcept;
    void add(IndexPair pair, const Manifold& manifold, std::vector<Contact>& out) const;

    static constexpr unsigned char none = 0, awake = 1, sleeps = 2, is_moving = 4;

    struct Form {
        Primitive shape;
        Pose part;
        bool operator==(const Form&) const noexcept = default;
    };
    std::vector<int> body_of_;             // of colliders, which are in the order of their bodies
    SharedValues<Form> forms_;             // theirs
    std::vector<unsigned char> role_;      // of each body
    std::vector<std::uint64_t> excluded_;  // sorted
    std::vector<double> radius_;
    std::vector<int> bounded_, planes_,
        sheets_;            // colliders; sheets: of fixed bodies, never moved
    BoundsTree tree_;       // of sheets
    bool planted_ = false;  // whether it is built
    std::vector<int> hits_;
    bool possible_ = false;
    std::vector<Pose> poses_;  // of colliders
    std::vector<double> arms_;
    std::vector<Bounds> bounds_;
    BroadPhase broad_phase_;
    std::vector<IndexPair> pairs_, on_planes_, near_;
};

}  // namespace spook
