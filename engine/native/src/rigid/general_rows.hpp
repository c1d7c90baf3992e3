// Rows over several bodies: linear relations between free coordinates (gears, racks, screws, belts, differentials), and
// the length of a wire that runs through points of bodies and may go slack.
//
//   relation   g = Σ c_k q_k                 q_k the free coordinate of joint k, turns counted, zero at the start
//   wire       g = Σ |p_(i+1) − p_i| − L     p_i points of bodies or of the world; one-sided: it only pulls, λ <= 0;
//              + Σ r_k q_k for the drums it is wound on
//   eye        the wire behind a point of it goes through there at the rate of Σ |p_(i+1) − p_i| over what follows
//              (and of its drums): kept at zero as far as friction reaches, see load_dependent_bounds.hpp
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "linear/large_array.hpp"
#include "linear/regularisation.hpp"
#include "rigid/joint_blocks.hpp"
#include "rigid/joint_rows.hpp"
#include "rigid/joint_stops.hpp"

namespace spook {

/// One row over any number of bodies: a relation between free coordinates, or the length of a wire.
struct GeneralRow {
    struct Term {
        int joint;
        double coefficient;
        int first, second;  // bodies of the joint, −1 the world
        JointConstants constants;
    };
    std::vector<Term> terms;
    struct Point {
        int body;
        Vec3 start, arm;  // world place at the start, and seen from the body's centre
    };
    std::vector<Point> points;
    std::vector<int> bodies;  // that are not fixed, in the order of first mention
    double length = 0.0, restitution = 0.0;
    bool one_sided = false;
    int eye = -1;                         // index into the eyes
    Point previous{};                     // of an eye: where the wire comes from
    double friction = 0.0, turned = 0.0;  // µ; rad beyond the bend
    Regularisation row;
};

class GeneralRows {
public:
    /// Takes the row of a joint over several bodies.
    void add(const RigidScene& scene, const JointSpec& spec, double time_step);
    /// The last row is an eye, in this block; its wire is the row `wire`, in the block `wire_block`.
    void make_eye(const JointSpec& spec, int block, int wire, int wire_block);

    int size() const noexcept { return static_cast<int>(rows_.size()); }
    const GeneralRow& operator[](int row) const noexcept { return rows_[row]; }
    /// Its bodies beyond the first two.
    std::span<const int> others(int row) const noexcept {
        const std::span<const int> all = rows_[row].bodies;
        return all.subspan(std::min<std::size_t>(2, all.size()));
    }
    /// Their Jacobians, six numbers each, as the last assemble() found them; null where no row has any.
    const double* other_gradient() const noexcept {
        return gradient_.empty() ? nullptr : gradient_.data() + 12;
    }
    /// Rows that rub; their grips are those of the last assemble().
    std::span<const EyeRow> eyes() const noexcept { return eyes_; }

    double violation(int row, std::span<const BodyState> bodies,
                     const LargeArray<JointState>& states) const noexcept {
        return along(rows_[row], bodies, states, nullptr).violation;
    }
    /// The second time derivative of the row when all its bodies go on with constant velocities.
    double bias(int row, std::span<const BodyState> bodies) const noexcept;
    /// Jacobians of the first two bodies, and the right side.
    void assemble(int row, std::span<const BodyState> bodies, const LargeArray<JointState>& states,
                  JointState& state, JointStops& stops, double* first, double* second,
                  BlockRight& right) noexcept;

private:
    struct Along {
        double violation = 0.0, rate = 0.0;
    };
    Along along(const GeneralRow& general, std::span<const BodyState> bodies,
                const LargeArray<JointState>& states, double* gradient) const noexcept;
    void rub(const GeneralRow& general, std::span<const BodyState> bodies) noexcept;

    std::vector<GeneralRow> rows_;
    std::vector<EyeRow> eyes_;
    std::vector<double> gradient_;  // of one row: six numbers per body
};

}  // namespace spook
