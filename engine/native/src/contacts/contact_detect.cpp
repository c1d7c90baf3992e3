// The contact stage's first part: which points are closed, which pairs will meet, and when.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "collision/sweep.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "linear/ahead.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

constexpr double closed = 1e-9;  // gaps up to this part of the larger body's radius count as closed
bool by_key(const Contact& a, const Contact& b) noexcept { return a.key < b.key; }
bool round_or_plane(const Primitive& shape) noexcept { return !shape.faceted(); }
constexpr unsigned pairs_a_look = 256;    // of shapes, between two looks at the clock
constexpr std::size_t many_pairs = 512;   // worth several threads
constexpr double vanishing = 1e-8;        // a direction so steep on the surface has no shadow
constexpr double same_side = 1.0 - 1e-9;  // cosine of normals
constexpr double other_side = 0.5;        // the same

}  // namespace

double ContactStage::size(const Contact& contact) const noexcept {
    return std::max(detection_.radius()[contact.first], detection_.radius()[contact.second]);
}

bool ContactStage::is_closed(const Contact& contact, double gap) const noexcept {
    return gap <= closed * size(contact);
}

/// How far a body may get in the step with either velocity, m.
double ContactStage::margin_of(std::size_t b, const std::vector<Vec6>& velocity,
                               const std::vector<Vec6>& other) const {
    const double radius = detection_.radius()[b];
    double speed = norm(linear(velocity[b])), spin = norm(angular(velocity[b]));
    if (&other != &velocity) {
        speed = std::max(speed, norm(linear(other[b])));
        spin = std::max(spin, norm(angular(other[b])));
    }
    return options_.time_step * (speed + spin * radius) + closed * radius;
}

/// Bodies that pass each other sideways need no row: what counts is the speed along the normal.
bool ContactStage::reachable(const Contact& contact) const {
    const std::vector<double>& radius = detection_.radius();
    const Vec3 n = contact.point.normal;
    auto speed = [&](int b) {
        const Vec6 free = sum(velocity_[b], kick_[b]);
        const double spin = std::max(norm(angular(velocity_[b])), norm(angular(free)));
        return std::max(std::abs(dot(n, linear(velocity_[b]))), std::abs(dot(n, linear(free)))) +
               spin * radius[b];
    };
    return contact.point.gap <=
           options_.time_step * (speed(contact.first) + speed(contact.second)) + closed * size(contact);
}

bool ContactStage::detect(const std::vector<Pose>& poses, const std::vector<Vec6>& velocity,
                          const std::vector<Vec6>& free_velocity) {
    const std::size_t bodies = margin_.size();
    if (team_) team_->refresh();
    poses_ = poses;
    velocity_ = velocity;
    changed_at_.assign(bodies, changes_ = 0);
    kick_.resize(bodies);
    for (std::size_t b = 0; b < bodies; ++b) {
        kick_[b] = sum(free_velocity[b], velocity[b], -1.0);
        prescribed_[b] = unknown_[b] < 0 ? velocity[b] : Vec6{};
    }
    supplies_ = conveys_ || std::any_of(prescribed_.begin(), prescribed_.end(),
                                        [](const Vec6& v) { return v != Vec6{}; });
    std::fill(lead_.begin(), lead_.end(), 0.0);
    std::fill(event_time_.begin(), event_time_.end(), -1.0);
    std::fill(supported_.begin(), supported_.end(), 0);
    std::fill(depth_.begin(), depth_.end(), 0.0);
    std::fill(sinking_.begin(), sinking_.end(), 0.0);
    correction_.clear();
    parting_.velocity.clear();
    points_.clear();
    touch_keys_.clear();
    roused_.clear();
    impact_needed_ = plastic_first_ = false;
    settling_ = ran_away_ = false;  // of a step that was taken back, or is over
    impact_rounds_ = 0;
    if (options_.impacts == ImpactOrder::successive) clock_.assign(bodies, 0.0), way_.assign(bodies, Vec6{});

    for (std::size_t b = 0; b < bodies; ++b) margin_[b] = margin_of(b, velocity, free_velocity);
    search_ = margin_;
    // Room for those that are only pushed in this step.
    if (options_.solver == SolverKind::iterative || options_.impacts == ImpactOrder::successive) {
        double squares = 0.0;
        for (const double margin : margin_) squares += margin * margin;
        const double room = std::sqrt(squares / static_cast<double>(margin_.size()));
        for (double& margin : search_) margin += room;
    }
    pressing_.clear();
    carried_kick_.assign(bodies, Vec6{});
    find_open();
    find_carried();
    predicted_.resize(bodies);
    for (std::size_t b = 0; b < bodies; ++b)
        predicted_[b] = supported_[b] || jointed_[b] || unknown_[b] < 0 ? velocity[b] : free_velocity[b];
    const std::size_t closed_points = points_.size();
    if (!begun_) find_given();
    if (find_strikes(predicted_, false) > 0) {
        find_events();
        take_back_strikes(closed_points, predicted_);
    }
    if (points_.empty()) {
        touches_.clear();
        return false;
    }
    counters_.contacts += points_.size();
    order_points();
    measure_points();
    return true;
}

