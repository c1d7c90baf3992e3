#include "contacts/position_projection.hpp"

#include <algorithm>
#include <tuple>

#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"
#include "linear/regularisation.hpp"

namespace spook {

using namespace tolerances::position_projection;

PositionProjector::PositionProjector(std::shared_ptr<const ContactModel> model, std::vector<char> yielding)
    : model_(std::move(model)),
      yielding_(std::move(yielding)),
      by_pgs_(model_->options.solver == SolverKind::iterative && !model_->surfaces.resists_turning),
      search_(model_, by_pgs_) {
    solver_.floor = model_->options.floor;
    solver_.refinements = model_->options.refinements;
}

void PositionProjector::begin_step() {
    for (std::vector<char>* flags :
         {&projection_.grounded, &projection_.externally_driven, &projection_.first_overlaps, &far_islands_})
        flags->reserve(model_->bodies.count());
    for (std::vector<double>* depths : {&projection_.overlap, &projection_.overlap_before})
        depths->reserve(model_->bodies.count());
}

/// What a contact yields, 1/kg, per moving body on either side. A light body that is jointed to a heavy one, or touches
/// one, must not be what gives way in its stead: a contact that is soft against the heavier side lifts nothing.
void PositionProjector::find_body_compliance(const MixedSystem& projection) {
    const Islands& connected = connected_.find(projection);
    std::vector<double>&mass = island_mass_, &give = compliance_;
    mass.assign(connected.count, 0.0), give.assign(projection.mass.size(), 0.0);
    for (std::size_t b = 0; b < give.size(); ++b)
        if (connected.of_body[b] >= 0) mass[connected.of_body[b]] += projection.mass[b][0];
    for (std::size_t b = 0; b < give.size(); ++b)
        give[b] = contact_compliance_share /
                  (connected.of_body[b] >= 0 ? mass[connected.of_body[b]] : projection.mass[b][0]);
}

double PositionProjector::compliance_of(const Contact& contact) const noexcept {
    const int a = model_->bodies.solver_index[contact.first], b = model_->bodies.solver_index[contact.second];
    return std::min(a < 0 ? unbounded : compliance_[a], b < 0 ? unbounded : compliance_[b]);
}

/// Rows of joints hold displacements instead of velocities; limits only push, and motors let go. They give far less
/// than the contacts, the least of which gives `least`.
void PositionProjector::hold_joints(MixedSystem& projection, double least) {
    masses_.find(projection.mass);
    for (std::size_t k = 0; k < projection.rows.size(); ++k) {
        RowBlock& block = projection.rows[k];
        for (int i = 0; i < block.size; ++i) {
            block.right[i] = block.multiplier[i] = 0.0;
            const bool below = block.lower[i] == -unbounded, above = block.upper[i] == unbounded;
            if ((!below && !above) || i == block.rotor) block.lower[i] = block.upper[i] = 0.0;
            if (k < yielding_.size() && yielding_[k] != 0) continue;
            const double softness = block.softness[i];
            block.softness[i] = 0.0;
            const double own = own_inertia(masses_, block, i);
            block.softness[i] = std::min({softness, joint_compliance_share * own,
                                          std::max(joint_share * least, min_joint_compliance * own)});
        }
    }
}

/// Takes down what is left of the overlaps that the run began with, at most what it was.
void PositionProjector::update_initial_penetrations(const ContactCache& cache,
                                                    DepthOfPair& initial_penetration) {
    if (initial_penetration.empty()) return;
    left_.clear();
    for (const CachedContact& cached : cache.sleeping)
        if (const auto given = initial_penetration.find(pair_of(cached.contact));
            given != initial_penetration.end())
            left_[given->pair] = *given;
    for (const PenetrationRecord& record : search_.records) {
        const auto given = initial_penetration.find(pair_of(record.contact));
        if (!(record.depth > 0.0) || given == initial_penetration.end()) continue;
        double& depth = left_[given->pair].depth;
        depth = std::max(depth, std::min(record.depth, given->depth));
    }
    for (DepthOfPair::Item& left : left_.items)
        if (const auto given = initial_penetration.find(left.pair);
            given->jammed && left.depth > still_jammed * given->depth)
            left = *given;
    initial_penetration = left_;
}

/// What is to be looked at again: every body, or by PGS the islands of the projection in which a point has parted far, or a body
/// that is no ball was displaced: turned about one corner it may come down on others that had no point. False if nothing is.
bool PositionProjector::mark_far_islands() {
    if (!by_pgs_) return goes_on_;
    bool some = false;
    const auto island = [this](int b) {
        return model_->bodies.moves(b) ? projection_.islands.of_body[model_->bodies.solver_index[b]] : -1;
    };
    std::vector<char>& far = filled(far_islands_, projection_.islands.count);
    for (const PenetrationRecord& record : search_.records) {
        if (!search_.moves_far(record)) continue;
        some = true;
        for (const int b : {record.contact.first, record.contact.second})
            if (island(b) >= 0) far[island(b)] = 1;
    }
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        const int k = island(static_cast<int>(b));
        if (k < 0 || model_->bodies.ball[b] != 0 || far[k] != 0) continue;
        const Vec6& d = projection_.velocity[model_->bodies.solver_index[b]];
        const double way =
            model_->options.time_step * (norm(linear(d)) + model_->bodies.radius[b] * norm(angular(d)));
        if (search_.is_far(way, model_->bodies.radius[b])) some = true, far[k] = 1;
    }
    reconsidered_.resize(model_->bodies.count());
    for (std::size_t b = 0; b < reconsidered_.size(); ++b) {
        const int k = island(static_cast<int>(b));
        reconsidered_[b] = k >= 0 && far[k] != 0;
    }
    return some;
}

