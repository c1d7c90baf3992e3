// The contact cache: what the contacts of the last step did, read by observables, and the warm start of the next step.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/detection.hpp"
#include "linear/vec.hpp"

namespace spook {

struct CachedContact {
    Contact contact;
    Vec3 impulse;                    // on the first body, impact and resting, N s
    double normal = 0.0;             // nu of the resting stage, N s
    double impact = 0.0;             // normal impulse of the impact, N s
    double tangent[2] = {0.0, 0.0};  // of the resting stage along the tangents, for a warm start
    double turning[3] = {0, 0, 0};   // of rolling along them and of turning, scaled, for a warm start
    double compression = 0.0;        // how far its bodies have pressed it in by the step's end, m
    double friction = 0.0;           // mu of the pair, along its direction if it has one
    bool active = false;             // pushes, or closed
    bool pushes() const noexcept { return normal > 0.0 || impact > 0.0; }
};

/// Both arrays are in order of keys. Readings are of sleepers, too: those of their last step awake.
struct ContactCache {
    std::vector<CachedContact> points;    // of the last step until the end of solve()
    std::vector<CachedContact> sleeping;  // of sleepers
    std::vector<char> asleep;             // by body; empty while none has slept

    bool sleeps(int body) const noexcept { return !asleep.empty() && asleep[body] != 0; }
    /// What that point did in the last step, null if it is new.
    const CachedContact* find(std::uint64_t key) const noexcept;
    /// Whether that pair of colliders had a point.
    bool has_pair(std::uint64_t pair) const noexcept;
    /// Whether that pair rested on each other in the last step, without an impact.
    bool pressed(std::uint64_t pair) const noexcept;
    /// The first point of that pair, or where it would be.
    std::vector<CachedContact>::const_iterator first_of(std::uint64_t pair) const noexcept;

    /// What such bodies touch is put by, or taken up again. `bodies`: of the scene.
    void put_to_sleep(const std::vector<int>& sleepers, std::size_t bodies);
    void wake(const std::vector<int>& sleepers);
    /// Sleepers that touch one of the bodies that `is_moving` names.
    std::vector<int> touching(const std::vector<char>& is_moving) const;

    /// Force [N] on `body` from `other` (or from all if −1), mean over the step h.
    Vec3 force(int body, int other, double h) const noexcept;
    /// Points that push or are closed.
    int count() const noexcept;
    /// Largest depth [m] among the step's points, at its start.
    double penetration() const noexcept;
    /// Points that push or are closed, ten numbers each: place [m], normal onto the first body, force [N] on it,
    /// coefficient of friction. The first `most` of them in order of bodies; NaN where there are fewer.
    void tell(int most, double h, double* out) const noexcept;
};

}  // namespace spook