/// Pairs near enough to meet: the closed ones get points, the others are open. Pairs that have points are known.
void ContactStage::find_open() {
    open_.clear();
    look_at(detection_.near(poses_, search_));
}

/// The same where the search has been widened for some bodies since: what is new is theirs.
void ContactStage::find_open_again() {
    if (!detection_.near_again(grown_, search_, near_)) {
        changed_.assign(unknown_.size(), 1);
        return find_open();
    }
    for (const int body : grown_) changed_[body] = 1;
    const auto in_order = [](const OpenPair& a, const OpenPair& b) { return a.pair < b.pair; };
    std::erase_if(near_, [&](const IndexPair& pair) {
        const auto at = std::lower_bound(open_.begin(), open_.end(), pair,
                                         [](const OpenPair& a, const IndexPair& b) { return a.pair < b; });
        return at != open_.end() && at->pair == pair;
    });
    const auto old = static_cast<std::ptrdiff_t>(open_.size());
    look_at(near_);
    merged_.clear();
    merged_.reserve(open_.capacity());
    std::merge(open_.begin(), open_.begin() + old, open_.begin() + old, open_.end(),
               std::back_inserter(merged_), in_order);
    open_.swap(merged_);
}

void ContactStage::look_at(const std::vector<IndexPair>& near) {
    known_.clear();
    open_bodies_.clear();
    const std::size_t before = points_.size();
    const auto unmet = static_cast<std::ptrdiff_t>(open_.size());
    for (const Point& point : points_) known_.push_back(point.contact.key >> feature_bits);
    std::sort(known_.begin(), known_.end());
    const auto separation_of = [this](const IndexPair& pair) {
        return separation(detection_.collider(pair.first).shape, detection_.pose(pair.first),
                          detection_.collider(pair.second).shape, detection_.pose(pair.second));
    };
    const bool shared = team_ && near.size() >= many_pairs;
    if (shared) {
        apart_.resize(near.size());
        share_out(team_.get(), near.size(), many_pairs, [&](int, std::size_t begin, std::size_t end) {
            for (std::size_t k = begin; k < end; ++k) apart_[k] = separation_of(near[k]);
        });
    }
    for (std::size_t k = 0; k < near.size(); ++k) {
        const IndexPair& pair = near[k];
        if (k + ahead < near.size()) {
            ask_for(detection_.pose(near[k + ahead].first));
            ask_for(detection_.pose(near[k + ahead].second));
        }
        if ((k + 1) % pairs_a_look == 0) Watch::look();
        if (std::binary_search(known_.begin(), known_.end(), pair_of(pair))) continue;
        const Collider::View first = detection_.collider(pair.first),
                             second = detection_.collider(pair.second);
        const double reach = search_[first.body] + search_[second.body];
        const OpenPair open = opened(pair, shared ? apart_[k] : separation_of(pair));
        const double size = std::max(detection_.radius()[first.body], detection_.radius()[second.body]);
        if (round_or_plane(first.shape) && round_or_plane(second.shape) && open.apart.gap > 1e-6 * size) {
            if (open.apart.gap <= reach) open_.push_back(open);  // clearly apart: no need for its points
            continue;
        }
        scratch_.clear();
        detection_.touch(pair, reach, scratch_);
        const bool touching =
            std::any_of(scratch_.begin(), scratch_.end(), [this](const Contact& c) { return is_closed(c); });
        // Any two shapes apart give a point, if they are near enough to meet; but not solids corner to corner, nor
        // where a triangle's neighbour comes first.
        const bool solids = (first.shape.faceted() && second.shape.faceted()) ||
                            first.shape.kind == ShapeKind::triangle ||
                            second.shape.kind == ShapeKind::triangle;
        if (!touching) {
            if (!scratch_.empty() || solids) open_.push_back(open);
            continue;
        }
        for (std::size_t i = 1; i < scratch_.size(); ++i)  // a few, nearly always in order
            for (std::size_t at = i; at > 0 && by_key(scratch_[at], scratch_[at - 1]); --at)
                std::swap(scratch_[at], scratch_[at - 1]);
        for (const Contact& contact : scratch_)
            if (reachable(contact)) add_point(contact, poses_[contact.first], poses_[contact.second], -1.0);
    }
    for (std::size_t k = before; k < points_.size(); ++k) {
        // As deep as a body will be when it meets the next part of what holds it.
        const double depth = sunk_by(points_[k], false);
        for (const int b : {points_[k].contact.first, points_[k].contact.second})
            depth_[b] = std::max(depth_[b], depth);
    }
    if (let_pass(before))
        std::sort(open_.begin() + unmet, open_.end(),
                  [](const OpenPair& a, const OpenPair& b) { return a.pair < b.pair; });
    for (std::size_t k = before; k < points_.size(); ++k) {
        if (k + ahead < points_.size()) {
            const Contact& later = points_[k + ahead].contact;
            for (const int body : {later.first, later.second}) ask_for(velocity_[body]), ask_for(kick_[body]);
        }
        note_pressing(points_[k]);
        for (const int b : {points_[k].contact.first, points_[k].contact.second}) supported_[b] = 1;
    }
}

