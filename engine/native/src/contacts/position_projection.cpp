// The contact stage's last part: which bodies overlap where the step ends, and by which displacements they part.
#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "contacts/tolerances.hpp"
#include "linear/ahead.hpp"
#include "linear/regularisation.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

using namespace tolerances::position_projection;

}  // namespace

/// How far a compliant contact is pressed in at the end of the step: where it was, and the way its bodies go.
double ContactStage::compression(const MixedSystem& system, const Point& point) const {
    if (!(material(point.contact).compliance > 0.0)) return 0.0;
    const Contact& contact = point.contact;
    double speed = 0.0;
    for (const int b : {contact.first, contact.second}) {
        const Vec6& v = solver_index_[b] < 0 ? velocity_[b] : system.velocity[solver_index_[b]];
        const bool first = b == contact.first;
        speed += dot(contact_row(first ? contact.point.normal : -contact.point.normal,
                                 first ? point.first_arm : point.second_arm),
                     v);
    }
    const double before = std::min(point.compression_before, -contact.point.gap);  // an open gap comes first
    return std::max(0.0, before - time_left(point) * speed);
}

/// What a contact yields, 1/kg, per moving body on either side. A light body that is jointed to a heavy one, or touches
/// one, must not be what gives way in its stead: a contact that is soft against the heavier side lifts nothing.
void ContactStage::find_body_compliance(const MixedSystem& projection) {
    const Islands& connected = arrays_.connected.find(projection);
    std::vector<double>&mass = arrays_.island_mass, &give = body_compliance_;
    mass.assign(connected.count, 0.0), give.assign(projection.mass.size(), 0.0);
    for (std::size_t b = 0; b < give.size(); ++b)
        if (connected.of_body[b] >= 0) mass[connected.of_body[b]] += projection.mass[b][0];
    for (std::size_t b = 0; b < give.size(); ++b)
        give[b] = contact_compliance_share /
                  (connected.of_body[b] >= 0 ? mass[connected.of_body[b]] : projection.mass[b][0]);
}

double ContactStage::compliance_of(const Contact& contact,
                                   const std::vector<double>& compliances) const noexcept {
    const int a = solver_index_[contact.first], b = solver_index_[contact.second];
    return std::min(a < 0 ? unbounded : compliances[a], b < 0 ? unbounded : compliances[b]);
}

/// Rows of joints hold displacements instead of velocities; limits only push, and motors let go. They give far less
/// than the contacts, the least of which gives `least`.
void ContactStage::hold_joints(MixedSystem& projection, double least) const {
    for (std::size_t k = 0; k < projection.rows.size(); ++k) {
        RowBlock& block = projection.rows[k];
        for (int i = 0; i < block.size; ++i) {
            block.right[i] = block.multiplier[i] = 0.0;
            const bool below = block.lower[i] == -unbounded, above = block.upper[i] == unbounded;
            if (!below && !above) block.lower[i] = block.upper[i] = 0.0;
            if (k < yielding_.size() && yielding_[k] != 0) continue;
            const double softness = block.softness[i];
            block.softness[i] = 0.0;
            const double own = own_inertia(projection, block, i);
            block.softness[i] = std::min({softness, joint_compliance_share * own,
                                          std::max(joint_share * least, min_joint_compliance * own)});
        }
    }
}

/// Whether a moving surface, or a body that moves as it is told, may do work at a contact.
bool ContactStage::is_externally_driven(const Contact& contact) const {
    if (!has_external_drive_) return false;
    if (conveys(contact)) return true;
    for (const int b : {contact.first, contact.second}) {
        if (norm(linear(prescribed_[b])) > 0.0 || norm(angular(prescribed_[b])) > 0.0) return true;
    }
    return false;
}

/// Takes down how deep pairs overlap where the run begins: nothing but the scene has brought them there.
void ContactStage::note_initial_penetrations() {
    state_.initial_penetration_known = true;
    for (const Point& point : points_) {
        const double excess = -point.contact.point.gap - elastic_depth(point);
        if (!(excess > 0.0)) continue;
        double& given = state_.initial_penetration[point.contact.key >> feature_bits];
        given = std::max(given, excess);
    }
}

