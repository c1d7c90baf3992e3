// Box3D stepped in a loop of its own, for engine/peers/box3d.py, which knows these functions by ctypes. Built by .ci/box3d.
#include "box3d/box3d.h"

#include <stdlib.h>

enum { BALL = 1, HINGE, PRISMATIC, LOCK, DISTANCE };
#define WITHOUT_BOUND 1e18f  // m/s; its square is a number, too

enum { LOAD, SPRING, ATTRACTION };

// What pushes: a load (force and torque on `first`), a spring (anchors, stiffness, rest length, viscosity), an attraction
// (centre, strength).
typedef struct Push {
    int kind, first, second;
    double numbers[9];
} Push;

typedef struct Loop {
    b3WorldId world;
    b3BodyId* bodies;
    b3JointId* joints;
    Push* pushes;
    b3MeshData** meshes;
    int count, joined, pushed, meshed;
    float substep;  // s
    b3BodyId ground;  // what joints to the world hold on to
    float stiffest;  // Hz, of joints; negative: Box3D's own
} Loop;

static b3Vec3 vector(const double* from) { return (b3Vec3){(float)from[0], (float)from[1], (float)from[2]}; }

static b3Quat turn(const double* from) { return (b3Quat){vector(from + 1), (float)from[0]}; }

// Sleep, damping and its bound of speeds off, one thread. `most`: bodies, joints and pushes at most. `threshold`: the speed [m/s] below which
// nothing bounces; `stiffest`: of joints [Hz], of which a substep takes a quarter of its rate; negative: Box3D's own.
Loop* spook_new(const double* gravity, const int* most, double threshold, double stiffest) {
    b3WorldDef def = b3DefaultWorldDef();
    def.gravity = vector(gravity);
    def.enableSleep = false;
    def.workerCount = 1;
    def.maximumLinearSpeed = WITHOUT_BOUND;
    if (threshold >= 0.0) {
        def.restitutionThreshold = (float)threshold;
    }
    Loop* loop = malloc(sizeof(Loop));
    loop->world = b3CreateWorld(&def);
    loop->bodies = malloc((size_t)most[0] * sizeof(b3BodyId));
    loop->joints = malloc((size_t)(most[1] + 1) * sizeof(b3JointId));
    loop->pushes = malloc((size_t)(most[2] + 1) * sizeof(Push));
    loop->meshes = malloc((size_t)most[0] * sizeof(b3MeshData*));
    loop->count = loop->joined = loop->pushed = loop->meshed = 0;
    loop->stiffest = (float)stiffest;
    b3BodyDef fixed = b3DefaultBodyDef();
    loop->ground = b3CreateBody(loop->world, &fixed);
    loop->substep = 0.0f;
    return loop;
}

void spook_free(Loop* loop) {
    b3DestroyWorld(loop->world);
    for (int i = 0; i < loop->meshed; ++i) {
        b3DestroyMesh(loop->meshes[i]);
    }
    free(loop->meshes);
    free(loop->bodies);
    free(loop->joints);
    free(loop->pushes);
    free(loop);
}

// `state`: position, quaternion (w, x, y, z), velocity, spin: 13 numbers. `mass`: mass and three moments; a mass of 0 stands
// still, and one below 0 moves as it does.
void spook_body(Loop* loop, const double* state, const double* mass) {
    b3BodyDef def = b3DefaultBodyDef();
    def.type = mass[0] > 0.0 ? b3_dynamicBody : mass[0] < 0.0 ? b3_kinematicBody : b3_staticBody;
    def.position = vector(state);
    def.rotation = turn(state + 3);
    def.linearVelocity = vector(state + 7);
    def.angularVelocity = vector(state + 10);
    def.enableSleep = false;
    def.allowFastRotation = true;
    b3BodyId body = b3CreateBody(loop->world, &def);
    b3Body_SetUserData(body, (void*)(size_t)loop->count);
    loop->bodies[loop->count++] = body;
    if (mass[0] > 0.0) {
        b3MassData data = {0};
        data.mass = (float)mass[0];
        data.inertia.cx.x = (float)mass[1];
        data.inertia.cy.y = (float)mass[2];
        data.inertia.cz.z = (float)mass[3];
        b3Body_SetMassData(body, data);
    }
}

static b3ShapeDef surface(const double* rubs) {
    b3ShapeDef shape = b3DefaultShapeDef();
    shape.baseMaterial.friction = (float)rubs[0];
    shape.baseMaterial.restitution = (float)rubs[1];
    shape.baseMaterial.tangentVelocity = vector(rubs + 2);
    shape.updateBodyMass = false;
    return shape;
}