OpenPair ContactStage::opened(const IndexPair& pair, const Separation& apart) const {
    const Collider::View first = detection_.collider(pair.first), second = detection_.collider(pair.second);
    const auto arm = [this](int collider, const Collider::View& of) {
        return of.shape.kind == ShapeKind::plane ? -1.0 : detection_.arm(collider);
    };
    return {pair, first.body, second.body, apart, arm(pair.first, first), arm(pair.second, second)};
}

void ContactStage::add_point(const Contact& contact, const Pose& first, const Pose& second, double strike) {
    Point& point = points_.emplace_back();
    point.contact = contact;
    point.material = combined(materials_[contact.first], materials_[contact.second]);
    point.first_arm = contact.point.position - first.position;
    point.second_arm = contact.point.position - second.position;
    point.tangent = world_tangent(contact.point.normal);
    point.strike = strike;
    point.begun = contact.point.gap;
    if (oriented_) orient(point, first, second);
    if (!asleep_.empty()) rouse(contact);
}

/// Where friction differs with the direction its bound is an ellipse about the direction's shadow on the surface. In
/// rows stretched by mu over the smaller mu, and impulses shrunk by it, it is the smaller one's disc, and every solver
/// sees that. The slip's work is the same in both, so what is opposite to the slip on the disc dissipates most on the
/// ellipse, and energy is only lost. A direction that stands askew on the surface counts less, by the square of its
/// shadow; no residual is told too small, rows being stretched, never shrunk.
void ContactStage::orient(Point& point, const Pose& first, const Pose& second) const {
    const Contact& contact = point.contact;
    const bool of_first = materials_[contact.first].is_oriented();
    const SurfaceMaterial& own = materials_[of_first ? contact.first : contact.second];
    const SurfaceMaterial& other = materials_[of_first ? contact.second : contact.first];
    const double mu = point.material.friction;
    if (!own.is_oriented() || !(mu > 0.0)) return;
    const Vec3 n = contact.point.normal, whole = (of_first ? first : second).rotation * own.direction;
    const Vec3 shadow = whole - dot(whole, n) * n;
    const double length = norm(shadow), across = std::sqrt(own.friction_across * other.friction);
    if (length > vanishing) {
        point.tangent = (1.0 / length) * shadow;
        point.tangent = point.tangent - dot(point.tangent, n) * n;
    }
    const double along = std::sqrt(across * across + (mu * mu - across * across) * length * length);
    point.material.friction = std::min(along, across);
    point.stretch[0] = along / point.material.friction;
    point.stretch[1] = across / point.material.friction;
}

