// The contact stage's last part: which bodies overlap where the step ends, and by which displacements they part.
#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "linear/ahead.hpp"
#include "linear/regularisation.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

constexpr double contact_give =
    1e-3;  // what a contact of jointed bodies yields, of 1/m of all that moves with them
constexpr double joint_give = 1e-6;      // and a joint, of its row's own inertia
constexpr double joint_share = 1e-3;     // and of what the contacts do
constexpr double least_give = 1e-12;     // of its row's own inertia: repeated joints share a load by it
constexpr std::size_t most_beside = 32;  // bodies of a ring: where more part at once, the next step will tell
constexpr int rings = 4;                 // of neighbours that parting sees
constexpr double over_relaxation = 1.25;  // of sweeps that part balls, not boxes
constexpr double around = 4.0;            // of the deepest overlap: gaps that parting may close
constexpr double aside = 1e-5;  // of the smaller body's radius: who parts by less pushes nobody else
constexpr double aside_by_sweeps = 5e-4;  // the same where every row more leads fifty sweeps less far
constexpr double same_place = 0.1;        // of the larger body's radius: one point, seen again

}  // namespace

/// How far a compliant contact is pressed in at the end of the step: where it was, and the way its bodies go.
double ContactStage::pressed(const MixedSystem& system, const Point& point) const {
    if (!(material(point.contact).compliance > 0.0)) return 0.0;
    const Contact& contact = point.contact;
    double speed = 0.0;
    for (const int b : {contact.first, contact.second}) {
        const Vec6& v = unknown_[b] < 0 ? velocity_[b] : system.velocity[unknown_[b]];
        const bool first = b == contact.first;
        speed += dot(contact_row(first ? contact.point.normal : -contact.point.normal,
                                 first ? point.first_arm : point.second_arm),
                     v);
    }
    const double before = std::min(point.pressed_before, -contact.point.gap);  // an open gap comes first
    return std::max(0.0, before - time_left(point) * speed);
}

/// What a contact yields, 1/kg, per moving body on either side. A light body that is jointed to a heavy one, or touches
/// one, must not be what gives way in its stead: a contact that is soft against the heavier side lifts nothing.
void ContactStage::find_gives(const MixedSystem& parting) {
    const Islands& hanging = arrays_.hanging.find(parting);
    std::vector<double>&mass = arrays_.island_mass, &give = gives_;
    mass.assign(hanging.count, 0.0), give.assign(parting.mass.size(), 0.0);
    for (std::size_t b = 0; b < give.size(); ++b)
        if (hanging.of_body[b] >= 0) mass[hanging.of_body[b]] += parting.mass[b][0];
    for (std::size_t b = 0; b < give.size(); ++b)
        give[b] = contact_give / (hanging.of_body[b] >= 0 ? mass[hanging.of_body[b]] : parting.mass[b][0]);
}

double ContactStage::give_of(const Contact& contact, const std::vector<double>& gives) const noexcept {
    const int a = unknown_[contact.first], b = unknown_[contact.second];
    return std::min(a < 0 ? unbounded : gives[a], b < 0 ? unbounded : gives[b]);
}

/// Rows of joints hold displacements instead of velocities; limits only push, and motors let go. They give far less
/// than the contacts, the least of which gives `least`.
void ContactStage::hold_joints(MixedSystem& parting, double least) const {
    for (std::size_t k = 0; k < parting.rows.size(); ++k) {
        RowBlock& block = parting.rows[k];
        for (int i = 0; i < block.size; ++i) {
            block.right[i] = block.multiplier[i] = 0.0;
            const bool below = block.lower[i] == -unbounded, above = block.upper[i] == unbounded;
            if (!below && !above) block.lower[i] = block.upper[i] = 0.0;
            if (k < yielding_.size() && yielding_[k] != 0) continue;
            const double softness = block.softness[i];
            block.softness[i] = 0.0;
            const double own = own_inertia(parting, block, i);
            block.softness[i] =
                std::min({softness, joint_give * own, std::max(joint_share * least, least_give * own)});
        }
    }
}