/// Takes down what is left of it, at most what it was.
void ContactStage::update_initial_penetrations() {
    if (state_.initial_penetration.empty()) return;
    DepthOfPair& left = arrays_.left;
    left.clear();
    for (const CachedContact& cached : state_.cache.sleeping)
        if (const auto given = state_.initial_penetration.find(cached.contact.key >> feature_bits);
            given != state_.initial_penetration.end())
            left[given->first] = given->second;
    for (const PenetrationRecord& record : penetrations_) {
        const auto given = state_.initial_penetration.find(record.contact.key >> feature_bits);
        if (!(record.depth > 0.0) || given == state_.initial_penetration.end()) continue;
        double& depth = left[given->first];
        depth = std::max(depth, std::min(record.depth, given->second));
    }
    state_.initial_penetration = left;
}

/// Whether a point parts by so much that its bodies may come down elsewhere, or push others aside, and one displacement is
/// not enough. By PGS balls never do, which only go aside: of a thousand of them hundreds part a little in each step.
bool ContactStage::moves_far(const PenetrationRecord& record) const noexcept {
    const double little = projects_by_pgs() ? min_separation_to_propagate_pgs : min_separation_to_propagate;
    if (!(record.depth > little * moving_size(record.contact))) return false;
    const auto swings = [this](int b) { return solver_index_[b] >= 0 && ball_[b] == 0; };
    return !projects_by_pgs() || swings(record.contact.first) || swings(record.contact.second);
}

/// What is to be looked at again: every body, or by PGS the islands of projection() in which a point has parted far, or a body
/// that is no ball was displaced: turned about one corner it may come down on others that had no point.
void ContactStage::mark_far_islands() {
    if (!projects_by_pgs()) return;
    moved_far_ = false;
    const auto island = [this](int b) {
        return solver_index_[b] < 0 ? -1 : projection_.islands.of_body[solver_index_[b]];
    };
    std::vector<char>& projected = filled(arrays_.moved_far, projection_.islands.count);
    for (const PenetrationRecord& record : penetrations_) {
        if (!moves_far(record)) continue;
        moved_far_ = true;
        for (const int b : {record.contact.first, record.contact.second})
            if (island(b) >= 0) projected[island(b)] = 1;
    }
    for (std::size_t b = 0; b < solver_index_.size(); ++b) {
        const int k = island(static_cast<int>(b));
        if (k < 0 || ball_[b] != 0 || projected[k] != 0) continue;
        const Vec6& d = projection_.velocity[solver_index_[b]];
        const double way =
            options_.time_step * (norm(linear(d)) + radius(static_cast<int>(b)) * norm(angular(d)));
        if (way > min_separation_to_propagate_pgs * radius(static_cast<int>(b)))
            moved_far_ = true, projected[k] = 1;
    }
    reconsidered_.resize(solver_index_.size());
    for (std::size_t b = 0; b < reconsidered_.size(); ++b) {
        const int k = island(static_cast<int>(b));
        reconsidered_[b] = k >= 0 && projected[k] != 0;
    }
}

/// Keeps points that earlier displacements of this step have parted and the manifolds have lost since, as those of two
/// edges when the faces beside them come down: they must not close again, or bodies would seesaw between them. Whether
/// something overlaps where those had no point.
bool ContactStage::keep_projected(const std::vector<Pose>& poses) {
    const auto order = [](const LargeArray<PenetrationRecord>& records, auto& places) {
        places.clear();
        for (std::size_t k = 0; k < records.size(); ++k) places.push_back({records[k].contact.key, k});
        std::sort(places.begin(), places.end());
    };
    const auto has = [this](const LargeArray<PenetrationRecord>& records, const auto& places,
                            const Contact& contact) {
        auto at = std::lower_bound(places.begin(), places.end(), std::make_pair(contact.key, std::size_t{0}));
        for (; at != places.end() && at->first == contact.key; ++at)  // parallel edges have one name
            if (norm(records[at->second].contact.point.position - contact.point.position) <
                same_place * size(contact))
                return true;
        return false;
    };
    order(penetrations_, places_);
    order(projected_, projected_places_);
    bool fresh = false;
    for (const PenetrationRecord& record : penetrations_)
        fresh = fresh ||
                (record.depth > slack(record.contact) && !has(projected_, projected_places_, record.contact));
    for (PenetrationRecord record : projected_) {
        const Contact& contact = record.contact;
        if (!is_reconsidered(contact.first, contact.second) || has(penetrations_, places_, contact)) continue;
        for (const int b : {contact.first, contact.second}) {
            Vec3& arm = b == contact.first ? record.first_arm : record.second_arm;
            const Vec3 now = poses[b].rotation * local(projected_poses_[b].rotation, arm);
            const Vec3 gone = poses[b].position - projected_poses_[b].position + now - arm;
            record.depth += dot(contact.point.normal, b == contact.first ? -gone : gone);
            arm = now;
        }
        record.depth = std::min(record.depth, 0.0);
        penetrations_.push_back(record);
    }
    return fresh;
}

