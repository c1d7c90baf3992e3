#include "contacts/cone_newton.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/tolerances.hpp"
#include "linear/elementary.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

using namespace tolerances::cone_newton;

/// M⁻¹ from its factor: good enough for directions, which are refined.
Mat6 inverse_six(const Mat6& factor) noexcept {
    Mat6 inverse{};
    for (int i = 0; i < 6; ++i) {
        Vec6 column{};
        column[i] = 1.0;
        solve_six(factor, column);
        for (int j = 0; j < 6; ++j) inverse[6 * i + j] = column[j];
    }
    return inverse;
}

}  // namespace

/// Reads one unit, rows of a block from its first one on; `friction` is its point's, null if it has none.
void ConeNewton::read(const RowBlock& given, const FrictionPoint* friction, ConeUnit& unit, ConeFour& four,
                      int at) const {
    unit.first = given.first;
    unit.second = given.second;
    const int row = unit.row;
    double own = 0.0, first[3], second[3];
    if (unit.first >= 0) own_inertias(mass_[unit.first], &given.first_jacobian[row], unit.size, first);
    if (unit.second >= 0) own_inertias(mass_[unit.second], &given.second_jacobian[row], unit.size, second);
    for (int i = 0; i < unit.size; ++i) {
        unit.first_row[i] = given.first_jacobian[row + i];
        unit.second_row[i] = given.second_jacobian[row + i];
        if (unit.first >= 0) own += first[i];
        if (unit.second >= 0) own += second[i];
        four.softness[i][at] = i > 0 ? friction->slip_softness : given.softness[row + i];
        four.right[i][at] = given.right[row + i];
        four.z[i][at] = given.multiplier[row + i];
    }
    const double lower = given.lower[row], upper = given.upper[row];
    four.soft = four.soft || four.is_soft(at);
    four.pushing = four.pushing && lower > -unbounded && upper == unbounded;
    four.root[at] = own > 0.0 ? std::sqrt(unit.size / own) : 1.0;
    four.over[at] = 1.0 / four.root[at];
    four.lower[at] = lower / four.root[at];
    four.upper[at] = upper / four.root[at];
    four.z[0][at] = std::clamp(four.z[0][at], lower, upper);
    if (unit.size == 3) {
        four.friction[at] = friction->coefficient;
        four.along[at] = four.over[at] / four.friction[at];
    }
}

void ConeNewton::prepare(MixedSystem& system, const std::vector<FrictionPoint>& points) {
    const std::size_t bodies = system.mass.size();
    laws_ = &cone_laws();
    mass_inverse_.resize(bodies);
    mass_.find(system.mass, [this](std::size_t b) { mass_inverse_[b] = inverse_six(mass_[b]); });
    std::vector<const FrictionPoint*>& friction = friction_;
    friction.assign(system.rows.size(), nullptr);
    for (const FrictionPoint& point : points)
        if (!turns(point)) friction[point.block] = &point;
    units_.clear();
    fours_.clear();
    turning_.clear();
    std::size_t next = 0;
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        RowBlock& given = system.rows[k];
        const bool rough = friction[k] && friction[k]->coefficient > 0.0;
        const int rows = rough ? 3 : friction[k] || given.is_contact ? 1 : given.size;
        const Vec6 start = given.multiplier;
        for (int row = rows; row < given.size; ++row) given.multiplier[row] = 0.0;  // smooth
        const int size = rough ? 3 : 1;
        for (int row = 0; row < rows; row += size) {
            if (BilateralRows::is_bilateral(given, row)) continue;
            if (fours_.empty() || fours_.back().count == ConeFour::most || fours_.back().size != size) {
                fours_.emplace_back().clear(size);
                fours_.back().begin = static_cast<int>(units_.size());
            }
            ConeUnit& unit = units_.emplace_back();
            unit.block = static_cast<int>(k);
            unit.row = row;
            unit.size = size;
            read(given, friction[k], unit, fours_.back(), fours_.back().count++);
        }
        const int normal = static_cast<int>(units_.size()) - 1;
        for (; next < points.size() && points[next].block == static_cast<int>(k); ++next) {
            const FrictionPoint& point = points[next];
            if (!turns(point)) continue;
            for (int row = point.row; row < point.row + point.size; ++row) given.multiplier[row] = start[row];
            turning_.read(given, point, mass_, static_cast<int>(fours_.size()) - 1, fours_.back().count - 1,
                          normal);
        }
    }
    joints_.read(system, mass_);
}

