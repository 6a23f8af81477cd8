#include "compensation/mixing.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {
namespace {

constexpr Real kLargestDemand = Real(1e9);  // N, N m: beyond it the arithmetic could overflow
// A layout and its torques could overflow or vanish, too.
constexpr Real kLargestDragScale = Real(1e6), kSmallestDragScale = Real(1e-6);
constexpr Real kSmallestTorque = Real(1e-9);  // N m per N
constexpr bool kDouble = sizeof(Real) == sizeof(double);
constexpr int kTorqueIterations = kDouble ? 8 : 5;
constexpr int kSearches = 2;
constexpr int kCorrections = 6;
constexpr Real kYawTolerance = kDouble ? Real(1e-13) : Real(1e-5);
/// Shares of a vehicle's sizes below which its rotors count as unable to make a torque.
constexpr Real kFlat = Real(1e-6);
/// How far, relative to what the rotors can give, a demand may be missed that is only rounding.
constexpr Real kRounding = kDouble ? Real(1e-9) : Real(1e-4);

bool usable(const RotorLayout& layout, const Rotors<Real>& drag_scale) noexcept {
  const std::size_t count = layout.hubs.size();
  if (count < kFewestRotors || layout.spins.size() != count) return false;
  if (drag_scale.size() != 0 && drag_scale.size() != count) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const Real x = layout.hubs[i].x.value(), y = layout.hubs[i].y.value();
    if (!(std::fabs(x) < Real(1e6)) || !(std::fabs(y) < Real(1e6))) return false;
    if (layout.spins[i] != 1 && layout.spins[i] != -1) return false;
    const Real scale = drag_scale.size() == 0 ? Real(1) : drag_scale[i];
    if (!(scale > kSmallestDragScale) || !(scale < kLargestDragScale)) return false;
  }
  return true;
}

Real within_reason(Real demand, bool& odd) noexcept {
  if (demand >= -kLargestDemand && demand <= kLargestDemand) return demand;
  odd = odd || is_nan(demand);
  return demand > 0 ? kLargestDemand : demand < 0 ? -kLargestDemand : Real(0);
}

void within_reason(std::size_t i, Real low, Real high, WithinLimits::Limits& held, bool& odd) noexcept {
  odd = odd || is_nan(low) || is_nan(high) || low > high;
  held.low[i] = low > 0 ? std::min(low, kLargestDemand) : Real(0);
  held.high[i] = high > held.low[i] ? std::min(high, kLargestDemand) : held.low[i];
}

[[gnu::noinline]] bool within(const Row& thrusts, const WithinLimits::Limits& limits) noexcept {
  for (std::size_t i = 0; i < thrusts.size(); ++i) {
    if (!(thrusts[i] >= limits.low[i] && thrusts[i] <= limits.high[i])) return false;
  }
  return true;
}

/// From what is assured of a yaw to all of it.
Range yaw_from(Real assured, Real yaw) noexcept {
  const Real least = std::min(assured > 0 ? assured : Real(0), std::fabs(yaw));
  return yaw > 0 ? Range{least, yaw} : Range{yaw, -least};
}

/// The largest.
Real size_of(const Row& row) noexcept {
  Real most = 0;
  for (const Real value : row) most = std::max(most, std::fabs(value));
  return most;
}

/// Limits far beyond anything that matters would hide in their rounding what does.
void keep_in_reach(WithinLimits::Limits& limits, const Row& wanted) noexcept {
  constexpr Real kFar = kDouble ? Real(1e3) : Real(1e2);
  const Real most = kFar * std::max(size_of(wanted), size_of(limits.low));
  for (std::size_t i = 0; i < wanted.size(); ++i)
    limits.high[i] = std::max(std::min(limits.high[i], most), limits.low[i]);
}

}  // namespace

std::optional<Mixer> Mixer::build(const RotorLayout& layout, DragTorque drag) noexcept {
  std::optional<Mixer> mixer;
  if (!mixer.emplace().rebuild(layout, drag)) mixer.reset();
  return mixer;
}

