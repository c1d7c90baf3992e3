// Overlapping bodies are parted by positions, and nothing else is to be seen of it.
//
// The contact stage gives displacements d, of the order of a fifth of an overlap whatever the time step. What is linear
// in d its rows take care of; the rest is done here, island by island:
//   joints     A turn of finite size leaves a violation of order d², which the next step's rows would answer with the
//              speed (4/h) Ups d²: 1000 J out of nothing at h = 1e-6 s. Newton's method takes it back, along M⁻¹ Gᵀ.
//   momenta    Σ m d = 0 holds already. Σ r × p + l is brought back by one rigid turn of the whole island, v += w × r,
//              l += I w: no joint and no contact feels it.
//   energy     Where the kinetic energy E has grown, the velocities are drawn towards the rigid motion that has the
//              island's momenta: they keep the momenta, and with share s left, E(s) = E_rigid + s² (E − E_rigid).
//              In an island that leans on the ground each body's angular momentum is shortened instead.
// Where this cannot be, half the way is tried, and a quarter, an eighth: overlaps may stay, kinetic energy may not rise.
#include <algorithm>
#include <cmath>

#include "rigid/rigid_system.hpp"

namespace spook {

namespace {

constexpr int most_rounds = 10;        // of Newton's method
constexpr double held = 1e-13;         // of a joint's size: a violation that is rounding
constexpr double nearly_held = 1e-11;  // and what may be left where rounding is worse
constexpr int most_halvings = 4;       // of the displacement
constexpr double rounding = 4e-16;     // of the energy

double twice_energy(const BodyConstants& body, const BodyState& s) noexcept {
    return body.mass * dot(s.velocity, s.velocity) +
           (body.particle ? 0.0 : dot(s.angular_momentum, s.angular_velocity));
}

Vec3 solved(const Mat3& a, Vec3 b) noexcept {
    const Vec3 x{a.m[0], a.m[3], a.m[6]}, y{a.m[1], a.m[4], a.m[7]}, z{a.m[2], a.m[5], a.m[8]};
    const double determinant = dot(x, cross(y, z));
    return (1.0 / determinant) * Vec3{dot(b, cross(y, z)), dot(x, cross(b, z)), dot(x, cross(y, b))};
}

}  // namespace

void RigidSystem::part_bodies() {
    const ContactStage::Parting& parting = contacts_->parting();
    const Islands& islands = parting.islands;
    parted_.resize(islands.count);
    parted_blocks_.resize(islands.count);
    for (std::vector<int>& members : parted_) members.clear();
    for (std::vector<int>& blocks : parted_blocks_) blocks.clear();
    for (std::size_t k = 0; k < tied_.size(); ++k)
        if (islands.of_body[k] >= 0) parted_[islands.of_body[k]].push_back(static_cast<int>(k));
    const auto blocks = joints_.blocks();
    overstep_at_.assign(blocks.size(), 0);
    std::size_t rows = 0;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        overstep_at_[k] = rows;
        rows += blocks[k].size;
        const int tied = std::max(mixed_.rows[k].first, mixed_.rows[k].second);
        if (tied >= 0) parted_blocks_[islands.of_body[tied]].push_back(static_cast<int>(k));
    }
    overstep_.resize(rows);
    unparted_ = live_.bodies;
    for (int island = 0; island < islands.count; ++island) {
        for (const int k : parted_blocks_[island])
            joints_.overstep(k, live_.bodies, overstep_.data() + overstep_at_[k]);
        for (int halving = 0; halving < most_halvings; ++halving) {
            if (part_island(island, std::ldexp(1.0, -halving))) break;
            for (const int k : parted_[island]) live_.bodies[tied_[k]] = unparted_[tied_[k]];
        }
    }
}

bool RigidSystem::part_island(int island, double share) {
    const ContactStage::Parting& parting = contacts_->parting();
    const std::vector<int>& members = parted_[island];
    for (const int k : members) {
        const Vec6& d = parting.velocity[k];
        displace(constants_[tied_[k]], share * h_, {d[0], d[1], d[2]}, {d[3], d[4], d[5]},
                 live_.bodies[tied_[k]]);
    }
    if (!hold_joints(members, parted_blocks_[island])) return false;
    if (parting.grounded[island] == 0) return keep_momenta(members);
    for (const int k : members) keep_spin_energy(tied_[k]);
    return true;
}

