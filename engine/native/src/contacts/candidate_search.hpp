// The search for contacts: which points are closed where a step begins, and which pairs meet within it, when and where.
#pragma once

#include <vector>

#include "collision/detection.hpp"
#include "contacts/contact_points.hpp"
#include "contacts/internal_edges.hpp"
#include "contacts/open_pairs.hpp"
#include "contacts/search_margins.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

class CandidateSearch {
public:
    explicit CandidateSearch(Detection shapes) : detection(std::move(shapes)) {}

    /// Finds the points that are closed where the step begins, and the pairs near enough to meet. What a joint
    /// drives goes where no forces tell: if it pressed in the `last` step and is near enough yet, it has its points at once.
    void begin(StepMotion& motion, const std::vector<Vec6>& free_velocity, const ContactCache& last,
               ContactPoints& points);
    /// The same pairs once more, of which those that have points are known.
    void find_open(StepMotion& motion, ContactPoints& points);
    /// Finds more of both where some body goes further than was looked for. `changed` names bodies with another velocity than
    /// at the look before: those that have more pairs now join them.
    void widen(const Cast& cast, std::vector<char>& changed, StepMotion& motion, ContactPoints& points);

    /// Casts the open pairs, once a step is begun those of bodies that `changed` names: the others were judged before.
    /// Those that meet get points. How many they are.
    int find_impacts(const Cast& cast, const std::vector<char>& changed, StepMotion& motion,
                     ContactPoints& points);
    /// An impact that is no event acts with the bodies at the start of the step, or the angular momentum of both would
    /// not be kept: with the points of that moment, if their rows stop the approach, else at the point of the meeting,
    /// taken back half-way between both bodies, or with the one that moves by itself.
    void move_impacts_to_start(std::size_t from, const std::vector<Vec6>& velocity, const StepMotion& motion,
                               ContactPoints& points);
    /// Looks where `velocity` leads the pairs that have points; true if some feature swings in and got a row.
    bool find_turned(const std::vector<Vec6>& velocity, const StepMotion& motion, ContactPoints& points);

    SearchedStep step(const StepMotion& motion, const ContactPoints& points) const noexcept {
        return {detection, motion, points};
    }
    const OpenPairs& open() const noexcept { return open_; }
    const SearchMargins& margins() const noexcept { return margins_; }

    Detection detection;
    InternalEdges edges;
    std::vector<int> woken;  // sleepers that another body met, or was moved into, since the step began

private:
    void look_at(const std::vector<IndexPair>& near, StepMotion& motion, ContactPoints& points);
    void look_at(const IndexPair& pair, const StepMotion& motion, ContactPoints& points);
    bool presses(const OpenPair& open, const std::vector<Vec6>& velocity, const StepMotion& motion,
                 const ContactPoints& points) const;
    bool reachable(const StepMotion& motion, const Contact& contact) const;
    StepContact& add_point(const ContactModel& model, ContactPoints& points, const Contact& contact,
                           const Pose& first, const Pose& second, double toi);
    OpenPair opened(const IndexPair& pair, const Separation& apart) const;
    bool skip_grazing(std::size_t from, const StepMotion& motion, ContactPoints& points);
    bool passes(const OpenPair& open, const StepMotion& motion, const ContactPoints& points,
                const std::vector<Vec6>& velocity) const;
    double meeting(const OpenPair& open, const Cast& cast, const StepMotion& motion,
                   const ContactPoints& points) const;
    bool add_toi_point_at_start(const OpenPair& open, double time, const std::vector<Vec6>& velocity,
                                const StepMotion& motion, ContactPoints& points);
    bool add_toi_points(const OpenPair& open, double time, const std::vector<Vec6>& along,
                        const std::vector<Vec6>& velocity, const StepMotion& motion, ContactPoints& points);
    bool is_known(const ContactPoints& points, const Contact& contact, std::size_t from, std::size_t end,
                  double size, bool& named) const;

    OpenPairs open_;
    SearchMargins margins_;
    const ContactCache* last_ = nullptr;  // of the step that is looked through
    // Of one look:
    std::vector<Meeting> meetings_;
    std::vector<IndexPair> near_, grazing_;  // where the search was widened; pairs, see skip_grazing()
    std::vector<std::size_t> asked_;         // open pairs to be judged
    std::vector<Contact> scratch_;
    std::vector<std::uint64_t> known_;  // pairs
};

}  // namespace spook
