// Stage: project positions. Overlapping bodies are parted by positions, and nothing else is to be seen of it; joints that stand
// beyond a limit return to it.
//
// The contact stage gives displacements d, of the order of an overlap whatever the time step. What is linear in d its
// rows take care of; the rest is done here, island by island:
//   joints     A turn of finite size leaves a violation of order d², which the next step's rows would answer with the
//              speed (4/h) Ups d²: 1000 J out of nothing at h = 1e-6 s. Newton's method takes it back, along M⁻¹ Gᵀ.
//   momenta    Σ m d = 0 holds already. Σ r × p + l is brought back by one rigid turn of the whole island, v += w × r,
//              l += I w: no joint and no contact feels it.
//   energy     Where the kinetic energy E has grown, the velocities are drawn towards the rigid motion that has the
//              island's momenta: they keep the momenta, and with share s left, E(s) = E_rigid + s² (E − E_rigid).
//              In an island that leans on the ground each body's angular momentum is shortened instead.
//   lifting    Bodies lifted against gravity gain Σ −f d. Contacts have taken energy in the same step, by stopping
//              bodies, by friction, or by letting them sink: it pays first. The rest is paid by the kinetic energy, all
//              velocities shortened alike, which no row over resting bodies feels. What both cannot pay is not lifted.
// Where this cannot be, half the way is tried, and a quarter, an eighth: overlaps may stay, energy may not rise. But where
// what cannot be paid is more than the step began with, iterations that ended early have moved what should rest: then the
// island goes back to where the step began, which the energy it had then pays for, and the next step iterates on.
//
// reads: places and velocities where the step ends, the contact cache, scratch_.start_of_contacts. writes: places, orientations and,
// where energy or momenta ask for it, velocities of bodies; the penetration that the scene began with, as far as it is left.
#include <algorithm>
#include <cmath>

#include "rigid/island_frame.hpp"
#include "rigid/overlap_projection.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::project_positions;

Vec3 solved(const Mat3& a, Vec3 b) noexcept {
    const Vec3 x{a.m[0], a.m[3], a.m[6]}, y{a.m[1], a.m[4], a.m[7]}, z{a.m[2], a.m[5], a.m[8]};
    const double determinant = dot(x, cross(y, z));
    return (1.0 / determinant) * Vec3{dot(b, cross(y, z)), dot(x, cross(b, z)), dot(x, cross(y, b))};
}

}  // namespace

void OverlapProjection::project_positions() {
    if (joints_.stops().take_some_overstepped()) project_limits();
    if (mixed_.touching()) project_overlaps();
}

/// Parts what overlaps where the step ends; again as long as it helps, since a displacement is only right to first
/// order, and turns bring other points down.
void OverlapProjection::project_overlaps() {
    for (int round = 0; round < max_projections; ++round) {
        scratch_.end_poses.resize(model_.constants.size());
        for (int i = 0; i < model_.bodies(); ++i)
            scratch_.end_poses[i] = {model_.position(i, live_.bodies),
                                     axes(model_.constants[i], live_.bodies[i])};
        projection_ = mixed_.contacts()->project_positions(mixed_.system, joints_.blocks().size(),
                                                           scratch_.end_poses, round > 0);
        if (projection_ == nullptr) return;
        project_bodies();
    }
}

/// The energy that contacts have taken from some bodies in this step so far, J: what forces and joints did on them,
/// less what their kinetic energy has grown by; none if that is negative.
double OverlapProjection::dissipated_energy(const std::vector<int>& members,
                                            const std::vector<int>& own_blocks) const {
    double sum = 0.0;
    for (const int k : members) {
        const int i = model_.constrained[k];
        const BodyState& s = live_.bodies[i];
        sum += 0.5 * (scratch_.start_of_contacts[i].energy - twice_energy(model_.constants[i], s)) +
               dot(forces_.force(i), s.displacement - scratch_.start_of_contacts[i].displacement) +
               model_.h * dot(model_.constants[i].torque, s.angular_velocity);
    }
    for (const int k : own_blocks) {
        const RowBlock& block = mixed_.system.rows[k];
        double work = 0.0;
        for (int i = 0; i < block.size; ++i) {
            double speed = row_velocity(block, i, mixed_.system.velocity);
            if (block.first >= 0)
                speed += dot(block.first_jacobian[i], scratch_.velocities[model_.constrained[block.first]]);
            if (block.second >= 0)
                speed += dot(block.second_jacobian[i], scratch_.velocities[model_.constrained[block.second]]);
            for (const FurtherBody& other : block.further)
                speed += dot(other.jacobian, scratch_.velocities[model_.constrained[other.body]]);
            work += 0.5 * block.multiplier[i] * speed;
        }
        sum += std::max(0.0, work);
    }
    return std::max(0.0, sum);
}

