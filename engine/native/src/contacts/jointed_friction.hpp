// Joints and contacts, or few contacts that resist turning: which solver is asked when, and which answer is taken.
//
// The joints are eliminated, and iterations and Newton's method go over contacts alone, in turns with more iterations each from
// the best so far (contacts/reduced_contacts.hpp). Newton's method on the whole, which costs a factor of all bodies an
// iteration, shares loads of redundant points evenly: it comes before where these are many, and no few for so many bodies, else
// after the first turn, from the start; and where points resist turning after later ones, too, from the best.
//
// Joints that are led back against a jam ask for what no impulse gives: where the first turn does not settle and one with them as
// far open as they are does, they stay so for the step.
#pragma once

#include <vector>

#include "contacts/friction_direct.hpp"
#include "contacts/friction_point.hpp"
#include "contacts/pivot_system.hpp"

namespace spook {

/// Reads and writes what its members refer to: `start` is the system as it was, `best` room for the best answer so far.
struct JointedFriction {
    MixedSystem& system;
    std::vector<FrictionPoint>& points;
    DirectSolver& direct;
    FrictionReport& report;
    const MixedSystem& start;
    MixedSystem& best;

    /// `newton`: whether Newton's method on the whole may be asked; `redundant`: whether points share loads in many ways.
    void solve(bool newton, bool redundant);

private:
    void take(double residual);
    void ask_newton(bool turning);
    void ask_reduced(int turn, double most);
    bool asks_more(int turn, bool turning, double at_once) const;
};

}  // namespace spook
