// What can be seen of rigid bodies, their joints and contacts; see readings.cpp.
#pragma once

#include "rigid/bilateral_solve.hpp"
#include "rigid/mixed_rows.hpp"
#include "rigid/plane_path.hpp"

namespace spook {

/// J, with that of rotors.
double kinetic_energy(const RigidModel& model, const RigidState& live, const JointSet& joints) noexcept;

class RigidReadings {
public:
    RigidReadings(const RigidModel& model, const RigidState& live, const JointSet& joints,
                  const Forces& forces, const BlockRows& rows, const BilateralSolve& bilateral,
                  const PlanePath& plane, const MixedRows& mixed) noexcept
        : model_(model),
          live_(live),
          joints_(joints),
          forces_(forces),
          rows_(rows),
          bilateral_(bilateral),
          plane_(plane),
          mixed_(mixed) {}

    int bodies() const noexcept { return model_.bodies(); }
    const BodyConstants& constants(int body) const noexcept { return model_.constants[body]; }
    const BodyState& state(int body) const noexcept { return live_.bodies[body]; }
    Vec3 position_of(int body) const noexcept { return model_.position(body, live_.bodies); }
    Quat orientation_of(int body) const noexcept {
        return orientation(model_.constants[body], live_.bodies[body]);
    }
    double kinetic_energy() const noexcept { return spook::kinetic_energy(model_, live_, joints_); }
    double potential_energy() const noexcept { return forces_.potential_energy(); }
    /// 13 numbers per body: place, orientation, velocity, angular velocity; without the last two they are NaN.
    std::vector<double> states(bool velocities) const;

    const JointSet& joints() const noexcept { return joints_; }
    void violation(int joint, double* out) const { joints_.violation(joint, live_.bodies, out); }
    double coordinate(int joint) const { return joints_.coordinate(joint, live_.bodies); }
    /// Force and torque on the second body at the joint in the last step [N, N m], world axes.
    void wrench(int joint, double* out) const noexcept;
    /// Of all joints, for a snapshot, since the rows they are made of are in none; those kept are told until the next solve.
    std::vector<Vec6> wrenches() const;
    void tell_kept(const std::vector<Vec6>& wrenches) { kept_wrenches_ = wrenches; }
    /// Tension of a distance in the last step [N], positive where it pulls.
    double tension(int joint) const noexcept { return -joints_.states[joint].multiplier[0] / model_.h; }

    /// Force [N] on `body` from `other` (−1: from all) in the last step; count and depth of its contact points.
    Vec3 contact_force(int body, int other) const noexcept;
    int contact_count() const noexcept;
    void contact_points(int most, double* out) const noexcept;
    double penetration() const noexcept;

private:
    bool by_rows() const noexcept;
    void find_wrench(int joint, double* out) const noexcept;
    void add_rows(std::size_t block, Vec3& force, Vec3& torque) const noexcept;

    const RigidModel& model_;
    const RigidState& live_;
    const JointSet& joints_;
    const Forces& forces_;
    const BlockRows& rows_;
    const BilateralSolve& bilateral_;
    const PlanePath& plane_;
    const MixedRows& mixed_;
    std::vector<Vec6> kept_wrenches_;
};

}  // namespace spook