/// What the displacement has cost against the forces, J.
double OverlapProjection::lifting_energy(const std::vector<int>& members) const {
    double sum = 0.0;
    for (const int k : members) {
        const int i = model_.constrained[k];
        sum -=
            dot(forces_.force(i), live_.bodies[i].displacement - scratch_.before_projection[i].displacement);
    }
    return sum;
}

/// The part of an island's displacement that what contacts took and its kinetic energy can pay for.
double OverlapProjection::affordable_share(int island) const {
    const PositionProjection& projection = *projection_;
    if (projection.externally_driven[island] != 0) return 1.0;
    double cost = 0.0, twice = 0.0;
    for (const int k : scratch_.island_members[island]) {
        const Vec6& d = projection.velocity[k];
        cost -= model_.h * dot(forces_.force(model_.constrained[k]), {d[0], d[1], d[2]});
        twice += twice_energy(model_.constants[model_.constrained[k]],
                              scratch_.before_projection[model_.constrained[k]]);
    }
    const double available_energy = scratch_.dissipated[island] + 0.5 * twice;
    return cost <= available_energy ? 1.0 : 0.999 * available_energy / cost;
}

/// Which body belongs to which island, and how far its joints are from where they hold.
void OverlapProjection::gather_islands() {
    const Islands& islands = projection_->islands;
    const auto count = static_cast<std::size_t>(islands.count);
    if (scratch_.island_members.size() <
        count) {  // lists keep their memory; later there may be more, of a few bodies each
        scratch_.island_members.resize(model_.constrained.size()),
            scratch_.island_blocks.resize(model_.constrained.size());
        for (std::vector<int>& members : scratch_.island_members) members.reserve(few_members);
        scratch_.dissipated.reserve(model_.constrained.size());
    }
    for (std::size_t k = 0; k < count; ++k)
        scratch_.island_members[k].clear(), scratch_.island_blocks[k].clear();
    for (std::size_t k = 0; k < model_.constrained.size(); ++k)
        if (islands.of_body[k] >= 0)
            scratch_.island_members[islands.of_body[k]].push_back(static_cast<int>(k));
    const auto blocks = joints_.blocks();
    scratch_.overstep_at.assign(blocks.size(), 0);
    std::size_t rows = 0;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        scratch_.overstep_at[k] = rows;
        rows += blocks[k].size;
        const int tied = std::max(mixed_.system.rows[k].first, mixed_.system.rows[k].second);
        if (tied >= 0) scratch_.island_blocks[islands.of_body[tied]].push_back(static_cast<int>(k));
    }
    scratch_.overstep.resize(rows);
    for (std::size_t k = 0; k < blocks.size(); ++k)
        joints_.overstep(static_cast<int>(k), live_.bodies,
                         scratch_.overstep.data() + scratch_.overstep_at[k]);
    scratch_.before_projection = live_.bodies;
    scratch_.dissipated.assign(islands.count, 0.0);
}