// A surface of the last body, as below: the hull of `count` corners, or with faces, which are three corners each, a mesh on
// what stands. Whether Box3D takes it.
int spook_corners(Loop* loop, const double* corners, int count, const int* faces, int triangles, const double* rubs) {
    b3BodyId body = loop->bodies[loop->count - 1];
    b3ShapeDef shape = surface(rubs);
    b3Vec3* points = malloc((size_t)count * sizeof(b3Vec3));
    for (int i = 0; i < count; ++i) {
        points[i] = vector(corners + 3 * i);
    }
    int taken = 0;
    if (triangles > 0) {
        b3MeshDef def = {0};
        def.vertices = points;
        def.vertexCount = count;
        def.indices = (int32_t*)faces;
        def.triangleCount = triangles;
        def.identifyEdges = true;
        b3MeshData* mesh = b3CreateMesh(&def, NULL, 0);
        if (mesh != NULL) {
            loop->meshes[loop->meshed++] = mesh;
            b3CreateMeshShape(body, &shape, mesh, (b3Vec3){1.0f, 1.0f, 1.0f});
            taken = 1;
        }
    } else {
        b3HullData* hull = b3CreateHull(points, count, count);
        if (hull != NULL) {
            b3CreateHullShape(body, &shape, hull);
            b3DestroyHull(hull);
            taken = 1;
        }
    }
    free(points);
    return taken;
}

// A surface of the last body. `kind`: 1 sphere (radius), 2 box (half edges), 3 capsule along z (radius, half length); `sizes`:
// 3 numbers; `place`: position and quaternion on the body; `rubs`: friction, restitution, and the velocity of what moves
// along itself.
void spook_shape(Loop* loop, int kind, const double* sizes, const double* place, const double* rubs) {
    b3BodyId body = loop->bodies[loop->count - 1];
    b3Transform at = {vector(place), turn(place + 3)};
    b3ShapeDef shape = surface(rubs);
    if (kind == 1) {
        b3Sphere sphere = {at.p, (float)sizes[0]};
        b3CreateSphereShape(body, &shape, &sphere);
    } else if (kind == 2) {
        b3BoxHull box = b3MakeTransformedBoxHull((float)sizes[0], (float)sizes[1], (float)sizes[2], at);
        b3CreateHullShape(body, &shape, &box.base);
    } else if (kind == 3) {
        float half = (float)sizes[1];
        b3Capsule capsule = {b3TransformPoint(at, (b3Vec3){0.0f, 0.0f, -half}),
                             b3TransformPoint(at, (b3Vec3){0.0f, 0.0f, half}), (float)sizes[0]};
        b3CreateCapsuleShape(body, &shape, &capsule);
    }
}

static void hold(Loop* loop, b3JointDef* base, const int* ends, const double* frames) {
    base->bodyIdA = ends[0] < 0 ? loop->ground : loop->bodies[ends[0]];
    base->bodyIdB = ends[1] < 0 ? loop->ground : loop->bodies[ends[1]];
    base->localFrameA = (b3Transform){vector(frames), turn(frames + 3)};
    base->localFrameB = (b3Transform){vector(frames + 7), turn(frames + 10)};
    if (loop->stiffest >= 0.0f) {
        base->constraintHertz = loop->stiffest;
    }
}

// `ends`: two bodies, -1 the world. `frames`: position and quaternion of the joint on each, the axis being z of a hinge and x of
// a slide. `numbers`: of a distance its length, and of one that gives its frequency [Hz] and damping ratio; of hinge and slide the speed of a motor and its largest force, which is none
// where it is negative.
void spook_joint(Loop* loop, int kind, const int* ends, const double* frames, const double* numbers) {
    b3JointId made;
    if (kind == BALL) {
        b3SphericalJointDef def = b3DefaultSphericalJointDef();
        hold(loop, &def.base, ends, frames);
        made = b3CreateSphericalJoint(loop->world, &def);
    } else if (kind == HINGE) {
        b3RevoluteJointDef def = b3DefaultRevoluteJointDef();
        hold(loop, &def.base, ends, frames);
        def.enableMotor = numbers[1] >= 0.0;
        def.motorSpeed = (float)numbers[0];
        def.maxMotorTorque = (float)numbers[1];
        made = b3CreateRevoluteJoint(loop->world, &def);
    } else if (kind == PRISMATIC) {
        b3PrismaticJointDef def = b3DefaultPrismaticJointDef();
        hold(loop, &def.base, ends, frames);
        def.enableMotor = numbers[1] >= 0.0;
        def.motorSpeed = (float)numbers[0];
        def.maxMotorForce = (float)numbers[1];
        made = b3CreatePrismaticJoint(loop->world, &def);
    } else if (kind == LOCK) {
        b3WeldJointDef def = b3DefaultWeldJointDef();
        hold(loop, &def.base, ends, frames);
        made = b3CreateWeldJoint(loop->world, &def);
    } else {
        b3DistanceJointDef def = b3DefaultDistanceJointDef();
        hold(loop, &def.base, ends, frames);
        def.base.collideConnected = true;
        def.length = (float)numbers[0];
        def.enableSpring = numbers[1] > 0.0;
        def.hertz = (float)numbers[1];
        def.dampingRatio = (float)numbers[2];
        made = b3CreateDistanceJoint(loop->world, &def);
    }
    loop->joints[loop->joined++] = made;
}

