#include "contacts/contact_stage.hpp"

#include <algorithm>
#include <cmath>

#include "linear/regularisation.hpp"

namespace spook {

namespace {

Vec3 linear(const Vec6& v) noexcept { return {v[0], v[1], v[2]}; }
Vec3 angular(const Vec6& v) noexcept { return {v[3], v[4], v[5]}; }
Vec6 row(Vec3 direction, Vec3 arm) noexcept {
    const Vec3 moment = cross(arm, direction);
    return {direction.x, direction.y, direction.z, moment.x, moment.y, moment.z};
}

/// The world axis x (or y, for surfaces that face along x) laid into the tangent plane.
Vec3 world_tangent(Vec3 normal) noexcept {
    const Vec3 axis = std::abs(normal.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 t = axis - dot(axis, normal) * normal;
    return (1.0 / norm(t)) * t;
}

double speed_between(const std::vector<Vec6>& from, const std::vector<Vec6>& to, int body) noexcept {
    return norm(linear(to[body]) - linear(from[body]));
}

constexpr double closed = 1e-9;  // gaps up to this part of the larger body's radius count as closed

}  // namespace

ContactStage::ContactStage(Detection detection, std::vector<SurfaceMaterial> materials,
                           std::vector<int> unknown, const ContactOptions& options)
    : detection_(std::move(detection)),
      materials_(std::move(materials)),
      unknown_(std::move(unknown)),
      options_(options) {
    for (IslandSolver* solver : {&resting_solver_, &impact_solver_, &parting_solver_}) {
        solver->floor = options.floor;
        solver->refinements = options.refinements;
    }
    margin_.assign(unknown_.size(), 0.0);
    prescribed_.assign(unknown_.size(), Vec6{});
}

double ContactStage::relative(std::size_t k, Vec3 direction, const std::vector<Vec6>& velocity,
                              bool only_prescribed) const {
    const Contact& contact = contacts_[k];
    double sum = 0.0;
    if (!only_prescribed || unknown_[contact.first] < 0)
        sum += dot(row(direction, points_[k].first_arm), velocity[contact.first]);
    if (!only_prescribed || unknown_[contact.second] < 0)
        sum -= dot(row(direction, points_[k].second_arm), velocity[contact.second]);
    return sum;
}

bool ContactStage::detect(const std::vector<Pose>& poses, const std::vector<Vec6>& velocity,
                          const std::vector<Vec6>& free_velocity) {
    const double h = options_.time_step;
    const std::vector<double>& radius = detection_.radius();
    for (std::size_t b = 0; b < margin_.size(); ++b) {
        const double speed = std::max(norm(linear(velocity[b])), norm(linear(free_velocity[b])));
        const double spin = std::max(norm(angular(velocity[b])), norm(angular(free_velocity[b])));
        margin_[b] = h * (speed + spin * radius[b]) + 1e-9 * radius[b];
        prescribed_[b] = unknown_[b] < 0 ? velocity[b] : Vec6{};
    }
    correction_.clear();
    impact_needed_ = false;
    detection_.detect(poses, margin_, contacts_);
    drop_unreachable(velocity, free_velocity);
    if (contacts_.empty()) {
        touches_.clear();
        return false;
    }
    counters_.contacts += contacts_.size();

    points_.resize(contacts_.size());
    std::size_t old = 0;  // both lists are in order of key
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& contact = contacts_[k];
        Point& point = points_[k];
        point = {};
        point.material = combined(materials_[contact.first], materials_[contact.second]);
        point.first_arm = contact.point.position - poses[contact.first].position;
        point.second_arm = contact.point.position - poses[contact.second].position;
        point.tangent = world_tangent(contact.point.normal);
        while (old < touches_.size() && touches_[old].contact.key < contact.key) ++old;
        if (old < touches_.size() && touches_[old].contact.key == contact.key) {
            point.before = touches_[old].normal;
            std::copy_n(touches_[old].tangent, 2, point.tangent_before);
        }
        const double gap = contact.point.gap;
        point.approach = relative(k, contact.point.normal, velocity, false);
        const double free_approach = relative(k, contact.point.normal, free_velocity, false);
        point.push = free_approach - point.approach;
        const double psi = point.material.restitution, speed = -point.approach;
        point.bounce = -1.0;
        if (is_closed(k)) {
            point.bounce = speed > 0.0 ? psi : 0.0;
        } else if (speed > 0.0 && psi > 0.0 && gap + h * free_approach < 0.0) {
            const double left =
                psi * psi - (1.0 - psi * psi) * 2.0 * (-point.push / h) * gap / (speed * speed);
            if (left > 0.0) point.bounce = std::min(1.0, std::sqrt(left));
        }
        const double kick = speed_between(velocity, free_velocity, contact.first) +
                            speed_between(velocity, free_velocity, contact.second);
        const double rounding = 1e-6 * kick + 1e-12 * (margin_[contact.first] + margin_[contact.second]) / h;
        point.rounding = rounding;
        if (point.bounce > 0.0 && speed > rounding) impact_needed_ = true;
    }
    touches_.assign(contacts_.size(), {});
    for (std::size_t k = 0; k < contacts_.size(); ++k) touches_[k].contact = contacts_[k];
    return true;
}

void ContactStage::drop_unreachable(const std::vector<Vec6>& velocity,
                                    const std::vector<Vec6>& free_velocity) {
    const std::vector<double>& radius = detection_.radius();
    auto speed = [&](int body, Vec3 n) {
        const double spin = std::max(norm(angular(velocity[body])), norm(angular(free_velocity[body])));
        return std::max(std::abs(dot(n, linear(velocity[body]))),
                        std::abs(dot(n, linear(free_velocity[body])))) +
               spin * radius[body];
    };
    std::erase_if(contacts_, [&](const Contact& contact) {
        const double size = std::max(radius[contact.first], radius[contact.second]);
        const Vec3 n = contact.point.normal;
        return contact.point.gap >
               options_.time_step * (speed(contact.first, n) + speed(contact.second, n)) + closed * size;
    });
}

RowBlock ContactStage::row_block(std::size_t k, bool tangents) const {
    const Contact& contact = contacts_[k];
    const Point& point = points_[k];
    RowBlock block;
    block.first = unknown_[contact.first];
    block.second = unknown_[contact.second];
    block.size = tangents ? 3 : 1;
    const Vec3 directions[3] = {contact.point.normal, point.tangent,
                                cross(contact.point.normal, point.tangent)};
    for (int i = 0; i < block.size; ++i) {
        if (block.first >= 0) block.first_jacobian[i] = row(directions[i], point.first_arm);
        if (block.second >= 0) block.second_jacobian[i] = row(-directions[i], point.second_arm);
        block.right[i] = -relative(k, directions[i], prescribed_, true);
    }
    block.lower[0] = 0.0;
    return block;
}

FrictionReport ContactStage::run(MixedSystem& system, std::vector<FrictionPoint>& points,
                                 IslandSolver& islands) {
    const ContactOptions& o = options_;
    const FrictionReport report = islands.run(
        system, points, [&o](MixedSystem& island, std::vector<FrictionPoint>& own, PivotSolver& solver) {
            switch (o.solver) {
                case SolverKind::iterative:
                    return solve_iterative(island, own, o.friction, o.iterations, o.residual_tolerance);
                case SolverKind::hybrid:
                    return solve_hybrid(island, own, o.friction, solver, o.iterations, o.residual_tolerance);
                case SolverKind::direct: break;
            }
            return solve_friction_direct(island, own, o.friction, solver);
        });
    counters_.friction_rounds += report.rounds;
    counters_.pivots += report.pivots;
    counters_.sweeps += report.sweeps;
    counters_.unsettled += !report.converged;
    return report;
}

double ContactStage::kinetic_energy(const MixedSystem& system, const std::vector<Vec6>& velocity) const {
    double twice = 0.0;
    for (std::size_t b = 0; b < velocity.size(); ++b)
        for (int i = 0; i < 6; ++i) {
            double momentum = 0.0;
            for (int j = 0; j < 6; ++j) momentum += system.mass[b][6 * i + j] * velocity[b][j];
            twice += momentum * velocity[b][i];
        }
    return 0.5 * twice;
}

void ContactStage::impact(MixedSystem& system) {
    ++counters_.impacts;
    MixedSystem hit;
    hit.mass = system.mass;
    hit.momentum = system.momentum;
    hit.rows = system.rows;
    for (RowBlock& block : hit.rows)
        for (int i = 0; i < block.size; ++i) {
            const bool below = block.lower[i] == -unbounded, above = block.upper[i] == unbounded;
            block.multiplier[i] = 0.0;
            if (below && above) block.right[i] = 0.0;
            else if (above && block.lower[i] == 0.0) block.right[i] = std::min(block.right[i], 0.0);
            else if (below && block.upper[i] == 0.0) block.right[i] = std::max(block.right[i], 0.0);
            else block.lower[i] = block.upper[i] = 0.0;
        }
    std::vector<std::size_t> who;
    bool pushed_by_motion = false;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        if (points_[k].bounce < 0.0) continue;
        RowBlock block = row_block(k, false);
        pushed_by_motion = pushed_by_motion || block.right[0] != 0.0;
        block.right[0] += std::max(0.0, -points_[k].bounce * points_[k].approach);
        block.state[0] = points_[k].approach < 0.0 ? RowState::free : RowState::at_lower;
        hit.rows.push_back(block);
        who.push_back(k);
    }
    const std::size_t joints = system.rows.size();
    std::vector<FrictionPoint> none;
    std::vector<Vec6> before = hit.momentum;
    for (std::size_t b = 0; b < before.size(); ++b) solve_six(factor_six(hit.mass[b]), before[b]);
    run(hit, none, impact_solver_);