/// The overlap at which a pair counts as met, m. Bodies that sink while sweeps have not settled meet the sides of the next
/// part of what holds them as deep as that; round shapes and planes have no sides.
double ContactStage::slop(const OpenPair& open) const noexcept {
    const int a = open.first, b = open.second;
    const bool sides =
        have_sides(detection_.collider(open.pair.first).shape, detection_.collider(open.pair.second).shape);
    return closed * std::max(detection_.radius()[a], detection_.radius()[b]) +
           (sides ? 2.0 * std::max(sinking_[a], sinking_[b]) : 0.0);
}

/// Whether a pair surely does not meet: the direction that separates it keeps it apart for the whole step. The first
/// round of first_touch(), without what that needs before.
bool ContactStage::passes(const OpenPair& open, const std::vector<Vec6>& velocity) const {
    const int a = open.first, b = open.second;
    if (event_time_[a] >= 0.0 || event_time_[b] >= 0.0) return false;
    const double closing = dot(open.apart.normal, linear(velocity[b]) - linear(velocity[a]));
    double turning = 0.0;
    if (open.first_arm != 0.0 || open.second_arm != 0.0) {
        const double first = norm(cross(angular(velocity[a]), open.apart.normal)),
                     second = norm(cross(angular(velocity[b]), open.apart.normal));
        if ((open.first_arm < 0.0 && first > 0.0) || (open.second_arm < 0.0 && second > 0.0)) return false;
        turning = first * open.first_arm + second * open.second_arm;
    }
    const double speed = std::max(0.0, closing) + turning;
    if (!(speed * options_.time_step > open.apart.gap)) return open.apart.gap > 0.0;
    const double slop = this->slop(open);
    return open.apart.gap > -0.5 * slop && !(speed * options_.time_step > open.apart.gap + slop);
}

/// When an open pair that does not surely pass meets along `velocity`, s; negative if it does not in this step.
double ContactStage::meeting(const OpenPair& open, const std::vector<Vec6>& velocity, bool late) const {
    const Pose at_first = moved(open.first, velocity), at_second = moved(open.second, velocity);
    const Mover first = mover(open.pair.first, at_first, velocity),
                second = mover(open.pair.second, at_second, velocity);
    const double time = first_touch(first, second, options_.time_step, slop(open));
    if (time < 0.0 || is_seam(first, open.first, second, open, velocity, time, late) ||
        is_seam(second, open.second, first, open, velocity, time, late))
        return -1.0;
    return time;
}

/// Where a body begins its way of this step. An event's bodies have gone part of it with another velocity.
Pose ContactStage::moved(int b, const std::vector<Vec6>& velocity) const {
    Pose pose = poses_[b];
    if (event_time_[b] >= 0.0)
        pose.position += event_time_[b] * (linear(predicted_[b]) - linear(velocity[b]));
    return pose;
}

/// A collider whose body goes on from `pose`, which must outlive it.
Mover ContactStage::mover(int collider, const Pose& pose, const std::vector<Vec6>& velocity) const {
    const Collider::View own = detection_.collider(collider);
    return {own.shape, own.part, pose, linear(velocity[own.body]), angular(velocity[own.body])};
}