/// Keeps points that earlier displacements of this step have parted and the manifolds have lost since, as those of two
/// edges when the faces beside them come down: they must not close again, or bodies would seesaw between them. Whether
/// something overlaps where those had no point.
bool PositionProjector::keep_projected(const std::vector<Pose>& poses) {
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
                same_place * model_->bodies.size(contact))
                return true;
        return false;
    };
    order(search_.records, places_);
    order(projected_, projected_places_);
    bool fresh = false;
    for (const PenetrationRecord& record : search_.records)
        fresh = fresh || (record.depth > model_->bodies.slack(record.contact) &&
                          !has(projected_, projected_places_, record.contact));
    for (PenetrationRecord record : projected_) {
        const Contact& contact = record.contact;
        if (!is_among(reconsidered_, contact.first, contact.second) || has(search_.records, places_, contact))
            continue;
        for (const int b : {contact.first, contact.second}) {
            Vec3& arm = b == contact.first ? record.first_arm : record.second_arm;
            const Vec3 now = poses[b].rotation * local(projected_poses_[b].rotation, arm);
            const Vec3 gone = poses[b].position - projected_poses_[b].position + now - arm;
            record.depth += dot(contact.point.normal, b == contact.first ? -gone : gone);
            arm = now;
        }
        record.depth = std::min(record.depth, 0.0);
        search_.records.push_back(record);
    }
    return fresh;
}

/// How fast the bodies of an overlap are to part in the step, m/s; of points apart, how fast they may close.
double PositionProjector::separation_speed(const PenetrationRecord& record, const DepthOfPair& initial,
                                           bool again) const {
    const double h = model_->options.time_step, excess = record.depth;
    const auto given = initial.find(pair_of(record.contact));
    if (again || !(excess > 0.0) || given == initial.end()) return excess / h;
    const double slow = std::min(excess, given->depth);
    const double gain = given->jammed ? 0.0 : regularise(0.0, record.damping, h).violation_gain;
    return gain * slow + (excess - slow) / h;
}

/// Whether an overlap is one that the run began with, no deeper, and is pushed: something may do work on it.
bool PositionProjector::is_pushed_first(const PenetrationRecord& record, const DepthOfPair& initial) const {
    const auto given = initial.find(pair_of(record.contact));
    return record.depth > 0.0 && given != initial.end() && !given->jammed &&
           record.depth <= given->depth + model_->bodies.slack(record.contact);
}

