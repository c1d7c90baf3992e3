// One contact's share of an iteration, over single numbers or over vectors of them. Included once per instruction set, with
// SPOOK_ISA naming it. Only elementwise operations in a fixed order, and contraction is off: all round alike.

#define SPOOK_ALWAYS inline __attribute__((always_inline))

namespace spook::SPOOK_ISA {
namespace {

#include "linear/fours.inl"

template <class R> struct Three {
    R x, y, z;
};
template <class R> SPOOK_ALWAYS R dot(const Three<R>& a, const Three<R>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class R> SPOOK_ALWAYS Three<R> cross(const Three<R>& a, const Three<R>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Coulomb's cone, cut at a normal impulse: the disc |beta| <= bound. One step of projection scales back what lies outside.
struct Disc {
    template <class R>
    SPOOK_ALWAYS R operator()(const R& step, const R& b1, const R& b2, const R& s1, const R& s2,
                              const R& bound, R& d1, R& d2) const {
        R z1 = b1 - step * s1, z2 = b2 - step * s2;
        const R reach = root_of(z1 * z1 + z2 * z2);
        const auto slides = reach > bound;
        const R shrunk = bound / reach;
        d1 = (slides ? z1 * shrunk : z1) - b1;
        d2 = (slides ? z2 * shrunk : z2) - b2;
        return root_of(d1 * d1 + d2 * d2) / step;
    }
};

/// Velocity of a body's point at `arm`.
template <class R>
SPOOK_ALWAYS Three<R> velocity_at(const Three<R>& v, const Three<R>& w, const Three<R>& arm) {
    const Three<R> turn = cross(w, arm);
    return {v.x + turn.x, v.y + turn.y, v.z + turn.z};
}

/// v += s M⁻¹ (impulse, moment) where `pushes`: bodies that no change reaches keep their bits.
template <class R, class Mask, class Body>
SPOOK_ALWAYS void push_body(Body body, const R& sign, const Three<R>& arm, const Three<R>& impulse,
                            const Mask& pushes) {
    Three<R> v, w;
    R inverse_mass, inverse_inertia;
    body.read(v, w, inverse_mass, inverse_inertia);
    const Three<R> turn = body.turned(cross(arm, impulse), inverse_inertia);
    v.x = pushes ? v.x + sign * (inverse_mass * impulse.x) : v.x;
    v.y = pushes ? v.y + sign * (inverse_mass * impulse.y) : v.y;
    v.z = pushes ? v.z + sign * (inverse_mass * impulse.z) : v.z;
    w.x = pushes ? w.x + sign * turn.x : w.x;
    w.y = pushes ? w.y + sign * turn.y : w.y;
    w.z = pushes ? w.z + sign * turn.z : w.z;
    body.write(v, w, inverse_mass, inverse_inertia);
}

/// Solves a contact's rows for the velocities of its bodies: the normal first, then friction by `law`, whose bound is mu
/// times the normal impulse, or the one before where `box`. Returns the largest change of a row, as a velocity. `from`
/// reads and writes the contact, one of a kind or several side by side; each part when it is needed.
template <class R, class From, class Law> SPOOK_ALWAYS R solve_contact(From from, const Law& law, bool box) {
    Three<R> first_arm, second_arm, normal, tangent, v, w;
    R right, diagonal, inverse_diagonal, impulse[3], friction, softness, before, inverse_mass,
        inverse_inertia;
    from.arms(first_arm, second_arm, right);
    from.first().read(v, w, inverse_mass, inverse_inertia);
    const Three<R> a = velocity_at(v, w, first_arm);
    from.second().read(v, w, inverse_mass, inverse_inertia);
    const Three<R> b = velocity_at(v, w, second_arm), u{a.x - b.x, a.y - b.y, a.z - b.z};
    from.normal(normal, diagonal);
    from.impulse(impulse, inverse_diagonal);
    from.tangent(tangent, friction);  // nothing where it has none
    from.normal_extras(softness, before);
    const R zero{}, old = impulse[0];
    const R asked = old - (dot(normal, u) + softness * old - right) * inverse_diagonal;
    const R nu = asked <= 0.0 ? zero : asked;  // what is not a number stays
    const R dn = nu - old;
    R change = magnitude(dn) * diagonal, d1 = zero, d2 = zero;
    impulse[0] = nu;
    const R bound = friction * (box ? before : nu);
    const auto rubs = (bound > 0.0) | (impulse[1] != 0.0) | (impulse[2] != 0.0);
    Three<R> across{};
    if (From::rough && any(rubs)) {
        R right1, right2, coupling1, coupling2, slip_softness, step;
        from.across(across, normal, tangent);
        from.tangent_scales(coupling1, coupling2, step);
        from.tangent_extras(right1, right2, slip_softness);
        const R s1 = dot(tangent, u) + coupling1 * dn + slip_softness * impulse[1] - right1;
        const R s2 = dot(across, u) + coupling2 * dn + slip_softness * impulse[2] - right2;
        const R own_change = law(step, impulse[1], impulse[2], s1, s2, bound, d1, d2);
        const auto kept = (change >= own_change) | (change != change);
        change = rubs ? (kept ? change : own_change) : change;
        d1 = rubs ? d1 : zero;
        d2 = rubs ? d2 : zero;
        impulse[1] = rubs ? impulse[1] + d1 : impulse[1];
        impulse[2] = rubs ? impulse[2] + d2 : impulse[2];
    }
    from.write(impulse, inverse_diagonal);
    const auto pushes = (dn != 0.0) | (d1 != 0.0) | (d2 != 0.0);
    if (!any(pushes)) return change;
    const Three<R> all{dn * normal.x + d1 * tangent.x + d2 * across.x,
                       dn * normal.y + d1 * tangent.y + d2 * across.y,
                       dn * normal.z + d1 * tangent.z + d2 * across.z};
    const R one = zero + 1.0;
    push_body(from.first(), one, first_arm, all, pushes);
    push_body(from.second(), -one, second_arm, all, pushes);
    return change;
}

/// A contact by itself. `fixed_body`, which does not move, is not written.
struct Single {
    static constexpr bool rough = true;
    PackedContact& c;
    const PackedFriction& slip;
    const PackedExtras* extras;  // null: none
    PgsBody* bodies;
    const PgsInertia* inertia;  // null: all are isotropic
    int fixed_body;

    struct Body {
        PgsBody& state;
        const PgsInertia* inertia;
        bool moves;
        SPOOK_ALWAYS void read(Three<double>& v, Three<double>& w, double& inverse_mass,
                               double& inverse_inertia) const {
            v = {state.velocity[0], state.velocity[1], state.velocity[2]};
            w = {state.velocity[3], state.velocity[4], state.velocity[5]};
            inverse_mass = state.inverse_mass, inverse_inertia = state.inverse_inertia;
        }
        SPOOK_ALWAYS Three<double> turned(const Three<double>& m, double inverse_inertia) const {
            return inertia != nullptr
                       ? three(inertia->turn({m.x, m.y, m.z}))
                       : Three<double>{inverse_inertia * m.x, inverse_inertia * m.y, inverse_inertia * m.z};
        }
        SPOOK_ALWAYS void write(const Three<double>& v, const Three<double>& w, double, double) const {
            if (moves) state.velocity = {v.x, v.y, v.z, w.x, w.y, w.z};
        }
    };
    SPOOK_ALWAYS Body body(int at) const {
        return {bodies[at], inertia != nullptr ? inertia + at : nullptr, at != fixed_body};
    }
    SPOOK_ALWAYS static Three<double> three(const Vec3& a) { return {a.x, a.y, a.z}; }
    SPOOK_ALWAYS Body first() const { return body(c.first); }
    SPOOK_ALWAYS Body second() const { return body(c.second); }
    SPOOK_ALWAYS void arms(Three<double>& first, Three<double>& second, double& right) const {
        first = three(c.first_arm), second = three(c.second_arm), right = c.right;
    }
    SPOOK_ALWAYS void normal(Three<double>& n, double& diagonal) const {
        n = three(c.normal), diagonal = c.diagonal;
    }
    SPOOK_ALWAYS void impulse(double* z, double& inverse_diagonal) const {
        for (int k = 0; k < 3; ++k) z[k] = c.impulse[k];
        inverse_diagonal = c.inverse_diagonal;
    }
    SPOOK_ALWAYS void tangent(Three<double>& t, double& friction) const {
        t = three(slip.tangent), friction = slip.friction;
    }
    SPOOK_ALWAYS void normal_extras(double& softness, double& before) const {
        softness = before = 0.0;
        if (extras != nullptr) softness = extras->softness, before = extras->normal_before;
    }
    SPOOK_ALWAYS void across(Three<double>& u, const Three<double>& n, const Three<double>& t) const {
        u = extras != nullptr ? three(extras->across) : cross(n, t);
    }
    SPOOK_ALWAYS void tangent_scales(double& coupling1, double& coupling2, double& step) const {
        coupling1 = slip.coupling[0], coupling2 = slip.coupling[1], step = slip.step;
    }
    SPOOK_ALWAYS void tangent_extras(double& right1, double& right2, double& softness) const {
        right1 = right2 = softness = 0.0;
        if (extras != nullptr)
            right1 = extras->right_along, right2 = extras->right_across, softness = extras->slip_softness;
    }
    SPOOK_ALWAYS void write(const double* z, double) const {
        for (int k = 0; k < 3; ++k) c.impulse[k] = z[k];
    }
};

}  // namespace
}  // namespace spook::SPOOK_ISA

#undef SPOOK_ALWAYS
