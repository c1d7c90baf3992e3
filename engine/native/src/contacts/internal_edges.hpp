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

/// The colliders of an open pair, on the rest of their ways.
struct OpenWays {
    OpenWays(const SearchedStep& step, const OpenPair& open, const std::vector<Vec6>& velocity)
        : first_body(step.motion.moved(open.first, velocity)),
          second_body(step.motion.moved(open.second, velocity)),
          first(step.mover(open.pair.first, first_body, velocity)),
          second(step.mover(open.pair.second, second_body, velocity)) {}
    OpenWays(const OpenWays&) = delete;  // movers refer to its poses
    OpenWays& operator=(const OpenWays&) = delete;

    Pose first_body, second_body;
    Mover first, second;
};

/// Of an open pair, by its place; s.
struct Meeting {
    std::size_t open;
    double time;
};

class InternalEdges {
public:
    /// To be told of the points before what follows is asked.
    void index(const SearchedStep& step);

    /// The overlap at which a pair counts as met, m: the tolerance of every time_of_impact().
    static double slop(const SearchedStep& step, const OpenPair& open) noexcept;
    /// Whether `body`, that would meet another at `time` [s], does not once it is lifted out of what holds it. `facing` is
    /// the normal they touch with already, if they do. Between iterations it sinks as far as it will, and is asked about again;
    /// to the side of another it goes over, settled iterations may have left it falling.
    bool is_internal_edge(const SearchedStep& step, const Mover& moving, int body, const Mover& other,
                          const OpenPair& open, const Cast& cast, double time, Vec3 facing = {}) const;
    /// Whether bodies that touch, and would overlap by `overlap` [m] along that normal, do not as they move.
    bool is_grazing(const SearchedStep& step, const StepContact& point, const OpenPair& open,
                    double overlap) const;
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
    /// A face that a body does not go into: of what holds it where the step begins, or of what it meets first.
    struct Support {
        std::uint64_t pair = 0;     // of what holds it
        Vec3 normal{}, velocity{};  // out of it; it goes itself, m/s
        double level = 0.0;         // where it touches the body along that, m,
        double time = 0.0;          //   and when, s
        double depth = 0.0;         // how deep the body is in it, m
        double most = unbounded;    // how deep it may come to be on its way, m
        bool leads_over(const Mover& held, const Mover& moving, const Mover& other, double toi, double h,
                        double slop) const;
    };
    static Support next_support(const SearchedStep& step, const Mover& moving, int body,
                                std::span<const int>& points, const std::vector<Vec6>& velocity);
    static bool occludes(const SearchedStep& step, const OpenPair& before, double earlier,
                         const OpenPair& after, double later, int body, const std::vector<Vec6>& velocity);

    PointsOfBodies points_of_;
    std::vector<MeetingOf> meetings_of_;  // by body and time
};

}  // namespace spook