bool PositionProjector::parts(int island, double share, const std::vector<Pose>& poses,
                              const Detection& detection, DepthOfPair& initial) {
    bool all = true;
    for (const PenetrationRecord& record : search_.records) {
        if (projection_.islands.of_body[model_->bodies.solver_body(record.contact)] != island) continue;
        if (!is_pushed_first(record, initial)) continue;
        const std::uint64_t key = pair_of(record.contact);
        met_.clear();
        detection.collide_pair({static_cast<int>(key >> 24), static_cast<int>(key & 0xffffff)},
                               poses[record.contact.first], poses[record.contact.second], 0.0, met_);
        const double way = share * model_->options.time_step * separation_speed(record, initial, false);
        const bool parts = std::all_of(met_.begin(), met_.end(), [&](const Contact& contact) {
            return contact.key != record.contact.key ||
                   contact.point.gap >= record.contact.point.gap + least_parted * way;
        });
        initial[key].jammed = !parts;
        all = all && parts;
    }
    return all;
}

/// Which bodies are to be seen as one: contacts that pushed aside are known; contacts that push, whose laws a turn of some of
/// their bodies would break, joints and the ground are added.
void PositionProjector::note_projected(const StepEnd& end, const ExternalDrive& drive) {
    for (const CachedContact& cached : end.cache.points)
        if (cached.pushes()) pushed_.tie(model_->bodies.solver_pair(cached.contact));
    for (const RowBlock& block : system_.rows) pushed_.tie(block);
    projection_.velocity = system_.velocity;
    projection_.islands = pushed_.find();
    projection_.grounded.assign(projection_.islands.count, 0);
    for (const auto [first, second] : pushed_.ties()) {
        const int body = std::max(first, second);
        if (std::min(first, second) < 0 && body >= 0)
            projection_.grounded[projection_.islands.of_body[body]] = 1;
    }
    projection_.externally_driven.assign(projection_.islands.count, 0);
    projection_.first_overlaps.assign(projection_.islands.count, 0);
    projection_.overlap.assign(projection_.islands.count, 0.0);
    projection_.overlap_before.assign(projection_.islands.count, 0.0);
    const auto island = [this](const Contact& contact) {
        return projection_.islands.of_body[model_->bodies.solver_body(contact)];
    };
    for (const CachedContact& cached : end.cache.points) {
        const int k = island(cached.contact);
        if (k < 0) continue;
        if (drive.acts_at(cached.contact, model_->surfaces)) projection_.externally_driven[k] = 1;
        projection_.overlap_before[k] = std::max(projection_.overlap_before[k], -cached.contact.point.gap);
    }
    for (const PenetrationRecord& record : search_.records) {
        const int k = island(record.contact);
        if (!(record.depth > 0.0) || k < 0) continue;
        if (is_pushed_first(record, end.initial_penetration))
            projection_.externally_driven[k] = projection_.first_overlaps[k] = 1;
        projection_.overlap[k] = std::max(projection_.overlap[k], record.depth);
    }
}

bool PositionProjector::project_directly(const DepthOfPair& given, bool again, ContactCounters& counters) {
    MixedSystem& projection = system_;
    const std::size_t joints = projection.rows.size();
    answered_.assign(joints, 1);  // where nothing overlaps, nothing is displaced
    for (const PenetrationRecord& record : search_.records) {
        answered_.push_back(!(separation_speed(record, given, again) > 0.0));
        RowBlock block;
        std::tie(block.first, block.second) = model_->bodies.solver_pair(record.contact);
        block.size = 1;
        const Vec3 normal = record.contact.point.normal;
        if (block.first >= 0) block.first_jacobian[0] = contact_row(normal, record.first_arm);
        if (block.second >= 0) block.second_jacobian[0] = contact_row(-normal, record.second_arm);
        block.lower[0] = 0.0;
        block.right[0] = separation_speed(record, given, again);
        block.state[0] = record.depth > 0.0 ? RowState::free : RowState::at_lower;
        if (joints > 0) block.softness[0] = compliance_of(record.contact);
        projection.rows.push_back(block);
    }
    projection.velocity.clear();
    std::vector<FrictionPoint> none;
    const IslandRules rules{.friction = model_->options.friction,
                            .enough = model_->options.unsettled_residual};
    if (!solve_islands(projection, none, solver_, model_->options, rules, counters, &answered_).finite)
        return false;
    for (std::size_t k = joints; k < projection.rows.size(); ++k)
        if (projection.rows[k].multiplier[0] != 0.0)
            pushed_.tie(projection.rows[k].first, projection.rows[k].second);
    projection.rows.resize(joints);
    return true;
}