    // Newton's law with different restitutions at once can raise the energy; blend with the plastic impact then.
    const double limit = kinetic_energy(hit, before);
    if (!pushed_by_motion && kinetic_energy(hit, hit.velocity) > limit * (1.0 + 1e-14)) {
        MixedSystem plastic = hit;
        for (std::size_t k = joints; k < plastic.rows.size(); ++k) plastic.rows[k].right[0] = 0.0;
        run(plastic, none, impact_solver_);
        double low = 0.0, high = 1.0;
        std::vector<Vec6> blend(before.size());
        auto mix = [&](double s) {
            for (std::size_t b = 0; b < blend.size(); ++b)
                for (int i = 0; i < 6; ++i)
                    blend[b][i] = plastic.velocity[b][i] + s * (hit.velocity[b][i] - plastic.velocity[b][i]);
        };
        for (int halving = 0; halving < 50; ++halving) {
            mix(0.5 * (low + high));
            (kinetic_energy(hit, blend) <= limit ? low : high) = 0.5 * (low + high);
        }
        mix(low);
        hit.velocity = blend;
        for (std::size_t k = joints; k < hit.rows.size(); ++k)
            hit.rows[k].multiplier[0] = plastic.rows[k].multiplier[0] +
                                        low * (hit.rows[k].multiplier[0] - plastic.rows[k].multiplier[0]);
    }
    system.velocity = hit.velocity;
    for (std::size_t j = 0; j < who.size(); ++j) touches_[who[j]].impact = hit.rows[joints + j].multiplier[0];
}

