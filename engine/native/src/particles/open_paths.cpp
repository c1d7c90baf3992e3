#include "particles/open_paths.hpp"

namespace spook {

void OpenPaths::factor(const Nodes& nodes, DistanceRows& rows, bool rigid) const noexcept {
    const double soft = rigid ? 0.0 : 1.0;
    for (std::size_t path = 0; path + 1 < first_.size(); ++path) {
        const int first = first_[path], end = first_[path + 1];
        double pivot_inverse = 1.0 / (rows.row[first].stiff + soft * rows.row[first].softness);
        rows.link[first].pivot_inverse = pivot_inverse;
        rows.link[first].lower = 0.0;
        for (int k = first + 1; k < end; ++k) {
            const double off = -nodes.w[rows.row[k].a] * dot(rows.link[k - 1].u, rows.link[k].u);
            const double lower = off * pivot_inverse;
            pivot_inverse = 1.0 / (rows.row[k].stiff + soft * rows.row[k].softness - lower * off);
            rows.link[k].lower = lower;
            rows.link[k].pivot_inverse = pivot_inverse;
        }
    }
}

void OpenPaths::substitute(DistanceRows& rows) const noexcept {
    for (std::size_t path = 0; path + 1 < first_.size(); ++path) {
        const int first = first_[path], end = first_[path + 1];
        double y = rows.link[first].rhs;
        rows.link[first].y = y;
        for (int k = first + 1; k < end; ++k) rows.link[k].y = y = rows.link[k].rhs - rows.link[k].lower * y;
        double lambda = rows.link[end - 1].lambda = y * rows.link[end - 1].pivot_inverse;
        for (int k = end - 2; k >= first; --k)
            rows.link[k].lambda = lambda =
                rows.link[k].y * rows.link[k].pivot_inverse - rows.link[k + 1].lower * lambda;
    }
}

/// v += kick + w (λ_in u_in − λ_out u_out), node by node; the order of the operations is that of swing().
void OpenPaths::kick(const Nodes& nodes, const DistanceRows& rows, std::vector<Vec3>& v) const noexcept {
    int node = 0;
    for (std::size_t path = 0; path + 1 < first_.size(); ++path) {
        const int end = first_[path + 1];
        Vec3 in;
        for (int k = first_[path]; k < end; ++k, ++node) {
            const Vec3 out = rows.link[k].lambda * rows.link[k].u;
            v[node] += nodes.kick[node] + nodes.w[node] * (in - out);
            in = out;
        }
        v[node] += nodes.kick[node] + nodes.w[node] * in;
        ++node;
    }
    for (; node < static_cast<int>(v.size()); ++node) v[node] += nodes.kick[node];  // bodies without rows
}

}  // namespace spook
