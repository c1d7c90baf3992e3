// Redundant joints that lock: whether what some rows repeat of others takes the motion.
//
// Rows that repeat others, nearly dependent rows of G, do no work as long as they agree. Linearised rows leave the
// curvature of the motion as violation, and a loop may be put together slightly off: then they contradict each
// other, and hold what the mechanism would let go. The part of their impulses that does so is λ' = (K + F)⁻¹ F λ,
// K = G Gᵀ and F a small part of its diagonal: what hardly moves anything. Of exactly redundant rows
// Gᵀλ' = 0, whatever they carry; of rows that are all needed λ' is small.
#include <algorithm>
#include <cmath>
#include <utility>

#include "linear/disjoint_sets.hpp"
#include "rigid/loop_watch.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::rigid_locking;

/// Which bodies joints tie to which, and which of these close a loop.
class LoopWatch::Ties {
public:
    Ties(const RigidModel& model, const JointSet& joints)
        : model_(model), anchor_(joints.blocks().size(), -1) {
        DisjointSets closing;  // with all that does not move by itself
        closing.begin(model.constrained.size() + 1);
        tied_.begin(model.constrained.size());
        for (int k = 0; k < static_cast<int>(anchor_.size()); ++k) {
            const JointBlock& block = joints.blocks()[k];
            if (block.axial) continue;
            tie(k, place(block.first));
            tie(k, place(block.second));
            for (const int body : joints.others(k)) tie(k, place(body));
            if (!closing.join(place(block.first), place(block.second)) && anchor_[k] >= 0)
                closes_.push_back(anchor_[k]);
        }
    }

    int world() const noexcept { return static_cast<int>(model_.constrained.size()); }
    /// Among the constrained bodies; `world()` of all that does not move by itself.
    int place(int body) const noexcept {
        return body < 0 || model_.solver_index[body] < 0 ? world() : model_.solver_index[body];
    }
    /// Gives each set of tied bodies that has a loop in it a number; how many there are.
    int number() {
        of_root_.assign(static_cast<std::size_t>(world()), -1);
        int count = 0;
        for (const int member : closes_)
            if (int& loop = of_root_[tied_.root(member)]; loop < 0) loop = count++;
        return count;
    }
    /// Of a member, or of a block of joints; −1: none.
    int loop_of(int member) { return member == world() ? -1 : of_root_[tied_.root(member)]; }
    int loop_of_block(int block) { return anchor_[block] < 0 ? -1 : loop_of(anchor_[block]); }

private:
    void tie(int block, int member) {
        if (member == world()) return;
        if (anchor_[block] >= 0) tied_.join(member, anchor_[block]);
        else anchor_[block] = member;
    }

    const RigidModel& model_;
    DisjointSets tied_;
    std::vector<int> anchor_, closes_, of_root_;  // per block: one of its members; some member of a loop
};

/// The loops that joints close, each with all that joints hang on it: what else moves in the scene says nothing of it.
/// Motors, limits and springs tie nothing here; they are loads.
void LoopWatch::take() {
    if (model_.composed) return;
    const auto blocks = joints_.blocks();
    Ties ties(model_, joints_);
    loops_.resize(static_cast<std::size_t>(ties.number()));
    for (int k = 0; k < static_cast<int>(blocks.size()); ++k) {
        if (!blocks[k].axial) {
            if (const int loop = ties.loop_of_block(k); loop >= 0) loops_[loop].blocks.push_back(k);
            continue;
        }
        const int first = ties.loop_of(ties.place(blocks[k].first)),
                  second = ties.loop_of(ties.place(blocks[k].second));
        if (first >= 0) loops_[first].drives.push_back(k);
        if (second >= 0 && second != first) loops_[second].drives.push_back(k);
    }
    std::vector<int> at(model_.constrained.size());
    for (int member = 0; member < ties.world(); ++member) {
        const int loop = ties.loop_of(member);
        if (loop < 0) continue;
        at[member] = static_cast<int>(loops_[loop].members.size());
        loops_[loop].members.push_back(member);
    }
    analyse_probes(ties, at);
}