/// Leads bodies that the scene has put beyond their joints' limits a part of the way back, at the rate of the limit's
/// row: by positions, with all other rows where they are.
void OverlapProjection::project_limits() {
    const auto blocks = joints_.blocks();
    scratch_.finder.begin(static_cast<int>(model_.constrained.size()));
    for (std::size_t k = 0; k < blocks.size(); ++k)
        scratch_.finder.tie(mixed_.system.rows[k].first, mixed_.system.rows[k].second);
    for (std::size_t k = 0; k < blocks.size(); ++k)
        for (int body : joints_.others(static_cast<int>(k)))
            if (model_.solver_index[body] >= 0)
                scratch_.finder.tie(mixed_.system.rows[k].first, model_.solver_index[body]);
    limit_projection_.islands = scratch_.finder.find();
    const std::size_t islands = static_cast<std::size_t>(limit_projection_.islands.count);
    limit_projection_.velocity.assign(model_.constrained.size(), Vec6{});
    limit_projection_.grounded.assign(islands, 0);
    limit_projection_.externally_driven.assign(islands, 1);
    projection_ = &limit_projection_;
    gather_islands();
    std::vector<char>& beyond = scratch_.beyond;
    beyond.assign(islands, 0);
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        if (rests(blocks[k], live_)) continue;
        const int first = mixed_.system.rows[k].first, second = mixed_.system.rows[k].second;
        const int island = limit_projection_.islands.of_body[std::max(first, second)];
        if (std::min(first, second) < 0) limit_projection_.grounded[island] = 1;
        if (joints_.folds(static_cast<int>(k))) {  // to where it shall be, the zero of its overstep
            double* at = scratch_.overstep.data() + scratch_.overstep_at[k];
            if (std::any_of(at, at + blocks[k].size, [](double each) { return each != 0.0; }))
                beyond[island] = 1;
            std::fill_n(at, blocks[k].size, 0.0);
            continue;
        }
        int row = 0;
        const double back = joints_.overstep_to_return(static_cast<int>(k), row);
        if (back == 0.0) continue;
        scratch_.overstep[scratch_.overstep_at[k] + row] -= back;
        beyond[island] = 1;
    }
    for (int island = 0; island < limit_projection_.islands.count; ++island)
        if (beyond[island] != 0 && !project_island(island, 1.0))
            for (const int k : scratch_.island_members[island])
                live_.bodies[model_.constrained[k]] = scratch_.before_projection[model_.constrained[k]];
}

/// Whether an island of what parts sleeps, and nothing is to be parted there.
bool OverlapProjection::sleeps(const std::vector<int>& members) const {
    return live_.sleep.sleepers > 0 && std::all_of(members.begin(), members.end(), [this](int k) {
               return live_.asleep(model_.constrained[k]) && projection_->velocity[k] == Vec6{};
           });
}

void OverlapProjection::project_bodies() {
    gather_islands();
    for (int island = 0; island < projection_->islands.count; ++island) {
        if (sleeps(scratch_.island_members[island])) continue;
        scratch_.dissipated[island] =
            dissipated_energy(scratch_.island_members[island], scratch_.island_blocks[island]);
        const double share = affordable_share(island);
        const double left = (1.0 - share) * projection_->overlap[island];
        if (left > projection_->overlap_before[island] && take_back(island)) continue;
        for (int halving = 0; halving < most_halvings; ++halving) {
            const double tried = std::ldexp(share, -halving);
            const bool moved = project_island(island, tried);
            if (moved && parts_first_overlaps(island, tried)) break;
            for (const int k : scratch_.island_members[island])
                live_.bodies[model_.constrained[k]] = scratch_.before_projection[model_.constrained[k]];
            if (moved) break;  // jammed, which no part of the way is to be tried for
        }
    }
}

/// Whether an island's overlaps that the run began with are less for its displacement: where joints jam them they are not, and
/// would be pushed at, and give energy, for ever.
bool OverlapProjection::parts_first_overlaps(int island, double share) {
    if (projection_->first_overlaps[island] == 0) return true;
    for (const int k : scratch_.island_members[island]) {
        const int i = model_.constrained[k];
        scratch_.end_poses[i] = {model_.position(i, live_.bodies),
                                 axes(model_.constants[i], live_.bodies[i])};
    }
    return mixed_.contacts()->parts_first_overlaps(island, share, scratch_.end_poses);
}

bool OverlapProjection::project_island(int island, double share) {
    const PositionProjection& projection = *projection_;
    const std::vector<int>& members = scratch_.island_members[island];
    for (const int k : members) {
        const Vec6& d = projection.velocity[k];
        displace(model_.constants[model_.constrained[k]], share * model_.h, {d[0], d[1], d[2]},
                 {d[3], d[4], d[5]}, live_.bodies[model_.constrained[k]]);
    }
    return hold_joints(members, scratch_.island_blocks[island]) && keep_energy(island);
}

/// Back to where the step began; false if that, too, cannot be.
bool OverlapProjection::take_back(int island) {
    const std::vector<int>& members = scratch_.island_members[island];
    for (const int k : members) {
        const int i = model_.constrained[k];
        BodyState& s = live_.bodies[i];
        s.displacement = scratch_.start_of_contacts[i].displacement;
        s.turn = scratch_.start_of_contacts[i].turn;
        if (!model_.constants[i].particle) refresh(model_.constants[i], s);
    }
    if (keep_energy(island)) return true;
    for (const int k : members)
        live_.bodies[model_.constrained[k]] = scratch_.before_projection[model_.constrained[k]];
    return false;
}