bool PositionProjector::project_by_pgs(const PgsSolver& beside, const DepthOfPair& given, bool again,
                                       ContactCounters& counters) {
    MixedSystem& projection = system_;
    pgs_.start_beside(beside, projection, model_->options.friction,
                      model_->bodies.swings ? 1.0 : over_relaxation);
    for (const PenetrationRecord& record : search_.records)
        pgs_.announce(model_->bodies.solver_index[record.contact.first],
                      model_->bodies.solver_index[record.contact.second]);
    pgs_.arrange();
    for (std::size_t k = 0; k < search_.records.size(); ++k) {
        const PenetrationRecord& record = search_.records[k];
        PgsContact row;
        std::tie(row.first, row.second) = model_->bodies.solver_pair(record.contact);
        row.normal = record.contact.point.normal;
        row.first_arm = record.first_arm;
        row.second_arm = record.second_arm;
        row.right[0] = separation_speed(record, given, again);
        if (!projection.rows.empty()) row.softness = compliance_of(record.contact);
        pgs_.add(row);
    }
    const FrictionReport report =
        pgs_.run(model_->options.iterations, model_->options.residual_tolerance, 0.0, nullptr);
    counters.pgs_iterations += static_cast<std::uint64_t>(report.pgs_iterations);
    if (!report.finite) return false;
    pgs_.write(projection);
    for (std::size_t k = 0; k < search_.records.size(); ++k) {
        const Contact& contact = search_.records[k].contact;
        if (pgs_.impulse(static_cast<int>(k))[0] != 0.0) pushed_.tie(model_->bodies.solver_pair(contact));
    }
    return true;
}

const PositionProjection* PositionProjector::project(const Solved& solved, const StepEnd& end,
                                                     const ExternalDrive& drive, bool again,
                                                     DepthOfPair& initial_penetration,
                                                     ContactCounters& counters, std::vector<int>& woken) {
    if (again && !goes_on_) return nullptr;
    const double last = deepest_;
    if (again) {
        std::swap(search_.records, projected_);
        deepest_ = search_.find_again(end, reconsidered_);
    } else {
        const OverlapSearch::Found found = search_.find(end);
        deepest_ = found.deepest, goes_on_ = found.goes_on;
    }
    if (!(deepest_ > 0.0)) {
        if (!again) initial_penetration.clear();
        return nullptr;
    }
    const auto is_rounding = [this](const PenetrationRecord& record) {
        return record.depth <= parted * model_->bodies.slack(record.contact);
    };
    if (again && std::all_of(search_.records.begin(), search_.records.end(), is_rounding)) return nullptr;
    for (const PenetrationRecord& record : search_.records)
        for (const int body : {record.contact.first, record.contact.second})
            if (end.detection.is_asleep(body)) woken.push_back(body);
    if (!again) ++counters.corrections;
    const bool fresh = again && keep_projected(end.poses);
    if (again && !fresh && !(deepest_ < 0.5 * last)) return nullptr;
    const auto& [system, joints, beside] = solved;
    if (joints > 0 || !by_pgs_) system_.mass = system.mass;
    system_.momentum.assign(system.mass.size(), Vec6{});
    system_.rows.assign(system.rows.begin(), system.rows.begin() + static_cast<std::ptrdiff_t>(joints));
    compliance_.clear();
    if (joints > 0) {
        find_body_compliance(system_);
        double least = unbounded;
        for (const PenetrationRecord& record : search_.records)
            least = std::min(least, compliance_of(record.contact));
        hold_joints(system_, least);
    }
    pushed_.begin(static_cast<int>(system.mass.size()));
    if (!(by_pgs_ ? project_by_pgs(beside, initial_penetration, again, counters)
                  : project_directly(initial_penetration, again, counters)))
        return nullptr;
    note_projected(end, drive);
    goes_on_ = mark_far_islands();
    if (goes_on_) projected_poses_ = end.poses;
    if (!again) update_initial_penetrations(end.cache, initial_penetration);
    return &projection_;
}

}  // namespace spook
