#include "contacts/energy_limit.hpp"

#include <cmath>

#include "contacts/contact_geometry.hpp"

namespace spook {

const std::vector<double>& EnergyLimit::shorten(MixedSystem& system, std::size_t joints,
                                                const StepMotion& motion, const ContactPoints& points,
                                                const std::function<bool(std::size_t)>& pushes) {
    const ContactModel& model = motion.model();
    const std::size_t bodies = system.mass.size();
    share_.assign(bodies, 1.0);
    pushes_.clear();
    connected_.begin(system, joints);
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        const Contact& contact = points.all[k].contact;
        pushes_.push_back(pushes(k));
        if (pushes_[k])
            connected_.tie(model.bodies.solver_index[contact.first],
                           model.bodies.solver_index[contact.second]);
    }
    const Islands& islands = connected_.find();
    std::vector<Sums>& sums = sums_;
    sums.assign(islands.count, {});
    const auto driven = [&](int first, int second) {
        sums[islands.of_body[std::max(first, second)]].driven = true;
    };
    for (std::size_t k = 0; k < joints; ++k) driven(system.rows[k].first, system.rows[k].second);
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        const StepContact& point = points.all[k];
        if (pushes_[k] && (motion.drive.acts_at(point.contact, model.surfaces) ||
                           model.surfaces.pair(point.contact).compliance > 0.0))
            driven(model.bodies.solver_index[point.contact.first],
                   model.bodies.solver_index[point.contact.second]);
    }
    std::vector<Vec6>& free = free_velocity_;
    free = system.momentum;
    for (std::size_t u = 0; u < bodies; ++u)
        if (islands.of_body[u] >= 0) solve_six(factor_six(system.mass[u]), free[u]);
    for (std::size_t b = 0; b < model.bodies.count(); ++b) {
        const int u = model.bodies.solver_index[b];
        if (u < 0 || islands.of_body[u] < 0) continue;
        const Vec6 by_contacts = sum(system.velocity[u], free[u], -1.0),
                   kick = sum(free[u], motion.velocity[b], -1.0);
        Sums& own = sums[islands.of_body[u]];
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) {
                const double m = system.mass[u][6 * i + j];
                if (m == 0.0) continue;
                own.square += 0.5 * m * by_contacts[i] * by_contacts[j];
                own.linear += m * by_contacts[i] * motion.velocity[b][j];
                own.fall += 0.5 * m * kick[i] * kick[j];
            }
    }
    for (std::size_t u = 0; u < bodies; ++u) {
        if (islands.of_body[u] < 0) continue;
        const auto& [square, linear, fall, is_driven] = sums[islands.of_body[u]];
        if (is_driven || !(square + linear > fall)) continue;
        const double root = std::sqrt(linear * linear + 4.0 * square * fall);
        share_[u] = linear > 0.0 ? 2.0 * fall / (linear + root) : (root - linear) / (2.0 * square);
        for (int i = 0; i < 6; ++i)
            system.velocity[u][i] = free[u][i] + share_[u] * (system.velocity[u][i] - free[u][i]);
    }
    return share_;
}

}  // namespace spook