/// Brings the joints back to where they were before the displacement; false if they cannot be.
bool RigidSystem::hold_joints(const std::vector<int>& members, const std::vector<int>& own_blocks) {
    if (own_blocks.empty()) return true;
    const auto blocks = joints_.blocks();
    std::vector<int> place(tied_.size(), -1);
    MixedSystem& system = holding_;
    system.mass.clear();
    for (std::size_t i = 0; i < members.size(); ++i) {
        place[members[i]] = static_cast<int>(i);
        system.mass.push_back(mixed_.mass[members[i]]);
    }
    system.rows.resize(own_blocks.size());
    const LargeArray<JointSet::State> states = joints_.states;
    double last = 0.0;
    for (int round = 0; round < most_rounds; ++round) {
        double worst = 0.0;
        system.momentum.assign(members.size(), Vec6{});
        for (std::size_t i = 0; i < own_blocks.size(); ++i) {
            const int k = own_blocks[i];
            RowBlock& block = system.rows[i];
            const RowBlock& given = mixed_.rows[k];
            block = RowBlock{};
            block.size = given.size;
            block.first = given.first < 0 ? -1 : place[given.first];
            block.second = given.second < 0 ? -1 : place[given.second];
            BlockRight unused;
            joints_.assemble(k, live_.bodies, block.first_jacobian[0].data(), block.second_jacobian[0].data(),
                             unused);
            double now[6];
            joints_.overstep(k, live_.bodies, now);
            for (int row = 0; row < block.size; ++row) {
                const double change = now[row] - overstep_[overstep_at_[k] + row];
                block.right[row] = -change / h_;
                if (change == 0.0 && !joints_.always_holds(blocks[k]))
                    block.lower[row] = block.upper[row] = 0.0;
                const double relative = std::abs(change) / joints_.gain(k, row).extent;
                if (!(relative <= worst)) worst = relative;
            }
        }
        joints_.states = states;  // assembling them takes notes for the step
        if (worst <= held) return true;
        if (round > 0 && !(worst < 0.5 * last)) return worst <= nearly_held;
        last = worst;
        if (!holding_pivot_.solve(system).finite) return false;
        for (std::size_t i = 0; i < members.size(); ++i) {
            const Vec6& d = system.velocity[i];
            displace(constants_[tied_[members[i]]], h_, {d[0], d[1], d[2]}, {d[3], d[4], d[5]},
                     live_.bodies[tied_[members[i]]]);
        }
    }
    return false;
}

void RigidSystem::keep_spin_energy(int body) {
    const BodyConstants& constants = constants_[body];
    const BodyState& before = unparted_[body];
    BodyState& s = live_.bodies[body];
    const double most = twice_energy(constants, before), now = twice_energy(constants, s);
    const double linear = constants.mass * dot(s.velocity, s.velocity);
    if (constants.particle || !(now > most)) return;
    s.angular_momentum *= std::sqrt((most - linear) / (now - linear));
    refresh(constants, s);
}

/// Brings an island back to the angular momentum it had, and to no more than the energy; false if it cannot be.
bool RigidSystem::keep_momenta(const std::vector<int>& members) {
    const auto [centre, inertia] = island_frame(members);
    double mass = 0.0, before = 0.0;
    Vec3 momentum, spin, gained;
    for (const int k : members) {
        const int i = tied_[k];
        const BodyState &old = unparted_[i], &s = live_.bodies[i];
        const Vec3 p = constants_[i].mass * s.velocity;
        mass += constants_[i].mass;
        momentum += p;
        gained += cross(s.displacement - old.displacement, p);
        before += twice_energy(constants_[i], old);
    }
    const auto turn_all = [&](Vec3 rate) {
        for (const int k : members) {
            BodyState& s = live_.bodies[tied_[k]];
            s.velocity += cross(rate, position_of(tied_[k]) - centre);
            if (constants_[tied_[k]].particle) continue;
            s.angular_momentum += s.inertia * rate;
            refresh(constants_[tied_[k]], s);
        }
    };
    const Vec3 back = solved(inertia, -gained);
    if (!finite(back)) return false;
    if (!is_zero(gained)) turn_all(back);
    double after = 0.0;
    for (const int k : members) {
        const BodyState& s = live_.bodies[tied_[k]];
        after += twice_energy(constants_[tied_[k]], s);
        spin += constants_[tied_[k]].mass * cross(position_of(tied_[k]) - centre, s.velocity) +
                s.angular_momentum;
    }
    if (after <= before * (1.0 + rounding)) return true;
    const Vec3 drift = (1.0 / mass) * momentum, turn = solved(inertia, spin);
    const double rigid = mass * dot(drift, drift) + dot(turn, spin);
    if (!(rigid <= before) || !finite(turn)) return false;
    const double share = std::sqrt((before - rigid) / (after - rigid));
    for (const int k : members) {
        const BodyConstants& body = constants_[tied_[k]];
        BodyState& s = live_.bodies[tied_[k]];
        const Vec3 v = drift + cross(turn, position_of(tied_[k]) - centre);
        s.velocity = v + share * (s.velocity - v);
        if (body.particle) continue;
        const Vec3 l = s.inertia * turn;
        s.angular_momentum = l + share * (s.angular_momentum - l);
        refresh(body, s);
    }
    return true;
}

}  // namespace spook
