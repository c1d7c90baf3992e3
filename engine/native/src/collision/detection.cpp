#include "collision/detection.hpp"

#include <algorithm>

#include "collision/narrow_phase.hpp"
#include "collision/shape_cast.hpp"
#include "collision/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::detection;

std::uint64_t pair_key(int i, int j) noexcept {
    return (static_cast<std::uint64_t>(std::min(i, j)) << 32) | static_cast<std::uint64_t>(std::max(i, j));
}

}  // namespace

Detection::Detection(std::vector<Collider> colliders, const std::vector<char>& dynamic,
                     const std::vector<IndexPair>& excluded)
    : radius_(dynamic.size(), 0.0) {
    for (const char moves : dynamic) role_.push_back(moves ? awake : none);
    std::stable_sort(colliders.begin(), colliders.end(),
                     [](const Collider& a, const Collider& b) { return a.body < b.body; });
    for (const Collider& c : colliders) {
        body_of_.push_back(c.body);
        forms_.push_back({c.shape, c.part});
    }
    for (auto [i, j] : excluded) excluded_.push_back(pair_key(i, j));
    std::sort(excluded_.begin(), excluded_.end());
    for (int k = 0; k < static_cast<int>(body_of_.size()); ++k) {
        const Collider::View c = collider(k);
        if (c.shape.kind == ShapeKind::plane) {
            planes_.push_back(k);
        } else if (c.shape.kind == ShapeKind::triangle) {
            sheets_.push_back(k);
        } else {
            bounded_.push_back(k);
            radius_[c.body] = std::max(radius_[c.body], norm(c.part.position) + reach(c.shape));
        }
    }
    // A pair is missing only if no two bodies with surfaces may touch; stop at the first that may.
    for (std::size_t i = 0; i < body_of_.size() && !possible_; ++i)
        for (std::size_t j = i + 1; j < body_of_.size() && !possible_; ++j)
            possible_ = may_touch(static_cast<int>(i), static_cast<int>(j));
    poses_.resize(body_of_.size());
    for (const Collider& c : colliders) arms_.push_back(turning_arm(c.shape, c.part));
    bounds_.resize(bounded_.size());
}

std::vector<char> Detection::balls() const {
    std::vector<char> ball(role_.size(), 1);
    for (std::size_t k = 0; k < body_of_.size(); ++k)
        if (forms_[k].shape.kind != ShapeKind::sphere || norm(forms_[k].part.position) > 0.0)
            ball[body_of_[k]] = 0;
    return ball;
}

bool Detection::single_points() const noexcept {
    return std::all_of(forms_.distinct().begin(), forms_.distinct().end(), [](const Form& form) {
        return form.shape.kind == ShapeKind::sphere || form.shape.kind == ShapeKind::plane;
    });
}

bool Detection::may_touch(int i, int j) const noexcept {
    const int a = body_of_[i], b = body_of_[j];
    const unsigned roles = role_[a] | role_[b];
    if (a == b || ((roles & awake) == 0 && roles != (sleeps | is_moving))) return false;
    if (forms_[i].shape.kind == ShapeKind::plane && forms_[j].shape.kind == ShapeKind::plane) return false;
    return excluded_.empty() || !std::binary_search(excluded_.begin(), excluded_.end(), pair_key(a, b));
}

/// Whether a bounded shape may come as near to a plane as the margins of both.
bool Detection::reaches(int plane, int k, const std::vector<double>& margin) const noexcept {
    const Vec3 normal = poses_[plane].rotation * forms_[plane].shape.normal;
    return dot(normal, poses_[k].position - poses_[plane].position) <=
           reach(forms_[k].shape) + (margin[body_of_[plane]] + margin[body_of_[k]]);
}

void Detection::add(IndexPair pair, const Manifold& manifold, std::vector<Contact>& out) const {
    const auto [i, j] = pair;
    for (int k = 0; k < manifold.count; ++k) {
        const ContactPoint& point = manifold.points[k];
        const std::uint64_t key = (pair_of(pair) << feature_bits) | point.feature;
        out.push_back({body_of_[i], body_of_[j], point, key});
    }
}

void Detection::collide_pair(IndexPair pair, double margin, std::vector<Contact>& out) const {
    const auto [i, j] = pair;
    add(pair, collide(forms_[i].shape, poses_[i], forms_[j].shape, poses_[j], margin), out);
}

