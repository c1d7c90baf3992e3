// The contact stage by projected Gauss–Seidel (PGS): resting contact for as many bodies as there are.
#include <algorithm>
#include <utility>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "contacts/tolerances.hpp"
#include "linear/ahead.hpp"
#include "linear/regularisation.hpp"

namespace spook {

namespace {

using namespace tolerances::contact_pgs;

}  // namespace

/// Gives the PGS solver the points it does not have yet.
void ContactStage::hand_over() {
    const double h = model_->options.time_step;
    for (std::size_t k = handed_over_; k < points_.all.size(); ++k)
        pgs_.announce(model_->bodies.solver_index[points_.all[k].contact.first],
                      model_->bodies.solver_index[points_.all[k].contact.second]);
    pgs_.arrange();
    for (; handed_over_ < points_.all.size(); ++handed_over_) {
        Point& point = points_.all[handed_over_];
        if (handed_over_ + ahead < points_.all.size()) {
            const Contact& later = points_.all[handed_over_ + ahead].contact;
            for (const int body : {later.first, later.second})
                prefetch(motion_.velocity[body]), prefetch(motion_.dv_ext[body]);
        }
        const PairMaterial material = model_->surfaces.pair(point.contact);
        const ContactExtras& extras = points_.extras(point);
        PgsContact row;
        row.first = model_->bodies.solver_index[point.contact.first];
        row.second = model_->bodies.solver_index[point.contact.second];
        row.normal = point.contact.point.normal;
        row.tangent = extras.axis_scale[0] * point.tangent;
        row.across = extras.axis_scale[1] * cross(row.normal, point.tangent);
        row.anisotropic = extras.is_anisotropic();
        row.first_arm = point.first_arm;
        row.second_arm = point.second_arm;
        row.softness = regularise(material.compliance, material.damping, h).softness;
        row.slip_softness = material.slip_compliance / h;
        row.friction = point.friction;
        row.normal_before = point.before;
        row.impulse[0] = point.solved ? point.normal : std::max(0.0, point.before);
        for (int i = 0; i < 2; ++i) row.impulse[i + 1] = point.tangents[i] / extras.axis_scale[i];
        if (model_->surfaces.conveys || row.first < 0 || row.second < 0) {
            const Vec3 directions[3] = {row.normal, row.tangent, row.across};
            for (int i = 0; i < 3; ++i)
                row.right[i] = -relative_velocity(point, directions[i], motion_.drive.prescribed());
            for (int i = 1; i < 3; ++i) row.right[i] -= motion_.surface_speed(point, directions[i]);
        }
        row.right[0] += rows().resting_right(point);
        pgs_.add(row);
    }
}

/// Pairs that meet because of what the iterations have found so far get rows in the same solve.
bool ContactStage::find_more(bool over, PgsLook& look) {
    const bool first = next_.empty();  // look of this step
    if (first) next_ = motion_.velocity;
    // On the way bodies are skipped at the sides of others that they do meet in the end, and need not have changed since.
    const bool was_settling = std::exchange(look.iterating, !over);
    const bool all = first || (was_settling && over && model_->bodies.swings);
    changed_.assign(model_->bodies.count(), all);
    pgs_.visit_moved([&](int moving) {
        const int b = model_->bodies.body_of[moving];
        const Vec6& now = pgs_.velocity(moving);
        changed_[b] = all || next_[b] != now;
        next_[b] = now;
    });
    const Cast cast{next_, over ? Cast::When::solved : Cast::When::iterating};
    search_.widen(cast, changed_, motion_, points_);
    if (model_->bodies.swings) search_.edges.predict_sinking(search_.step(motion_), points_, next_);
    const std::size_t known = points_.all.size();
    const bool turned = search_.find_turned(next_, motion_, points_);
    const CandidateSearch::Found found = find_impacts(cast, impacts_.plastic_too());
    look.left_out = look.left_out || found.left_out;
    if (found.pairs == 0 && !turned) return false;
    take_in(known);
    return true;
}

/// Hands the points found since `known` to the PGS solver, with what they did in the step before.
void ContactStage::take_in(std::size_t known) {
    state_.counters.contacts += points_.all.size() - known;
    for (std::size_t k = known; k < points_.all.size(); ++k) {
        Point& point = points_.all[k];
        const CachedContact* const old = state_.cache.find(point.contact.key);
        if (old == nullptr) continue;
        point.before = std::max(0.0, old->normal);
        point.compression_before = old->compression;
        std::copy_n(old->tangent, 2, point.tangents);
    }
    hand_over();
}

/// Notes how far the iterations are from their law, and if that is more than the method asks for, which body is.
ContactStage::PgsEnd ContactStage::judge_pgs(MixedSystem& system) {
    quality_.body = -1;
    quality_.by = 0.0;
    if (!system.rows.empty()) pgs_.write(system);
    const RowsResidual contact = pgs_.worst(focus * model_->options.unsettled_residual,
                                            model_->options.unsettled_residual),
                       joint = rows_residual(system, {}, model_->options.friction);
    quality_.residual = std::max(contact.residual, joint.residual);
    if (contact.row >= 0 && contact.residual >= joint.residual) {
        const Contact& pair = points_.all[contact.row].contact;
        blame(quality_, *model_, motion_, contact.residual,
              std::max(model_->bodies.solver_index[pair.first], model_->bodies.solver_index[pair.second]));
    } else if (!system.rows.empty()) {
        const RowBlock& block = system.rows[joint.row];
        blame(quality_, *model_, motion_, joint.residual, std::max(block.first, block.second));
    }
    return {quality_.body<0, joint.residual> contact.residual};
}

/// Whether the iterations have made far more energy than there is. No answer does, but where friction on a long arm loads the
/// contact that it stems from, each iteration's may be larger than the one before.
bool ContactStage::runs_away(const MixedSystem& system) const {
    double speed = 0.0, had = 0.0, has = 0.0;  // of what moves as it is told, or along itself
    for (std::size_t b = 0; motion_.drive.any() && b < motion_.drive.prescribed().size(); ++b)
        speed = std::max(speed, norm(linear(motion_.drive.prescribed()[b])) +
                                    model_->bodies.radius[b] * norm(angular(motion_.drive.prescribed()[b])));
    for (const Point& point : points_.all)
        if (model_->surfaces.conveys)
            speed = std::max(
                {speed, std::abs(motion_.surface_speed(point, point.tangent)),
                 std::abs(motion_.surface_speed(point, cross(point.contact.point.normal, point.tangent)))});
    const auto energy = [](const Mat6& mass, const Vec6& v) {
        double sum = 0.0;
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) sum += 0.5 * v[i] * mass[6 * i + j] * v[j];
        return sum;
    };
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        if (!model_->bodies.moves(b)) continue;
        const Mat6& mass = system.mass[model_->bodies.solver_index[b]];
        had += energy(mass, motion_.velocity[b]) + energy(mass, sum(motion_.velocity[b], motion_.dv_ext[b])) +
               mass[0] * speed * speed;
        has += energy(mass, pgs_.velocity(model_->bodies.solver_index[b]));
    }
    return !(has <= too_much * had);
}