/// `at`: the place of each member in its loop.
void LoopWatch::analyse_probes(Ties& ties, const std::vector<int>& at) {
    const auto blocks = joints_.blocks();
    std::vector<int> row_at(blocks.size());
    std::vector<std::vector<BlockEdge>> edges(loops_.size());
    for (const Loop& loop : loops_)
        for (std::size_t k = 0; k < loop.blocks.size(); ++k) row_at[loop.blocks[k]] = static_cast<int>(k);
    for (int edge = 0; edge < static_cast<int>(rows_.matrix.edges().size()); ++edge) {
        const BlockEdge& e = rows_.matrix.edges()[edge];
        const int index = ties.loop_of_block(e.first);
        if (index < 0) continue;
        Loop& loop = loops_[index];
        const int member = e.second - static_cast<int>(blocks.size());
        edges[index].push_back({row_at[e.first], static_cast<int>(loop.blocks.size()) + at[member]});
        loop.edges.push_back(edge);
    }
    for (std::size_t index = 0; index < loops_.size(); ++index) {
        Loop& loop = loops_[index];
        std::vector<int> sizes;
        for (int k : loop.blocks) sizes.push_back(blocks[k].size);
        for (int member : loop.members)
            sizes.push_back(model_.constants[model_.constrained[member]].particle ? 3 : 6);
        std::vector<std::uint8_t> is_row(sizes.size(), 0);
        std::fill_n(is_row.begin(), loop.blocks.size(), std::uint8_t{1});
        loop.probe.analyse(sizes, edges[index], is_row, true);
    }
}

/// In which loops some rows repeat others, and something is left to move.
void LoopWatch::begin() {
    live_.watched.assign(loops_.size(), {});
    if (loops_.empty()) return;
    rows_.assemble();
    for (Loop& loop : loops_) {
        loop.may_lock = find_freedom(loop) && loop.redundant > 0 && loop.freedom > 0;
    }
}

bool LoopWatch::find_freedom(Loop& loop) {
    take_probe(loop, 0.0);
    loop.probe.clear_counters();
    const double shorter = std::min(1.0, few_joints / static_cast<double>(loop.blocks.size()));
    if (!loop.probe.factor(near_dependence * shorter * shorter)) return false;
    loop.redundant = static_cast<std::int64_t>(loop.probe.counters().floored_pivots);
    loop.freedom =
        loop.probe.unknowns() - 2 * static_cast<std::int64_t>(loop.weakness.size()) + loop.redundant;
    return true;
}

void LoopWatch::judge_forced(RunReport& report) {
    if (loops_.empty() || report.status != Status::completed || !joints_.drives().give_energy()) return;
    rows_.assemble();
    for (Loop& loop : loops_) {
        double violation[6], most = forced_open;
        int open = -1;
        for (const int k : loop.blocks) {
            joints_.violation(joints_.blocks()[k].joint, live_.bodies, violation);
            for (int i = 0; i < joints_.blocks()[k].size; ++i) {
                if (joints_.law(joints_.blocks()[k].joint, i).gives_way(model_.h)) continue;
                const double share = std::fabs(violation[i]) / joints_.gain(k, i).extent;
                if (share > most) most = share, open = k;
            }
        }
        if (open < 0 || loop.drives.empty() || !find_freedom(loop) || loop.freedom > 0) continue;
        return report.leave_unsettled(
            model_.mover(joints_.blocks()[open]),
            "was pulled off its joint by a motor, in a loop of joints that leaves it nothing to move; put the loop "
            "together so that it can, or bound the motor");
    }
}

/// The matrix of a loop with rigid rows, but for a softness of that part of what each moves; and with every body as
/// heavy as any other, as far across as its joints lie: whether rows repeat each other does not depend on masses.
void LoopWatch::take_probe(Loop& loop, double part) {
    const int rows = static_cast<int>(loop.blocks.size());
    BlockLdlt& probe = loop.probe;
    find_extents(loop);
    for (std::size_t k = 0; k < loop.members.size(); ++k) {
        const int block = rows + static_cast<int>(k), n = probe.size(block);
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                probe.diagonal(block)[n * i + j] = i != j ? 0.0 : i < 3 ? 1.0 : loop.square[k];
    }
    loop.weakness.assign(static_cast<std::size_t>(probe.offset(rows)), 0.0);
    for (std::size_t e = 0; e < loop.edges.size(); ++e) {
        const BlockEdge& edge = probe.edges()[e];
        const int n = probe.size(edge.second), size = probe.size(edge.first);
        const double* j = rows_.matrix.coupling(loop.edges[e]);
        std::copy_n(j, size * n, probe.coupling(static_cast<int>(e)));
        double* moved = loop.weakness.data() + probe.offset(edge.first);
        for (int i = 0; i < size; ++i, j += n) {
            moved[i] += part * (j[0] * j[0] + j[1] * j[1] + j[2] * j[2]);
            if (n == 6)
                moved[i] +=
                    part * (j[3] * j[3] + j[4] * j[4] + j[5] * j[5]) / loop.square[edge.second - rows];
        }
    }
    for (int k = 0; k < rows; ++k)
        for (int i = 0; i < probe.size(k); ++i) probe.diagonal(k)[i] = -loop.weakness[probe.offset(k) + i];
}

