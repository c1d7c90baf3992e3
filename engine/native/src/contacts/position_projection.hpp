// Position projection: by which displacements bodies part that overlap where the step ends. They leave no trace in velocities.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "contacts/contact_bodies.hpp"
#include "contacts/contact_options.hpp"
#include "contacts/external_drive.hpp"
#include "contacts/islands.hpp"
#include "contacts/overlap_search.hpp"
#include "contacts/pgs_solver.hpp"
#include "contacts/solve_islands.hpp"

namespace spook {

/// How overlapping bodies are to be displaced at the end of the step.
struct PositionProjection {
    std::vector<Vec6> velocity;           // per moving body
    Islands islands;                      // of bodies that push each other, or are connected by joints
    std::vector<char> grounded;           // per island: something that does not move by itself took part
    std::vector<char> externally_driven;  // per island: what moves it, or a first overlap, may do work on it
    std::vector<char> first_overlaps;     // per island: it is to part some of those that the run began with
    std::vector<double> overlap,
        overlap_before;  // per island: deepest where the step ends, and began, m
};

class PositionProjector {
public:
    /// `yielding` tells of each block of rows of joints whether it gives way while overlaps are parted, as springs do.
    PositionProjector(std::shared_ptr<const ContactModel> model, std::vector<char> yielding);
    /// Makes room, or there would be none in a copy: there may be as many islands as bodies, however late in a run.
    void begin_step();

    /// The system of the step's solve, of whose rows those of so many joints come first, and what PGS was started with there.
    struct Solved {
        const MixedSystem& system;
        std::size_t joints;
        const PgsSolver& pgs;
    };
    /// Null if nothing overlaps. To be asked `again` when the bodies are displaced: what is linear in the displacement is not
    /// all. Then it is null, too, where the displacement before was of no use, or by PGS so small that nothing comes of it.
    /// Takes down in `initial_penetration` what is left of overlaps that the run began with, and in `woken` the sleepers met.
    const PositionProjection* project(const Solved& solved, const StepEnd& end, const ExternalDrive& drive,
                                      bool again, DepthOfPair& initial_penetration, ContactCounters& counters,
                                      std::vector<int>& woken);

    /// Whether bodies of an island at `poses`, displaced by a share of what was asked, have parted as far as first overlaps were to:
    /// what has not is jammed, between joints, and left alone until it is moved.
    bool parts(int island, double share, const std::vector<Pose>& poses, const Detection& detection,
               DepthOfPair& initial);

    IslandSolver& solver() noexcept { return solver_; }
    const IslandSolver& solver() const noexcept { return solver_; }

private:
    void find_body_compliance(const MixedSystem& projection);
    double compliance_of(const Contact& contact) const noexcept;
    void hold_joints(MixedSystem& projection, double least);
    double separation_speed(const PenetrationRecord& record, const DepthOfPair& given, bool again) const;
    bool is_pushed_first(const PenetrationRecord& record, const DepthOfPair& initial) const;
    bool project_directly(const DepthOfPair& given, bool again, ContactCounters& counters);
    bool project_by_pgs(const PgsSolver& beside, const DepthOfPair& given, bool again,
                        ContactCounters& counters);
    void note_projected(const StepEnd& end, const ExternalDrive& drive);
    bool mark_far_islands();
    bool keep_projected(const std::vector<Pose>& poses);
    void update_initial_penetrations(const ContactCache& cache, DepthOfPair& initial_penetration);

    std::shared_ptr<const ContactModel> model_;
    std::vector<char> yielding_;
    bool by_pgs_;  // cheap, and as exact as the next step will need
    OverlapSearch search_;
    IslandSolver solver_;
    PgsSolver pgs_;
    PositionProjection projection_;
    // Of the step's projections so far:
    double deepest_ = 0.0;                     // overlap at the last, m
    bool goes_on_ = false;                     // that may not have been enough
    LargeArray<PenetrationRecord> projected_;  // its points,
    std::vector<Pose> projected_poses_;        //   with bodies there
    std::vector<char> reconsidered_;           // which bodies are looked at again
    // Of one:
    MixedSystem system_;
    MassFactors masses_;
    IslandFinder connected_, pushed_;               // by joints and ground; by contacts that push, too
    std::vector<double> island_mass_, compliance_;  // kg; of contacts of jointed bodies, 1/kg
    std::vector<char> answered_, far_islands_;
    std::vector<std::pair<std::uint64_t, std::size_t>> places_, projected_places_;  // of points, by key
    DepthOfPair left_;
    std::vector<Contact> met_;
};

}  // namespace spook