/// Whether a moving surface, or a body that moves as it is told, may do work at a contact.
bool ContactStage::is_supplied(const Contact& contact) const {
    if (!supplies_) return false;
    if (conveys(contact)) return true;
    for (const int b : {contact.first, contact.second}) {
        if (norm(linear(prescribed_[b])) > 0.0 || norm(angular(prescribed_[b])) > 0.0) return true;
    }
    return false;
}

/// Takes down how deep pairs overlap where the run begins: nothing but the scene has brought them there.
void ContactStage::find_given() {
    begun_ = true;
    for (const Point& point : points_) {
        const double excess = -point.contact.point.gap - explained_depth(point);
        if (!(excess > 0.0)) continue;
        double& given = given_[point.contact.key >> feature_bits];
        given = std::max(given, excess);
    }
}

/// Takes down what is left of it, at most what it was.
void ContactStage::note_given() {
    if (given_.empty()) return;
    DepthOfPair& left = arrays_.left;
    left.clear();
    for (const Touch& touch : kept_)
        if (const auto given = given_.find(touch.contact.key >> feature_bits); given != given_.end())
            left[given->first] = given->second;
    for (const Lap& lap : laps_) {
        const auto given = given_.find(lap.contact.key >> feature_bits);
        if (!(lap.push > 0.0) || given == given_.end()) continue;
        double& depth = left[given->first];
        depth = std::max(depth, std::min(lap.push, given->second));
    }
    given_ = left;
}

/// Whether a point parts by so much that its bodies may come down elsewhere, or push others aside, and one displacement is
/// not enough. By sweeps balls never do, which only go aside: of a thousand of them hundreds part a little in each step.
bool ContactStage::parts_far(const Lap& lap) const noexcept {
    const double little = parts_by_sweeps() ? aside_by_sweeps : aside;
    if (!(lap.push > little * moving_size(lap.contact))) return false;
    const auto swings = [this](int b) { return unknown_[b] >= 0 && ball_[b] == 0; };
    return !parts_by_sweeps() || swings(lap.contact.first) || swings(lap.contact.second);
}

/// Who is to be looked at again: everybody, or by sweeps the islands of parting() in which a point has parted far.
void ContactStage::note_far() {
    if (!far_ || !parts_by_sweeps()) return;
    far_ = false;
    const auto island = [this](int b) {
        return unknown_[b] < 0 ? -1 : parting_.islands.of_body[unknown_[b]];
    };
    std::vector<char>& parted = filled(arrays_.parted_far, parting_.islands.count);
    for (const Lap& lap : laps_) {
        if (!parts_far(lap)) continue;
        far_ = true;
        for (const int b : {lap.contact.first, lap.contact.second})
            if (island(b) >= 0) parted[island(b)] = 1;
    }
    looked_at_.resize(unknown_.size());
    for (std::size_t b = 0; b < looked_at_.size(); ++b) {
        const int k = island(static_cast<int>(b));
        looked_at_[b] = k >= 0 && parted[k] != 0;
    }
}

