// Which bodies overlap where a step ends: the points that the position projection is to part.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "collision/detection.hpp"
#include "contacts/contact_arrays.hpp"
#include "contacts/contact_bodies.hpp"
#include "contacts/contact_cache.hpp"
#include "linear/large_array.hpp"

namespace spook {

/// A point where the step ends, of bodies that may overlap.
struct PenetrationRecord {
    Contact contact;
    Vec3 first_arm, second_arm;  // from the centres of mass, m
    double damping = 0.0;        // of the pair
    double depth = 0.0;          // how deep it is, m; negative where bodies are apart
};

/// Where a step ends: where its bodies were when it began, and are; how far they were looked for, per body, m; its contacts,
/// and how deep pairs overlapped where the run began.
struct StepEnd {
    Detection& detection;
    const std::vector<Pose>&begun, &poses;
    const std::vector<double>& margin;
    const ContactCache& cache;
    const DepthOfPair& initial_penetration;
};

/// Whether one of two is among the bodies that are named; none are: every one is.
inline bool is_among(const std::vector<char>& bodies, int a, int b) noexcept {
    return bodies.empty() || bodies[a] != 0 || bodies[b] != 0;
}

class OverlapSearch {
public:
    struct Found {
        double deepest = 0.0;  // overlap that nothing explains, m
        bool goes_on = true;   // the bodies displaced may push others
    };

    /// `by_pgs`: displacements come by PGS, cheap and rough.
    OverlapSearch(std::shared_ptr<const ContactModel> model, bool by_pgs)
        : model_(std::move(model)), by_pgs_(by_pgs) {}

    /// Points of the step's pairs, up to gaps of `search_factor` times their largest overlap that nothing explains, and of
    /// pairs without points that may be pushed into each other, into `records`. None of them if there is no overlap.
    Found find(const StepEnd& end);
    /// The same once bodies have been displaced: of pairs of those that `reconsidered` names, by body; empty: of every one.
    double find_again(const StepEnd& end, const std::vector<char>& reconsidered);

    /// Whether a point parts by so much that its bodies may come down elsewhere, or push others aside, and one displacement is
    /// not enough. By PGS balls never do, which only go aside: of a thousand of them hundreds part a little in each step.
    bool moves_far(const PenetrationRecord& record) const noexcept;
    /// Whether a body of so large a radius pushes others when it goes so far, m.
    bool is_far(double way, double radius) const noexcept;

    LargeArray<PenetrationRecord> records;

private:
    double find(const StepEnd& end, const std::vector<char>& reconsidered, bool again, bool& goes_on);
    double look(const StepEnd& end, double margin, const std::vector<char>& reconsidered, bool again);
    bool find_neighbours(const StepEnd& end, double margin);
    double look_at_neighbours(const StepEnd& end, double margin, const std::vector<char>& reconsidered);
    void add(const Contact& contact, const std::vector<Pose>& poses, double excess);
    double way(int body, const StepEnd& end) const;

    std::shared_ptr<const ContactModel> model_;
    bool by_pgs_;
    double expected_ = 0.0;                          // of the last step: how near to look at balls, no more
    std::vector<IndexPair> neighbours_, untouched_;  // pairs without points; of those, what overlapped before
    // Of one search:
    std::vector<Contact> scratch_;
    std::vector<IndexPair> near_;
    std::vector<int> grown_;
    std::vector<double> margin_;
    std::vector<char> reached_;  // in which round, from one on
};

}  // namespace spook
