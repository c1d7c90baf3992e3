// The bodies of a scene and their surfaces, as contacts see them: nothing of it changes once a scene is compiled.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "collision/detection.hpp"
#include "collision/rotation.hpp"
#include "contacts/contact_material.hpp"
#include "contacts/contact_options.hpp"
#include "contacts/tolerances.hpp"
#include "linear/shared_values.hpp"

namespace spook {

/// Two bodies with rows of a joint, −1 for the world: whether it has a stop, and whether a motor or a kinematic body moves it.
struct JointTie {
    int first, second;
    bool stops = false, driven = false;
};

/// A body whose angular velocity changes where no torque acts, for its moments of inertia differ.
struct Tumbler {
    int body;
    FreeRotor rotor;
    Vec3 moments;  // principal, kg m²
    Mat3 axes;     // principal ones in those of the body
};

struct ContactBodies {
    /// solver_index[b] is the body's index in MixedSystem, or −1 if it does not move by itself (static, kinematic).
    /// `joints` are the pairs of bodies that rows of joints tie.
    ContactBodies(const Detection& detection, std::vector<int> solver_indices, std::vector<JointTie> ties,
                  std::vector<Tumbler> tumblers = {});

    std::size_t count() const noexcept { return solver_index.size(); }
    bool moves(std::size_t body) const noexcept { return solver_index[body] >= 0; }
    /// The index in MixedSystem of one of a contact's bodies that moves by itself.
    int solver_body(const Contact& contact) const noexcept {
        return std::max(solver_index[contact.first], solver_index[contact.second]);
    }
    /// One of them, by its index in the scene.
    int mover(const Contact& contact) const noexcept { return body_of[solver_body(contact)]; }
    /// Of both, −1 for what does not move by itself.
    template <class Pair> std::pair<int, int> solver_pair(const Pair& contact) const noexcept {
        return {solver_index[contact.first], solver_index[contact.second]};
    }
    /// The larger of a contact's bodies, and the smaller of those that move by themselves, by their radius, m.
    double size(const Contact& contact) const noexcept {
        return std::max(radius[contact.first], radius[contact.second]);
    }
    double moving_size(const Contact& contact) const noexcept {
        const int a = contact.first, b = contact.second;
        if (!moves(a)) return radius[b];
        return moves(b) ? std::min(radius[a], radius[b]) : radius[a];
    }
    /// A depth that is rounding: it may come back as a speed, which gives a billionth of a body's height at most, m.
    double slack(const Contact& contact) const noexcept;
    bool is_deep(const Contact& contact) const noexcept { return contact.point.gap <= -slack(contact); }
    /// Without the rounding of the places it was found at, which would come back as a speed step after step.
    double gap(const Contact& contact) const noexcept;
    /// A point is open from a gap of tolerances' `closed` on, times the radius of the larger body.
    bool is_closed(const Contact& contact, double gap) const noexcept {
        return gap <= closed * size(contact);
    }
    bool is_closed(const Contact& contact) const noexcept { return is_closed(contact, contact.point.gap); }

    std::vector<int> solver_index, body_of;  // and back
    std::vector<JointTie> joints;
    std::vector<char> jointed;   // bodies with rows of joints
    std::vector<char> driven;    // those with one that is driven
    std::vector<char> ball;      // whose only surface is a sphere round their centre, and that no stop holds
    std::vector<double> radius;  // m
    bool swings = false;         // some surface has sides: what turns on it may meet elsewhere
    std::vector<Tumbler> tumblers;  // of those that move by themselves
};

struct ContactSurfaces {
    ContactSurfaces(const std::vector<SurfaceMaterial>& materials, std::vector<PairFriction> pairs);

    const SurfaceMaterial& operator[](int body) const noexcept { return of[body]; }
    PairMaterial pair(const Contact& contact) const noexcept {
        if (pairs.empty()) return combined(of[contact.first], of[contact.second]);
        return pair_among_given(contact);  // apart: of the common way little is computed
    }
    PairMaterial pair_among_given(const Contact& contact) const noexcept;
    /// Whether a surface of the contact moves along itself.
    bool is_conveyed(const Contact& contact) const noexcept {
        return conveys && (norm(of[contact.first].surface_velocity) > 0.0 ||
                           norm(of[contact.second].surface_velocity) > 0.0);
    }

    SharedValues<SurfaceMaterial> of;                // by body
    std::vector<PairFriction> pairs;                 // lower body first, in order
    bool conveys = false;                            // some surface moves along itself
    bool oriented = false;                           // some friction differs with the direction
    bool resists_turning = false, rebounds = false;  // some surface does
};

/// What a scene says of contacts, and how they are to be solved.
struct ContactModel {
    ContactBodies bodies;
    ContactSurfaces surfaces;
    ContactOptions options;
};

}  // namespace spook