/// Pairs without points, near enough to what parts, or to who that pushes, to be pushed into each other: one neighbour
/// after the other, `rings` of them.
void ContactStage::find_beside(const std::vector<Pose>& poses, double margin) {
    beside_.clear();
    seams_.clear();
    std::vector<char>& reached = arrays_.reached;  // in which round, from one on
    reached.assign(unknown_.size(), 0);
    char round = 1;
    const auto reach = [&](int b) {
        if (reached[b] || unknown_[b] < 0) return;
        reached[b] = round;
        grown_.push_back(b);
        search_[b] = std::max(search_[b], margin + way(b, poses));
    };
    grown_.clear();
    for (const Lap& lap : laps_)
        if (parts_far(lap)) reach(lap.contact.first), reach(lap.contact.second);
    far_ = !parts_by_sweeps() || !grown_.empty();
    for (int ring = 0; ring < rings && !grown_.empty() && grown_.size() <= most_beside; ++ring) {
        std::sort(grown_.begin(), grown_.end());
        if (!detection_.near_again(grown_, search_, near_)) near_ = detection_.near(poses_, search_);
        const auto inside = [&](int b) { return reached[b] != 0 && reached[b] < round; };
        ++round;
        grown_.clear();
        for (const Touch& touch : touches_) {
            const int a = touch.contact.first, b = touch.contact.second;
            if (inside(a)) reach(b);
            if (inside(b)) reach(a);
        }
        for (const IndexPair& pair : near_) {
            const int a = detection_.collider(pair.first).body, b = detection_.collider(pair.second).body;
            if (!inside(a) && !inside(b)) continue;
            const std::uint64_t key = pair_of(pair);
            const auto touch = std::lower_bound(
                touches_.begin(), touches_.end(), key,
                [](const Touch& t, std::uint64_t k) { return t.contact.key >> feature_bits < k; });
            if (touch != touches_.end() && touch->contact.key >> feature_bits == key) continue;
            scratch_.clear();
            detection_.touch(pair, poses[a], poses[b], margin, scratch_);
            if (scratch_.empty()) continue;
            beside_.push_back(pair);
            if (std::any_of(scratch_.begin(), scratch_.end(),
                            [this](const Contact& c) { return is_deep(c); }))
                seams_.push_back(pair);
            reach(a);
            reach(b);
        }
    }
    for (std::vector<IndexPair>* pairs : {&beside_, &seams_}) {
        std::sort(pairs->begin(), pairs->end());
        pairs->erase(std::unique(pairs->begin(), pairs->end()), pairs->end());
    }
}

/// The same pairs' points. What overlapped without points before anything was parted was let in as a seam; what overlaps
/// since has been pushed.
double ContactStage::find_overlaps_beside(const std::vector<Pose>& poses, double margin) {
    double deepest = 0.0;
    unsigned seen = 0;
    for (const IndexPair& pair : beside_) {
        const int a = detection_.collider(pair.first).body, b = detection_.collider(pair.second).body;
        if (!is_looked_at(a, b)) continue;
        if (++seen % pairs_a_look == 0) Watch::look();
        scratch_.clear();
        detection_.touch(pair, poses[a], poses[b], margin, scratch_);
        const bool seam = std::binary_search(seams_.begin(), seams_.end(), pair);
        for (const Contact& contact : scratch_) {
            if (seam && is_deep(contact)) continue;
            const double excess = -contact.point.gap - slack(contact);
            deepest = std::max(deepest, excess);
            if (margin > 0.0) add_lap(contact, poses, excess);
        }
    }
    return deepest;
}

/// Keeps points that earlier displacements of this step have parted and the manifolds have lost since, as those of two
/// edges when the faces beside them come down: they must not close again, or bodies would seesaw between them. Whether
/// something overlaps where those had no point.
bool ContactStage::keep_parted(const std::vector<Pose>& poses) {
    const auto order = [](const LargeArray<Lap>& laps, auto& places) {
        places.clear();
        for (std::size_t k = 0; k < laps.size(); ++k) places.push_back({laps[k].contact.key, k});
        std::sort(places.begin(), places.end());
    };
    const auto has = [this](const LargeArray<Lap>& laps, const auto& places, const Contact& contact) {
        auto at = std::lower_bound(places.begin(), places.end(), std::make_pair(contact.key, std::size_t{0}));
        for (; at != places.end() && at->first == contact.key; ++at)  // parallel edges have one name
            if (norm(laps[at->second].contact.point.position - contact.point.position) <
                same_place * size(contact))
                return true;
        return false;
    };
    order(laps_, places_);
    order(parted_, parted_places_);
    bool fresh = false;
    for (const Lap& lap : laps_)
        fresh = fresh || (lap.push > slack(lap.contact) && !has(parted_, parted_places_, lap.contact));
    for (Lap lap : parted_) {
        const Contact& contact = lap.contact;
        if (!is_looked_at(contact.first, contact.second) || has(laps_, places_, contact)) continue;
        for (const int b : {contact.first, contact.second}) {
            Vec3& arm = b == contact.first ? lap.first_arm : lap.second_arm;
            const Vec3 now = poses[b].rotation * local(lap_poses_[b].rotation, arm);
            const Vec3 gone = poses[b].position - lap_poses_[b].position + now - arm;
            lap.push += dot(contact.point.normal, b == contact.first ? -gone : gone);
            arm = now;
        }
        lap.push = std::min(lap.push, 0.0);
        laps_.push_back(lap);
    }
    return fresh;
}

