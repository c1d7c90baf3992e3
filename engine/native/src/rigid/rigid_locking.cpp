// Redundant joints that lock: whether what some rows repeat of others takes the motion.
//
// Rows that repeat others, nearly dependent rows of G, do no work as long as they agree. Linearised rows leave the
// curvature of the motion as violation, and a loop may be put together slightly off: then they contradict each
// other, and hold what the mechanism would let go. The part of their impulses that does so is λ' = (K + F)⁻¹ F λ,
// K = G Gᵀ and F a small part of its diagonal: what hardly moves anything. Of exactly redundant rows
// Gᵀλ' = 0, whatever they carry; of rows that are all needed λ' is small.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "rigid/rigid_system.hpp"

namespace spook {

namespace {

constexpr double NEARLY = 1e-4;  // of a row's diagonal: an angle of 1e-2 between rows
constexpr std::int64_t SOON = 8,
                       LATE = 64;  // steps to the next look; and where half of the motion goes in one
constexpr double LITTLE = 1e-2;    // of what is too much: then the next look has twice the time
constexpr double TAKEN = 0.25;     // of the largest energy of motion, by rows that should take none
constexpr double HELD = 0.1;       // of what the loads would set in motion
constexpr double TOLD = 1e-3;      // of the largest share: a joint that is named

}  // namespace

/// Whether joints close a loop in which some rows repeat others, and something is left to move.
bool RigidSystem::may_lock() {
    if (solver_ != RigidSolver::block || composed_ || !locked_.empty()) return false;
    std::vector<int> root(tied_.size() + 1);  // the last one is all that does not move by itself
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&root](int i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    const auto place = [this](int body) {
        return body < 0 || slot_[body] < 0 ? static_cast<int>(tied_.size()) : slot_[body];
    };
    bool loops = false;
    for (const JointBlock& block : joints_.blocks()) {
        if (block.axial) continue;
        const int a = find(place(block.first)), b = find(place(block.second));
        loops = loops || a == b;
        root[a] = b;
    }
    if (!loops) return false;
    assemble_blocks();
    if (stiff_) stiffness_.assign(tied_.size(), Mat3{});
    fill_inertias();
    take_probe(0.0);
    probe_.clear_counters();
    if (!probe_.factor(NEARLY)) return false;
    const auto redundant = static_cast<std::int64_t>(probe_.counters().floored_pivots);
    return redundant > 0 && probe_.unknowns() - 2 * static_cast<std::int64_t>(rows_) + redundant > 0;
}

/// The matrix with rigid rows, but for a softness of that part of what each moves; and with every body as heavy as any
/// other, as far across as its joints lie: whether rows repeat each other does not depend on masses.
void RigidSystem::take_probe(double part) {
    const auto blocks = joints_.blocks();
    const int row_blocks = static_cast<int>(blocks.size());
    probe_ = matrix_;
    probe_.shift_constraints(0.0);
    find_extents();
    for (std::size_t k = 0; k < tied_.size(); ++k) {
        const int n = probe_.size(row_blocks + static_cast<int>(k));
        double* diagonal = probe_.diagonal(row_blocks + static_cast<int>(k));
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) diagonal[n * i + j] = i != j ? 0.0 : i < 3 ? 1.0 : square_[k];
    }
    weakness_.assign(rows_, 0.0);
    std::size_t row = 0;
    for (int k = 0; k < row_blocks; ++k)
        for (int i = 0; i < blocks[k].size; ++i, ++row) {
            double moved = 0.0;
            for (const bool second : {false, true}) {
                const int body = second ? blocks[k].second : blocks[k].first;
                if (body < 0 || slot_[body] < 0) continue;
                const double* j = jacobian(k, second) + 6 * i;
                moved += j[0] * j[0] + j[1] * j[1] + j[2] * j[2];
                if (!constants_[body].particle)
                    moved += (j[3] * j[3] + j[4] * j[4] + j[5] * j[5]) / square_[slot_[body]];
            }
            weakness_[row] = part * moved;
            probe_.diagonal(k)[i] = blocks[k].axial ? matrix_.diagonal(k)[i] : -weakness_[row];
        }
}