/// Sweeps the open pairs along `velocity`; those that meet get points. Late strikes, after the solve, come too late
/// for an impact: if they need one, late_blow_ tells so, see blows_come_first().
int ContactStage::find_strikes(const std::vector<Vec6>& velocity, bool late) {
    meetings_.resize(team_ ? static_cast<std::size_t>(team_->size()) : 1);
    for (auto& meetings : meetings_) meetings.clear();
    if (swings_ && !open_.empty()) index_points();
    if (open_bodies_.size() != open_.size()) {
        open_bodies_.clear();
        for (const OpenPair& open : open_) open_bodies_.emplace_back(open.first, open.second);
    }
    arrays_.asked.resize(meetings_.size());
    share_out(team_.get(), open_.size(), many_pairs, [&](int part, std::size_t begin, std::size_t end) {
        std::vector<std::size_t>& asked = arrays_.asked[part];
        asked.resize(end - begin + 1);
        std::size_t count = 0;
        for (std::size_t k = begin; k < end; ++k) {  // the others were judged before
            asked[count] = k;
            count += !late || (changed_[open_bodies_[k].first] | changed_[open_bodies_[k].second]) != 0;
        }
        const std::size_t all = std::exchange(count, 0);
        for (std::size_t at = 0; at < all; ++at) {  // nearly all pass: the others are gathered first
            asked[count] = asked[at];
            count += !passes(open_[asked[at]], velocity);
        }
        for (std::size_t at = 0; at < count; ++at) {
            if (at + ahead < count) {
                const OpenPair& later = open_[asked[at + ahead]];
                for (const int body : {later.first, later.second})
                    ask_for(poses_[body]), ask_for(kick_[body]);
            }
            if (end - begin == open_.size() && (at + 1) % pairs_a_look == 0) Watch::look();  // on one thread
            if (const double time = meeting(open_[asked[at]], velocity, late); !(time < 0.0))
                meetings_[part].push_back({asked[at], time});
        }
    });
    std::vector<Meeting>& all = meetings_[0];
    for (std::size_t part = 1; part < meetings_.size(); ++part)
        all.insert(all.end(), meetings_[part].begin(), meetings_[part].end());
    leave_out_what_others_keep_off(all, velocity);
    int found = 0;
    for (const auto& [k, time] : all) {
        OpenPair& open = open_[k];
        const Pose first = moved(open.first, velocity), second = moved(open.second, velocity);
        const std::size_t known = points_.size();
        const bool met =
            add_strike(open.pair, mover(open.pair.first, first, velocity).body_at(time),
                       mover(open.pair.second, second, velocity).body_at(time), time, velocity, late);
        const Vec3 led =
            (first.position - poses_[open.first].position) - (second.position - poses_[open.second].position);
        for (std::size_t i = known; i < points_.size(); ++i)
            points_[i].begun -= dot(points_[i].contact.point.normal, led);
        if (!met) continue;
        open.first = -1;
        ++found;
    }
    if (found > 0) {
        std::erase_if(open_, [](const OpenPair& open) { return open.first < 0; });
        open_bodies_.clear();
    }
    return found;
}

bool ContactStage::meets(const std::vector<Vec6>& next, bool struck, bool rebounds) {
    plastic_first_ = rebounds;  // blows that a stop's rebound leads to are found again after it
    late_blow_ = false;
    changed_ = jointed_;  // others have been swept with what they fly with
    if (outrun(next)) find_open_again();
    const std::size_t closed_points = points_.size();
    int found = find_strikes(next, true);
    if (late_blow_ && struck && !plastic_first_) {  // as are those to a body that it only stops
        plastic_first_ = true;
        found += find_strikes(next, true);
    }
    if (found > 0) take_back_strikes(closed_points, next);
    if (points_.empty()) return false;
    counters_.contacts += points_.size();
    order_points();
    return true;
}

