// How far the solves of a step have left their rows from their law, and which body is to be named for it.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "contacts/contact_arrays.hpp"
#include "contacts/contact_points.hpp"
#include "contacts/islands.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

/// Impacts that were to rebound and were stopped instead.
struct StoppedImpacts {
    std::uint64_t count = 0;
    double energy = 0.0;  // J, that they would have given back
    double most = 0.0;    // J, of the one that loses most
    int body = -1;        // of that one
    void note(double given_back, int of) noexcept {
        if (!(given_back > 0.0)) return;
        ++count, energy += given_back;
        if (given_back > most) most = given_back, body = of;
    }
    /// Whether one of these loses more than all before.
    bool add(const StoppedImpacts& others) noexcept {
        const bool more = others.most > most;
        count += others.count, energy += others.energy;
        if (more) most = others.most, body = others.body;
        return more;
    }
};

struct SolveQuality {
    double residual = 0.0;  // the last solve's or impact's rows_residual(), m/s
    int body = -1;          // whose rows it left further from their law than `unsettled_residual`; −1: none
    double by = 0.0;        // m/s
    bool sunk = false;      // no row is off, but the body was left in another
    StoppedImpacts stopped;
};

/// What a solve is judged by: bodies and v before it, points, and how deep pairs overlapped where the run began.
struct JudgedStep {
    const StepMotion& motion;
    const ContactPoints& points;
    const DepthOfPair& initial_penetration;
};

/// What a compliant contact was pressed in by while it was one, and rounding, m.
inline double elastic_depth(const ContactBodies& bodies, const StepContact& point) noexcept {
    return point.compression_before + bodies.slack(point.contact);
}

/// Takes down a row of the body of that solver index that is off by more than the method allows.
void blame(SolveQuality& quality, const StepMotion& motion, double residual, int solver_index);
/// Iterations that stop early let bodies sink by little each, in a tall stack step after step: no row is far off, and the
/// load is not borne. What the projection could not lift again shows it.
void blame_sunk(SolveQuality& quality, const JudgedStep& step);

SolveQuality judge(const JudgedStep& step, const MixedSystem& system,
                   const std::vector<FrictionPoint>& points, const FrictionReport& report);
/// The same of an impact whose solve stopped at a limit; of several solves, as they follow each other in a step, the worst.
void judge_impact(SolveQuality& quality, const StepMotion& motion, const MixedSystem& hit,
                  const std::vector<FrictionPoint>& points, FrictionModel friction);

/// What a solve that did not settle may leave: its impulses are shortened so that the energy does not rise.
class EnergyLimit {
public:
    /// There may be as many islands as bodies, however late; a copy has no room for them.
    void reserve(std::size_t bodies) { sums_.reserve(bodies); }
    /// Per moving body: what is left of the impulses of its island, where a solve that did not settle would raise
    /// the energy; all of it in islands that joints hold or something drives. Shortens the velocities alike. Islands are of the
    /// points that `pushes` tells of, as the projection's are: what merely lies near pays for no gain.
    const std::vector<double>& shorten(MixedSystem& system, std::size_t joints, const StepMotion& motion,
                                       const ContactPoints& points,
                                       const std::function<bool(std::size_t)>& pushes);

private:
    struct Sums {
        double square = 0.0, linear = 0.0, fall = 0.0;  // E₊ − E = square s² + linear s − fall
        bool driven = false;
    };
    std::vector<double> share_;
    std::vector<char> pushes_;         // by point
    std::vector<Sums> sums_;           // by island
    std::vector<Vec6> free_velocity_;  // per moving body
    IslandFinder connected_;
};

}  // namespace spook
