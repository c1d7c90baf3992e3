// Box3D stepped in a loop of its own, for engine/peers/box3d.py, which knows these functions by ctypes. Built by .ci/box3d.
#include "box3d/box3d.h"

#include <stdlib.h>

typedef struct Loop {
    b3WorldId world;
    b3BodyId* bodies;
    int count;
    float substep;  // s
} Loop;

static b3Vec3 vector(const double* from) { return (b3Vec3){(float)from[0], (float)from[1], (float)from[2]}; }

// Sleep and damping off, one thread. `threshold`: the speed [m/s] below which nothing bounces; negative: Box3D's own.
Loop* spook_new(const double* gravity, int most, double threshold) {
    b3WorldDef def = b3DefaultWorldDef();
    def.gravity = vector(gravity);
    def.enableSleep = false;
    def.workerCount = 1;
    if (threshold >= 0.0) {
        def.restitutionThreshold = (float)threshold;
    }
    Loop* loop = malloc(sizeof(Loop));
    loop->world = b3CreateWorld(&def);
    loop->bodies = malloc((size_t)most * sizeof(b3BodyId));
    loop->count = 0;
    loop->substep = 0.0f;
    return loop;
}

void spook_free(Loop* loop) {
    b3DestroyWorld(loop->world);
    free(loop->bodies);
    free(loop);
}

// `state`: position, quaternion (w, x, y, z), velocity, spin: 13 numbers. `mass`: mass and three moments; a mass of 0 stands
// still. `kind`: 0 nothing, 1 sphere (radius), 2 box (half edges), 3 capsule along z (radius, half length); `sizes`: 3 numbers.
void spook_body(Loop* loop, const double* state, const double* mass, int kind, const double* sizes,
                double friction, double restitution) {
    b3BodyDef def = b3DefaultBodyDef();
    def.type = mass[0] > 0.0 ? b3_dynamicBody : b3_staticBody;
    def.position = vector(state);
    def.rotation = (b3Quat){vector(state + 4), (float)state[3]};
    def.linearVelocity = vector(state + 7);
    def.angularVelocity = vector(state + 10);
    def.enableSleep = false;
    def.allowFastRotation = true;
    b3BodyId body = b3CreateBody(loop->world, &def);
    b3Body_SetUserData(body, (void*)(size_t)loop->count);
    loop->bodies[loop->count++] = body;

    b3ShapeDef shape = b3DefaultShapeDef();
    shape.baseMaterial.friction = (float)friction;
    shape.baseMaterial.restitution = (float)restitution;
    shape.updateBodyMass = false;
    if (kind == 1) {
        b3Sphere sphere = {{0.0f, 0.0f, 0.0f}, (float)sizes[0]};
        b3CreateSphereShape(body, &shape, &sphere);
    } else if (kind == 2) {
        b3BoxHull box = b3MakeBoxHull((float)sizes[0], (float)sizes[1], (float)sizes[2]);
        b3CreateHullShape(body, &shape, &box.base);
    } else if (kind == 3) {
        float half = (float)sizes[1];
        b3Capsule capsule = {{0.0f, 0.0f, -half}, {0.0f, 0.0f, half}, (float)sizes[0]};
        b3CreateCapsuleShape(body, &shape, &capsule);
    }
    if (mass[0] > 0.0) {
        b3MassData data = {0};
        data.mass = (float)mass[0];
        data.inertia.cx.x = (float)mass[1];
        data.inertia.cy.y = (float)mass[2];
        data.inertia.cz.z = (float)mass[3];
        b3Body_SetMassData(body, data);
    }
}

// Two bodies that must not touch.
void spook_apart(Loop* loop, int first, int second) {
    b3FilterJointDef def = b3DefaultFilterJointDef();
    def.base.bodyIdA = loop->bodies[first];
    def.base.bodyIdB = loop->bodies[second];
    b3CreateFilterJoint(loop->world, &def);
}

void spook_step(Loop* loop, int count, double step, int substeps) {
    loop->substep = (float)(step / substeps);
    for (int i = 0; i < count; ++i) {
        b3World_Step(loop->world, (float)step, substeps);
    }
}

// 13 numbers a body, as above.
void spook_state(Loop* loop, double* state) {
    for (int i = 0; i < loop->count; ++i, state += 13) {
        b3WorldTransform at = b3Body_GetTransform(loop->bodies[i]);
        b3Vec3 v = b3Body_GetLinearVelocity(loop->bodies[i]), w = b3Body_GetAngularVelocity(loop->bodies[i]);
        const double row[13] = {at.p.x, at.p.y, at.p.z, at.q.s, at.q.v.x, at.q.v.y, at.q.v.z,
                                v.x,    v.y,    v.z,    w.x,    w.y,      w.z};
        for (int k = 0; k < 13; ++k) {
            state[k] = row[k];
        }
    }
}

// Contact points that carry load or overlap, each pair of bodies once: first, second, force on the second [N] in the last
// substep, depth [m]: 6 numbers a point. How many there are, though no more than `most` are written.
int spook_contacts(Loop* loop, double* points, int most) {
    int found = 0;
    for (int i = 0; i < loop->count; ++i) {
        int capacity = b3Body_GetContactCapacity(loop->bodies[i]);
        if (capacity == 0) {
            continue;
        }
        b3ContactData* data = malloc((size_t)capacity * sizeof(b3ContactData));
        int touching = b3Body_GetContactData(loop->bodies[i], data, capacity);
        for (int k = 0; k < touching; ++k) {
            int first = (int)(size_t)b3Body_GetUserData(b3Shape_GetBody(data[k].shapeIdA));
            int second = (int)(size_t)b3Body_GetUserData(b3Shape_GetBody(data[k].shapeIdB));
            // Told by both bodies: taken of the first.
            if (i != (first < second ? first : second)) {
                continue;
            }
            for (int m = 0; m < data[k].manifoldCount; ++m) {
                const b3Manifold* manifold = data[k].manifolds + m;
                for (int p = 0; p < manifold->pointCount; ++p) {
                    const b3ManifoldPoint* point = manifold->points + p;
                    if (point->normalImpulse <= 0.0f && point->separation >= 0.0f) {
                        continue;
                    }
                    if (found < most) {
                        double* row = points + 6 * found;
                        float normal = point->normalImpulse / loop->substep;
                        float share =
                            1.0f / ((float)manifold->pointCount * loop->substep);  // friction is one for all
                        row[0] = first;
                        row[1] = second;
                        row[2] = normal * manifold->normal.x + share * manifold->frictionImpulse.x;
                        row[3] = normal * manifold->normal.y + share * manifold->frictionImpulse.y;
                        row[4] = normal * manifold->normal.z + share * manifold->frictionImpulse.z;
                        row[5] = point->separation < 0.0f ? -point->separation : 0.0;
                    }
                    ++found;
                }
            }
        }
        free(data);
    }
    return found;
}
