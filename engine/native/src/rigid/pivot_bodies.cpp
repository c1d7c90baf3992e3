#include "rigid/pivot_bodies.hpp"

#include <cmath>

#include "collision/rotation.hpp"

namespace spook {

namespace {

/// Turns `axes` (columns) until aᵀ `tensor` a is diagonal for each of them: Jacobi's method. The moments.
Vec3 principal(Mat3 tensor, Mat3& axes) noexcept {
    for (int iteration = 0; iteration < 20; ++iteration) {
        bool turned = false;
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                const double off = tensor(p, q), size = std::fabs(tensor(p, p)) + std::fabs(tensor(q, q));
                if (!(std::fabs(off) > 1e-17 * size)) continue;
                turned = true;
                const double theta = (tensor(q, q) - tensor(p, p)) / (2.0 * off);
                const double t =
                    (theta < 0.0 ? -1.0 : 1.0) / (std::fabs(theta) + std::sqrt(1.0 + theta * theta));
                const double c = 1.0 / std::sqrt(1.0 + t * t), s = t * c;
                const auto turn = [&](double& a, double& b) {
                    const double was = a;
                    a = c * was - s * b;
                    b = s * was + c * b;
                };
                for (int i = 0; i < 3; ++i) turn(tensor(i, p), tensor(i, q));
                for (int i = 0; i < 3; ++i) turn(tensor(p, i), tensor(q, i));
                for (int i = 0; i < 3; ++i) turn(axes(i, p), axes(i, q));
            }
        if (!turned) break;
    }
    return {tensor(0, 0), tensor(1, 1), tensor(2, 2)};
}

}  // namespace

void PivotBodies::add(int body, const BodyConstants& constants, Vec3 arm) {
    Pivot pivot{body, constants.mass, arm, {}, constants.start_rotation};
    const Vec3 r = transposed_times(constants.start_rotation, arm);
    Mat3 tensor = Mat3::diagonal(constants.inertia);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            tensor(i, j) += constants.mass * ((i == j ? dot(r, r) : 0.0) - r[i] * r[j]);
    pivot.rotor = FreeRotor(principal(tensor, pivot.axes));
    pivots_.push_back(pivot);
    turns_.emplace_back();
}

void PivotBodies::stage(double tau, LargeArray<BodyState>& bodies, std::int64_t& rounds) noexcept {
    ++rounds;
    const double over = 1.0 / tau;
    for (std::size_t k = 0; k < pivots_.size(); ++k) {
        const Pivot& pivot = pivots_[k];
        const BodyState& s = bodies[pivot.body];
        Turn& turn = turns_[k];
        Mat3 axes = s.turn_less_one * pivot.axes;
        for (int i = 0; i < 9; ++i) axes.m[i] += pivot.axes.m[i];
        turn.reach = pivot.arm + s.turn_less_one * pivot.arm;
        turn.momentum = s.angular_momentum - cross(turn.reach, pivot.mass * s.velocity);
        const Quat moved = pivot.rotor.turn(tau, transposed_times(axes, turn.momentum));
        const Vec3 e = axes * Vec3{moved.x, moved.y, moved.z};
        turn.moved = {moved.w, e.x, e.y, e.z};
    }
    for (std::size_t k = 0; k < pivots_.size(); ++k) {
        const Pivot& pivot = pivots_[k];
        const Turn& turn = turns_[k];
        BodyState& s = bodies[pivot.body];
        s.turn = unit(turn.moved * s.turn);
        s.turn_less_one = rotation_less_one(s.turn);
        s.displacement = -(s.turn_less_one * pivot.arm);
        s.velocity = -over * (rotation_less_one(turn.moved) * turn.reach);
        s.angular_momentum = turn.momentum + cross(turn.reach, pivot.mass * s.velocity);
    }
}

}  // namespace spook