// Of each joint force and torque on its second body in the last substep, world axes, about the joint: 6 numbers; of a
// distance its tension first.
void spook_joint_forces(Loop* loop, double* forces) {
    for (int i = 0; i < loop->joined; ++i, forces += 6) {
        b3JointId joint = loop->joints[i];
        b3Vec3 f = b3Joint_GetConstraintForce(joint), t = b3Joint_GetConstraintTorque(joint);
        b3JointType type = b3Joint_GetType(joint);
        b3Transform frame = b3Joint_GetLocalFrameA(joint);
        b3WorldTransform a = b3Body_GetTransform(b3Joint_GetBodyA(joint));
        b3Quat axes = b3MulQuat(a.q, frame.q);
        if (type == b3_distanceJoint) {
            b3WorldTransform b = b3Body_GetTransform(b3Joint_GetBodyB(joint));
            b3Vec3 there = b3TransformWorldPoint(b, b3Joint_GetLocalFrameB(joint).p);
            b3Vec3 away = b3Normalize(b3Sub(there, b3TransformWorldPoint(a, frame.p)));
            f = (b3Vec3){-b3Dot(f, away), 0.0f, 0.0f};
        } else if (type == b3_revoluteJoint) {
            // It counts what the motor gives twice.
            t = b3MulSub(t, b3RevoluteJoint_GetMotorTorque(joint), b3RotateVector(axes, b3Vec3_axisZ));
        } else if (type == b3_prismaticJoint) {
            // It tells what is along x, y, z of the joint as along z, x, y, and turns a torque that is in world axes.
            b3Vec3 told = b3InvRotateVector(axes, f);
            f = b3RotateVector(axes, (b3Vec3){told.z, told.x, told.y});
            t = b3InvRotateVector(axes, t);
        }
        const double row[6] = {f.x, f.y, f.z, t.x, t.y, t.z};
        for (int k = 0; k < 6; ++k) {
            forces[k] = row[k];
        }
    }
}

void spook_push(Loop* loop, int kind, int first, int second, const double* numbers) {
    Push* one = loop->pushes + loop->pushed++;
    one->kind = kind;
    one->first = first;
    one->second = second;
    for (int k = 0; k < 9; ++k) {
        one->numbers[k] = numbers[k];
    }
}

// Where a point of a body is, given on it, and how fast; a point of the world stands.
static b3Vec3 reached(Loop* loop, int body, const double* anchor, b3Vec3* speed) {
    *speed = b3Vec3_zero;
    if (body < 0) {
        return vector(anchor);
    }
    b3WorldTransform at = b3Body_GetTransform(loop->bodies[body]);
    b3Vec3 arm = b3RotateVector(at.q, vector(anchor));
    *speed = b3Add(b3Body_GetLinearVelocity(loop->bodies[body]),
                   b3Cross(b3Body_GetAngularVelocity(loop->bodies[body]), arm));
    return b3Add(at.p, arm);
}

// Loads act through all substeps. What depends on the place is a push at the start of a step, of `step` s, as in engines
// without substeps: held through them it would give energy.
static void push(Loop* loop, const Push* one, float step) {
    const double* given = one->numbers;
    if (one->kind == LOAD) {
        b3Body_ApplyForceToCenter(loop->bodies[one->first], vector(given), true);
        b3Body_ApplyTorque(loop->bodies[one->first], vector(given + 3), true);
    } else if (one->kind == SPRING) {
        b3Vec3 v, w;
        b3Vec3 a = reached(loop, one->first, given, &v), b = reached(loop, one->second, given + 3, &w);
        b3Vec3 away = b3Sub(b, a);
        float length = b3Length(away);
        if (length > 0.0f) {
            float opening = b3Dot(away, b3Sub(w, v)) / length;
            float pull = step * (float)(given[6] * (length - given[7]) + given[8] * opening) / length;
            if (one->first >= 0) {
                b3Body_ApplyLinearImpulse(loop->bodies[one->first], b3MulSV(pull, away), a, true);
            }
            if (one->second >= 0) {
                b3Body_ApplyLinearImpulse(loop->bodies[one->second], b3MulSV(-pull, away), b, true);
            }
        }
    } else {
        for (int i = 0; i < loop->count; ++i) {
            b3Vec3 away = b3Sub(b3Body_GetTransform(loop->bodies[i]).p, vector(given));
            float length = b3Length(away), mass = b3Body_GetMass(loop->bodies[i]);
            if (mass > 0.0f) {
                float size = (float)-given[3] * step * mass / (length * length * length);
                b3Body_ApplyLinearImpulseToCenter(loop->bodies[i], b3MulSV(size, away), true);
            }
        }
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
        for (int k = 0; k < loop->pushed; ++k) {
            push(loop, loop->pushes + k, (float)step);
        }
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