/// The islands of the points, and which of them have points from `known` on: no solve has answered those yet.
const ContactStage::Unanswered& ContactStage::find_unanswered(std::size_t bodies, std::size_t known) {
    const Islands& islands = connected(bodies);
    Unanswered& found = unanswered_;
    found.open.assign(islands.count, 0);
    found.points.assign(islands.count, 0);
    found.island.clear();
    found.largest = 0;
    for (std::size_t k = 0; k < points_.all.size(); ++k) {
        found.island.push_back(islands.of_body[model_->bodies.solver_body(points_.all[k].contact)]);
        ++found.points[found.island[k]];
        if (k >= known) found.open[found.island[k]] = 1;
    }
    for (int k = 0; k < islands.count; ++k)
        if (found.open[k]) found.largest = std::max(found.largest, found.points[k]);
    return found;
}

/// Where a solve sets many bodies in motion towards others, each solve would find a few pairs more that meet. Iterations find
/// nearly all of them at a fraction of the cost, and the next solve starts from where they end. Islands that an earlier
/// solve has answered, and no new point ties to others, stay as they are to the last bit.
bool ContactStage::warm_start_by_pgs(MixedSystem& system, std::size_t known, int round) {
    if (model_->surfaces.resists_turning) return false;  // PGS over contacts knows no such friction
    if (points_.all.size() <= few_points && round < many_rounds) return false;
    if (find_unanswered(system.mass.size(), known).largest <= few_points && round < many_rounds) return false;
    double speed = 0.0;
    for (const Vec6& v : system.velocity) speed = std::max(speed, norm(linear(v)));
    system.rows.clear();
    pgs_.start(system, model_->options.friction);
    next_.clear();
    handed_over_ = 0;
    hand_over();
    const double enough = warm_started * speed;
    PgsLook look;  // what is left out by velocities on the way, the solve will tell
    const FrictionReport report =
        pgs_.run(warm_start_iterations, enough, enough, [&](bool over) { return find_more(over, look); });
    state_.counters.pgs_iterations += static_cast<std::uint64_t>(report.pgs_iterations);
    search_.edges.forget_sinking();
    if (!report.finite) return false;
    const Unanswered& islands = find_unanswered(system.mass.size(), known);
    for (std::size_t k = 0; k < points_.all.size(); ++k) {
        if (!islands.open[islands.island[k]]) continue;
        Point& point = points_.all[k];
        const double* impulse = pgs_.impulse(static_cast<int>(k));
        point.solved = true;
        point.normal = impulse[0];
        for (int i = 0; i < 2; ++i) point.tangents[i] = impulse[i + 1] * points_.extras(point).axis_scale[i];
    }
    return true;
}

