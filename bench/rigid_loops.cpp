// Rods in a row on hinges, in a plane, as a loop written by hand: what a programmer would write for only this scene.
// Same arithmetic as the engine's plain SPOOK step of this scene (bench_rigid.py, rods): 1 kg, half a metre long, each end
// on the next one's beginning, the first on a wall; h = 1/240 s, g = 9.81 m/s² along -y, rows damped over 2 h, as
// compliant as the engine's and measured in the first body's frame, so that its arm reaches to the second one's point. Two
// rows a hinge, a tridiagonal system of 2 × 2 blocks; -O3, no fast-math. Returns the last rod's x.
#include <cmath>
#include <vector>

namespace {

constexpr double H = 1.0 / 240.0, G = 9.81, LENGTH = 0.5, MASS = 1.0, INERTIA = MASS * LENGTH * LENGTH / 12.0;
constexpr double EPS = 1e-8;  // m/N, what a joint has unless told
constexpr double VIOLATION = 4.0 / (H * 9.0), VELOCITY = 8.0 / 9.0, SOFT = 4.0 * EPS / (H * H * 9.0);

struct Rod {
    double x, y, c, s;  // centre, and the direction of its length
    double u = 0.0, v = 0.0, w = 0.0;
};
struct Pair {
    double x, y;
};
struct Block {
    double xx, xy, yx, yy;
};

Pair times(const Block& b, Pair a) { return {b.xx * a.x + b.xy * a.y, b.yx * a.x + b.yy * a.y}; }
Block times(const Block& a, const Block& b) {
    return {a.xx * b.xx + a.xy * b.yx, a.xx * b.xy + a.xy * b.yy, a.yx * b.xx + a.yy * b.yx, a.yx * b.xy + a.yy * b.yy};
}
Block inverse(const Block& b) {
    const double scale = 1.0 / (b.xx * b.yy - b.xy * b.yx);
    return {scale * b.yy, -scale * b.xy, -scale * b.yx, scale * b.xx};
}

}  // namespace

extern "C" double rods(long count, long steps) {
    const auto n = static_cast<std::size_t>(count);
    std::vector<Rod> rod(n);
    std::vector<Block> above(n), pivot(n);  // off the diagonal to the hinge before, and what elimination leaves
    std::vector<Pair> rhs(n), arm(n);  // of the rod before, to the hinge
    for (std::size_t k = 0; k < n; ++k) rod[k] = {LENGTH * (static_cast<double>(k) + 0.5), 0.0, 1.0, 0.0};
    constexpr double half = 0.5 * LENGTH, light = 1.0 / MASS, turn = half * half / INERTIA;
    for (long step = 0; step < steps; ++step) {
        for (std::size_t k = 0; k < n; ++k) {  // hinge k: the beginning of rod k on the end of the one before
            const Rod& b = rod[k];
            Pair off{b.x - half * b.c, b.y - half * b.s}, rate{b.u + half * b.s * b.w, b.v - half * b.c * b.w};
            Block diagonal{light + turn * b.s * b.s + SOFT, -turn * b.s * b.c, 0.0, light + turn * b.c * b.c + SOFT};
            if (k == 0) {
                rhs[k] = {-VIOLATION * off.x - VELOCITY * rate.x, -VIOLATION * off.y - VELOCITY * rate.y + H * G};
                diagonal.yx = diagonal.xy;
                pivot[k] = inverse(diagonal);
                continue;
            }
            const Rod& a = rod[k - 1];
            const Pair r = arm[k] = {off.x - a.x, off.y - a.y};
            off = {r.x - half * a.c, r.y - half * a.s};
            rate = {rate.x - a.u + r.y * a.w, rate.y - a.v - r.x * a.w};
            diagonal.xx += light + r.y * r.y / INERTIA;
            diagonal.xy -= r.x * r.y / INERTIA;
            diagonal.yy += light + r.x * r.x / INERTIA;
            diagonal.yx = diagonal.xy;
            const Pair in{half * a.c / INERTIA, half * a.s / INERTIA};  // minus the arm to the hinge before
            const Block next{r.y * in.y - light, -r.y * in.x, -r.x * in.y, r.x * in.x - light};
            above[k] = times(next, pivot[k - 1]);
            const Block less = times(above[k], {next.xx, next.yx, next.xy, next.yy});
            pivot[k] = inverse({diagonal.xx - less.xx, diagonal.xy - less.xy, diagonal.yx - less.yx, diagonal.yy - less.yy});
            const Pair before = times(above[k], rhs[k - 1]);
            rhs[k] = {-VIOLATION * off.x - VELOCITY * rate.x - before.x, -VIOLATION * off.y - VELOCITY * rate.y - before.y};
        }
        Pair later{0.0, 0.0};
        for (std::size_t k = n; k-- > 0;) {
            Pair push = times(pivot[k], rhs[k]);
            if (k + 1 < n) {
                const Block& m = above[k + 1];  // its transpose
                push.x -= m.xx * later.x + m.yx * later.y;
                push.y -= m.xy * later.x + m.yy * later.y;
            }
            Rod& b = rod[k];
            b.u += light * (push.x - later.x);
            b.v += light * (push.y - later.y) - H * G;
            b.w += half / INERTIA * (b.s * push.x - b.c * push.y);
            if (k + 1 < n) b.w -= (arm[k + 1].x * later.y - arm[k + 1].y * later.x) / INERTIA;
            const double sine = std::sin(H * b.w), cosine = std::cos(H * b.w), c = b.c;
            b.x += H * b.u;
            b.y += H * b.v;
            b.c = c * cosine - b.s * sine;
            b.s = b.s * cosine + c * sine;
            later = push;
        }
    }
    return rod[n - 1].x;
}