/// The points of a pair that meets at `time`, with the bodies where they will be then.
bool ContactStage::add_strike(IndexPair pair, const Pose& first, const Pose& second, double time,
                              const std::vector<Vec6>& velocity, bool late) {
    const int a = detection_.collider(pair.first).body, b = detection_.collider(pair.second).body;
    const double radius = std::max(detection_.radius()[a], detection_.radius()[b]);
    scratch_.clear();
    detection_.touch(pair, first, second, std::max(margin_[a] + margin_[b], 2.0 * closed * radius), scratch_);
    bool met = false;
    for (const Contact& contact : scratch_) {
        add_point(contact, first, second, time);
        Point& point = points_.back();
        const double closing = -relative(point, contact.point.normal, velocity, false);
        // What forces give to one of them in this step is no blow, though both got it before one was held.
        const double push = std::max({std::abs(relative(point, contact.point.normal, kick_, false)),
                                      std::abs(dot(contact.point.normal, linear(kick_[contact.first]))),
                                      std::abs(dot(contact.point.normal, linear(kick_[contact.second])))});
        if (late && !plastic_first_ && point.material.restitution > 0.0 && closing > 4.0 * push) {
            late_blow_ = true;
            points_.pop_back();
            continue;
        }
        point.meeting_gap = contact.point.gap;
        point.begun = contact.point.gap + time * closing;
        point.contact.point.gap = std::max(0.0, point.begun);
        met = true;
    }
    return met;
}

/// A strike that is no event acts with the bodies at the start of the step, or the angular momentum of both would
/// not be kept: with the points of that moment, if their rows stop the approach, else at the point of the meeting,
/// taken back half-way between both bodies, or with the one that moves by itself.
void ContactStage::take_back_strikes(std::size_t from, const std::vector<Vec6>& velocity) {
    const double h = options_.time_step;
    strikes_.assign(points_.begin() + static_cast<std::ptrdiff_t>(from), points_.end());
    points_.resize(from);
    for (std::size_t k = 0; k < strikes_.size();) {
        const Contact meeting = strikes_[k].contact;
        const double strike = strikes_[k].strike;
        std::size_t end = k;
        while (end < strikes_.size() &&
               (strikes_[end].contact.key >> feature_bits) == (meeting.key >> feature_bits))
            ++end;
        if (strike < 0.0 || strikes_[k].event) {
            for (; k < end; ++k) points_.push_back(strikes_[k]);
            continue;
        }
        const IndexPair pair{static_cast<int>(meeting.key >> (feature_bits + 24)),
                             static_cast<int>(meeting.key >> feature_bits & 0xffffff)};
        scratch_.clear();
        detection_.touch(pair, search_[meeting.first] + search_[meeting.second], scratch_);
        const std::size_t old = points_.size();
        bool stops = false;
        // Past an edge, another side is met than the one that is faced at the start; of two that move, surely another.
        const bool fixed = std::min(unknown_[meeting.first], unknown_[meeting.second]) < 0;
        const double same =
            fixed ? same_side
            : have_sides(detection_.collider(pair.first).shape, detection_.collider(pair.second).shape)
                ? other_side
                : -unbounded;
        if (std::any_of(scratch_.begin(), scratch_.end(), [&](const Contact& contact) {
                return dot(contact.point.normal, meeting.point.normal) < same;
            }))
            scratch_.clear();
        for (const Contact& contact : scratch_) {
            add_point(contact, poses_[contact.first], poses_[contact.second], strike);
            stops =
                stops ||
                contact.point.gap + h * relative(points_.back(), contact.point.normal, velocity, false) < 0.0;
        }
        if (stops) {
            k = end;
            continue;
        }
        points_.resize(old);
        for (; k < end; ++k) {
            Point& p = points_.emplace_back(strikes_[k]);
            const int a = p.contact.first, b = p.contact.second;
            const bool alone = std::min(unknown_[a], unknown_[b]) < 0;  // then its arm is that of the meeting
            const Vec3 own = linear(velocity[unknown_[a] < 0 ? b : a]);
            p.contact.point.position -= p.strike * (alone ? own : 0.5 * (own + linear(velocity[b])));
            if (alone) continue;
            p.first_arm = p.contact.point.position - poses_[a].position;
            p.second_arm = p.contact.point.position - poses_[b].position;
        }
    }
}

}  // namespace spook