bool ContactStage::is_closed(std::size_t k) const noexcept {
    const Contact& contact = contacts_[k];
    const double size = std::max(detection_.radius()[contact.first], detection_.radius()[contact.second]);
    return contact.point.gap <= closed * size;
}

double ContactStage::explained_depth(std::size_t k) const noexcept {
    const Contact& contact = contacts_[k];
    const double carried = std::max(0.0, points_[k].before) / options_.time_step;
    const double size = std::max(detection_.radius()[contact.first], detection_.radius()[contact.second]);
    return 2.0 * points_[k].material.compliance * carried + closed * size;
}

bool ContactStage::solve(MixedSystem& system, const std::vector<Vec6>& velocity) {
    const double h = options_.time_step;
    const std::size_t joints = system.rows.size();
    std::vector<FrictionPoint> friction;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Point& point = points_[k];
        const SurfaceMaterial& material = point.material;
        const Regularisation row = regularise(material.compliance, material.damping, h);
        RowBlock block = row_block(k, material.friction > 0.0);
        const double gap = contacts_[k].point.gap;
        point.approach = relative(k, contacts_[k].point.normal, velocity, false);
        // A plastic hit is met by the resting row itself, so that friction gets its share of the whole blow.
        if (point.approach < -point.rounding) point.approach = 0.0;
        block.right[0] += !is_closed(k) ? -gap / h
                                        : -row.violation_gain * std::max(gap, -explained_depth(k)) +
                                              row.upsilon * point.approach;
        block.softness[0] = row.softness;
        const bool pressed =
            point.before > 0.0 ||
            (point.before < 0.0 && (is_closed(k) || gap + h * (point.approach + point.push) < 0.0));
        block.state[0] = pressed ? RowState::free : RowState::at_lower;
        block.multiplier[0] = std::max(0.0, point.before);
        if (block.size == 3) {
            block.softness[1] = block.softness[2] = material.slip_compliance / h;
            for (int i = 1; i <= 2; ++i) block.multiplier[i] = point.tangent_before[i - 1];
            friction.push_back({static_cast<int>(system.rows.size()), material.friction,
                                material.slip_compliance / h, point.before});
        }
        system.rows.push_back(block);
    }
    const FrictionReport report = run(system, friction, resting_solver_);
    residual_ = report.residual;

    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const RowBlock& block = system.rows[joints + k];
        const Vec3 normal = contacts_[k].point.normal;
        Touch& touch = touches_[k];
        touch.normal = block.multiplier[0];
        touch.impulse = (touch.normal + touch.impact) * normal;
        for (int i = 1; i < block.size;
             ++i) {  // the solver may have turned the tangents: read them from the rows
            const Vec3 direction =
                block.first >= 0 ? linear(block.first_jacobian[i]) : -linear(block.second_jacobian[i]);
            touch.impulse += block.multiplier[i] * direction;
        }
        touch.tangent[0] = dot(touch.impulse, points_[k].tangent);
        touch.tangent[1] = dot(touch.impulse, cross(normal, points_[k].tangent));
        touch.active = touch.normal > 0.0 || touch.impact > 0.0 || is_closed(k);
    }
    if (report.finite) part_overlaps(system, joints);
    return report.finite;
}

