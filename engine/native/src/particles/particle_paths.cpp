// Distance rows in open paths: G M⁻¹ Gᵀ + Sig is tridiagonal, because only neighbours share a body.
//
//     S_kk = w_a + w_b + Sig,   S_k−1,k = −w u_k−1·u_k  (w of the shared body),   S = L D Lᵀ,
// one pass down and one up, O(n) in time and memory.
#include "particles/particle_system.hpp"

namespace spook {

/// `rigid` leaves the softness out.
void ParticleSystem::factor_paths(bool rigid) noexcept {
    const double soft = rigid ? 0.0 : 1.0;
    for (std::size_t path = 0; path + 1 < path_first_.size(); ++path) {
        const int first = path_first_[path], end = path_first_[path + 1];
        double pivot_inverse = 1.0 / (row_[first].stiff + soft * row_[first].softness);
        link_[first].pivot_inverse = pivot_inverse;
        link_[first].lower = 0.0;
        for (int k = first + 1; k < end; ++k) {
            const double off = -w_[row_[k].a] * dot(link_[k - 1].u, link_[k].u);
            const double lower = off * pivot_inverse;
            pivot_inverse = 1.0 / (row_[k].stiff + soft * row_[k].softness - lower * off);
            link_[k].lower = lower;
            link_[k].pivot_inverse = pivot_inverse;
        }
    }
}

void ParticleSystem::substitute_paths() noexcept {
    for (std::size_t path = 0; path + 1 < path_first_.size(); ++path) {
        const int first = path_first_[path], end = path_first_[path + 1];
        double y = link_[first].rhs;
        link_[first].lambda = y;
        for (int k = first + 1; k < end; ++k) link_[k].lambda = y = link_[k].rhs - link_[k].lower * y;
        double lambda = link_[end - 1].lambda *= link_[end - 1].pivot_inverse;
        for (int k = end - 2; k >= first; --k)
            link_[k].lambda = lambda = link_[k].lambda * link_[k].pivot_inverse - link_[k + 1].lower * lambda;
    }
}

/// v += kick + w (λ_in u_in − λ_out u_out), node by node; the order of the operations is that of swing().
void ParticleSystem::kick_paths(std::vector<Vec3>& v) const noexcept {
    int node = 0;
    for (std::size_t path = 0; path + 1 < path_first_.size(); ++path) {
        const int end = path_first_[path + 1];
        Vec3 in;
        for (int k = path_first_[path]; k < end; ++k, ++node) {
            const Vec3 out = link_[k].lambda * link_[k].u;
            v[node] += kick_[node] + w_[node] * (in - out);
            in = out;
        }
        v[node] += kick_[node] + w_[node] * in;
        ++node;
    }
    for (; node < static_cast<int>(v.size()); ++node) v[node] += kick_[node];  // bodies without rows
}

}  // namespace spook