/// The mean square of every member's arms to its joints [m²]; that of the others where all of its joints are at its centre.
void LoopWatch::find_extents(Loop& loop) {
    loop.square.assign(loop.members.size(), 0.0);
    std::vector<int> ends(loop.members.size(), 0);
    double sum = 0.0;
    int count = 0;
    const int rows = static_cast<int>(loop.blocks.size());
    for (const BlockEdge& edge : loop.probe.edges()) {
        const JointBlock& block = joints_.blocks()[loop.blocks[edge.first]];
        const int k = edge.second - rows, body = model_.constrained[loop.members[k]];
        if (body != block.first && body != block.second) continue;
        const JointSet::State& state = joints_.states[block.joint];
        const Vec3 arm = body == block.second ? state.second_reach : state.first_reach;
        loop.square[k] += dot(arm, arm), sum += dot(arm, arm);
        ++ends[k], ++count;
    }
    const double mean = sum > 0.0 ? sum / count : 1.0;
    for (std::size_t k = 0; k < loop.square.size(); ++k)
        loop.square[k] = loop.square[k] > point_arm * point_arm * mean ? loop.square[k] / ends[k] : mean;
}

/// After a solve, before its velocities are taken.
void LoopWatch::look() {
    for (std::size_t k = 0; k < loops_.size(); ++k)
        if (loops_[k].may_lock && live_.locked < 0) watch(loops_[k], live_.watched[k]);
}

double LoopWatch::motion_of(const Loop& loop) const {
    double motion = 0.0;  // J
    for (int member : loop.members) {
        const int i = model_.constrained[member];
        const double* x = rows_.solution.data() + rows_.body_at(member);
        const Vec3 v{x[0], x[1], x[2]};
        motion += 0.5 * model_.constants[i].mass * dot(v, v);
        if (model_.constants[i].particle) continue;
        const Vec3 w{x[3], x[4], x[5]};
        motion += 0.5 * dot(w, live_.bodies[i].inertia * w);
    }
    return motion;
}

bool LoopWatch::stops(const RigidState::Watched& seen, double motion) const noexcept {
    // What stands moves by rounding, and that may stop as it likes: it would be looked at in nearly every step.
    const double told = slight_share * max_taken * std::max(seen.motion, at_rest * seen.given);
    return motion < 0.5 * seen.last && seen.last > told;
}

/// Whether a step in a plane needs a look at some loop, which the rows of the space are for. If not, it is seen.
bool LoopWatch::wants_look(const PlaneStep& plane) {
    const auto motion = [&plane](const Loop& loop) {
        double sum = 0.0;
        for (int member : loop.members) sum += plane.motion(member);
        return 0.5 * sum;
    };
    const auto watched = [this](const Loop& loop) { return loop.may_lock && live_.locked < 0; };
    for (std::size_t k = 0; k < loops_.size(); ++k) {
        const RigidState::Watched& seen = live_.watched[k];
        if (watched(loops_[k]) && (live_.step >= seen.next || stops(seen, motion(loops_[k])))) return true;
    }
    for (std::size_t k = 0; k < loops_.size(); ++k) {
        if (!watched(loops_[k])) continue;
        RigidState::Watched& seen = live_.watched[k];
        seen.last = motion(loops_[k]);
        seen.motion = std::max(seen.motion, seen.last);
    }
    return false;
}