/// Finds which pairs of bodies are coupled; a pattern analysed before that contains them is used again.
void ConeNewton::connect() {
    needed_.clear();
    for (const ConeUnit& unit : units_)
        if (unit.first >= 0 && unit.second >= 0) needed_.emplace_back(std::minmax(unit.first, unit.second));
    const int bodies = static_cast<int>(mass_inverse_.size());
    joints_.couple(bodies, needed_);
    std::sort(needed_.begin(), needed_.end());
    needed_.erase(std::unique(needed_.begin(), needed_.end()), needed_.end());
    // The order of elimination follows from this system alone: a run that goes back must round as it did.
    if (bodies != bodies_ || pairs_ != needed_) {
        sizes_.assign(bodies, 6);
        is_constraint_.assign(bodies, 0);
        for (int k = 0; k < joints_.nodes(); ++k)
            sizes_.push_back(joints_.size(k)), is_constraint_.push_back(1);
        edges_.clear();
        for (const auto& [a, b] : needed_) edges_.push_back({a, b});
        bodies_ = -1;  // until the analysis is whole
        matrix_.analyse(sizes_, edges_, is_constraint_);
        pairs_ = needed_;
        bodies_ = bodies;
    }
    joints_.place(bodies, pairs_);
    for (ConeUnit& unit : units_) {
        if (unit.first >= 0) unit.matrix[1][1] = matrix_.diagonal(unit.first);
        if (unit.second >= 0) unit.matrix[0][0] = matrix_.diagonal(unit.second);
        if (unit.first < 0 || unit.second < 0) continue;
        const std::pair<int, int> pair = std::minmax(unit.first, unit.second);
        const auto edge =
            static_cast<int>(std::lower_bound(pairs_.begin(), pairs_.end(), pair) - pairs_.begin());
        const bool turned = unit.first > unit.second;
        unit.matrix[1][0] = turned ? matrix_.back(edge) : matrix_.forth(edge);
        unit.matrix[0][1] = turned ? matrix_.forth(edge) : matrix_.back(edge);
    }
}

/// The square of the smoothed map a part of the way along Newton's direction and the path; past `enough` a part of it.
double ConeNewton::merit(double blur, double length, double along, double enough) const {
    const ConeAid aid{blur, hold_, frozen_};
    const double beside = joints_.merit(length, along) + turning_.merit(fours_, aid, length, along);
    if (beside > enough) return beside;
    return beside + laws_->merit(fours_, aid, length, along, enough - beside);
}

/// Newton's direction, by a factor of M + Σ Gᵀ K G.
bool ConeNewton::step(const MixedSystem& system, double blur) {
    matrix_.clear();
    for (int b = 0; b < bodies_; ++b) std::copy_n(system.mass[b].data(), 36, matrix_.diagonal(b));
    laws_->linearise(fours_, {blur, hold_, frozen_});
    laws_->add(fours_, units_);
    turning_.linearise(fours_, {blur, hold_, frozen_});
    turning_.add(fours_, units_);
    joints_.fill(bodies_, matrix_);
    ++factorisations_;
    block_operations_ += static_cast<std::uint64_t>(matrix_.operations());
    if (!matrix_.factor()) return false;
    return find_directions(blur);
}

/// to ← share × from.
void ConeNewton::scale(double share, const ConeFour::Each* from, ConeFour::Each* to) noexcept {
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < ConeFour::most; ++i) to[k][i] = share * from[k][i];
}

/// Newton's direction, and the path's for the whole blur. False if nothing finite was found.
bool ConeNewton::find_directions(double blur) {
    for (ConeFour& four : fours_) scale(-1.0, four.map, four.lack);
    joints_.ask(true);
    turning_.ask(true, blur);
    if (!answer(&ConeFour::dz, &ConeFour::du, true, refined)) return false;
    if (blur == 0.0) {  // a jump: there is no path
        for (ConeFour& four : fours_)
            for (int k = 0; k < 3; ++k) std::fill_n(four.tz[k], 4, 0.0), std::fill_n(four.tu[k], 4, 0.0);
        joints_.forget_path();
        turning_.forget_path();
        return true;
    }
    for (ConeFour& four : fours_) scale(blur, four.bend, four.lack);
    joints_.ask(false);
    turning_.ask(false, blur);
    return answer(&ConeFour::tz, &ConeFour::tu, false, roughly);
}