void ContactStage::add_lap(const Contact& contact, const std::vector<Pose>& poses, double excess) {
    Lap& lap = laps_.emplace_back();
    lap.contact = contact;
    lap.damping = std::max(materials_[contact.first].damping, materials_[contact.second].damping);
    lap.first_arm = contact.point.position - poses[contact.first].position;
    lap.second_arm = contact.point.position - poses[contact.second].position;
    lap.push = excess;
}

/// How far some point of a body has gone in the step, m.
double ContactStage::way(int b, const std::vector<Pose>& poses) const {
    double turned = 0.0;
    for (int i = 0; i < 9; ++i)
        turned = std::max(turned, std::abs(poses[b].rotation.m[i] - poses_[b].rotation.m[i]));
    return norm(poses[b].position - poses_[b].position) + (turned > 0.0 ? 3.0 * turned * radius(b) : 0.0);
}

/// Points of the step's pairs, up to gaps of `around` times their largest overlap that nothing explains, with the bodies at
/// `poses`, into laps_; that overlap. None of them if there is no overlap. Balls have the same points however near one
/// looks, and are looked at once: as near as the last step lets expect.
double ContactStage::find_overlaps(const std::vector<Pose>& poses, bool again) {
    const double expected = swings_ ? 0.0 : 2.0 * around * expected_overlap_;
    double deepest = look_for_overlaps(poses, expected, again);
    if (again) deepest = std::max(deepest, find_overlaps_beside(poses, 0.0));
    expected_overlap_ = deepest;
    if (!(deepest > 0.0)) return deepest;
    const double margin = around * deepest;
    if (margin > expected) look_for_overlaps(poses, margin, again);
    else std::erase_if(laps_, [margin](const Lap& lap) { return lap.contact.point.gap > margin; });
    if (!again) find_beside(poses, margin);
    find_overlaps_beside(poses, margin);
    if (!asleep_.empty())
        for (const Lap& lap : laps_) rouse(lap.contact);
    return deepest;
}

/// The same up to gaps of `margin`; without one, only the overlap. It does not count pairs that have not moved against each
/// other and did not overlap before.
double ContactStage::look_for_overlaps(const std::vector<Pose>& poses, double margin, bool again) {
    laps_.clear();
    double deepest = 0.0;
    unsigned seen = 0;
    for (std::size_t from = 0, end = 0; from < touches_.size(); from = end) {
        const std::uint64_t key = touches_[from].contact.key >> feature_bits;
        const int a = touches_[from].contact.first, b = touches_[from].contact.second;
        const double rounding = slack(touches_[from].contact);
        double most_pressed = 0.0;
        bool overlapped = false;
        for (; end < touches_.size() && touches_[end].contact.key >> feature_bits == key; ++end) {
            most_pressed = std::max(most_pressed, touches_[end].pressed);
            overlapped = overlapped || touches_[end].contact.point.gap < -rounding;
        }
        if (from + ahead < touches_.size()) {
            const Contact& later = touches_[from + ahead].contact;
            for (const int body : {later.first, later.second}) ask_for(poses[body]), ask_for(poses_[body]);
        }
        if (!is_looked_at(a, b)) continue;
        const auto is_still = [&] { return !overlapped && way(a, poses) + way(b, poses) < 0.1 * rounding; };
        if (margin == 0.0 && is_still()) continue;
        if (++seen % pairs_a_look == 0) Watch::look();
        scratch_.clear();
        const IndexPair pair{static_cast<int>(key >> 24), static_cast<int>(key & 0xffffff)};
        detection_.touch(pair, poses[a], poses[b], margin, scratch_);
        for (const Contact& contact : scratch_) {
            double pressed = 0.0;
            if (materials_[a].compliance + materials_[b].compliance > 0.0) pressed = most_pressed;
            for (std::size_t k = from; k < end; ++k)
                if (touches_[k].contact.key == contact.key) pressed = touches_[k].pressed;
            double excess = -contact.point.gap - pressed - rounding;
            if (again && excess > 0.0 && given_.contains(key))
                excess = std::max(0.0, excess - given_.at(key));
            if (excess > deepest && (margin == 0.0 || !is_still())) deepest = excess;
            if (margin > 0.0) add_lap(contact, poses, excess);
        }
    }
    return deepest;
}