void Detection::collide_pair(IndexPair pair, const Pose& first, const Pose& second, double margin,
                             std::vector<Contact>& out) const {
    const Collider::View a = collider(pair.first), b = collider(pair.second);
    add(pair, collide(a.shape, placed(first, a.part), b.shape, placed(second, b.part), margin), out);
}

const std::vector<IndexPair>& Detection::near(const std::vector<Pose>& bodies,
                                              const std::vector<double>& margin) {
    for (std::size_t k = 0; k < body_of_.size(); ++k) poses_[k] = placed(bodies[body_of_[k]], forms_[k].part);
    for (std::size_t k = 0; k < bounded_.size(); ++k) {
        const Collider::View c = collider(bounded_[k]);
        bounds_[k] = bounds(c.shape, poses_[bounded_[k]], margin[c.body]);
    }
    broad_phase_.overlapping_pairs(bounds_, pairs_);
    std::size_t kept = 0;
    for (auto [p, q] : pairs_)
        if (may_touch(bounded_[p], bounded_[q])) pairs_[kept++] = {bounded_[p], bounded_[q]};
    pairs_.resize(kept);
    on_planes_.clear();
    for (int plane : planes_) {
        for (int k : bounded_)
            if (reaches(plane, k, margin) && may_touch(plane, k))
                on_planes_.emplace_back(std::min(plane, k), std::max(plane, k));
    }
    if (!sheets_.empty()) {
        if (!planted_) {
            std::vector<Bounds> fixed;
            for (const int k : sheets_) fixed.push_back(bounds(forms_[k].shape, poses_[k], 0.0));
            tree_.build(std::move(fixed));
            planted_ = true;
        }
        for (std::size_t p = 0; p < bounded_.size(); ++p) {
            const int k = bounded_[p];
            hits_.clear();
            if (role_[body_of_[k]] == awake) tree_.overlapping(bounds_[p], hits_);
            for (const int hit : hits_)
                if (may_touch(sheets_[hit], k))
                    on_planes_.emplace_back(std::min(sheets_[hit], k), std::max(sheets_[hit], k));
        }
    }
    std::sort(on_planes_.begin(), on_planes_.end());
    near_.resize(pairs_.size() + on_planes_.size());
    std::merge(pairs_.begin(), pairs_.end(), on_planes_.begin(), on_planes_.end(), near_.begin());
    return near_;
}

bool Detection::near_again(const std::vector<int>& grown, const std::vector<double>& margin,
                           std::vector<IndexPair>& out) {
    out.clear();
    if (grown.size() > most_grown) return false;
    const auto add = [&](int i, int j) {
        if (may_touch(i, j)) out.emplace_back(std::min(i, j), std::max(i, j));
    };
    const auto first_of = [this](int body) {
        return std::lower_bound(bounded_.begin(), bounded_.end(), body,
                                [this](int k, int b) { return body_of_[k] < b; });
    };
    for (const int plane : planes_)
        if (std::binary_search(grown.begin(), grown.end(), body_of_[plane])) return false;
    for (const int body : grown)
        for (auto at = first_of(body); at != bounded_.end() && body_of_[*at] == body; ++at)
            bounds_[at - bounded_.begin()] = bounds(forms_[*at].shape, poses_[*at], margin[body]);
    for (const int body : grown)
        for (auto at = first_of(body); at != bounded_.end() && body_of_[*at] == body; ++at) {
            const Bounds own = bounds_[at - bounded_.begin()];
            for (std::size_t k = 0; k < bounded_.size(); ++k)
                if (overlap(own, bounds_[k])) add(*at, bounded_[k]);
            for (const int plane : planes_)
                if (reaches(plane, *at, margin)) add(plane, *at);
            hits_.clear();
            if (planted_ && role_[body] == awake) tree_.overlapping(own, hits_);
            for (const int hit : hits_) add(sheets_[hit], *at);
        }
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return true;
}

void Detection::detect(const std::vector<Pose>& bodies, const std::vector<double>& margin,
                       std::vector<Contact>& out) {
    out.clear();
    for (const IndexPair& pair : near(bodies, margin))
        collide_pair(pair, margin[body_of_[pair.first]] + margin[body_of_[pair.second]], out);
    std::sort(out.begin(), out.end(), [](const Contact& a, const Contact& b) { return a.key < b.key; });
}

}  // namespace spook
