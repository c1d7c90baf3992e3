#include <algorithm>
#include <limits>
#include <stdexcept>

#include "particles/particle_program.hpp"

namespace spook {

Sampler sampler_of(ParticleSystem& system, const QuantityRequest& request) {
    const ParticleReadings* s = &system.readings();
    const int index = request.index, bodies = s->bodies(), rows = s->rows();
    const Vec3 about = request.point;
    switch (from_text<Quantity>(request.kind, "quantity")) {
        case Quantity::position:
            return one_or_all(index, bodies, 3, [s](int body, double* out) { put(out, s->position(body)); });
        case Quantity::velocity:
            return one_or_all(index, bodies, 3, [s](int body, double* out) { put(out, s->velocity(body)); });
        case Quantity::orientation:
            return one_or_all(index, bodies, 4, [](int, double* out) {
                put(out + 1, {});
                out[0] = 1.0;
            });
        case Quantity::angular_velocity:
            return one_or_all(index, bodies, 3, [](int, double* out) { put(out, {}); });
        case Quantity::contact_force: return {3, [](double* out) { put(out, {}); }};
        case Quantity::contact_points:
            return {CONTACT_NUMBERS * index, [index](double* out) {
                        std::fill_n(out, CONTACT_NUMBERS * index, std::numeric_limits<double>::quiet_NaN());
                    }};
        case Quantity::contact_count:
        case Quantity::penetration: return {1, [](double* out) { *out = 0.0; }};
        case Quantity::violation:
            return one_or_all(index, rows, 1, [s](int row, double* out) { *out = s->violation(row); });
        case Quantity::constraint_force:
            return one_or_all(index, rows, 1, [s](int row, double* out) { *out = s->tension(row); });
        case Quantity::kinetic_energy: return {1, [s](double* out) { *out = s->kinetic_energy(); }};
        case Quantity::potential_energy: return {1, [s](double* out) { *out = s->potential_energy(); }};
        case Quantity::energy:
            return {1, [s](double* out) { *out = s->kinetic_energy() + s->potential_energy(); }};
        case Quantity::momentum:
            return {3, [s](double* out) {
                        Vec3 sum;
                        for (int body = 0; body < s->bodies(); ++body)
                            sum += s->mass(body) * s->velocity(body);
                        put(out, sum);
                    }};
        case Quantity::angular_momentum:
            return {3, [s, about](double* out) {
                        Vec3 sum;
                        for (int body = 0; body < s->bodies(); ++body)
                            sum += s->mass(body) * cross(s->position(body) - about, s->velocity(body));
                        put(out, sum);
                    }};
        case Quantity::joint_coordinate: break;
    }
    throw std::invalid_argument("particles have no quantity " + request.kind);
}

}  // namespace spook
