// What both pipelines have: settings, ends, springs, centres of gravity.
#pragma once

#include "bindings/columns.hpp"
#include "run/forces.hpp"

namespace spook {

/// Two ends, each the index of a body or −1 for a point of the world.
struct Ends {
    Ends(Columns& table, std::size_t bodies)
        : there{bodies, "bodies", true},
          first(table.numbers("first")),
          second(table.numbers("second")),
          first_point(table.numbers("first_point", 3)),
          second_point(table.numbers("second_point", 3)) {}
    End operator()(std::size_t row, int side) const {
        if (side == 0) return {first.index(row, there), first_point.vec(row)};
        return {second.index(row, there), second_point.vec(row)};
    }
    Range there;
    Numbers first, second, first_point, second_point;
};

/// What is no table.
template <class Scene> void read_settings(Entries& in, Scene& scene) {
    Point gravity;
    in.read("gravity", gravity);
    scene.gravity = to_vec(gravity);
    in.read("loads_change", scene.loads_change);
}

inline std::vector<SpringForce> read_springs(Entries& in, std::size_t bodies) {
    std::vector<SpringForce> read;
    Columns table(in, "springs");
    const Ends end(table, bodies);
    const Numbers stiffness = table.numbers("stiffness"), length = table.numbers("rest_length"),
                  viscosity = table.numbers("viscosity");
    for (std::size_t i = 0; i < table.rows(); ++i)
        read.push_back({{end(i, 0), end(i, 1)}, stiffness[i], length[i], viscosity[i]});
    table.expect_all_read();
    return read;
}

inline std::vector<CentralField> read_fields(Entries& in) {
    std::vector<CentralField> read;
    Columns table(in, "fields");
    const Numbers strength = table.numbers("strength"), centre = table.numbers("centre", 3);
    for (std::size_t i = 0; i < table.rows(); ++i) read.push_back({strength[i], centre.vec(i)});
    table.expect_all_read();
    return read;
}

}  // namespace spook
