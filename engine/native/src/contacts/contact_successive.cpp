// Successive blows: which comes next, and the free balls that are led to its time.
#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"

namespace spook {

/// How far a body has come since the step began, at a time from when on nothing has hit it.
Vec6 ContactStage::way_until(std::size_t body, double time) const {
    if (unknown_[body] < 0) return sum(Vec6{}, prescribed_[body], time);
    const double on = time - clock_[body];
    const Vec6 way = sum(way_[body], velocity_[body], on);
    return supported_[body] || jointed_[body] ? way : sum(way, kick_[body], on);
}

/// The gap of a point at that time, with both bodies on their ways.
double ContactStage::gap_at(const Point& point, double time) const {
    const Contact& contact = point.contact;
    const Vec3 n = contact.point.normal;
    return point.begun + dot(contact_row(n, point.first_arm), way_until(contact.first, time)) -
           dot(contact_row(n, point.second_arm), way_until(contact.second, time));
}

/// From when on the ways of both bodies of a point are straight, s.
double ContactStage::both_known(const Point& point) const noexcept {
    return std::max(clock_[point.contact.first], clock_[point.contact.second]);
}

/// When a point that is approached closes, s. Forces are part of the ways: what they slow closes later.
double ContactStage::closing_time(const Point& point) const {
    const double from = both_known(point), gap = std::max(0.0, gap_at(point, from));
    if (gap == 0.0) return from;
    const double speed = (gap - gap_at(point, from + options_.time_step)) / options_.time_step;
    return from + gap / (speed > 0.0 ? speed : -point.approach);
}

/// An open point among balls that are led by successive blows is led to the time of their last one.
void ContactStage::lead_point(Point& point) {
    for (const int body : {point.contact.first, point.contact.second})
        if (unknown_[body] >= 0 && event_time_[body] < 0.0) return;
    const double time = both_known(point), gap = gap_at(point, time);
    if (point.strike < 0.0 && is_closed(point.contact, gap)) return;
    point.event = true;
    point.strike = time;
    point.contact.point.gap = std::max(0.0, gap);
}

/// Forces act on a free ball until the time it is led to, and the rest of them after it: what a fall towards a wall wins
/// until then is lost on the way back.
void ContactStage::lead_forces(std::size_t b, MixedSystem& system) {
    const double lead = clock_[b] / options_.time_step;
    if (supported_[b] || !(lead > lead_[b])) return;
    const double part = (lead - lead_[b]) / (1.0 - lead_[b]);
    lead_[b] = lead;
    const Vec6 more = sum(Vec6{}, kick_[b], part);
    velocity_[b] = sum(velocity_[b], more);
    for (double& k : kick_[b]) k *= 1.0 - part;
    const Mat6& mass = system.mass[unknown_[b]];
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) system.momentum[unknown_[b]][i] += mass[6 * i + j] * more[j];
}

/// Of successive blows those to be answered next: of what may meet in this step the points that are approached, and closed
/// when the first of them is. Free balls are led there, as to the time of a single strike.
void ContactStage::find_earliest_blows(MixedSystem& system, std::vector<std::size_t>& who) {
    arrays_.hanging.begin(static_cast<int>(system.mass.size()));
    for (const RowBlock& block : system.rows) arrays_.hanging.tie(block);
    for (const Point& point : points_)
        arrays_.hanging.tie(unknown_[point.contact.first], unknown_[point.contact.second]);
    for (const OpenPair& open : open_)
        if (!open.has_met()) arrays_.hanging.tie(unknown_[open.first], unknown_[open.second]);
    const Islands& islands = arrays_.hanging.find();
    const auto is_blow = [](const Point& point) {
        return point.bounce >= 0.0 && point.approach < -point.rounding;
    };
    std::vector<double>&first = filled(arrays_.blow.first, islands.count, unbounded),
    &closing = filled(arrays_.blow.closing, points_.size(), unbounded);
    for (std::size_t k = 0; k < points_.size(); ++k) {
        if (!is_blow(points_[k])) continue;
        closing[k] = closing_time(points_[k]);
        double& earliest = first[island_of(islands, points_[k])];
        earliest = std::min(earliest, closing[k]);
    }
    std::vector<char>&hit = arrays_.blow.is_hit, &balls = arrays_.blow.balls;
    hit.assign(unknown_.size(), 0), balls.assign(islands.count, 1);
    for (std::size_t k = 0; k < points_.size(); ++k) {
        const Point& point = points_[k];
        const double now = first[island_of(islands, point)];
        if (!is_blow(point) || (closing[k] > now && !is_closed(point.contact, gap_at(point, now)))) continue;
        who.push_back(k);
        hit[point.contact.first] = hit[point.contact.second] = 1;
    }
    const auto island = [&](std::size_t b) { return unknown_[b] >= 0 ? islands.of_body[unknown_[b]] : -1; };
    for (std::size_t b = 0; b < unknown_.size(); ++b)
        if (island(b) >= 0) balls[island(b)] = balls[island(b)] && ball_[b] && !jointed_[b];
    for (std::size_t b = 0; b < unknown_.size(); ++b) {
        const int own = island(b);
        if (own < 0 || first[own] == unbounded) continue;
        if (const double time = std::min(first[own], options_.time_step); hit[b] && time > clock_[b]) {
            way_[b] = way_until(b, time);
            clock_[b] = time;
            if (balls[own]) lead_forces(b, system);
        }
        if (!balls[own] || climbs(static_cast<int>(b))) continue;
        event_time_[b] = clock_[b];
        if (clock_[b] > 0.0) predicted_[b] = sum(Vec6{}, way_[b], 1.0 / clock_[b]);
    }
    for (Point& point : points_) lead_point(point);
    for (const std::size_t k : who) {
        Point& point = points_[k];
        point.approach = relative(point, point.contact.point.normal, velocity_, false);
        if (point.event) point.bounce = material(point.contact).restitution;
    }
}

}  // namespace spook
