#include "contacts/contact_pgs.hpp"

#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_rows.hpp"
#include "contacts/tolerances.hpp"
#include "linear/ahead.hpp"

namespace spook {

using namespace tolerances::contact_pgs;

void ContactPgs::hand_over(const StepMotion& motion, ContactPoints& points) {
    const ContactBodies& bodies = motion.bodies();
    const ContactRows rows{motion, points};
    std::size_t next = solver_.count();
    for (std::size_t k = next; k < points.all.size(); ++k)
        solver_.announce(bodies.solver_index[points.all[k].contact.first],
                         bodies.solver_index[points.all[k].contact.second]);
    solver_.arrange();
    for (; next < points.all.size(); ++next) {
        if (next + ahead < points.all.size())
            prefetch_bodies(points.all[next + ahead].contact, motion.velocity, motion.dv_ext);
        solver_.add(rows.resting(points.all[next]));
    }
}

void ContactPgs::take_in(std::size_t known, const ContactCache& cache, const StepMotion& motion,
                         ContactPoints& points) {
    for (std::size_t k = known; k < points.all.size(); ++k)
        if (const CachedContact* const old = cache.find(points.all[k].contact.key))
            points.remember(points.all[k], *old, false);
    hand_over(motion, points);
}

FrictionReport ContactPgs::run(const ContactOptions& options, const std::function<bool(bool)>& more) {
    return solver_.run(options.iterations, options.residual_tolerance, focus * options.unsettled_residual,
                       more);
}

void ContactPgs::follow(const ContactBodies& bodies, bool all, std::vector<Vec6>& velocity,
                        std::vector<char>& changed) const {
    changed.assign(bodies.count(), all);
    const auto take = [&](int moving) {
        const int b = bodies.body_of[moving];
        const Vec6& now = solver_.velocity(moving);
        changed[b] = all || velocity[b] != now;
        velocity[b] = now;
    };
    solver_.visit_moved(take);
}

bool ContactPgs::judge(MixedSystem& system, const StepMotion& motion, const ContactPoints& points,
                       SolveQuality& quality) {
    const ContactOptions& options = motion.options();
    quality.body = -1;
    quality.by = 0.0;
    if (!system.rows.empty()) solver_.write(system);
    const RowsResidual contact =
                           solver_.worst(focus * options.unsettled_residual, options.unsettled_residual),
                       joint = rows_residual(system, {}, options.friction);
    quality.residual = std::max(contact.residual, joint.residual);
    if (contact.row >= 0 && contact.residual >= joint.residual) {
        const Contact& pair = points.all[contact.row].contact;
        blame(quality, motion, contact.residual, motion.bodies().solver_body(pair));
    } else if (!system.rows.empty()) {
        const RowBlock& block = system.rows[joint.row];
        blame(quality, motion, joint.residual, std::max(block.first, block.second));
    }
    return joint.residual > contact.residual;
}

bool ContactPgs::runs_away(const MixedSystem& system, const StepMotion& motion,
                           const ContactPoints& points) const {
    const ContactBodies& bodies = motion.bodies();
    double speed = 0.0, had = 0.0, has = 0.0;  // of what moves as it is told, or along itself
    for (std::size_t b = 0; motion.drive.any() && b < motion.drive.prescribed().size(); ++b)
        speed = std::max(speed, norm(linear(motion.drive.prescribed()[b])) +
                                    bodies.radius[b] * norm(angular(motion.drive.prescribed()[b])));
    for (const StepContact& point : points.all)
        if (motion.surfaces().conveys)
            speed = std::max(
                {speed, std::abs(motion.surface_speed(point, point.tangent)),
                 std::abs(motion.surface_speed(point, cross(point.contact.point.normal, point.tangent)))});
    const auto energy = [](const Mat6& mass, const Vec6& v) {
        double sum = 0.0;
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) sum += 0.5 * v[i] * mass[6 * i + j] * v[j];
        return sum;
    };
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        if (!bodies.moves(b)) continue;
        const Mat6& mass = system.mass[bodies.solver_index[b]];
        had += energy(mass, motion.velocity[b]) + energy(mass, sum(motion.velocity[b], motion.dv_ext[b])) +
               mass[0] * speed * speed;
        has += energy(mass, solver_.velocity(bodies.solver_index[b]));
    }
    return !(has <= too_much * had);
}

std::size_t ContactPgs::find_unanswered(const ContactBodies& bodies, std::size_t known,
                                        const ContactPoints& points) {
    connected_.begin(static_cast<int>(bodies.body_of.size()));
    points.tie(bodies, connected_);
    const Islands& islands = connected_.find();
    Unanswered& found = unanswered_;
    std::size_t largest = 0;
    found.open.assign(islands.count, 0);
    found.points.assign(islands.count, 0);
    found.island.clear();
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        found.island.push_back(islands.of_body[bodies.solver_body(points.all[k].contact)]);
        ++found.points[found.island[k]];
        if (k >= known) found.open[found.island[k]] = 1;
    }
    for (int k = 0; k < islands.count; ++k)
        if (found.open[k]) largest = std::max(largest, found.points[k]);
    return largest;
}

void ContactPgs::store_unanswered(ContactPoints& points) const {
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        if (!unanswered_.open[unanswered_.island[k]]) continue;
        StepContact& point = points.all[k];
        const double* impulse = solver_.impulse(static_cast<int>(k));
        point.solved = true;
        point.normal = impulse[0];
        for (int i = 0; i < 2; ++i) point.tangents[i] = impulse[i + 1] * points.extras(point).axis_scale[i];
    }
}

void ContactPgs::deliver(MixedSystem& system, bool unsettled, const StepMotion& motion,
                         const ContactPoints& points, EnergyLimit& energy, std::vector<char>& has_rows,
                         std::vector<CachedContact>& cache, StoppedImpacts& stopped) const {
    const ContactBodies& bodies = motion.bodies();
    const auto pushes = [this](std::size_t k) {
        const double* z = solver_.impulse(static_cast<int>(k));
        return std::any_of(z, z + 3, [](double each) { return each != 0.0; });
    };
    const std::vector<double>* const share =
        unsettled ? &energy.shorten(system, system.rows.size(), motion, points, pushes) : nullptr;
    const ContactRows rows{motion, points};
    cache.clear();
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        const StepContact& point = points.all[k];
        double impulse[3];
        std::copy_n(solver_.impulse(static_cast<int>(k)), 3, impulse);
        if (share)
            for (double& z : impulse) z *= (*share)[bodies.solver_body(point.contact)];
        const Vec3 across = cross(point.contact.point.normal, point.tangent);
        const double* const axis_scale = points.extras(point).axis_scale;
        const Vec3 along =
            (impulse[1] * axis_scale[0]) * point.tangent + (impulse[2] * axis_scale[1]) * across;
        cache_contact(rows, system, point, impulse[0], along, cache);
        stopped.note(motion.given_back(point, impulse[0]), bodies.mover(point.contact));
        if (impulse[0] == 0.0 && impulse[1] == 0.0 && impulse[2] == 0.0) continue;
        for (const int body : {point.contact.first, point.contact.second})
            if (bodies.moves(body)) has_rows[bodies.solver_index[body]] = 1;
    }
}

}  // namespace spook