ContactStage::PgsSolveEnd ContactStage::solve_by_pgs(MixedSystem& system) {
    pgs_.start(system, model_->options.friction);
    next_.clear();
    handed_over_ = 0;
    hand_over();
    PgsLook look;
    const std::size_t begun = points_.all.size();
    FrictionReport report;
    quality_ = {};
    for (bool again = true; again;) {
        again = false;
        double last = unbounded;
        for (int turn = 0; turn < most_turns || pgs_.work() < most_turns * model_->options.iterations;
             ++turn) {
            report = pgs_.run(model_->options.iterations, model_->options.residual_tolerance,
                              focus * model_->options.unsettled_residual,
                              [&](bool over) { return find_more(over, look); });
            state_.counters.pgs_iterations += static_cast<std::uint64_t>(report.pgs_iterations);
            PgsEnd end;
            if (report.finite) end = judge_pgs(system);
            if (end.settled || report.converged) break;
            const bool grows =
                quality_.residual > std::exchange(last, quality_.residual) && system.rows.empty();
            if (!report.finite || (grows && runs_away(system))) {
                points_.all.resize(begun);  // what was met on that way is not
                search_.find_open(motion_, points_, Cast::When::solved);
                ran_away_ = true;
                return {{}, true};
            }
            if (turn + 1 >= joint_turns && end.joint_is_worst) break;
        }
        pgs_.write(system);
        if (!report.finite) break;
        if (!look.left_out) {
            if (needs_impact_first(system, begun, next_, false)) return {};
            break;
        }
        look.left_out = false;  // it was one by velocities on the way
        for (std::size_t b = 0; b < model_->bodies.count(); ++b)
            if (model_->bodies.moves(b)) next_[b] = pgs_.velocity(model_->bodies.solver_index[b]);
        changed_.assign(model_->bodies.count(), 1);
        const std::size_t known = points_.all.size();
        const bool left_out = find_impacts({next_, Cast::When::solved}, impacts_.plastic_too()).left_out;
        if (needs_impact_first(system, begun, next_, left_out)) return {};
        again = points_.all.size() > known;
        if (again) take_in(known);
    }
    if (report.finite && passes_other_ends(system, system.rows.size(), model_->options.time_step))
        return {{.ends_passed = true}};
    const std::size_t blocks = system.rows.size() + points_.all.size();
    const bool unsettled = quality_.body >= 0;
    const bool unfinished = report.finite && !report.converged && !system.rows.empty() &&
                            blocks <= (unsettled ? few_jointed : few_rows);
    state_.by_rows = state_.by_rows || unfinished;
    if (unfinished) return {{}, true};
    state_.counters.unsettled += !report.converged;

    std::vector<double>& share = arrays_.share;
    share.clear();
    if (!report.converged) {
        if (quality_.body < 0) blame_sunk(quality_, judged());
        std::vector<char>& pushes = arrays_.pushes;
        pushes.clear();
        for (std::size_t k = 0; k < points_.all.size(); ++k) {
            const double* z = pgs_.impulse(static_cast<int>(k));
            pushes.push_back(std::any_of(z, z + 3, [](double each) { return each != 0.0; }));
        }
        shorten_unsettled(system, system.rows.size(), pushes, share);
    }
    mark_rows(system.mass.size(),
              system.rows);  // by joints; of contacts those that push, or did in an impact
    for (std::size_t b = 0; b < model_->bodies.count(); ++b)
        if (model_->bodies.moves(b) && motion_.event_time[b] >= 0.0)
            has_rows_[model_->bodies.solver_index[b]] = 1;
    state_.cache.points.clear();
    for (std::size_t k = 0; k < points_.all.size(); ++k) {
        const Point& point = points_.all[k];
        double impulse[3];
        std::copy_n(pgs_.impulse(static_cast<int>(k)), 3, impulse);
        if (!share.empty())
            for (double& z : impulse)
                z *= share[std::max(model_->bodies.solver_index[point.contact.first],
                                    model_->bodies.solver_index[point.contact.second])];
        const Vec3 across = cross(point.contact.point.normal, point.tangent);
        const double* const axis_scale = points_.extras(point).axis_scale;
        const Vec3 along =
            (impulse[1] * axis_scale[0]) * point.tangent + (impulse[2] * axis_scale[1]) * across;
        cache_contact(rows(), system, point, impulse[0], along, state_.cache.points);
        state_.counters.stopped += motion_.is_stopped(point, impulse[0]);
        if (impulse[0] == 0.0 && impulse[1] == 0.0 && impulse[2] == 0.0) continue;
        for (const int body : {point.contact.first, point.contact.second})
            if (model_->bodies.moves(body)) has_rows_[model_->bodies.solver_index[body]] = 1;
    }
    if (report.finite) correct_events(system);
    order_by_key(state_.cache.points, unordered_, places_);
    return {{.finite = report.finite}};
}

}  // namespace spook
