// Rows whose bounds follow from what other rows carry in the same step.
//
//   eye    the pulls T₁, T₂ of a wire before and behind a point it rubs on differ by the eye's own row, at most by what
//          Euler and Eytelwein allow, T₂ <= e^{µφ} T₁ either way:  |T₂ − T₁| <= tanh(½µφ) (T₁ + T₂)
//   tyre   (F_x/µ_x)² + (F_y/µ_y)² <= N², see tyre_rows.hpp
//   bearing   |F| <= F₀ + c |N|, N the force that the joint's own rows hold
//
// Solve, bound anew, solve again, until both agree. A tyre that slides has softer rows instead of bounds: 1/|F| is affine in that
// factor, of one tyre by itself, and the third round a secant's. An eye's bound b = y(b) is a contraction: more friction takes from
// T₁ what it gives to T₂ or less, so |y'| <= tanh(½µφ) < 1; two rounds tell y', and the third is a secant's. Only rows
// that are at a bound, or would be, have a say.
#pragma once

#include <vector>

#include "contacts/pivot_system.hpp"
#include "rigid/joint_set.hpp"

namespace spook {

class LoadDependentBounds {
public:
    static constexpr int max_rounds = 100;
    static constexpr int patient_rounds = 8;  // rounds, before steps are halved
    static constexpr double agreed = 1e-11;   // of the pull or the load

    /// Which rows there are; the first step begins with bounds of zero.
    void take(const JointSet& joints, bool eyes, bool tyres, bool bearings);
    bool empty() const noexcept { return eyes_.empty() && tyres_.empty() && bearings_.empty(); }

    /// A new step.
    void begin() noexcept { round_ = 0; }
    struct Followed {
        double off = 0.0;         // the largest difference of a row to its law, relative to what bounds it
        bool same_matrix = true;  // bounds have changed alone
    };
    /// Bounds from a solution, for the rows and for the next step. `late`: for the next step alone; then tyres have bounds only.
    Followed follow(MixedSystem& solved, JointSet& joints, bool late = false);
    /// The block of the row that was furthest off.
    int worst() const noexcept { return worst_; }

private:
    struct Guess {
        double bound = 0.0, answer = 0.0;  // of a tyre that slides: the factor, 1/|F|; else 0
    };
    void see(double off, int block) noexcept {
        if (off > off_) off_ = off, worst_ = block;
    }
    void follow_eye(int eye, MixedSystem& solved, JointSet& joints);
    bool follow_tyre(int tyre, MixedSystem& solved, JointSet& joints);
    void follow_tyre_late(int tyre, MixedSystem& solved, JointSet& joints);
    void follow_bearing(int bearing, MixedSystem& solved, JointSet& joints);

    std::vector<int> eyes_, tyres_, bearings_;  // indices into those of the joints
    std::vector<Guess> last_;                   // per eye and tyre, of the round before
    int round_ = 0, worst_ = 0;
    double off_ = 0.0;
};

}  // namespace spook