void ContactStage::add_penetration(const Contact& contact, const std::vector<Pose>& poses, double excess) {
    PenetrationRecord& record = penetrations_.emplace_back();
    record.contact = contact;
    record.damping = std::max(materials_[contact.first].damping, materials_[contact.second].damping);
    record.first_arm = contact.point.position - poses[contact.first].position;
    record.second_arm = contact.point.position - poses[contact.second].position;
    record.depth = excess;
}

/// How far some point of a body has gone in the step, m.
double ContactStage::way(int b, const std::vector<Pose>& poses) const {
    double turned = 0.0;
    for (int i = 0; i < 9; ++i)
        turned = std::max(turned, std::abs(poses[b].rotation.m[i] - poses_[b].rotation.m[i]));
    return norm(poses[b].position - poses_[b].position) + (turned > 0.0 ? 3.0 * turned * radius(b) : 0.0);
}

/// Points of the step's pairs, up to gaps of `search_factor` times their largest overlap that nothing explains, with the bodies at
/// `poses`, into penetrations_; that overlap. None of them if there is no overlap. Balls have the same points however near one
/// looks, and are looked at once: as near as the last step lets expect.
double ContactStage::find_overlaps(const std::vector<Pose>& poses, bool again) {
    const double expected = swings_ ? 0.0 : 2.0 * search_factor * expected_overlap_;
    double deepest = look_for_overlaps(poses, expected, again);
    if (again) deepest = std::max(deepest, find_neighbour_overlaps(poses, 0.0));
    expected_overlap_ = deepest;
    if (!(deepest > 0.0)) return deepest;
    const double margin = search_factor * deepest;
    if (margin > expected) look_for_overlaps(poses, margin, again);
    else
        std::erase_if(penetrations_, [margin](const PenetrationRecord& record) {
            return record.contact.point.gap > margin;
        });
    if (!again) find_neighbours(poses, margin);
    find_neighbour_overlaps(poses, margin);
    if (!state_.cache.asleep.empty())
        for (const PenetrationRecord& record : penetrations_) wake_sleepers(record.contact);
    return deepest;
}

/// The same up to gaps of `margin`; without one, only the overlap. It does not count pairs that have not moved against each
/// other and did not overlap before.
double ContactStage::look_for_overlaps(const std::vector<Pose>& poses, double margin, bool again) {
    penetrations_.clear();
    double deepest = 0.0;
    unsigned seen = 0;
    const std::vector<CachedContact>& cache = state_.cache.points;
    for (std::size_t from = 0, end = 0; from < cache.size(); from = end) {
        const std::uint64_t key = cache[from].contact.key >> feature_bits;
        const int a = cache[from].contact.first, b = cache[from].contact.second;
        const double rounding = slack(cache[from].contact);
        double most_compression = 0.0;
        bool overlapped = false;
        for (; end < cache.size() && cache[end].contact.key >> feature_bits == key; ++end) {
            most_compression = std::max(most_compression, cache[end].compression);
            overlapped = overlapped || cache[end].contact.point.gap < -rounding;
        }
        if (from + ahead < cache.size()) {
            const Contact& later = cache[from + ahead].contact;
            for (const int body : {later.first, later.second}) prefetch(poses[body]), prefetch(poses_[body]);
        }
        if (!is_reconsidered(a, b)) continue;
        const auto is_still = [&] { return !overlapped && way(a, poses) + way(b, poses) < 0.1 * rounding; };
        if (margin == 0.0 && is_still()) continue;
        if (++seen % pairs_a_look == 0) Watch::look();
        scratch_.clear();
        const IndexPair pair{static_cast<int>(key >> 24), static_cast<int>(key & 0xffffff)};
        detection_.collide_pair(pair, poses[a], poses[b], margin, scratch_);
        for (const Contact& contact : scratch_) {
            double compression = 0.0;
            if (materials_[a].compliance + materials_[b].compliance > 0.0) compression = most_compression;
            for (std::size_t k = from; k < end; ++k)
                if (cache[k].contact.key == contact.key) compression = cache[k].compression;
            double excess = -contact.point.gap - compression - rounding;
            if (again && excess > 0.0 && state_.initial_penetration.contains(key))
                excess = std::max(0.0, excess - state_.initial_penetration.at(key));
            if (excess > deepest && (margin == 0.0 || !is_still())) deepest = excess;
            if (margin > 0.0) add_penetration(contact, poses, excess);
        }
    }
    return deepest;
}