/// The dz and du that answer what the units' laws lack, refined while that helps and more than `enough` is left.
bool ConeNewton::answer(ConeFour::Each (ConeFour::*dz)[3], ConeFour::Each (ConeFour::*du)[3], bool newton,
                        double enough) {
    double asked = joints_.asked() + turning_.asked();
    for (const ConeFour& four : fours_)
        for (int i = 0; i < four.count; ++i) {
            const double a = four.lack[0][i], b = four.lack[1][i], c = four.lack[2][i];
            asked += a * a + b * b + c * c;
        }
    double before = asked;
    for (int round = 0; round < 3; ++round) {
        image_.assign(mass_inverse_.size() + joints_.nodes(), Vec6{});
        laws_->respond(fours_, units_, image_.data());
        turning_.respond(fours_, image_.data());
        joints_.respond(image_.data() + bodies_);
        matrix_.solve(image_[0].data());
        change_.assign(mass_inverse_.size(), Vec6{});
        laws_->turn(fours_, units_, image_.data(), change_.data());
        turning_.turn(fours_, image_.data(), change_.data());
        joints_.turn(image_.data() + bodies_, change_.data());
        laws_->map_bodies(mass_inverse_, change_.data());
        const double left = joints_.remain(change_.data()) + turning_.remain(fours_, change_.data()) +
                            laws_->remain(fours_, units_, change_.data());
        if (!std::isfinite(left)) return false;
        if (round > 0 && !(left < before)) break;
        for (ConeFour& four : fours_)
            for (int k = 0; k < four.size; ++k)
                for (int i = 0; i < ConeFour::most; ++i) {
                    double &z = (four.*dz)[k][i], &u = (four.*du)[k][i];
                    z = (round == 0 ? 0.0 : z) + four.c[k][i];
                    u = (round == 0 ? 0.0 : u) + four.turn[k][i];
                }
        joints_.take(newton, round == 0);
        turning_.take(newton, round == 0);
        if (left <= enough * asked) break;
        before = left;
    }
    return true;
}

/// M v = p + Gᵀ z, and u of every unit.
void ConeNewton::measure(const MixedSystem& system) {
    velocity_ = system.momentum;
    laws_->push(fours_, units_, velocity_.data());
    joints_.push(velocity_.data());
    turning_.push(velocity_.data());
    for (std::size_t b = 0; b < velocity_.size(); ++b) solve_six(mass_[b], velocity_[b]);
    laws_->measure(fours_, units_, velocity_.data());
    joints_.measure(velocity_.data());
    turning_.measure(velocity_.data());
}

ConeNewton::Left ConeNewton::worst() const {
    Left left = turning_.worst(fours_, frozen_);
    const auto add = [&left](double map, double speed) {  // not a number stays
        if (left.map <= map || std::isnan(map)) left.map = map;
        if (left.speed <= speed || std::isnan(speed)) left.speed = speed;
    };
    const Left laws = laws_->worst(fours_, frozen_);
    const BilateralRows::Left joints = joints_.worst();
    add(laws.map, laws.speed), add(joints.map, joints.speed);
    return left;
}

/// What is lost of a speed beside the largest impulse: bodies squeezed without a way out push ever harder.
double ConeNewton::rounding() const {
    double largest = 0.0;
    for (const ConeFour& four : fours_)
        for (int i = 0; i < four.count; ++i)
            largest = std::max(largest, std::abs(four.z[0][i]) / (four.root[i] * four.root[i]));
    return 1e-16 * largest;
}

/// The speeds there are without contacts, and those that rows ask for.
double ConeNewton::speed_of(const MixedSystem& system) const {
    double speed = std::max(joints_.largest_right(), turning_.largest_right());
    for (std::size_t b = 0; b < system.momentum.size(); ++b) {
        Vec6 v = system.momentum[b];
        solve_six(mass_[b], v);
        for (int a = 0; a < 3; ++a) speed = std::max(speed, std::abs(v[a]));
    }
    for (const ConeFour& four : fours_)
        for (int k = 0; k < four.size; ++k)
            for (int i = 0; i < four.count; ++i) speed = std::max(speed, std::abs(four.right[k][i]));
    return speed;
}

