#include "live.hpp"

#include <memory>
#include <string>

#include "linear/elementary.hpp"
#include "particles/particle_program.hpp"
#include "rigid/rigid_program.hpp"

namespace {

using namespace spook;

/// The one scene of a page.
struct Live {
    bool rigid = false;
    ParticleScene particles;
    RigidScene bodies;
    std::vector<QuantityRequest> quantities;
    std::vector<Observation> observations;
    RunReport report;
};

std::unique_ptr<Live> live = std::make_unique<Live>();
char name[64];

template <class Program, class Scene> RunReport run(const Scene& scene, int steps, double time_limit) {
    return Program(scene, live->quantities, live->observations).run(steps, time_limit, false);
}

void shape(const Primitive& primitive) {
    Collider collider;
    collider.body = static_cast<int>(live->bodies.bodies.size()) - 1;
    collider.part = {Vec3{}, rotation(Quat{})};
    collider.shape = primitive;
    live->bodies.colliders.push_back(collider);
}

const Recording& recording(int observable) {
    return live->report.recordings[static_cast<std::size_t>(observable)];
}

}  // namespace

void live_begin(int rigid) {
    live = std::make_unique<Live>();
    live->rigid = rigid != 0;
}

void live_gravity(double x, double y, double z) {
    live->particles.gravity = live->bodies.gravity = {x, y, z};
}

void live_method(double time_step, int substeps, int corrections, int composition, int half_step_velocities,
                 int solver, int friction, int iterations, double residual_tolerance) {
    ParticleMethod& p = live->particles.method;
    p.time_step = time_step;
    p.substeps = substeps;
    p.corrections = corrections;
    p.composition = composition;
    p.half_step_velocities = half_step_velocities != 0;
    p.iterative = solver == 1;
    p.iterations = iterations;
    p.residual_tolerance = residual_tolerance;
    p.floor = 1e-12;
    RigidMethod& r = live->bodies.method;
    r.time_step = time_step;
    r.substeps = substeps;
    r.solver = static_cast<SolverKind>(solver);
    r.friction = static_cast<FrictionModel>(friction);
    r.iterations = iterations;
    r.residual_tolerance = residual_tolerance;
}

void live_particle(double mass, double x, double y, double z, double vx, double vy, double vz) {
    ParticleBody body;
    body.mass = mass;
    body.position = {x, y, z};
    body.velocity = {vx, vy, vz};
    live->particles.bodies.push_back(body);
}

void live_body(int motion, double mass, double ix, double iy, double iz, double x, double y, double z,
               double qw, double qx, double qy, double qz) {
    RigidBodySpec body;
    body.motion = static_cast<Motion>(motion);
    body.mass = mass;
    body.inertia = {ix, iy, iz};
    body.position = {x, y, z};
    body.orientation = {qw, qx, qy, qz};
    live->bodies.bodies.push_back(body);
}

void live_velocity(double vx, double vy, double vz, double wx, double wy, double wz) {
    live->bodies.bodies.back().velocity = {vx, vy, vz};
    live->bodies.bodies.back().angular_velocity = {wx, wy, wz};
}

void live_material(double friction, double restitution, double compliance, double damping,
                   double slip_compliance) {
    live->bodies.bodies.back().material = {friction, restitution, compliance, damping, slip_compliance};
}

void live_sphere(double radius) { shape(Primitive::sphere(radius)); }
void live_box(double x, double y, double z) { shape(Primitive::box({x, y, z})); }
void live_plane(double x, double y, double z) { shape(Primitive::plane({x, y, z})); }

void live_distance(int first, int second, double x1, double y1, double z1, double x2, double y2, double z2,
                   double rest_length, double compliance, double damping) {
    DistanceRow row;
    row.ends[0] = {first, {x1, y1, z1}};
    row.ends[1] = {second, {x2, y2, z2}};
    row.rest_length = rest_length;
    row.compliance = compliance;
    row.damping = damping;
    live->particles.rows.push_back(row);
}

void live_spring(int first, int second, double x1, double y1, double z1, double x2, double y2, double z2,
                 double stiffness, double rest_length, double viscosity) {
    SpringForce spring;
    spring.ends[0] = {first, {x1, y1, z1}};
    spring.ends[1] = {second, {x2, y2, z2}};
    spring.stiffness = stiffness;
    spring.rest_length = rest_length;
    spring.viscosity = viscosity;
    live->particles.springs.push_back(spring);
}

void live_centre(double strength, double x, double y, double z) {
    live->particles.fields.push_back({strength, {x, y, z}});
}

void live_lock(int first, int second, double x, double y, double z, double along, double about,
               double damping) {
    JointSpec joint;
    joint.kind = JointKind::lock;
    joint.first = first;
    joint.second = second;
    joint.first_point = joint.second_point = {x, y, z};
    joint.axes = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    joint.compliance = {along, along, along, about, about, about};
    joint.damping.fill(damping);
    live->bodies.joints.push_back(joint);
    if (first >= 0 && second >= 0) live->bodies.no_contact.push_back({first, second});
}

char* live_name() { return name; }

int live_observe(int index, int other, int every) {
    const int number = static_cast<int>(live->quantities.size());
    live->quantities.push_back({name, index, {}, other});
    Observation trace;
    trace.quantity = number;
    trace.reduction = Reduction::trace;
    trace.every = every;
    live->observations.push_back(trace);
    return number;
}

int live_run(int steps, double time_limit) {
    live->report = live->rigid ? run<RigidProgram>(live->bodies, steps, time_limit)
                               : run<ParticleProgram>(live->particles, steps, time_limit);
    return static_cast<int>(live->report.status);
}

const double* live_values(int observable) { return recording(observable).values.data(); }
int live_width(int observable) { return recording(observable).width; }
int live_samples(int observable) { return static_cast<int>(recording(observable).samples); }
int live_steps() { return static_cast<int>(live->report.steps); }
double live_seconds() { return live->report.seconds; }
const char* live_state_hash() { return live->report.state_hash.c_str(); }

double live_sine(double angle) { return sine_cosine(angle).sine; }
double live_cosine(double angle) { return sine_cosine(angle).cosine; }