/// How fast the bodies of an overlap are to part in the step, m/s; of points apart, how fast they may close.
double ContactStage::separation_speed(const PenetrationRecord& record, bool again) const {
    const double h = options_.time_step, excess = record.depth;
    const auto given = state_.initial_penetration.find(record.contact.key >> feature_bits);
    if (again || !(excess > 0.0) || given == state_.initial_penetration.end()) return excess / h;
    const double slow = std::min(excess, given->second);
    return regularise(0.0, record.damping, h).violation_gain * slow + (excess - slow) / h;
}

/// Which bodies are to be seen as one: contacts that pushed aside are known; contacts that push, whose laws a turn of some of
/// their bodies would break, joints and the ground are added.
void ContactStage::note_projected(const MixedSystem& projection) {
    for (const CachedContact& cached : state_.cache.points)
        if (cached.pushes())
            arrays_.projected.tie(solver_index_[cached.contact.first], solver_index_[cached.contact.second]);
    for (const RowBlock& block : projection.rows) arrays_.projected.tie(block);
    projection_.velocity = projection.velocity;
    projection_.islands = arrays_.projected.find();
    projection_.grounded.assign(projection_.islands.count, 0);
    for (const auto [first, second] : arrays_.projected.ties()) {
        const int body = std::max(first, second);
        if (std::min(first, second) < 0 && body >= 0)
            projection_.grounded[projection_.islands.of_body[body]] = 1;
    }
    projection_.externally_driven.assign(projection_.islands.count, 0);
    projection_.overlap.assign(projection_.islands.count, 0.0);
    projection_.overlap_before.assign(projection_.islands.count, 0.0);
    const auto island = [this](const Contact& contact) {
        return projection_.islands
            .of_body[std::max(solver_index_[contact.first], solver_index_[contact.second])];
    };
    for (const CachedContact& cached : state_.cache.points) {
        const int k = island(cached.contact);
        if (k < 0) continue;
        if (is_externally_driven(cached.contact)) projection_.externally_driven[k] = 1;
        projection_.overlap_before[k] = std::max(projection_.overlap_before[k], -cached.contact.point.gap);
    }
    for (const PenetrationRecord& record : penetrations_) {
        const int k = island(record.contact);
        if (!(record.depth > 0.0) || k < 0) continue;
        if (state_.initial_penetration.contains(record.contact.key >> feature_bits))
            projection_.externally_driven[k] = 1;
        projection_.overlap[k] = std::max(projection_.overlap[k], record.depth);
    }
}

bool ContactStage::project_positions(const MixedSystem& system, std::size_t joints,
                                     const std::vector<Pose>& poses, bool again) {
    const double last = projection_.deepest;
    projection_.velocity.clear();
    if (again && !moved_far_) return false;
    if (again) std::swap(penetrations_, projected_);
    else reconsidered_.clear();
    projection_.deepest = find_overlaps(poses, again);
    if (!(projection_.deepest > 0.0)) {
        if (!again) state_.initial_penetration.clear();
        return false;
    }
    if (!again) ++state_.counters.corrections;
    const bool fresh = again && keep_projected(poses);
    if (again && !fresh && !(projection_.deepest < 0.5 * last)) return false;
    MixedSystem& projection = projection_system_;
    if (joints > 0 || !projects_by_pgs()) projection.mass = system.mass;
    projection.momentum.assign(system.mass.size(), Vec6{});
    projection.rows.assign(system.rows.begin(), system.rows.begin() + static_cast<std::ptrdiff_t>(joints));
    body_compliance_.clear();
    if (joints > 0) {
        find_body_compliance(projection);
        double least = unbounded;
        for (const PenetrationRecord& record : penetrations_)
            least = std::min(least, compliance_of(record.contact, body_compliance_));
        hold_joints(projection, least);
    }
    arrays_.projected.begin(static_cast<int>(system.mass.size()));
    if (!(projects_by_pgs() ? project_by_pgs(projection, again) : project_directly(projection, again)))
        return false;
    note_projected(projection);
    mark_far_islands();
    if (moved_far_) projected_poses_ = poses;
    if (!again) update_initial_penetrations();
    return true;
}