/// How fast the bodies of an overlap are to part in the step, m/s; of points apart, how fast they may close.
double ContactStage::parting_speed(const Lap& lap, bool again) const {
    const double h = options_.time_step, excess = lap.push;
    const auto given = given_.find(lap.contact.key >> feature_bits);
    if (again || !(excess > 0.0) || given == given_.end()) return excess / h;
    const double slow = std::min(excess, given->second);
    return regularise(0.0, lap.damping, h).violation_gain * slow + (excess - slow) / h;
}

/// Who is to be seen as one: contacts that pushed aside are given; contacts that push, whose laws a turn of some of
/// their bodies would break, joints and the ground are added.
void ContactStage::note_parted(const MixedSystem& parting) {
    for (const Touch& touch : touches_)
        if (touch.normal > 0.0 || touch.impact > 0.0)
            arrays_.parted.tie(unknown_[touch.contact.first], unknown_[touch.contact.second]);
    for (const RowBlock& block : parting.rows) arrays_.parted.tie(block);
    parting_.velocity = parting.velocity;
    parting_.islands = arrays_.parted.find();
    parting_.grounded.assign(parting_.islands.count, 0);
    for (const auto [first, second] : arrays_.parted.ties()) {
        const int body = std::max(first, second);
        if (std::min(first, second) < 0 && body >= 0) parting_.grounded[parting_.islands.of_body[body]] = 1;
    }
    parting_.supplied.assign(parting_.islands.count, 0);
    const auto island = [this](const Contact& contact) {
        return parting_.islands.of_body[std::max(unknown_[contact.first], unknown_[contact.second])];
    };
    for (const Touch& touch : touches_)
        if (is_supplied(touch.contact) && island(touch.contact) >= 0)
            parting_.supplied[island(touch.contact)] = 1;
    for (const Lap& lap : laps_)
        if (lap.push > 0.0 && given_.contains(lap.contact.key >> feature_bits) && island(lap.contact) >= 0)
            parting_.supplied[island(lap.contact)] = 1;
}

bool ContactStage::part(const MixedSystem& system, std::size_t joints, const std::vector<Pose>& poses,
                        bool again) {
    const double last = parting_.deepest;
    parting_.velocity.clear();
    if (again && !far_) return false;
    if (again) std::swap(laps_, parted_);
    else looked_at_.clear();
    parting_.deepest = find_overlaps(poses, again);
    if (!(parting_.deepest > 0.0)) {
        if (!again) given_.clear();
        return false;
    }
    if (!again) ++counters_.corrections;
    const bool fresh = again && keep_parted(poses);
    if (again && !fresh && !(parting_.deepest < 0.5 * last)) return false;
    MixedSystem& parting = parting_system_;
    if (joints > 0 || !parts_by_sweeps()) parting.mass = system.mass;
    parting.momentum.assign(system.mass.size(), Vec6{});
    parting.rows.assign(system.rows.begin(), system.rows.begin() + static_cast<std::ptrdiff_t>(joints));
    gives_.clear();
    if (joints > 0) {
        find_gives(parting);
        double least = unbounded;
        for (const Lap& lap : laps_) least = std::min(least, give_of(lap.contact, gives_));
        hold_joints(parting, least);
    }
    arrays_.parted.begin(static_cast<int>(system.mass.size()));
    if (!(parts_by_sweeps() ? part_by_sweeps(parting, again) : part_directly(parting, again))) return false;
    note_parted(parting);
    note_far();
    if (far_) lap_poses_ = poses;
    if (!again) note_given();
    return true;
}

