// A small world for tests of contacts: bodies without joints, stepped by the contact stage alone.
#pragma once

#include <vector>

#include "contacts/contact_stage.hpp"

struct ContactBody {
    spook::Primitive shape;
    double mass = 1.0;             // kg; 0 does not move
    spook::Vec3 inertia{1, 1, 1};  // principal, kg m²
    spook::Vec3 position, velocity, spin;
    spook::Quat turn;
    spook::SurfaceMaterial material;
};

inline spook::Vec3 box_inertia(double mass, spook::Vec3 size) {
    return mass / 12.0 *
           spook::Vec3{size.y * size.y + size.z * size.z, size.x * size.x + size.z * size.z,
                       size.x * size.x + size.y * size.y};
}

class ContactWorld {
public:
    ContactWorld(std::vector<ContactBody> bodies, spook::Vec3 gravity, spook::ContactOptions options)
        : bodies(std::move(bodies)), gravity(gravity), options(options), stage(make(this->bodies, options)) {}

    void step() {
        using namespace spook;
        const double h = options.time_step;
        std::vector<Pose> poses;
        std::vector<Vec6> velocity, free_velocity;
        MixedSystem system;
        for (const ContactBody& b : bodies) {
            poses.push_back({b.position, rotation(b.turn)});
            velocity.push_back(packed(b));
            Vec6 free = velocity.back();
            for (int i = 0; i < 3 && b.mass > 0.0; ++i) free[i] += h * gravity[i];
            free_velocity.push_back(free);
        }
        auto momenta = [&](const std::vector<Vec6>& v) {
            system.momentum.clear();
            for (std::size_t k = 0, u = 0; k < bodies.size(); ++k) {
                if (bodies[k].mass == 0.0) continue;
                Vec6 p{};
                for (int i = 0; i < 6; ++i)
                    for (int j = 0; j < 6; ++j) p[i] += system.mass[u][6 * i + j] * v[k][j];
                system.momentum.push_back(p);
                ++u;
            }
        };
        for (std::size_t k = 0; k < bodies.size(); ++k)
            if (bodies[k].mass > 0.0) system.mass.push_back(mass_block(bodies[k], poses[k].rotation));
        const bool touching = stage.detect(poses, velocity, free_velocity);
        std::vector<double> lead(bodies.size(), 0.0);
        for (std::size_t k = 0; k < bodies.size(); ++k)
            if (touching && bodies[k].mass > 0.0) {
                lead[k] = stage.toi_fraction(static_cast<int>(k));
                for (int i = 0; i < 3; ++i) velocity[k][i] += lead[k] * h * gravity[i];
            }
        while (touching && stage.impact_needed(system)) {
            momenta(velocity);
            StepMotion& motion = stage.find_next_impact(system);
            for (std::size_t k = 0; k < bodies.size(); ++k)
                if (const double until = motion.moved_until(static_cast<int>(k)); until > 0.0) {
                    const Vec3 w{velocity[k][3], velocity[k][4], velocity[k][5]};
                    const double rate = norm(w),
                                 share = rate > 0.0 ? sine_cosine(0.5 * until * rate).sine / rate : 0.0;
                    const Quat turn{sine_cosine(0.5 * until * rate).cosine, share * w.x, share * w.y,
                                    share * w.z};
                    motion.turn_to_impact(static_cast<int>(k), rotation(turn) * poses[k].rotation, w);
                }
            std::vector<Vec6> impulses;
            stage.impact(system, impulses);
            for (std::size_t k = 0, u = 0; k < bodies.size(); ++k)
                if (bodies[k].mass > 0.0) {
                    velocity[k] = system.velocity[u++];
                    lead[k] = stage.toi_fraction(static_cast<int>(k));
                }
        }
        for (std::size_t k = 0; k < bodies.size(); ++k)
            for (int i = 0; i < 3 && bodies[k].mass > 0.0; ++i) {
                free_velocity[k] = velocity[k];
            }
        for (std::size_t k = 0; k < bodies.size(); ++k)
            for (int i = 0; i < 3 && bodies[k].mass > 0.0; ++i)
                free_velocity[k][i] += (1.0 - lead[k]) * h * gravity[i];
        if (touching) {
            momenta(free_velocity);
            stage.solve(system, velocity, {});
        }
        for (std::size_t k = 0, u = 0; k < bodies.size(); ++k) {
            ContactBody& b = bodies[k];
            if (b.mass > 0.0) {
                const Vec6 v = touching ? system.velocity[u] : free_velocity[k];
                b.velocity = {v[0], v[1], v[2]};
                b.spin = {v[3], v[4], v[5]};
            }
            const bool led = b.mass > 0.0 && touching && !stage.correction().empty();
            const Vec6 extra = led ? stage.correction()[u] : Vec6{};
            if (b.mass > 0.0) {
                ++u;
                move(b, packed(b));
                move(b, extra);
            }
        }
        for (int round = 0; touching && round < 3; ++round) {
            for (std::size_t k = 0; k < bodies.size(); ++k)
                poses[k] = {bodies[k].position, rotation(bodies[k].turn)};
            const PositionProjection* const projection = stage.project_positions(system, 0, poses, round > 0);
            if (projection == nullptr) break;
            for (std::size_t k = 0, u = 0; k < bodies.size(); ++k)
                if (bodies[k].mass > 0.0) move(bodies[k], projection->velocity[u++]);
        }
    }