void ContactStage::part_overlaps(const MixedSystem& system, std::size_t joints) {
    bool overlap = false;
    for (std::size_t k = 0; k < contacts_.size() && !overlap; ++k)
        overlap = contacts_[k].point.gap < -explained_depth(k);
    if (!overlap) return;
    ++counters_.corrections;
    const double h = options_.time_step;
    MixedSystem parting;
    parting.mass = system.mass;
    parting.momentum.assign(system.mass.size(), Vec6{});
    parting.rows.assign(system.rows.begin(), system.rows.begin() + static_cast<std::ptrdiff_t>(joints));
    for (RowBlock& block : parting.rows)
        for (int i = 0; i < block.size; ++i) {
            block.right[i] = block.multiplier[i] = 0.0;
            const bool below = block.lower[i] == -unbounded, above = block.upper[i] == unbounded;
            if (!below && !above) block.lower[i] = block.upper[i] = 0.0;
        }
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        RowBlock block = row_block(k, false);
        const double gap = contacts_[k].point.gap;
        const double ahead =
            gap + h * (row_velocity(system.rows[joints + k], 0, system.velocity) - block.right[0]);
        const double excess = -gap - explained_depth(k);
        const double rate = regularise(0.0, points_[k].material.damping, h).violation_gain;
        block.right[0] = excess > 0.0 ? rate * excess : -std::max(0.0, ahead) / h;
        block.state[0] = excess > 0.0 ? RowState::free : RowState::at_lower;
        parting.rows.push_back(block);
    }
    std::vector<FrictionPoint> none;
    if (run(parting, none, parting_solver_).finite) correction_ = parting.velocity;
}

Vec3 ContactStage::force(int body, int other) const noexcept {
    Vec3 sum;
    for (const Touch& touch : touches_) {
        const bool first = touch.contact.first == body, second = touch.contact.second == body;
        if (!first && !second) continue;
        if (other >= 0 && (first ? touch.contact.second : touch.contact.first) != other) continue;
        sum += (first ? 1.0 : -1.0) * touch.impulse;
    }
    return (1.0 / options_.time_step) * sum;
}

int ContactStage::count() const noexcept {
    return static_cast<int>(
        std::count_if(touches_.begin(), touches_.end(), [](const Touch& t) { return t.active; }));
}

double ContactStage::penetration() const noexcept {
    double depth = 0.0;
    for (const Touch& touch : touches_) depth = std::max(depth, -touch.contact.point.gap);
    return depth;
}

BlockLdlt::Counters ContactStage::factor_counters() const noexcept {
    BlockLdlt::Counters sum = resting_solver_.counters();
    for (const IslandSolver* solver : {&impact_solver_, &parting_solver_}) {
        const BlockLdlt::Counters more = solver->counters();
        sum.factorisations += more.factorisations;
        sum.block_operations += more.block_operations;
        sum.floored_pivots += more.floored_pivots;
        sum.solves += more.solves;
    }
    return sum;
}

}  // namespace spook
