// The contact stage's part for what is not closed yet: which pairs meet within the step, and the points they get.
#include <algorithm>

#include "collision/sweep.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"

namespace spook {

namespace {

constexpr double closed = 1e-9;  // gaps up to this part of the larger body's radius count as closed

}  // namespace

/// The overlap at which a pair counts as met. Bodies sunk into a seamless support, or sinking while sweeps have not
/// settled, meet the sides of its next part as deep as they are sunk; round shapes and planes have no sides.
double ContactStage::slop(const OpenPair& open) const noexcept {
    const int a = open.first, b = open.second;
    const ShapeKind one = detection_.collider(open.pair.first).shape.kind;
    const ShapeKind two = detection_.collider(open.pair.second).shape.kind;
    const bool balls = one == ShapeKind::sphere && two == ShapeKind::sphere;
    const bool sides = !balls && one != ShapeKind::plane && two != ShapeKind::plane;
    return closed * std::max(detection_.radius()[a], detection_.radius()[b]) +
           (sides ? 2.0 * std::max(depth_[a] + sinking_[a], depth_[b] + sinking_[b]) : 0.0);
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

/// Gives a pair points if it meets on the way along `velocity`, and says so.
bool ContactStage::strikes(const OpenPair& open, const std::vector<Vec6>& velocity, bool late) {
    if (passes(open, velocity)) return false;
    const Collider &one = detection_.collider(open.pair.first), &two = detection_.collider(open.pair.second);
    const int a = one.body, b = two.body;
    const auto moved = [&](int body) {  // an event's bodies have gone part of their way with another velocity
        Pose pose = poses_[body];
        if (event_time_[body] >= 0.0)
            pose.position += event_time_[body] * (linear(predicted_[body]) - linear(velocity[body]));
        return pose;
    };
    const Pose at_a = moved(a), at_b = moved(b);
    const Mover first{one.shape, one.part, at_a, linear(velocity[a]), angular(velocity[a])};
    const Mover second{two.shape, two.part, at_b, linear(velocity[b]), angular(velocity[b])};
    const double time = first_touch(first, second, options_.time_step, slop(open));
    return time >= 0.0 &&
           add_strike(open.pair, first.body_at(time), second.body_at(time), time, velocity, late);
}

/// Sweeps the open pairs along `velocity`; those that meet get points. Late strikes, after the solve, come too late
/// for an impact: if they need one, late_blow_ tells so, see blows_come_first().
int ContactStage::find_strikes(const std::vector<Vec6>& velocity, bool late) {
    if (late && !all_changed_) return find_strikes_of_movers(velocity);
    int found = 0;
    std::erase_if(open_, [&](const OpenPair& open) {
        if (open.met) return true;
        if (late && changed_[open.first] == 0 && changed_[open.second] == 0) return false;
        const bool met = strikes(open, velocity, late);
        found += met;
        return met;
    });
    open_items_.start(0);
    return found;
}

/// The same where few bodies have another velocity than at the last look. In the same order; pairs that have met stay
/// where they are until all are gone through again.
int ContactStage::find_strikes_of_movers(const std::vector<Vec6>& velocity) {
    if (open_items_.items() == 0) {
        open_items_.start(static_cast<int>(unknown_.size()));
        for (const OpenPair& open : open_) open_items_.add(open.first, open.second);
    }
    int found = 0;
    for (const int body : movers_) open_items_.call(body);
    open_items_.round([&](int item, int) {
        OpenPair& open = open_[static_cast<std::size_t>(item)];
        if (open.met) return;
        open.met = strikes(open, velocity, true);
        found += open.met;
    });
    return found;
}

/// All bodies are looked at, those that changed_ names.
void ContactStage::all_change() {
    all_changed_ = true;
    changed_.assign(unknown_.size(), 1);
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
        point.contact.point.gap = std::max(0.0, contact.point.gap + time * closing);
        met = true;
    }
    return met;
}

/// A strike that is no event acts with the bodies at the start of the step, or the angular momentum of both would
/// not be kept: with the points of that moment, if their rows stop the approach, else at the point of the meeting,
/// taken back half-way between both bodies.
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
            const Vec3 way = linear(velocity[p.contact.first]) + linear(velocity[p.contact.second]);
            p.contact.point.position -= 0.5 * p.strike * way;
            p.first_arm = p.contact.point.position - poses_[p.contact.first].position;
            p.second_arm = p.contact.point.position - poses_[p.contact.second].position;
        }
    }
}

}  // namespace spook