    double energy() const {
        using namespace spook;
        double sum = 0.0;
        for (const ContactBody& b : bodies) {
            if (b.mass == 0.0) continue;
            const Vec3 w = local(rotation(b.turn), b.spin);
            sum += 0.5 * b.mass * dot(b.velocity, b.velocity) - b.mass * dot(gravity, b.position);
            sum += 0.5 * (b.inertia.x * w.x * w.x + b.inertia.y * w.y * w.y + b.inertia.z * w.z * w.z);
        }
        return sum;
    }

    std::vector<ContactBody> bodies;
    spook::Vec3 gravity;
    spook::ContactOptions options;
    spook::ContactStage stage;

private:
    void move(ContactBody& b, const spook::Vec6& v) const {
        using namespace spook;
        const double h = options.time_step;
        const Vec3 turned{v[3], v[4], v[5]};
        b.position += h * Vec3{v[0], v[1], v[2]};
        const double angle = h * norm(turned),
                     s = angle > 1e-12 ? std::sin(0.5 * angle) / norm(turned) : 0.5 * h;
        const Quat q = Quat{std::cos(0.5 * angle), s * turned.x, s * turned.y, s * turned.z} * b.turn;
        const double n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
        b.turn = {q.w / n, q.x / n, q.y / n, q.z / n};
    }
    static spook::Vec6 packed(const ContactBody& b) {
        return {b.velocity.x, b.velocity.y, b.velocity.z, b.spin.x, b.spin.y, b.spin.z};
    }
    static spook::Mat6 mass_block(const ContactBody& b, const spook::Mat3& turn) {
        using namespace spook;
        const Mat3 inertia = turn * Mat3::diagonal(b.inertia) * transpose(turn);
        Mat6 m{};
        for (int i = 0; i < 3; ++i) {
            m[7 * i] = b.mass;
            for (int j = 0; j < 3; ++j) m[6 * (i + 3) + j + 3] = 0.5 * (inertia(i, j) + inertia(j, i));
        }
        return m;
    }
    static spook::ContactStage make(const std::vector<ContactBody>& bodies,
                                    const spook::ContactOptions& options) {
        using namespace spook;
        std::vector<Collider> colliders;
        std::vector<char> dynamic;
        std::vector<SurfaceMaterial> materials;
        std::vector<int> unknown;
        int next = 0;
        for (std::size_t k = 0; k < bodies.size(); ++k) {
            colliders.push_back({static_cast<int>(k), bodies[k].shape, {}});
            dynamic.push_back(bodies[k].mass > 0.0);
            materials.push_back(bodies[k].material);
            unknown.push_back(bodies[k].mass > 0.0 ? next++ : -1);
        }
        return ContactStage(Detection(colliders, dynamic, {}), materials, unknown, options);
    }
};
