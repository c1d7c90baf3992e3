// Internal edges: sides of what holds a body, and of what it meets first, that it does not meet.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "collision/detection.hpp"
#include "collision/shape_cast.hpp"
#include "contacts/contact_points.hpp"
#include "contacts/open_pairs.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

/// What a search reads: shapes, bodies on their way through the step, and the points they have.
struct SearchedStep {
    const Detection& detection;
    const StepMotion& motion;
    const ContactPoints& points;

    /// A collider whose body goes on from `pose`, which must outlive it.
    Mover mover(int collider, const Pose& pose, const std::vector<Vec6>& velocity) const;
};

/// What bodies are cast along, and when: ahead of any solve, between iterations, or after a solve.
struct Cast {
    enum class When : unsigned char { ahead, iterating, solved };
    const std::vector<Vec6>& velocity;  // per body of the scene
    When when = When::ahead;
};

/// Of an open pair, by its place; s.
struct Meeting {
    std::size_t open;
    double time;
};

class InternalEdges {
public:
    void begin(std::size_t bodies);
    /// How deep the closed points from `from` on hold their bodies.
    void note_depths(const SearchedStep& step, std::size_t from);
    /// How much deeper into what supports them bodies would go with velocities between iterations; or that there are none.
    void predict_sinking(const SearchedStep& step, const std::vector<Vec6>& velocity);
    void forget_sinking() noexcept;
    /// To be told of the points before what follows is asked.
    void index(const SearchedStep& step);

    /// The overlap at which a pair counts as met, m. Bodies that sink while iterations have not settled meet the sides of the
    /// next part of what holds them as deep as that; round shapes and planes have no sides.
    double slop(const SearchedStep& step, const OpenPair& open) const noexcept;
    /// Whether `body`, that would meet another at `time` [s], does not once it is lifted out of what holds it. `facing` is
    /// the normal they touch with already, if they do. Between iterations a body may also sink on the way, and to the side of
    /// another as far as settled iterations may have left it falling.
    bool is_internal_edge(const SearchedStep& step, const Mover& moving, int body, const Mover& other,
                          const OpenPair& open, const Cast& cast, double time, Vec3 facing = {}) const;
    /// Whether bodies that touch, and would overlap by `overlap` [m] along that normal, do not as they move.
    bool is_grazing(const SearchedStep& step, const StepContact& point, const OpenPair& open, double overlap,
                    Cast::When when) const;
    /// Of what one body meets in a step, leaves out what it would not meet if that which comes before stopped it. What it meets
    /// all the same is found again with the velocities of the solve.
    void remove_occluded(const SearchedStep& step, const LargeArray<OpenPair>& pairs,
                         const std::vector<Vec6>& velocity, std::vector<Meeting>& meetings);

private:
    /// Of a body, the one at that place.
    struct MeetingOf {
        int body;
        double time;
        std::size_t at;
    };
    /// What holds a body: the points of one pair that are closed where the step begins.
    struct Support {
        std::uint64_t pair = 0;
        Vec3 normal{}, velocity{};  // out of it, of its deepest point; it goes itself, m/s
        double depth = -unbounded;  // there, when the body meets the next part, m
        double begun = 0.0;         // the largest where the step begins, m
        double sinking = 0.0;       // the same with what the velocity then adds
    };
    /// That of the first of a body's points, which are left behind.
    static Support next_support(const SearchedStep& step, int body, std::span<const int>& points,
                                const Cast& cast);
    double fallen_depth(const SearchedStep& step, const Support& support, const Mover& moving, int body,
                        const Mover& other, Cast::When when, double time, double slop) const;
    bool occludes(const SearchedStep& step, const OpenPair& before, double earlier, const OpenPair& after,
                  double later, int body, const std::vector<Vec6>& velocity) const;

    std::vector<double> depth_;              // of a body's closed contacts, m
    std::vector<double> predicted_sinking_;  // what unsettled iterations would add to it in the step, m
    PointsOfBodies points_of_;
    std::vector<MeetingOf> meetings_of_;  // by body and time
};

}  // namespace spook
