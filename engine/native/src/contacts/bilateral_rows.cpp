#include "contacts/bilateral_rows.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/tolerances.hpp"

namespace spook {

using namespace tolerances::bilateral_rows;

void BilateralRows::read(const MixedSystem& system, const MassFactors& mass) {
    nodes_.clear();
    ties_.clear();
    rows_ = 0;
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        Node node;
        for (int i = 0; i < block.size; ++i)
            if (is_bilateral(block, i)) node.row[node.count++] = i;
        if (node.count == 0) continue;
        rows_ += node.count;
        node.block = static_cast<int>(k);
        node.first_tie = static_cast<int>(ties_.size());
        Row own{};
        const auto tie = [&](int body, const Vec6* rows) {
            if (body < 0) return;
            Tie& tie = ties_.emplace_back();
            tie.body = body;
            double each[6] = {};
            for (int i = 0; i < node.count; ++i) tie.rows[i] = rows[node.row[i]];
            own_inertias(mass[body], tie.rows.data(), node.count, each);
            for (int i = 0; i < node.count; ++i) own[i] += each[i];
        };
        tie(block.first, block.first_jacobian.data());
        tie(block.second, block.second_jacobian.data());
        for (const FurtherBody& other : block.further) tie(other.body, &other.jacobian);
        node.ties = static_cast<int>(ties_.size()) - node.first_tie;
        for (int i = 0; i < node.count; ++i) {
            node.softness[i] = block.softness[node.row[i]];
            node.right[i] = block.right[node.row[i]];
            node.z[i] = block.multiplier[node.row[i]];
            node.root[i] = own[i] > 0.0 ? std::sqrt(1.0 / own[i]) : 1.0;
        }
        nodes_.push_back(node);
    }
}

void BilateralRows::couple(int bodies, std::vector<std::pair<int, int>>& pairs) const {
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        for (int t = 0; t < nodes_[k].ties; ++t)
            pairs.emplace_back(ties_[nodes_[k].first_tie + t].body, bodies + static_cast<int>(k));
}

void BilateralRows::place(int bodies, const std::vector<std::pair<int, int>>& pairs) {
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        for (int t = 0; t < nodes_[k].ties; ++t) {
            Tie& tie = ties_[nodes_[k].first_tie + t];
            const std::pair<int, int> own{tie.body, bodies + static_cast<int>(k)};
            tie.edge = static_cast<int>(std::lower_bound(pairs.begin(), pairs.end(), own) - pairs.begin());
        }
}

void BilateralRows::fill(int bodies, BlockLu& matrix) const {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Node& node = nodes_[k];
        double* diagonal = matrix.diagonal(bodies + static_cast<int>(k));
        for (int i = 0; i < 6; ++i)
            diagonal[7 * i] =
                i < node.count ? node.softness[i] + relief / (node.root[i] * node.root[i]) : 1.0;
        for (int t = 0; t < node.ties; ++t) {
            const Tie& tie = ties_[node.first_tie + t];
            double *down = matrix.forth(tie.edge), *across = matrix.back(tie.edge);
            for (int i = 0; i < node.count; ++i)
                for (int a = 0; a < 6; ++a) {
                    down[6 * a + i] -= tie.rows[i][a];
                    across[6 * i + a] += tie.rows[i][a];
                }
        }
    }
}

void BilateralRows::push(Vec6* momentum) const {
    for (const Node& node : nodes_)
        for (int t = 0; t < node.ties; ++t) {
            const Tie& tie = ties_[node.first_tie + t];
            for (int i = 0; i < node.count; ++i)
                for (int a = 0; a < 6; ++a) momentum[tie.body][a] += tie.rows[i][a] * node.z[i];
        }
}

void BilateralRows::measure(const Vec6* velocity) {
    for (Node& node : nodes_)
        for (int i = 0; i < node.count; ++i) {
            double speed = node.softness[i] * node.z[i] - node.right[i];
            for (int t = 0; t < node.ties; ++t) {
                const Tie& tie = ties_[node.first_tie + t];
                speed += dot(tie.rows[i], velocity[tie.body]);
            }
            node.u[i] = speed;
        }
}

