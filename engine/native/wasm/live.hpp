// The engine for a web page: a scene is said call by call, run once, and read from memory. Every default is the
// caller's to resolve, as engine/particle_program.py and engine/rigid_program.py do it for Python.
#pragma once

extern "C" {

/// Forget everything and begin a scene of particles (0) or with rigid bodies (1).
void live_begin(int rigid);
void live_gravity(double x, double y, double z);  // m/s²
/// Time step in s; solver: 0 direct, 1 iterative; friction: 0 cone, 1 box, 2 scaled box;
/// composition: order 2, 4, 6 or 8.
void live_method(double time_step, int substeps, int corrections, int composition, int half_step_velocities,
                 int solver, int friction, int iterations, double residual_tolerance);

/// Bodies are counted from 0 in the order they are said; mass in kg, lengths in m, velocities in m/s and rad/s.
void live_particle(double mass, double x, double y, double z, double vx, double vy, double vz);
/// motion: 0 dynamic, 1 fixed, 2 kinematic. Moments of inertia along the body's axes, kg m².
void live_body(int motion, double mass, double ix, double iy, double iz, double x, double y, double z,
               double qw, double qx, double qy, double qz);
/// Of the last body.
void live_velocity(double vx, double vy, double vz, double wx, double wy, double wz);
void live_material(double friction, double restitution, double compliance, double damping,
                   double slip_compliance);
void live_sphere(double radius);
void live_box(double x, double y, double z);    // edges
void live_plane(double x, double y, double z);  // unit normal

/// Ends are bodies, or (−1) the points given; compliance in m/N, damping in s.
void live_distance(int first, int second, double x1, double y1, double z1, double x2, double y2, double z2,
                   double rest_length, double compliance, double damping);
void live_spring(int first, int second, double x1, double y1, double z1, double x2, double y2, double z2,
                 double stiffness, double rest_length, double viscosity);
void live_centre(double strength, double x, double y, double z);  // m³/s²
/// A lock at a point of the world; the second body is held to the first (−1 the world). Compliances and dampings
/// of three shifts along x, y, z and of three turns about them.
void live_lock(int first, int second, double x, double y, double z, double along, double about,
               double damping);

/// Where the caller writes a name before live_observe: up to 63 bytes and a zero.
char* live_name();
/// Trace the quantity of that name (engine/native: QuantityRequest), every `every` samples. Returns its number.
int live_observe(int index, int other, int every);

/// Run from the start. Returns 0 completed, 1 diverged, 2 not finite, 3 timed out.
int live_run(int steps, double time_limit);
const double* live_values(int observable);
int live_width(int observable);
int live_samples(int observable);
int live_steps();
double live_seconds();
const char* live_state_hash();

double live_sine(double angle);
double live_cosine(double angle);
}