void LoopWatch::watch(Loop& loop, RigidState::Watched& seen) {
    const double motion = motion_of(loop);
    const bool stopped = stops(seen, motion);
    const bool due = live_.step >= seen.next;
    seen.last = motion;
    seen.motion = std::max(seen.motion, motion);
    if (!(due || stopped)) return;
    ++live_.looks;
    if (!find_repeated(loop)) return;

    double work = 0.0, load = driven(loop);
    const double held = loop.held_back(model_.constants, live_.bodies, model_.constrained);
    const double* y = loop.repeated.data() + loop.weakness.size();  // minus the probe's velocities
    for (std::size_t k = 0; k < loop.members.size(); ++k) {
        const int i = model_.constrained[loop.members[k]];
        const double* x = rows_.solution.data() + rows_.body_at(loop.members[k]);
        const BodyConstants& body = model_.constants[i];
        const BodyState& s = live_.bodies[i];
        const Vec3 v{x[0], x[1], x[2]}, impulse{-y[0], -y[1], -y[2]}, given = forces_.kick(i);
        work += 0.5 * dot(impulse, v + s.velocity);
        load += body.mass * dot(given, given);
        y += 3;
        if (body.particle) continue;
        const Vec3 w{x[3], x[4], x[5]}, twist = -loop.square[k] * Vec3{y[0], y[1], y[2]},
                                        given_twist = model_.h * body.torque;
        work += 0.5 * dot(twist, w + s.angular_velocity);
        load += dot(given_twist, turned_by(body, s, given_twist));
        y += 3;
    }
    seen.given = load;
    const double most = max_taken * seen.motion, before = seen.work;
    seen.work += (stopped ? 1.0 : static_cast<double>(seen.wait)) * work;
    seen.held += std::sqrt(held);
    seen.load += std::sqrt(load);
    const bool little =
        std::abs(seen.work - before) < slight_share * max_taken * std::max(seen.motion, at_rest * load) &&
        held < slight_share * max_held * max_held * load;
    seen.wait = little ? std::clamp(2 * seen.wait, soon, late) : soon;
    seen.next = live_.step + seen.wait;
    const bool took = std::abs(seen.work) > most && seen.motion > at_rest * load;
    const bool holds = seen.load > 0.0 && seen.held > max_held * seen.load;
    // Near its equilibrium little pulls a mechanism: what is held back of that would be seen by now, and nothing of it is.
    const double steps = static_cast<double>(live_.step);
    const double told = std::max(min_repeated * min_repeated * load,
                                 standing_ratio * standing_ratio * seen.motion / (steps * steps));
    if (!took && !holds) {
        if (!(held > told)) return;
        loop.repeat();
        if (!(loop.held_back(model_.constants, live_.bodies, model_.constrained) > told)) return;
    }
    if (!loop.bends(joints_, model_.constants, {live_.bodies.begin(), live_.bodies.end()}, model_.constrained,
                    model_.method.floor))
        return note_locked(loop);
    seen.work = seen.held = seen.load = 0.0;
}

/// Of what hardly resists, the part that hardly resists: what rows that are all needed hold is a small part of it each time.
void LoopWatch::Loop::repeat() {
    for (std::size_t row = 0; row < repeated.size(); ++row)
        repeated[row] *= row < weakness.size() ? weakness[row] : 0.0;
    probe.solve(repeated.data());
}

/// 2 J of the velocities that it holds back in a step.
double LoopWatch::Loop::held_back(const LargeArray<BodyConstants>& constants,
                                  std::span<const BodyState> bodies,
                                  const std::vector<int>& constrained) const {
    const double* y = repeated.data() + weakness.size();
    double held = 0.0;
    for (std::size_t k = 0; k < members.size(); ++k) {
        const int i = constrained[members[k]];
        const Vec3 impulse{y[0], y[1], y[2]};
        held += dot(impulse, impulse) / constants[i].mass;
        y += 3;
        if (constants[i].particle) continue;
        const Vec3 twist = square[k] * Vec3{y[0], y[1], y[2]};
        held += dot(twist, turned_by(constants[i], bodies[i], twist));
        y += 3;
    }
    return held;
}

/// Whether rows that hardly resist a motion would soon, so that they are needed and repeat nothing: those of a lift that lies
/// nearly flat, or of a toggle. In a mechanism that is put together slightly off they never do. Along the motion d that is
/// held, |d| = 1, what the combination s of rows resists grows by sᵀ Ġ d, to second order of the way.
bool LoopWatch::Loop::bends(const JointSet& joints, const LargeArray<BodyConstants>& constants,
                            std::vector<BodyState> along, const std::vector<int>& constrained,
                            double floor) const {
    for (BodyState& body : along) body.velocity = body.angular_velocity = {};
    const double* y = repeated.data() + weakness.size();
    double motion = 0.0, extent = 0.0;
    for (std::size_t k = 0; k < members.size(); ++k) {
        BodyState& body = along[constrained[members[k]]];
        body.velocity = {y[0], y[1], y[2]};
        motion += dot(body.velocity, body.velocity);
        extent += square[k] / static_cast<double>(members.size());
        y += 3;
        if (constants[constrained[members[k]]].particle) continue;
        body.angular_velocity = {y[0], y[1], y[2]};
        motion += square[k] * dot(body.angular_velocity, body.angular_velocity);
        y += 3;
    }
    double grows = 0.0, size = 0.0, bias[6];
    std::size_t row = 0;
    for (const int k : blocks) {
        joints.bias(k, along, bias);
        for (int i = 0; i < joints.blocks()[k].size; ++i, ++row) {
            grows += repeated[row] * bias[i];
            size += weakness[row] * repeated[row] * repeated[row];
        }
    }
    const double count = static_cast<double>(blocks.size());
    size /= near_dependence / (count * count);
    if (!(motion > floor * size)) return false;  // so flat that rounding decides
    return std::sqrt(extent) * std::abs(grows) > min_growth / (count * count) * motion * std::sqrt(size);
}