bool ContactStage::part_directly(MixedSystem& parting, bool again) {
    const std::size_t joints = parting.rows.size();
    std::vector<char>& answered = arrays_.answered;
    answered.assign(joints, 1);  // where nothing overlaps, nothing is displaced
    for (const Lap& lap : laps_) {
        answered.push_back(!(parting_speed(lap, again) > 0.0));
        RowBlock block;
        block.first = unknown_[lap.contact.first];
        block.second = unknown_[lap.contact.second];
        block.size = 1;
        const Vec3 normal = lap.contact.point.normal;
        if (block.first >= 0) block.first_jacobian[0] = contact_row(normal, lap.first_arm);
        if (block.second >= 0) block.second_jacobian[0] = contact_row(-normal, lap.second_arm);
        block.lower[0] = 0.0;
        block.right[0] = parting_speed(lap, again);
        block.state[0] = lap.push > 0.0 ? RowState::free : RowState::at_lower;
        if (joints > 0) block.softness[0] = give_of(lap.contact, gives_);
        parting.rows.push_back(block);
    }
    parting.velocity.clear();
    std::vector<FrictionPoint> none;
    if (!run(parting, none, parting_solver_, options_.friction, &answered).finite) return false;
    for (std::size_t k = joints; k < parting.rows.size(); ++k)
        if (parting.rows[k].multiplier[0] != 0.0)
            arrays_.parted.tie(parting.rows[k].first, parting.rows[k].second);
    parting.rows.resize(joints);
    return true;
}

bool ContactStage::part_by_sweeps(MixedSystem& parting, bool again) {
    parting_sweeps_.start_beside(sweeps_, parting, options_.friction, swings_ ? 1.0 : over_relaxation);
    for (const Lap& lap : laps_)
        parting_sweeps_.announce(unknown_[lap.contact.first], unknown_[lap.contact.second]);
    parting_sweeps_.arrange();
    for (std::size_t k = 0; k < laps_.size(); ++k) {
        const Lap& lap = laps_[k];
        SweepContact row;
        row.first = unknown_[lap.contact.first];
        row.second = unknown_[lap.contact.second];
        row.normal = lap.contact.point.normal;
        row.first_arm = lap.first_arm;
        row.second_arm = lap.second_arm;
        row.right[0] = parting_speed(lap, again);
        if (!parting.rows.empty()) row.softness = give_of(lap.contact, gives_);
        parting_sweeps_.add(row);
    }
    const FrictionReport report =
        parting_sweeps_.run(options_.iterations, options_.residual_tolerance, 0.0, nullptr);
    counters_.sweeps += static_cast<std::uint64_t>(report.sweeps);
    if (!report.finite) return false;
    parting_sweeps_.write(parting);
    for (std::size_t k = 0; k < laps_.size(); ++k) {
        const Contact& contact = laps_[k].contact;
        if (parting_sweeps_.impulse(static_cast<int>(k))[0] != 0.0)
            arrays_.parted.tie(unknown_[contact.first], unknown_[contact.second]);
    }
    return true;
}

void ContactStage::pay(int island, Vec3 momentum) noexcept {
    for (Touch& touch : touches_) {
        const int first = unknown_[touch.contact.first], second = unknown_[touch.contact.second];
        if (std::min(first, second) >= 0 || parting_.islands.of_body[std::max(first, second)] != island)
            continue;
        if (!(touch.normal > 0.0 || touch.impact > 0.0)) continue;
        touch.impulse += first >= 0 ? -momentum : momentum;
        return;
    }
}

}  // namespace spook
