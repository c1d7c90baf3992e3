// Stage: sleeping. Bodies at rest are left out of the steps until something comes to them.
//
// Bodies that are connected by contacts, joints or springs are an island; what does not move by itself joins none. An
// island whose bodies all were slower than the method's sleep_speed, |v| + |w| r and as measured by where they got,
// for so many steps in a row, half of their load held, falls asleep: velocities zero, places as they are to the last bit,
// forces to be read as they were. It takes no part in a step but stays in the search for pairs, at rest. Whatever gets a point with
// a sleeper, or moves what it touches or is attached to, wakes its island (wake.cpp), and the velocities of that step are
// found anew. Falling asleep takes the kinetic energy that was left.
//
// Never asleep: bodies that displace a fluid, whose load or joint follows the time, whose joints have friction that
// follows their load, and what touches a body that moves as it is told, or a surface that moves along itself.
//
// reads: velocities and places of bodies at both ends of the step, the contact cache, woken bodies, ties of joints and springs.
// writes: live_.sleep, velocities of bodies that fall asleep, the contact stage's list of sleepers.
#include <algorithm>
#include <cmath>

#include "rigid/sleeping.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::sleep;

void Sleeping::take(const RigidScene& scene) {
    if (!(model_.method.sleep_speed > 0.0) || !mixed_.may_touch()) return;
    SleepRules& rules = rules_;
    rules.may.assign(model_.constants.size(), 0);
    for (const int i : model_.constrained) rules.may[i] = 1;
    for (const int i : model_.constrained)
        if (forces_.floats(i)) rules.may[i] = 0;
    std::vector<char> driven(scene.joints.size(), mixed_.follow_load());
    for (const TimeDrive& drive : forces_.drives()) {
        if (drive.kind == DriveKind::load) rules.may[drive.index] = 0;
        if (drive.kind == DriveKind::motor || drive.kind == DriveKind::push || drive.kind == DriveKind::rest)
            driven[drive.index] = 1;
    }
    const auto blocks = joints_.blocks();
    for (int k = 0; k < static_cast<int>(blocks.size()); ++k) {
        std::vector<int> bodies{blocks[k].first, blocks[k].second};
        bodies.insert(bodies.end(), joints_.others(k).begin(), joints_.others(k).end());
        std::erase_if(bodies, [](int body) { return body < 0; });
        const auto first =
            std::find_if(bodies.begin(), bodies.end(), [this](int i) { return model_.constants[i].moves(); });
        for (const int body : bodies) {
            if (driven[blocks[k].joint]) rules.may[body] = 0;
            if (first != bodies.end() && body != *first) rules.ties.emplace_back(*first, body);
        }
    }
    forces_.each_spring([&rules](const SpringForce& spring) {
        if (spring.ends[0].body >= 0 && spring.ends[1].body >= 0)
            rules.ties.emplace_back(spring.ends[0].body, spring.ends[1].body);
    });
    for (int i = 0; i < model_.bodies(); ++i) {
        const BodyConstants& body = model_.constants[i];
        double reach = mixed_.surfaces()->model().bodies.radius[i];
        if (body.motion == Motion::kinematic && reach == 0.0) reach = far;  // a plane
        if (body.moves() && !body.particle)
            reach = std::max(
                reach, std::sqrt(std::max({body.inertia.x, body.inertia.y, body.inertia.z}) / body.mass));
        rules.reach.push_back(reach);
    }
    rules.after =
        static_cast<std::int64_t>(std::max(1.0, std::ceil(model_.method.sleep_after / model_.h - 1e-9)));
    start_places_.resize(model_.constants.size());
}

void Sleeping::begin() {
    live_.sleep = {};
    if (!rules_.on()) return;
    live_.sleep.island.assign(model_.constants.size(), 0);
    live_.sleep.quiet.assign(model_.constants.size(), 0);
    live_.sleep.since.assign(model_.constants.size(), 0.0);
}

/// Rows of sleepers are read where all rows are while others are solved with bounds.
void Sleeping::keep_jacobians() {
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k) {
        const int block = static_cast<int>(k);
        if (!rests(joints_.blocks()[k], live_)) continue;
        RowBlock& rows = mixed_.system.rows[k];
        const auto numbers = 6 * static_cast<std::size_t>(rows.size);
        std::copy_n(rows_.jacobian(block, false), numbers, rows.first_jacobian[0].data());
        std::copy_n(rows_.jacobian(block, true), numbers, rows.second_jacobian[0].data());
    }
}

/// Where bodies are as a step begins.
void Sleeping::note_places() {
    for (const int i : model_.constrained) {
        start_places_[i].displacement = live_.bodies[i].displacement;
        start_places_[i].turn = live_.bodies[i].turn;
    }
}