/// 2 J of what motors and springs alone would set in motion.
double LoopWatch::driven(const Loop& loop) {
    if (loop.drives.empty()) return 0.0;
    push_.assign(model_.constrained.size(), {});
    for (int k : loop.drives) {
        const JointBlock& block = joints_.blocks()[k];
        for (const bool second : {false, true}) {
            const int body = second ? block.second : block.first;
            if (body < 0 || model_.solver_index[body] < 0) continue;
            const double* j = std::as_const(rows_).jacobian(k, second);
            for (int i = 0; i < block.size; ++i)
                for (int axis = 0; axis < 6; ++axis, ++j)
                    if (i != block.rotor)  // inertia drives nothing
                        push_[model_.solver_index[body]][axis] +=
                            *j * rows_.solution[rows_.matrix.offset(k) + i];
        }
    }
    double sum = 0.0;
    for (int member : loop.members) {
        const int i = model_.constrained[member];
        const Vec6& p = push_[member];
        const Vec3 linear{p[0], p[1], p[2]}, twist{p[3], p[4], p[5]};
        sum += dot(linear, linear) / model_.constants[i].mass;
        sum += dot(twist, turned_by(model_.constants[i], live_.bodies[i], twist));
    }
    return sum;
}

/// λ' of the last solve, with the sign of the solution, and what it changes of the velocities.
bool LoopWatch::find_repeated(Loop& loop) {
    const double size = static_cast<double>(loop.blocks.size());
    take_probe(loop, near_dependence / (size * size));  // the rows of a long chain move each other but little
    if (!loop.probe.factor(0.0)) return false;
    loop.repeated.assign(static_cast<std::size_t>(loop.probe.unknowns()), 0.0);
    std::size_t row = 0;
    for (int k : loop.blocks)
        for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row)
            loop.repeated[row] = loop.weakness[row] * rows_.solution[rows_.matrix.offset(k) + i];
    loop.probe.solve(loop.repeated.data());
    return true;
}

/// The joints whose rows repeat each other by what was found, each by its largest share.
void LoopWatch::note_locked(const Loop& loop) {
    const std::vector<double> share = shares(loop);
    const auto most = std::max_element(share.begin(), share.end());
    live_.named.clear();
    for (std::size_t k = 0; k < share.size(); ++k)
        if (share[k] > named_share * *most) live_.named.push_back(joints_.blocks()[loop.blocks[k]].joint);
    live_.locked = model_.mover(joints_.blocks()[loop.blocks[most - share.begin()]]);
}

/// Per block of the loop: what its rows repeat of others.
std::vector<double> LoopWatch::shares(const Loop& loop) const {
    std::vector<double> share(loop.blocks.size(), 0.0);
    std::size_t row = 0;
    for (std::size_t k = 0; k < loop.blocks.size(); ++k)
        for (int i = 0; i < joints_.blocks()[loop.blocks[k]].size; ++i, ++row)
            share[k] = std::max(share[k], std::sqrt(loop.weakness[row]) * std::abs(loop.repeated[row]));
    return share;
}

/// Redundant rows had to be told apart, which those that agree need not: of which loop?
void LoopWatch::note_projected() {
    const Loop* worst = nullptr;
    double largest = 0.0;
    for (Loop& loop : loops_) {
        if (!find_repeated(loop)) continue;
        const std::vector<double> share = shares(loop);
        const double most = *std::max_element(share.begin(), share.end());
        if (most > largest) largest = most, worst = &loop;
    }
    if (worst) return note_locked(*worst);
    const JointBlock& busiest = joints_.blocks()[rows_.busiest_block()];
    live_.named.assign(1, busiest.joint);
    live_.locked = model_.mover(busiest);
}

}  // namespace spook
