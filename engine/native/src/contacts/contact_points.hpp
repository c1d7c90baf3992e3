// The points of a step with contacts, and what few of them have besides.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "contacts/contact_bodies.hpp"
#include "contacts/contact_cache.hpp"
#include "contacts/islands.hpp"
#include "contacts/step_contact.hpp"
#include "linear/large_array.hpp"

namespace spook {

struct ContactPoints {
    void clear() noexcept { all.clear(), extras_.clear(); }
    /// Of bodies that stand at `first` and `second`; `toi` is when they touch within the step, negative if they do.
    StepContact& add(const ContactModel& model, const Contact& contact, const Pose& first, const Pose& second,
                     double toi);
    /// Takes out those from `from` on; valid until order().
    const LargeArray<StepContact>& take_from(std::size_t from) {
        rest_.assign(all.begin() + static_cast<std::ptrdiff_t>(from), all.end());
        all.resize(from);
        return rest_;
    }
    /// Sorts them by key and finds each one's predecessor in the step before.
    void order(const ContactCache& before, bool resists_turning);
    /// What a point did in the step before, as where the solve starts.
    void remember(StepContact& point, const CachedContact& before, bool resists_turning);

    /// The impulses of points of the bodies that are marked, by their index in MixedSystem, if any are: none.
    void forget(const ContactBodies& bodies, const std::vector<char>& marked);

    /// Tells what they connect.
    void tie(const ContactBodies& bodies, IslandFinder& finder) const {
        for (const StepContact& point : all) finder.tie(bodies.solver_pair(point.contact));
    }

    const ContactExtras& extras(const StepContact& point) const noexcept {
        static constexpr ContactExtras none{};
        return point.extras < 0 ? none : extras_[point.extras];
    }
    ContactExtras& own_extras(StepContact& point) {
        if (point.extras < 0) {
            point.extras = static_cast<int>(extras_.size());
            extras_.emplace_back();
        }
        return extras_[point.extras];
    }

    LargeArray<StepContact> all;
    std::size_t ordered = 0;  // so many of them are in order

private:
    void orient(const ContactModel& model, StepContact& point, const Pose& first, const Pose& second);

    std::vector<ContactExtras> extras_;  // in no order
    LargeArray<StepContact> rest_;
    std::vector<std::pair<std::uint64_t, std::size_t>> places_;  // by key
};

}  // namespace spook