void Sleeping::note_velocities() {
    for (const int i : model_.constrained) start_places_[i].velocity = live_.bodies[i].velocity;
}

/// How fast a body's surface was in the step, by its velocities and by where it got [m/s].
double Sleeping::surface_speed(int i) const noexcept {
    const BodyState& s = live_.bodies[i];
    const auto& [displacement, velocity, start_turn] = start_places_[i];
    const double way = norm(s.displacement - displacement) / model_.h;
    const double speed = std::max(norm(s.velocity), way);
    if (model_.constants[i].particle) return speed;
    const Quat turn = s.turn * conjugate(start_turn);
    const double turned = 2.0 * norm(Vec3{turn.x, turn.y, turn.z}) / model_.h;
    return speed + rules_.reach[i] * std::max(norm(s.angular_velocity), turned);
}

/// Whether a body was slower in the step than what sleeps may be, and is not about to move: what falls is slow at first, so
/// half of its load must have been held, and so is what starts to roll or swing, so it must be no faster than it was when
/// it began to be slow. What gets faster begins anew.
bool Sleeping::still(int i) noexcept {
    const Vec3 load = model_.h * forces_.acceleration(i);
    const Vec3 gained = live_.bodies[i].velocity - start_places_[i].velocity;
    if (dot(gained, load) > 0.5 * dot(load, load)) return false;
    const double speed = surface_speed(i);
    if (!(speed < model_.method.sleep_speed)) return false;
    double& since = live_.sleep.since[i];
    if (live_.sleep.quiet[i] == 0) since = speed;
    return live_.sleep.quiet[i] + 1 < rules_.after ||
           speed - since <= gained_share * model_.method.sleep_speed;
}

/// For how many steps each body has been still; whether some has been for long enough.
bool Sleeping::count_still_steps() {
    const bool broke = !joints_.breaks.empty() && joints_.breaks.back().step == live_.step;
    bool some = false;
    for (const int i : model_.constrained) {
        if (live_.asleep(i)) continue;
        std::int64_t& quiet = live_.sleep.quiet[i];
        quiet = rules_.may[i] != 0 && !broke && still(i) ? std::min(quiet + 1, rules_.after) : 0;
        some = some || quiet == rules_.after;
    }
    return some;
}

/// What contacts, joints and springs connect; `kept_up`: per body, whether something that moves as it is told holds it awake.
const Islands& Sleeping::find_islands(std::vector<char>& kept_up) {
    scratch_.finder.begin(model_.bodies());
    kept_up.assign(model_.constants.size(), 0);
    const auto tie = [&](int a, int b) {
        for (const auto& [one, other] : {IndexPair{a, b}, IndexPair{b, a}})
            if (is_moving(other)) kept_up[one] = 1;
        scratch_.finder.tie(model_.constants[a].moves() ? a : -1, model_.constants[b].moves() ? b : -1);
    };
    for (const auto& [a, b] : rules_.ties) tie(a, b);
    for (const CachedContact& cached : mixed_.contacts()->cache().points) {
        tie(cached.contact.first, cached.contact.second);
        if (mixed_.contacts()->model().surfaces.is_conveyed(cached.contact))
            kept_up[cached.contact.first] = kept_up[cached.contact.second] = 1;
    }
    for (const int i : model_.constrained) scratch_.finder.tie(i, i);
    return scratch_.finder.find();
}

/// The end of a step: what was met by a displaced body is awake, and islands that have been at rest fall asleep.
void Sleeping::sleep() {
    Sleep& sleep = live_.sleep;
    if (!mixed_.contacts()->woken().empty()) wake(mixed_.contacts()->woken());
    sleep.slept += static_cast<std::int64_t>(sleep.sleepers);
    if (!count_still_steps()) return;
    std::vector<char> kept_up;
    const Islands& islands = find_islands(kept_up);
    std::vector<char> awake(static_cast<std::size_t>(islands.count), 0);
    for (const int i : model_.constrained)
        if (sleep.quiet[i] < rules_.after || kept_up[i]) awake[islands.of_body[i]] = 1;
    std::vector<int> tired, first(static_cast<std::size_t>(islands.count), 0);
    for (const int i : model_.constrained) {
        const int island = islands.of_body[i];
        if (live_.asleep(i) || awake[island]) continue;
        if (first[island] == 0) first[island] = i + 1;
        sleep.island[i] = first[island];
        tired.push_back(i);
        BodyState& s = live_.bodies[i];
        s.velocity = s.angular_velocity = s.angular_momentum = {};
    }
    if (tired.empty()) return;
    sleep.sleepers += tired.size();
    if (live_.last_rows != LastRows::mixed) keep_jacobians();
    mixed_.contacts()->put_to_sleep(tired);
}

}  // namespace spook
