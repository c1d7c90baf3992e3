#include "rigid/island_frame.hpp"

namespace spook {

IslandFrame island_frame(const RigidModel& model, const LargeArray<BodyState>& bodies,
                         const std::vector<int>& members) {
    IslandFrame frame;
    double mass = 0.0;
    for (int k : members) {
        const BodyConstants& body = model.constants[model.constrained[k]];
        frame.centre += body.mass * model.position(model.constrained[k], bodies);
        mass += body.mass;
    }
    frame.centre *= 1.0 / mass;
    for (int k : members) {
        const BodyConstants& body = model.constants[model.constrained[k]];
        const Vec3 r = model.position(model.constrained[k], bodies) - frame.centre;
        const double r2 = dot(r, r);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                frame.inertia(i, j) += body.mass * ((i == j ? r2 : 0.0) - r[i] * r[j]) +
                                       (body.particle ? 0.0 : bodies[model.constrained[k]].inertia(i, j));
    }
    return frame;
}

}  // namespace spook