/// The mean square of every tied body's arms to its joints [m²].
void RigidSystem::find_extents() {
    square_.assign(tied_.size(), 0.0);
    std::vector<int>& ends = ends_;
    ends.assign(tied_.size(), 0);
    double sum = 0.0;
    int count = 0;
    for (const JointBlock& block : joints_.blocks()) {
        if (block.axial) continue;
        const JointSet::State& state = joints_.states[block.joint];
        for (const bool second : {false, true}) {
            const int body = second ? block.second : block.first;
            if (body < 0 || slot_[body] < 0) continue;
            const Vec3 arm = second ? state.second_reach : state.first_reach;
            square_[slot_[body]] += dot(arm, arm), sum += dot(arm, arm);
            ++ends[slot_[body]], ++count;
        }
    }
    const double mean = sum > 0.0 ? sum / count : 1.0;
    for (std::size_t k = 0; k < square_.size(); ++k)
        square_[k] = square_[k] > 0.0 ? square_[k] / ends[k] : mean;
}

/// After a solve, before its velocities are taken.
void RigidSystem::watch_redundancy() {
    Live::Watched& seen = live_.watched;
    double motion = 0.0;  // J
    const double* x = solution_.data() + rows_;
    for (int i : tied_) {
        const Vec3 v{x[0], x[1], x[2]};
        motion += 0.5 * constants_[i].mass * dot(v, v);
        x += 3;
        if (constants_[i].particle) continue;
        const Vec3 w{x[0], x[1], x[2]};
        motion += 0.5 * dot(w, live_.bodies[i].inertia * w);
        x += 3;
    }
    const bool stopped = motion < 0.5 * seen.last;
    const bool due = live_.step >= seen.next;
    seen.last = motion;
    seen.motion = std::max(seen.motion, motion);
    if (live_.locked >= 0 || !(due || stopped) || !find_repeated()) return;

    double work = 0.0, held = 0.0, load = 0.0;
    x = solution_.data() + rows_;
    const double* y = repeated_.data() + rows_;  // of the probe's bodies: minus the change of velocity
    for (std::size_t k = 0; k < tied_.size(); ++k) {
        const int i = tied_[k];
        const BodyConstants& body = constants_[i];
        const BodyState& s = live_.bodies[i];
        const Vec3 v{x[0], x[1], x[2]}, impulse{-y[0], -y[1], -y[2]}, given = kick(i);
        work += 0.5 * dot(impulse, v + s.velocity);
        held += dot(impulse, impulse) / body.mass;
        load += body.mass * dot(given, given);
        x += 3, y += 3;
        if (body.particle) continue;
        const Vec3 w{x[0], x[1], x[2]}, twist = -square_[k] * Vec3{y[0], y[1], y[2]},
                                        given_twist = h_ * body.torque;
        work += 0.5 * dot(twist, w + s.angular_velocity);
        held += dot(twist, turned_by(body, s, twist));
        load += dot(given_twist, turned_by(body, s, given_twist));
        x += 3, y += 3;
    }
    const double most = TAKEN * seen.motion, before = seen.work;
    seen.work += (stopped ? 1.0 : static_cast<double>(seen.wait)) * work;
    seen.held += std::sqrt(held);
    seen.load += std::sqrt(load);
    const bool little = std::abs(seen.work - before) < LITTLE * most && held < LITTLE * HELD * HELD * load;
    seen.wait = little ? std::min(2 * seen.wait, LATE) : SOON;
    seen.next = live_.step + seen.wait;
    const bool took = std::abs(seen.work) > most && seen.motion > 1e-6 * load;
    if (took || (seen.load > 0.0 && seen.held > HELD * seen.load)) note_locked();
}

/// λ' of the last solve, with the sign of the solution, and what it changes of the velocities.
bool RigidSystem::find_repeated() {
    const double loop = static_cast<double>(joints_.blocks().size());
    take_probe(NEARLY / (loop * loop));  // the rows of a long chain move each other but little
    if (!probe_.factor(0.0)) return false;
    repeated_.assign(static_cast<std::size_t>(probe_.unknowns()), 0.0);
    for (std::size_t row = 0; row < rows_; ++row) repeated_[row] = weakness_[row] * solution_[row];
    probe_.solve(repeated_.data());
    return true;
}

/// The joints whose rows repeat each other by what repeated_ says, each by its largest share.
void RigidSystem::note_locked() {
    const auto blocks = joints_.blocks();
    std::vector<double> share(blocks.size(), 0.0);
    std::size_t row = 0;
    double largest = 0.0;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        for (int i = 0; i < blocks[k].size; ++i, ++row)
            share[k] = std::max(share[k], std::sqrt(weakness_[row]) * std::abs(repeated_[row]));
        largest = std::max(largest, share[k]);
    }
    live_.named.clear();
    for (std::size_t k = 0; k < blocks.size(); ++k)
        if (share[k] > TOLD * largest) live_.named.push_back(blocks[k].joint);
    const auto most = std::max_element(share.begin(), share.end());
    live_.locked = body_of(static_cast<int>(most - share.begin()));
}

}  // namespace spook