/// The next point: on along the path as far as it stays near, else towards it.
ConeNewton::Search ConeNewton::search(double blur) const {
    const double wide = near_ * near_ * static_cast<double>(units_.size() + joints_.rows() + turning_.rows());
    for (const double share : {1e-3, 1e-2, 0.1, 0.3, 0.6, 0.9}) {
        const double next = share * blur, room = wide * next * next;
        if (merit(next, 1.0, 1.0 - share, room) <= room) return {next, 1.0, 1.0 - share};
    }
    const double before = merit(blur, 0.0, 0.0, unbounded);
    double length = 1.0, least = before;
    Search found{blur, 0.0, 0.0};
    for (int halving = 0; halving < 8; ++halving, length *= 0.5) {
        const double now = merit(blur, length, 0.0, before);
        if (now < least) least = now, found.length = length;
        if (now <= (1.0 - 2e-4 * length) * before) break;
    }
    return found;
}

/// Takes down where the units stand: they are held there.
void ConeNewton::hold() {
    for (ConeFour& four : fours_)
        for (int i = 0; i < ConeFour::most; ++i) {
            four.held[0][i] = four.z[0][i] * four.over[i];
            four.held[1][i] = four.z[1][i] * four.along[i];
            four.held[2][i] = four.z[2][i] * four.along[i];
            four.load[i] = std::abs(four.held[0][i]);
        }
    turning_.hold(fours_);
}

void ConeNewton::move(const MixedSystem& system, const Search& found) {
    if (!(found.length > 0.0)) return;
    for (ConeFour& four : fours_)
        for (int k = 0; k < four.size; ++k)
            for (int i = 0; i < ConeFour::most; ++i)
                four.z[k][i] += found.length * four.dz[k][i] + found.along * four.tz[k][i];
    joints_.move(found.length, found.along);
    turning_.move(found.length, found.along);
    measure(system);
}

double ConeNewton::relative(double speed) const noexcept { return speed_ > 0.0 ? speed / speed_ : speed; }

/// m/s; none of a start that is an answer already.
double ConeNewton::goal_from(const Left& start) const noexcept {
    return start.speed > known * speed_ ? tightest * speed_ : unbounded;
}

/// Iterations without a gain after which the path is lost: far from its end it may crawl.
int ConeNewton::patience(const Left& best) const noexcept {
    return best.speed > far * speed_ ? long_patience : backoff;
}

/// Of the speeds in the system: the longer nothing better is found, the less is asked.
double ConeNewton::asked_after(int stalled) noexcept {
    double enough = 1e-12;
    for (int k = 0; k < stalled && enough < loosest; ++k) enough *= 10.0;
    return std::min(loosest, enough);
}

/// Far behind the blur what is held back is all that is left.
void ConeNewton::let_go_behind(const Left& left, const Left& before, double blur) noexcept {
    if (left.map > behind * blur && left.map > slow * before.map)
        hold_ = std::max(0.1 * hold_, tightest_hold);
}

void ConeNewton::keep_met() {
    for (ConeFour& four : fours_) scale(1.0, four.z, four.met);
    joints_.keep_met();
    turning_.keep_met();
}

/// Where the path is begun again, which was met last at the blur `met`: the blur, further from the end.
double ConeNewton::back_from(double met, double blur, const MixedSystem& system) {
    if (!(met > 0.0)) return back * blur;
    near_ *= nearer;
    for (ConeFour& four : fours_) scale(1.0, four.met, four.z);
    joints_.back_to_met();
    turning_.back_to_met();
    measure(system);
    return back * met;
}

void ConeNewton::take_best(MixedSystem& system) {
    for (std::size_t k = 0; k < fours_.size(); ++k) {
        ConeFour& four = fours_[k];
        scale(1.0, best_[k].z, four.z);
        scale(1.0, best_[k].u, four.u);
        for (int i = 0; i < four.count; ++i) {
            four.finish(i);
            const ConeUnit& unit = units_[four.begin + i];
            for (int row = 0; row < unit.size; ++row)
                system.rows[unit.block].multiplier[unit.row + row] = four.z[row][i];
        }
    }
    joints_.deliver(system);
    turning_.deliver(system);
    measure(system);  // what is handed over, not what led to it
    system.velocity = velocity_;
}