bool ContactStage::project_directly(MixedSystem& projection, bool again) {
    const std::size_t joints = projection.rows.size();
    std::vector<char>& answered = arrays_.answered;
    answered.assign(joints, 1);  // where nothing overlaps, nothing is displaced
    for (const PenetrationRecord& record : penetrations_) {
        answered.push_back(!(separation_speed(record, again) > 0.0));
        RowBlock block;
        block.first = solver_index_[record.contact.first];
        block.second = solver_index_[record.contact.second];
        block.size = 1;
        const Vec3 normal = record.contact.point.normal;
        if (block.first >= 0) block.first_jacobian[0] = contact_row(normal, record.first_arm);
        if (block.second >= 0) block.second_jacobian[0] = contact_row(-normal, record.second_arm);
        block.lower[0] = 0.0;
        block.right[0] = separation_speed(record, again);
        block.state[0] = record.depth > 0.0 ? RowState::free : RowState::at_lower;
        if (joints > 0) block.softness[0] = compliance_of(record.contact, body_compliance_);
        projection.rows.push_back(block);
    }
    projection.velocity.clear();
    std::vector<FrictionPoint> none;
    if (!run(projection, none, projection_solver_, options_.friction, &answered).finite) return false;
    for (std::size_t k = joints; k < projection.rows.size(); ++k)
        if (projection.rows[k].multiplier[0] != 0.0)
            arrays_.projected.tie(projection.rows[k].first, projection.rows[k].second);
    projection.rows.resize(joints);
    return true;
}

bool ContactStage::project_by_pgs(MixedSystem& projection, bool again) {
    projection_pgs_.start_beside(pgs_, projection, options_.friction, swings_ ? 1.0 : over_relaxation);
    for (const PenetrationRecord& record : penetrations_)
        projection_pgs_.announce(solver_index_[record.contact.first], solver_index_[record.contact.second]);
    projection_pgs_.arrange();
    for (std::size_t k = 0; k < penetrations_.size(); ++k) {
        const PenetrationRecord& record = penetrations_[k];
        PgsContact row;
        row.first = solver_index_[record.contact.first];
        row.second = solver_index_[record.contact.second];
        row.normal = record.contact.point.normal;
        row.first_arm = record.first_arm;
        row.second_arm = record.second_arm;
        row.right[0] = separation_speed(record, again);
        if (!projection.rows.empty()) row.softness = compliance_of(record.contact, body_compliance_);
        projection_pgs_.add(row);
    }
    const FrictionReport report =
        projection_pgs_.run(options_.iterations, options_.residual_tolerance, 0.0, nullptr);
    state_.counters.pgs_iterations += static_cast<std::uint64_t>(report.pgs_iterations);
    if (!report.finite) return false;
    projection_pgs_.write(projection);
    for (std::size_t k = 0; k < penetrations_.size(); ++k) {
        const Contact& contact = penetrations_[k].contact;
        if (projection_pgs_.impulse(static_cast<int>(k))[0] != 0.0)
            arrays_.projected.tie(solver_index_[contact.first], solver_index_[contact.second]);
    }
    return true;
}

void ContactStage::apply_balancing_impulse(int island, Vec3 momentum) noexcept {
    for (CachedContact& cached : state_.cache.points) {
        const int first = solver_index_[cached.contact.first], second = solver_index_[cached.contact.second];
        if (std::min(first, second) >= 0 || projection_.islands.of_body[std::max(first, second)] != island)
            continue;
        if (!cached.pushes()) continue;
        cached.impulse += first >= 0 ? -momentum : momentum;
        return;
    }
}

}  // namespace spook