bool Mixer::rebuild(const RotorLayout& layout, DragTorque drag) noexcept {
  const Real per_newton = drag.per_newton.value();
  if (!(per_newton > kSmallestTorque) || !(per_newton < Real(1e6)) ||
      !(std::fabs(drag.per_square_newton) < Real(1e6))) {
    return false;
  }
  return set(layout, {}, drag);
}

bool Mixer::set_layout(const RotorLayout& layout, const Rotors<Real>& drag_scale) noexcept {
  return set(layout, drag_scale, drag_);
}

bool Mixer::set(const RotorLayout& layout, const Rotors<Real>& drag_scale, DragTorque drag) noexcept {
  const std::size_t count = layout.hubs.size();
  if (!usable(layout, drag_scale)) return false;
  Mixer next(count, drag);
  const Real share = 1 / static_cast<Real>(count);
  Real mean_x = 0, mean_y = 0;
  for (std::size_t i = 0; i < count; ++i) {
    next.x_[i] = layout.hubs[i].x.value();
    next.y_[i] = layout.hubs[i].y.value();
    next.drag_scale_[i] = drag_scale.size() == 0 ? Real(1) : drag_scale[i];
    next.spins_[i] = static_cast<Real>(layout.spins[i]);
    next.reach_ = std::max(next.reach_, std::max(std::fabs(next.x_[i]), std::fabs(next.y_[i])));
    mean_x += next.x_[i] * share;
    mean_y += next.y_[i] * share;
  }
  Real xx = 0, xy = 0, yy = 0;  // about their mean
  for (std::size_t i = 0; i < count; ++i) {
    const Real x = next.x_[i] - mean_x, y = next.y_[i] - mean_y;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  const Real determinant = xx * yy - xy * xy, spread = (xx + yy) / 8;  // where four are far away, the square of how far
  if (!(determinant > kFlat * spread * spread)) return false;
  // The least squares of all thrusts that make a roll about the mean are along y and x, the thrust is 1/n of each.
  for (std::size_t i = 0; i < count; ++i) {
    const Real x = next.x_[i] - mean_x, y = next.y_[i] - mean_y;
    next.per_roll_[i] = (xx * y - xy * x) / determinant;
    next.per_pitch_[i] = (xy * y - yy * x) / determinant;
    next.per_thrust_[i] = share - mean_y * next.per_roll_[i] + mean_x * next.per_pitch_[i];
    next.arms_[i] = next.spins_[i] * next.drag_scale_[i] * drag.per_newton.value();
  }
  next.free_ = next.torque_free(next.arms_);
  next.arm_ = size_of(next.arms_);
  const Real square = dot(next.free_, next.free_);
  if (next.yaws_ && !(square > kFlat * kFlat * dot(next.arms_, next.arms_))) return false;
  *this = next;
  return true;
}

Real Mixer::yaw_of(const Row& thrusts, Row& slopes) const noexcept {
  const Real per_newton = drag_.per_newton.value(), most = 2 * per_newton, least = per_newton / 2;
  Real yaw = 0;
  for (std::size_t i = 0; i < rotors(); ++i) {
    const Real bend = drag_.per_square_newton * drag_scale_[i] * std::max(thrusts[i], Real(0));
    const Real torque = per_newton + bend, held = std::min(std::max(torque, least), most);
    const Real arm = spins_[i] * drag_scale_[i];
    yaw += arm * held * thrusts[i];
    slopes[i] = arm * (torque < least || torque > most ? held : torque + bend);
  }
  return yaw;
}

Row Mixer::torque_free(const Row& arms) const noexcept {
  Real thrust = 0;
  const Real roll = dot(y_, arms), pitch = -dot(x_, arms);
  for (const Real arm : arms) thrust += arm;
  Row rest = arms;
  for (std::size_t i = 0; i < rotors(); ++i) {
    rest[i] -= thrust * per_thrust_[i] + roll * per_roll_[i] + pitch * per_pitch_[i];
  }
  return rest;
}

void Mixer::add_yaw(Row& thrusts, Real yaw, const WithinLimits::Limits& limits) const noexcept {
  const Row without = thrusts;
  Row along = free_, slopes = arms_;
  Real share = (yaw - dot(arms_, without)) / dot(along, along);
  for (int i = 0; i < kTorqueIterations; ++i) {
    for (std::size_t j = 0; j < rotors(); ++j) thrusts[j] = without[j] + share * along[j];
    if (!bends() || (i > 1 && !within(thrusts, limits))) return;  // beyond the limits it is to be searched for
    const Real off = yaw - yaw_of(thrusts, slopes);
    // Four rotors have one direction for it, more of them that of the slopes which they have about there.
    if (i == 0 && rotors() > 4) along = torque_free(slopes);
    const Real steep = dot(slopes, along);
    if ((i > 0 && std::fabs(off) <= kYawTolerance * std::fabs(steep)) || !(std::fabs(steep) > 0)) return;
    share += off / steep;
  }
}

void Mixer::search_yaw_and_thrust(WithinLimits& search, const Real (&asked)[4], Real assured,
                                  Row& thrusts) const noexcept {
  const Range kept = yaw_from(assured, asked[3]);
  const int searches = bends() ? kSearches : 1;
  Row slopes(rotors());
  for (int i = 0; i < searches; ++i) {
    search.thrusts(thrusts);
    const Real now = yaw_of(thrusts, slopes);
    search.set_yaw(slopes, now);
    search.reach(WithinLimits::Goal::yaw, kept);
    search.reach(WithinLimits::Goal::thrust, {asked[0], asked[0]});
    search.reach(WithinLimits::Goal::yaw, {asked[3], asked[3]});
    if (i == 0) search.ease();
    for (int j = 0; bends() && j < (i + 1 < searches ? 1 : kCorrections); ++j) {
      search.thrusts(thrusts);
      if (!search.correct_yaw(search.yaw() - yaw_of(thrusts, slopes))) break;
    }
  }
}

void Mixer::give_up(Row& thrusts, const Real (&asked)[4], WithinLimits::Limits& held, Real assured,
                    MixedThrusts& mixed) const noexcept {
  keep_in_reach(held, thrusts);
  WithinLimits search(held, thrusts, x_, y_, {reach_, yaws_ ? arm_ : Real(0)});
  search.reach_roll_pitch(asked[1], asked[2]);
  if (yaws_) {
    search_yaw_and_thrust(search, asked, assured, thrusts);
  } else {
    search.reach(WithinLimits::Goal::thrust, {asked[0], asked[0]});
  }
  mixed.steps = search.steps();
  mixed.concessions = mixed.concessions.with(Concession::unfinished, search.cut_short());
  search.thrusts(thrusts);
}

MixedThrusts Mixer::mix(const Wrench& demand, const ThrustLimits& limits, NewtonMetres assured_yaw) const noexcept {
  Real smallest[kMostRotors], largest[kMostRotors];
  for (std::size_t i = 0; i < rotors(); ++i) {
    smallest[i] = i < limits.smallest.size() ? limits.smallest[i].value() : Real(0);
    largest[i] = i < limits.largest.size() ? limits.largest[i].value() : Real(0);
  }
  return mix(demand, smallest, largest, assured_yaw);
}

MixedThrusts Mixer::mix(const Wrench& demand, const Real* smallest, const Real* largest,
                        NewtonMetres assured_yaw) const noexcept {
  bool odd = false;
  WithinLimits::Limits held{Row(rotors()), Row(rotors())};
  for (std::size_t i = 0; i < rotors(); ++i) within_reason(i, smallest[i], largest[i], held, odd);
  Real asked[] = {demand.thrust.value(), demand.roll.value(), demand.pitch.value(), demand.yaw.value()};
  for (Real& one : asked) one = within_reason(one, odd);

  Row wanted(rotors());
  for (std::size_t i = 0; i < rotors(); ++i) {
    wanted[i] = asked[0] * per_thrust_[i] + asked[1] * per_roll_[i] + asked[2] * per_pitch_[i];
  }
  if (yaws_) add_yaw(wanted, asked[3], held);

  MixedThrusts mixed;
  if (!within(wanted, held)) give_up(wanted, asked, held, assured_yaw.value(), mixed);
  mixed.thrusts.resize(rotors());
  for (std::size_t i = 0; i < rotors(); ++i) mixed.thrusts[i] = Newtons(wanted[i]);
  const Real rounding = kRounding * std::max(size_of(wanted), Real(1));
  const Wrench& got = mixed.achieved = wrench_of(wanted);
  const Real off[] = {got.thrust.value(), got.roll.value(), got.pitch.value(), got.yaw.value()};
  const Real arms[] = {1, reach_, reach_, arm_};
  constexpr Concession kOf[] = {Concession::thrust, Concession::roll_pitch, Concession::roll_pitch, Concession::yaw};
  for (std::size_t i = 0; i < 4; ++i) {
    if (std::fabs(off[i] - asked[i]) > rounding * arms[i]) mixed.concessions = mixed.concessions.with(kOf[i], true);
  }
  if (odd) mixed.concessions = mixed.concessions.with(Concession::demand_nan, true);
  return mixed;
}

Wrench Mixer::wrench_of(const Rotors<Newtons>& thrusts) const noexcept {
  Row f(rotors());
  for (std::size_t i = 0; i < rotors(); ++i) f[i] = i < thrusts.size() ? thrusts[i].value() : Real(0);
  return wrench_of(f);
}

Wrench Mixer::wrench_of(const Row& thrusts) const noexcept {
  Row slopes(rotors());
  Real sum = 0, roll = 0, pitch = 0;
  for (std::size_t i = 0; i < rotors(); ++i) {
    sum += thrusts[i];
    roll += y_[i] * thrusts[i];
    pitch -= x_[i] * thrusts[i];
  }
  return {Newtons(sum), NewtonMetres(roll), NewtonMetres(pitch), NewtonMetres(yaw_of(thrusts, slopes))};
}

namespace {

/// Of the first `size` of these columns, with the rows from `row` on.
Real determinant(const Real (*columns[4])[4], std::size_t row, std::size_t size) noexcept {
  if (size == 1) return (*columns[0])[row];
  Real sum = 0;
  for (std::size_t k = 0; k < size; ++k) {
    const Real(*others[4])[4];
    for (std::size_t i = 0, to = 0; i < size; ++i) {
      if (i != k) others[to++] = columns[i];
    }
    const Real part = (*columns[k])[row] * determinant(others, row + 1, size - 1);
    sum += k % 2 == 0 ? part : -part;
  }
  return sum;
}

}  // namespace

Real condition_of(const RotorLayout& layout, const Rotors<Real>& drag_scale) noexcept {
  constexpr Real kNoise = Real(1e-7);
  const std::size_t count = layout.hubs.size();
  Real columns[kMostRotors][4], reach = 0, arm = 0, least = 1;
  for (std::size_t i = 0; i < count; ++i) {
    reach = std::max({reach, std::fabs(layout.hubs[i].x.value()), std::fabs(layout.hubs[i].y.value())});
    arm = std::max(arm, i < drag_scale.size() ? drag_scale[i] : Real(1));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Real scale = i < drag_scale.size() ? drag_scale[i] : Real(1);
    columns[i][0] = static_cast<Real>(layout.spins[i]) * scale / arm;
    columns[i][1] = layout.hubs[i].y.value() / reach;
    columns[i][2] = -layout.hubs[i].x.value() / reach;
    columns[i][3] = 1;
  }
  // Every choice of rotors is a number with a bit for each.
  for (unsigned chosen = 1; chosen < 1u << count; ++chosen) {
    const Real(*some[4])[4];
    std::size_t size = 0;
    for (std::size_t i = 0; i < count && size <= 4; ++i) {
      if ((chosen >> i & 1u) == 0) continue;
      if (size < 4) some[size] = &columns[i];
      ++size;
    }
    if (size < 2 || size > 4) continue;
    // Two by roll and pitch, three by these and yaw or thrust, four by all.
    for (std::size_t row = size == 3 || size == 4 ? 0 : 1; row + size <= 4 && row < 2; ++row) {
      const Real size_of_it = std::fabs(determinant(some, row, size));
      if (size_of_it > kNoise) least = std::min(least, size_of_it);
    }
  }
  return 1 / least;
}

}  // namespace kphi::compensation