double BilateralRows::largest_right() const {
    double largest = 0.0;
    for (const Node& node : nodes_)
        for (int i = 0; i < node.count; ++i) largest = std::max(largest, std::abs(node.right[i]));
    return largest;
}

BilateralRows::Left BilateralRows::worst() const {
    Left left;
    for (const Node& node : nodes_)
        for (int i = 0; i < node.count; ++i) {
            const double speed = std::abs(node.u[i]), map = node.root[i] * speed;
            if (!(map <= left.map)) left.map = map;
            if (!(speed <= left.speed)) left.speed = speed;
        }
    return left;
}

double BilateralRows::merit(double length, double along) const {
    double sum = 0.0;
    for (const Node& node : nodes_)
        for (int i = 0; i < node.count; ++i) {
            const double map = node.root[i] * (node.u[i] + length * node.du[i] + along * node.tu[i]);
            sum += map * map;
        }
    return sum;
}

void BilateralRows::move(double length, double along) {
    for (Node& node : nodes_)
        for (int i = 0; i < node.count; ++i) node.z[i] += length * node.dz[i] + along * node.tz[i];
}

void BilateralRows::ask(bool newton) {
    for (Node& node : nodes_)
        for (int i = 0; i < node.count; ++i) node.lack[i] = newton ? -node.root[i] * node.u[i] : 0.0;
}

double BilateralRows::asked() const {
    double sum = 0.0;
    for (const Node& node : nodes_)
        for (int i = 0; i < node.count; ++i) sum += node.lack[i] * node.lack[i];
    return sum;
}

void BilateralRows::respond(Vec6* nodes) const {
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        for (int i = 0; i < nodes_[k].count; ++i) nodes[k][i] = nodes_[k].lack[i] / nodes_[k].root[i];
}

void BilateralRows::turn(const Vec6* nodes, Vec6* change) {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        Node& node = nodes_[k];
        node.c = nodes[k];
        for (int t = 0; t < node.ties; ++t) {
            const Tie& tie = ties_[node.first_tie + t];
            for (int i = 0; i < node.count; ++i)
                for (int a = 0; a < 6; ++a) change[tie.body][a] += tie.rows[i][a] * node.c[i];
        }
    }
}

double BilateralRows::remain(const Vec6* change) {
    double sum = 0.0;
    for (Node& node : nodes_)
        for (int i = 0; i < node.count; ++i) {
            double speed = node.softness[i] * node.c[i];
            for (int t = 0; t < node.ties; ++t) {
                const Tie& tie = ties_[node.first_tie + t];
                speed += dot(tie.rows[i], change[tie.body]);
            }
            node.image[i] = speed;
            node.lack[i] -= node.root[i] * speed;
            sum += node.lack[i] * node.lack[i];
        }
    return sum;
}

void BilateralRows::take(bool newton, bool first) {
    for (Node& node : nodes_) {
        Row &z = newton ? node.dz : node.tz, &u = newton ? node.du : node.tu;
        for (int i = 0; i < node.count; ++i) {
            z[i] = (first ? 0.0 : z[i]) + node.c[i];
            u[i] = (first ? 0.0 : u[i]) + node.image[i];
        }
    }
}

void BilateralRows::forget_path() {
    for (Node& node : nodes_) node.tz = node.tu = Row{};
}

void BilateralRows::keep_best() {
    for (Node& node : nodes_) node.best = node.z;
}

void BilateralRows::keep_met() {
    for (Node& node : nodes_) node.met = node.z;
}

void BilateralRows::back_to_met() {
    for (Node& node : nodes_) node.z = node.met;
}

void BilateralRows::back_to_best() {
    for (Node& node : nodes_) node.z = node.best;
}

void BilateralRows::deliver(MixedSystem& system) {
    for (Node& node : nodes_) {
        node.z = node.best;
        for (int i = 0; i < node.count; ++i) system.rows[node.block].multiplier[node.row[i]] = node.z[i];
    }
}

}  // namespace spook