/// Momenta and energy of an island whose places have changed; false if they cannot be kept.
bool OverlapProjection::keep_energy(int island) {
    const PositionProjection& projection = *projection_;
    const std::vector<int>& members = scratch_.island_members[island];
    double limit = 0.0, now = 0.0;
    for (const int k : members)
        limit += twice_energy(model_.constants[model_.constrained[k]],
                              scratch_.before_projection[model_.constrained[k]]);
    if (projection.externally_driven[island] == 0)
        limit -= 2.0 * std::max(0.0, lifting_energy(members) - scratch_.dissipated[island]);
    if (!(limit >= 0.0)) return false;
    if (projection.grounded[island] == 0) return keep_momenta(members, limit);
    for (const int k : members) {
        keep_spin_energy(model_.constrained[k]);
        now += twice_energy(model_.constants[model_.constrained[k]], live_.bodies[model_.constrained[k]]);
    }
    if (now <= limit) return true;
    const double left = std::sqrt(limit / now);
    Vec3 lost;
    for (const int k : members) {
        BodyState& s = live_.bodies[model_.constrained[k]];
        lost += (1.0 - left) * model_.constants[model_.constrained[k]].mass * s.velocity;
        s.velocity *= left;
        s.angular_momentum *= left;
        if (!model_.constants[model_.constrained[k]].particle)
            refresh(model_.constants[model_.constrained[k]], s);
    }
    if (projection_ != &limit_projection_)
        mixed_.contacts()->apply_balancing_impulse(projection_->islands, island, lost);
    return true;
}

/// A joint's row that is to lead back to where it was before the displacement; how far that is, of the joint's size. A stop, or a
/// wire, that is overstepped by less than before, or was left, may stay so: led back it would close what has parted.
double OverlapProjection::hold_row(int k, int row, double now, RowBlock& block) const {
    const JointBlock& joint = joints_.blocks()[k];
    double wanted = scratch_.overstep[scratch_.overstep_at[k] + row];
    if (now == 0.0 && wanted == 0.0 && !joints_.always_holds(joint))
        block.lower[row] = block.upper[row] = 0.0;
    else if (joints_.lets_go(joint)) {
        const bool high = (now == 0.0 ? wanted : now) > 0.0;
        wanted = high ? std::max(0.0, wanted) : std::min(0.0, wanted);
        (high ? block.upper : block.lower)[row] = 0.0;
        if (high ? now <= wanted : now >= wanted) {
            block.right[row] = (wanted - now) / model_.h;
            return 0.0;
        }
    }
    block.right[row] = (wanted - now) / model_.h;
    return std::abs(now - wanted) / joints_.gain(k, row).extent;
}

/// Brings the joints back to where they were before the displacement; false if they cannot be.
bool OverlapProjection::hold_joints(const std::vector<int>& members, const std::vector<int>& own_blocks) {
    if (own_blocks.empty()) return true;
    const auto blocks = joints_.blocks();
    std::vector<int>& place = scratch_.place;
    place.assign(model_.constrained.size(), -1);
    MixedSystem& system = scratch_.holding;
    system.mass.clear();
    for (std::size_t i = 0; i < members.size(); ++i) {
        place[members[i]] = static_cast<int>(i);
        system.mass.push_back(mixed_.system.mass[members[i]]);
    }
    system.rows.resize(own_blocks.size());
    scratch_.holding_further.resize(blocks.size());
    LargeArray<JointSet::State>& states = scratch_.joint_states;
    states = joints_.states;
    double last = 0.0;
    for (int round = 0; round < most_rounds; ++round) {
        double worst = 0.0;
        system.momentum.assign(members.size(), Vec6{});
        for (std::size_t i = 0; i < own_blocks.size(); ++i) {
            const int k = own_blocks[i];
            RowBlock& block = system.rows[i];
            const RowBlock& given = mixed_.system.rows[k];
            block = RowBlock{};
            block.size = given.size;
            block.first = given.first < 0 ? -1 : place[given.first];
            block.second = given.second < 0 ? -1 : place[given.second];
            BlockRight unused;
            double now[6];
            joints_.overstep(k, live_.bodies, now);  // before its rows take notes
            joints_.assemble(k, live_.bodies, block.first_jacobian[0].data(), block.second_jacobian[0].data(),
                             unused);
            if (!joints_.others(k).empty()) {
                mixed_.fill_further(k, block, unused, scratch_.holding_further[k]);
                for (FurtherBody& other : scratch_.holding_further[k]) other.body = place[other.body];
            }
            for (int row = 0; row < block.size; ++row) {
                const double off = hold_row(k, row, now[row], block);
                if (!(off <= worst)) worst = off;
            }
        }
        joints_.states = states;  // assembling them takes notes for the step
        if (worst <= held) return true;
        if (round > 0 && !(worst < 0.5 * last)) return worst <= nearly_held;
        last = worst;
        if (!holding_pivot_.solve(system).finite) return false;
        for (std::size_t i = 0; i < members.size(); ++i) {
            const Vec6& d = system.velocity[i];
            displace(model_.constants[model_.constrained[members[i]]], model_.h, {d[0], d[1], d[2]},
                     {d[3], d[4], d[5]}, live_.bodies[model_.constrained[members[i]]]);
        }
    }
    return false;
}