ConeReport ConeNewton::solve(MixedSystem& system, const std::vector<FrictionPoint>& points) {
    ConeReport report;
    prepare(system, points);
    connect();
    speed_ = speed_of(system);
    measure(system);
    Left best = worst();
    keep();
    double blur = start_blur * best.map, met = -1.0;  // the blur where the path was met last
    int stalled = 0, jumps = -1, losses = 0;          // jumps made, negative on the path; times it was lost
    double least = unbounded;                         // residual of this row of jumps, m/s
    near_ = tolerances::cone_newton::nearest, hold_ = loosest_hold;
    Left before = best;
    const double goal = goal_from(best);
    while (best.speed > goal && report.iterations < max_iterations && losses < max_losses) {
        if (stalled > 0 && best.speed <= asked_after(stalled) * speed_) break;
        Watch::look();
        hold();
        if (!step(system, blur)) break;
        ++report.iterations;
        const Search found = jumps >= 0 ? Search{0.0, 1.0, 0.0} : search(blur);
        move(system, found);
        const Left left = worst();
        stalled = left.speed < 0.5 * best.speed || found.along > 0.3 ? 0 : stalled + 1;
        if (left.speed < best.speed) best = left, keep();
        let_go_behind(left, before, found.blur);
        before = left;
        if (found.along > 0.0) met = found.blur, keep_met();
        blur = found.blur;
        const bool lost = stalled >= patience(best) || found.length < narrow;
        if (lost && best.speed <= near_enough * speed_) break;
        if (jumps < 0 && !lost) continue;
        if (jumps < 0 && met > 0.0) {
            jumps = 0, blur = 0.0;
            least = unbounded;
            continue;
        }
        if (jumps >= 0) {
            if (left.speed < 0.5 * least) jumps = -1;
            least = std::min(least, left.speed);
            if (++jumps < max_jumps) continue;
        }
        if (best.speed <= near_enough * speed_) break;
        // Begin anew, further from the end and more carefully.
        jumps = -1, stalled = 0, hold_ = loosest_hold, ++losses;
        blur = back_from(met, blur, system);
    }
    if (max_frozen > 0 && !(best.speed <= near_enough * speed_)) best = follow_frozen(system, report, best);
    take_best(system);
    report.residual = relative(std::max(worst().speed, rounding()));
    report.converged = report.residual <= loosest;
    return report;
}

void ConeNewton::back_to_best(const MixedSystem& system) {
    for (std::size_t k = 0; k < fours_.size(); ++k) scale(1.0, best_[k].z, fours_[k].z);
    joints_.back_to_best();
    turning_.back_to_best();
    measure(system);
}

/// Where the path ends for Coulomb's law, which may have several answers, De Saxcé's term is frozen: what is left is convex
/// and has one path. Its end gives the next term; a fixed point is an answer. Between, a few of Newton's steps on the law
/// itself, which finish.
ConeNewton::Left ConeNewton::follow_frozen(MixedSystem& system, ConeReport& report, Left best) {
    back_to_best(system);
    for (int outer = 0; outer < max_frozen && !(best.speed <= near_enough * speed_); ++outer) {
        Watch::look();
        for (ConeFour& four : fours_)
            for (int i = 0; i < ConeFour::most; ++i)
                four.slide[i] = four.size < 3
                                    ? 0.0
                                    : four.root[i] * four.friction[i] * length(four.u[1][i], four.u[2][i]);
        turning_.freeze();
        const double off = worst().map, met = best.speed;  // of the law itself
        for (const bool frozen : {true, false}) {
            frozen_ = frozen;
            hold_ = loosest_hold;
            double blur = (frozen ? start_blur : 1e-3 * start_blur) * std::max(worst().map, off);
            const double goal = frozen ? 1e-3 * off : tightest;
            Left before = worst();
            for (int k = 0; k < (frozen ? 15 : 6) && before.map > goal; ++k) {
                hold();
                if (!step(system, blur)) break;
                ++report.iterations;
                const Search found = search(blur);
                if (!(found.length > 0.0)) break;
                move(system, found);
                const Left left = worst();
                let_go_behind(left, before, found.blur);
                // A short step tries too much at once: units are held harder, and let go again.
                if (found.length < brief) hold_ = std::min(10.0 * hold_, hardest_hold);
                else hold_ = std::max(0.1 * hold_, std::min(hold_, loosest_hold));
                before = left;
                blur = found.blur;
                if (!frozen && left.speed < best.speed) best = left, keep();
            }
            frozen_ = false;
            const Left left = worst();
            if (left.speed < best.speed) best = left, keep();
            if (!frozen && !(left.map < off)) {
                back_to_best(system);
            }
        }
        if (!(best.speed < 0.5 * met)) break;
    }
    return best;
}

void ConeNewton::keep() {
    joints_.keep_best();
    turning_.keep_best();
    best_.resize(fours_.size());
    for (std::size_t k = 0; k < fours_.size(); ++k) {
        scale(1.0, fours_[k].z, best_[k].z);
        scale(1.0, fours_[k].u, best_[k].u);
    }
}

}  // namespace spook
