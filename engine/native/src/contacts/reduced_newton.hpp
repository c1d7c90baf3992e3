// Contacts alone as a dense problem, and Newton's method over it on a working set of rows; see reduced_contacts.hpp.
//
// With u = W z + q: a row between bounds rests at one that u pushes it against, or u = 0; friction is within the disc, or on its
// edge against u. Every point obeys the bounds.
#pragma once

#include <vector>

#include "contacts/pivot_system.hpp"

namespace spook {

class ReducedNewton {
protected:
    /// Rows that are found together: one between bounds, or those of a disc (an interval, where one) of a normal's.
    struct Unit {
        int block = 0, row = 0, size = 1, at = 0;
        int normal = -1;           // in z: what bounds it; −1: lower and upper
        double coefficient = 0.0;  // times that
        double lower = 0.0, upper = 0.0;
        double own = 1.0;  // of W's block: its entry, or trace
    };
    void measure();
    double residual_of(const Unit& unit, const double* z, const double* u) const;
    double residual() const;
    double keep_best();
    /// From z_, which ends on the last point; the best is in best_. Returns how many steps were taken. `tight`: without relief.
    int polish(double goal, bool tight);

    int rows_ = 0;
    std::vector<Unit> units_;
    std::vector<double> w_, q_, z_, u_, best_;  // W row by row; best_: z
    double speed_ = 0.0, best_residual_ = 0.0;

private:
    bool rests_at_bound(const Unit& unit) const;
    void choose_rows();
    bool find_step(double& worst);
    void lay_slide(const Unit& unit, const double* d, double size, std::size_t& row, double& worst);
    bool eliminate(std::size_t m);
    double share_to_edge(const Unit& unit) const;
    double share_to_bound(const Unit& unit, bool& low) const;
    void find_image();
    double share_to_leaving(const Unit& unit) const;
    bool take_step(double most);
    bool drive(double worst, double goal);
    const Unit* most_held(double& most);
    double leaves(const Unit& unit) const;

    std::vector<double> dense_, step_, drive_, image_;
    std::vector<int> active_, place_;
    std::vector<signed char> pinned_;
    const Unit* driver_ = nullptr;  // that is being let go, and which way
    int way_ = 0;
    double relief_ = 0.0;
    bool ended_ = false;  // without a way to go on
};

}  // namespace spook