void OverlapProjection::keep_spin_energy(int body) {
    const BodyConstants& constants = model_.constants[body];
    const BodyState& before = scratch_.before_projection[body];
    BodyState& s = live_.bodies[body];
    const double most = twice_energy(constants, before), now = twice_energy(constants, s);
    const double linear = constants.mass * dot(s.velocity, s.velocity);
    if (constants.particle || !(now > most)) return;
    s.angular_momentum *= std::sqrt((most - linear) / (now - linear));
    refresh(constants, s);
}

/// Brings an island back to the angular momentum it had, and to no more than `limit`, twice the kinetic energy allowed;
/// false if it cannot be.
bool OverlapProjection::keep_momenta(const std::vector<int>& members, double limit) {
    const auto [centre, inertia] = island_frame(model_, live_.bodies, members);
    double mass = 0.0;
    Vec3 momentum, spin, gained;
    for (const int k : members) {
        const int i = model_.constrained[k];
        const BodyState &old = scratch_.before_projection[i], &s = live_.bodies[i];
        const Vec3 p = model_.constants[i].mass * s.velocity;
        mass += model_.constants[i].mass;
        momentum += p;
        gained += cross(s.displacement - old.displacement, p);
    }
    const auto turn_all = [&](Vec3 rate) {
        for (const int k : members) {
            BodyState& s = live_.bodies[model_.constrained[k]];
            s.velocity += cross(rate, model_.position(model_.constrained[k], live_.bodies) - centre);
            if (model_.constants[model_.constrained[k]].particle) continue;
            s.angular_momentum += s.inertia * rate;
            refresh(model_.constants[model_.constrained[k]], s);
        }
    };
    const Vec3 back = solved(inertia, -gained);
    if (!finite(back)) return false;
    if (!is_zero(gained)) turn_all(back);
    double after = 0.0;
    for (const int k : members) {
        const BodyState& s = live_.bodies[model_.constrained[k]];
        after += twice_energy(model_.constants[model_.constrained[k]], s);
        spin += model_.constants[model_.constrained[k]].mass *
                    cross(model_.position(model_.constrained[k], live_.bodies) - centre, s.velocity) +
                s.angular_momentum;
    }
    if (after <= limit * (1.0 + energy_rounding)) return true;
    const Vec3 drift = (1.0 / mass) * momentum, turn = solved(inertia, spin);
    const double rigid = mass * dot(drift, drift) + dot(turn, spin);
    if (!(rigid <= limit) || !finite(turn)) return false;
    const double share = std::sqrt((limit - rigid) / (after - rigid));
    for (const int k : members) {
        const BodyConstants& body = model_.constants[model_.constrained[k]];
        BodyState& s = live_.bodies[model_.constrained[k]];
        const Vec3 v = drift + cross(turn, model_.position(model_.constrained[k], live_.bodies) - centre);
        s.velocity = v + share * (s.velocity - v);
        if (body.particle) continue;
        const Vec3 l = s.inertia * turn;
        s.angular_momentum = l + share * (s.angular_momentum - l);
        refresh(body, s);
    }
    return true;
}

}  // namespace spook
