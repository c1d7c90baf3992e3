// Bodies on their way through a step: where they begin it and how fast, and which part of its forces has acted on each.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "contacts/contact_bodies.hpp"
#include "contacts/external_drive.hpp"
#include "contacts/step_contact.hpp"
#include "contacts/supported_bodies.hpp"

namespace spook {

/// All arrays are per body of the scene.
struct StepMotion {
    explicit StepMotion(std::shared_ptr<const ContactModel> model) : model_(std::move(model)) {}
    /// `free_velocity` is v + h M⁻¹ f.
    void begin(const std::vector<Pose>& at, const std::vector<Vec6>& v,
               const std::vector<Vec6>& free_velocity);
    /// What bodies are cast along, once it is known which are supported.
    void predict(const std::vector<Vec6>& free_velocity);

    const ContactModel& model() const noexcept { return *model_; }
    const ContactBodies& bodies() const noexcept { return model_->bodies; }
    const ContactSurfaces& surfaces() const noexcept { return model_->surfaces; }
    const ContactOptions& options() const noexcept { return model_->options; }
    bool is_free(std::size_t b) const noexcept { return !supported[b] && !model_->bodies.jointed[b]; }
    /// Whether a body that is supported, or jointed, moves along the forces.
    bool moves_along_forces(int body) const;
    /// Forces act on a free body up to this part of the step; the rest of them comes with the solve.
    void apply_forces_until(std::size_t body, double part);
    /// Where bodies may rebound, free ones that are not moved to the time of an impact have half of the forces before any.
    void apply_half_of_forces();
    /// A supported body that an impact sends along the forces, or against them: until then its support took its kick.
    void release_support(int body, const Vec6& after);
    /// What a supported body of an event that falls in the rest of the step is to go besides, m/s: it falls for all of it, or it
    /// would have the speed of a fall and not have lost the height.
    Vec3 free_fall_correction(int body, Vec3 after) const;

    /// An event's bodies went with v₋ until its time: with v₊ for the whole step they would end elsewhere. `has_rows` is of
    /// moving bodies.
    void correct_events(const MixedSystem& system, const std::vector<char>& has_rows);

    /// How far into the step a body that is not a ball has been moved to an impact, s.
    double moved_until(int body) const noexcept {
        return model_->bodies.ball[body] != 0 ? 0.0 : std::max(0.0, event_time[body]);
    }
    void turn_to_impact(int body, const Mat3& there, Vec3 w) noexcept {
        event_rotation[body] = there;
        velocity[body][3] = w.x, velocity[body][4] = w.y, velocity[body][5] = w.z;
    }
    /// The same velocities, with the mean angular velocity of what tumbles in the step in the place of that it begins with.
    const std::vector<Vec6>& along(const std::vector<Vec6>& velocity);
    /// Where a body begins its way of this step. An event's bodies have gone part of it with another velocity.
    Pose moved(int body, const std::vector<Vec6>& along) const;
    /// Approach and push, from the current velocities.
    void measure(StepContact& point) const {
        point.approach = relative_velocity(point, point.contact.point.normal, velocity);
        point.dv_ext = relative_velocity(point, point.contact.point.normal, dv_ext);
    }
    /// The speed that forces give to the bodies of a contact in the whole step, m/s.
    double fall(const Contact& contact) const noexcept {
        return norm(linear(whole_dv_ext[contact.first])) + norm(linear(whole_dv_ext[contact.second]));
    }
    /// What is left of the step after a point's event, s.
    double time_left(const StepContact& point) const noexcept {
        const double h = model_->options.time_step;
        return point.event ? std::max(h - point.toi, 1e-3 * h) : h;
    }
    /// How fast the surfaces move along themselves, the first against the second, along `direction`, m/s.
    double surface_speed(const StepContact& point, Vec3 direction) const noexcept;
    /// What a point that was stopped by the impulse `normal` [N s] would have given back, J, where it was to rebound and came faster
    /// than a fall in a step; else 0. Newton's impact gives back psi² of what the plastic one takes, ½ Σ nu |C v₋| without friction.
    double given_back(const StepContact& point, double normal) const;

    std::vector<Pose> poses;             // where the step begins
    std::vector<Vec6> velocity, dv_ext;  // v, and what is still to come of h M⁻¹ f
    std::vector<Vec6> whole_dv_ext;      // the second before an impact takes its part
    std::vector<Vec6> predicted;         // what bodies are cast along
    std::vector<double> toi_fraction;    // the part of the forces that acts before the last impact
    std::vector<double> event_time;      // s; negative: the body is moved to no impact's time
    std::vector<Mat3> event_rotation;    // of what is not a ball, where it is moved to one
    std::vector<Vec6> correction;        // to add to v₊ when positions advance, per moving body; empty: none
    SupportedBodies supported;
    ExternalDrive drive;

private:
    std::shared_ptr<const ContactModel> model_;
    std::vector<Vec6> along_;
};

}  // namespace spook
