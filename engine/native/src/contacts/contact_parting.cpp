// The contact stage's last part: by which displacements overlapping bodies part.
#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "linear/regularisation.hpp"

namespace spook {

namespace {

constexpr double joint_give = 1e-6;  // of a row's own inertia: what a joint yields while overlaps are parted
constexpr double contact_give = 1e-3;  // and what a contact of jointed bodies does

}  // namespace

/// Whether two bodies overlap by more than their contact's compliance explains.
bool ContactStage::some_overlap() const {
    return std::any_of(points_.begin(), points_.end(), [this](const Point& point) {
        return point.contact.point.gap < -explained_depth(point);
    });
}

/// How far a compliant contact is pressed in at the end of the step: where it was, and the way its bodies go.
double ContactStage::pressed(const MixedSystem& system, const Point& point) const {
    if (!(point.material.compliance > 0.0)) return 0.0;
    const Contact& contact = point.contact;
    double speed = 0.0;
    for (const int b : {contact.first, contact.second}) {
        const Vec6& v = unknown_[b] < 0 ? velocity_[b] : system.velocity[unknown_[b]];
        const bool first = b == contact.first;
        speed += dot(contact_row(first ? contact.point.normal : -contact.point.normal,
                                 first ? point.first_arm : point.second_arm),
                     v);
    }
    const double before = std::min(point.pressed_before, -contact.point.gap);  // an open gap comes first
    return std::max(0.0, before - time_left(point) * speed);
}

/// Rows of joints hold displacements instead of velocities; limits only push, and motors let go.
void ContactStage::hold_joints(MixedSystem& parting) const {
    for (std::size_t k = 0; k < parting.rows.size(); ++k) {
        RowBlock& block = parting.rows[k];
        for (int i = 0; i < block.size; ++i) {
            block.right[i] = block.multiplier[i] = 0.0;
            const bool below = block.lower[i] == -unbounded, above = block.upper[i] == unbounded;
            if (!below && !above) block.lower[i] = block.upper[i] = 0.0;
            if (k < yielding_.size() && yielding_[k] != 0) continue;
            const double softness = block.softness[i];
            block.softness[i] = 0.0;
            block.softness[i] = std::min(softness, joint_give * own_inertia(parting, block, i));
        }
    }
}

/// Who is to be seen as one: contacts that pushed aside are given; contacts that push, whose laws a turn of some of
/// their bodies would break, joints and the ground are added.
void ContactStage::note_parted(const MixedSystem& parting, std::vector<Islands::Tie>& ties) {
    for (const Touch& touch : touches_)
        if (touch.normal > 0.0)
            ties.push_back({unknown_[touch.contact.first], unknown_[touch.contact.second]});
    for (const RowBlock& block : parting.rows) ties.push_back({block.first, block.second});
    parting_.velocity = parting.velocity;
    parting_.islands = find_islands(static_cast<int>(parting.mass.size()), ties);
    parting_.grounded.assign(parting_.islands.count, 0);
    for (const auto [first, second] : ties) {
        const int body = std::max(first, second);
        if (std::min(first, second) < 0 && body >= 0) parting_.grounded[parting_.islands.of_body[body]] = 1;
    }
}

void ContactStage::part_overlaps(const MixedSystem& system, std::size_t joints) {
    if (!some_overlap()) return;
    ++counters_.corrections;
    const double h = options_.time_step;
    MixedSystem parting;
    parting.mass = system.mass;
    parting.momentum.assign(system.mass.size(), Vec6{});
    parting.rows.assign(system.rows.begin(), system.rows.begin() + static_cast<std::ptrdiff_t>(joints));
    hold_joints(parting);
    for (std::size_t k = 0; k < points_.size(); ++k) {
        RowBlock block = row_block(points_[k], 1);
        const double gap = points_[k].contact.point.gap;
        const double ahead =
            gap + h * (row_velocity(system.rows[joints + k], 0, system.velocity) - block.right[0]);
        const double excess = -gap - explained_depth(points_[k]);
        const double rate = regularise(0.0, points_[k].material.damping, h).violation_gain;
        block.right[0] = excess > 0.0 ? rate * excess : -std::max(0.0, ahead) / h;
        block.state[0] = excess > 0.0 ? RowState::free : RowState::at_lower;
        if (joints > 0) block.softness[0] = contact_give * own_inertia(parting, block, 0);
        parting.rows.push_back(block);
    }
    std::vector<FrictionPoint> none;
    if (!run(parting, none, parting_solver_, options_.friction).finite) return;
    std::vector<Islands::Tie> ties;
    for (std::size_t k = joints; k < parting.rows.size(); ++k)
        if (parting.rows[k].multiplier[0] != 0.0)
            ties.push_back({parting.rows[k].first, parting.rows[k].second});
    parting.rows.resize(joints);
    note_parted(parting, ties);
}

/// part_overlaps(), by sweeps.
void ContactStage::part_by_sweeps(const MixedSystem& system) {
    if (!some_overlap()) return;
    ++counters_.corrections;
    const double h = options_.time_step;
    MixedSystem& parting = parting_system_;
    parting.mass = system.mass;
    parting.momentum.assign(system.mass.size(), Vec6{});
    parting.rows = system.rows;
    hold_joints(parting);
    parting_sweeps_.start_beside(sweeps_, parting, options_.friction);
    for (std::size_t b = 0; b < unknown_.size(); ++b)
        next_[b] = unknown_[b] >= 0 ? system.velocity[unknown_[b]] : velocity_[b];
    for (const Point& point : points_) {
        SweepContact row;
        row.first = unknown_[point.contact.first];
        row.second = unknown_[point.contact.second];
        row.normal = point.contact.point.normal;
        row.tangent = point.tangent;
        row.first_arm = point.first_arm;
        row.second_arm = point.second_arm;
        const double gap = point.contact.point.gap, excess = -gap - explained_depth(point);
        const double ahead = gap + h * relative(point, row.normal, next_, false);
        const double rate = regularise(0.0, point.material.damping, h).violation_gain;
        row.right[0] = excess > 0.0 ? rate * excess : -std::max(0.0, ahead) / h;
        row.impulse[0] = point.parting_before;
        if (!parting.rows.empty()) row.softness = contact_give * own_inertia(parting, row_block(point, 1), 0);
        parting_sweeps_.add(row);
    }
    const FrictionReport report =
        parting_sweeps_.run(options_.iterations, options_.residual_tolerance, nullptr);
    counters_.sweeps += static_cast<std::uint64_t>(report.sweeps);
    if (!report.finite) return;
    parting_sweeps_.write(parting);
    std::vector<Islands::Tie> ties;
    for (std::size_t k = 0; k < points_.size(); ++k) {
        touches_[k].parting = parting_sweeps_.impulse(static_cast<int>(k))[0];
        if (touches_[k].parting != 0.0)
            ties.push_back({unknown_[points_[k].contact.first], unknown_[points_[k].contact.second]});
    }
    note_parted(parting, ties);
}

}  // namespace spook
