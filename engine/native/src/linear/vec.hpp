// Three-vectors, 3×3 matrices and unit quaternions: plain values, no invariants, no allocation.
#pragma once

#include <cmath>

namespace spook {

struct Vec3 {
    double x = 0.0, y = 0.0, z = 0.0;

    constexpr bool operator==(const Vec3&) const noexcept = default;
    constexpr double& operator[](int i) noexcept { return i == 0 ? x : i == 1 ? y : z; }
    constexpr double operator[](int i) const noexcept { return i == 0 ? x : i == 1 ? y : z; }
    constexpr Vec3& operator+=(Vec3 b) noexcept {
        x += b.x;
        y += b.y;
        z += b.z;
        return *this;
    }
    constexpr Vec3& operator-=(Vec3 b) noexcept {
        x -= b.x;
        y -= b.y;
        z -= b.z;
        return *this;
    }
    constexpr Vec3& operator*=(double s) noexcept {
        x *= s;
        y *= s;
        z *= s;
        return *this;
    }
};

constexpr Vec3 operator+(Vec3 a, Vec3 b) noexcept { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(Vec3 a, Vec3 b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(Vec3 a) noexcept { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(double s, Vec3 a) noexcept { return {s * a.x, s * a.y, s * a.z}; }
constexpr Vec3 operator*(Vec3 a, double s) noexcept { return {s * a.x, s * a.y, s * a.z}; }
constexpr double dot(Vec3 a, Vec3 b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) noexcept {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(Vec3 a) noexcept { return std::sqrt(dot(a, a)); }
constexpr bool is_zero(Vec3 a) noexcept { return a.x == 0.0 && a.y == 0.0 && a.z == 0.0; }
inline bool finite(Vec3 a) noexcept { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }

/// Row-major 3×3 matrix.
struct Mat3 {
    double m[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};

    constexpr bool operator==(const Mat3&) const noexcept = default;
    constexpr double& operator()(int i, int j) noexcept { return m[3 * i + j]; }
    constexpr double operator()(int i, int j) const noexcept { return m[3 * i + j]; }
    static constexpr Mat3 diagonal(Vec3 d) noexcept { return {{d.x, 0, 0, 0, d.y, 0, 0, 0, d.z}}; }
    static constexpr Mat3 identity() noexcept { return diagonal({1, 1, 1}); }
};

constexpr Vec3 operator*(const Mat3& a, Vec3 v) noexcept {
    return {a.m[0] * v.x + a.m[1] * v.y + a.m[2] * v.z, a.m[3] * v.x + a.m[4] * v.y + a.m[5] * v.z,
            a.m[6] * v.x + a.m[7] * v.y + a.m[8] * v.z};
}
constexpr Mat3 transpose(const Mat3& a) noexcept {
    return {{a.m[0], a.m[3], a.m[6], a.m[1], a.m[4], a.m[7], a.m[2], a.m[5], a.m[8]}};
}
/// aᵀ v.
constexpr Vec3 transposed_times(const Mat3& a, Vec3 v) noexcept {
    return {a.m[0] * v.x + a.m[3] * v.y + a.m[6] * v.z, a.m[1] * v.x + a.m[4] * v.y + a.m[7] * v.z,
            a.m[2] * v.x + a.m[5] * v.y + a.m[8] * v.z};
}
constexpr Mat3 operator*(const Mat3& a, const Mat3& b) noexcept {
    Mat3 c;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            c.m[3 * i + j] = a.m[3 * i] * b.m[j] + a.m[3 * i + 1] * b.m[3 + j] + a.m[3 * i + 2] * b.m[6 + j];
    return c;
}

/// Quaternion (w, x, y, z); a unit quaternion maps body coordinates to world coordinates.
struct Quat {
    double w = 1.0, x = 0.0, y = 0.0, z = 0.0;
};

constexpr Quat operator*(Quat a, Quat b) noexcept {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
constexpr Quat conjugate(Quat q) noexcept { return {q.w, -q.x, -q.y, -q.z}; }
constexpr Mat3 rotation(Quat q) noexcept {
    return {{1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.w * q.z), 2 * (q.x * q.z + q.w * q.y),
             2 * (q.x * q.y + q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z - q.w * q.x),
             2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x), 1 - 2 * (q.x * q.x + q.y * q.y)}};
}

}  // namespace spook
