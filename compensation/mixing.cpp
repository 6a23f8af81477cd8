#include "compensation/mixing.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::compensation {
namespace {

constexpr Real kLargestDemand = Real(1e9);  // N, N m: beyond it the arithmetic could overflow
// A layout and its torques could overflow or vanish, too.
constexpr Real kLargestDragScale = Real(1e6), kSmallestDragScale = Real(1e-6);
constexpr Real kSmallestTorque = Real(1e-9);  // N m per N
constexpr bool kDouble = sizeof(Real) == sizeof(double);
constexpr int kTorqueIterations = 10;
constexpr int kSearches = 4;
constexpr int kHalvings = 20;
constexpr Real kYawTolerance = kDouble ? Real(1e-13) : Real(1e-5);
constexpr Real kTorqueTolerance = kDouble ? Real(1e-9) : Real(1e-5);
/// Shares of a vehicle's sizes below which its rotors count as unable to make a torque.
constexpr Real kFlat = Real(1e-6);
/// How far, relative to what the rotors can give, a demand may be missed that is only rounding.
constexpr Real kRounding = kDouble ? Real(1e-9) : Real(1e-4);

/// f = from + distance along.
Row moved(const Row& from, Real distance, const Row& along) noexcept {
  Row result = from;
  for (std::size_t i = 0; i < result.size(); ++i) result[i] += distance * along[i];
  return result;
}

bool usable(const RotorLayout& layout, const Row& drag_scale) noexcept {
  const std::size_t count = layout.hubs.size();
  if (count < kFewestRotors || layout.spins.size() != count || drag_scale.size() != count) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const Real x = layout.hubs[i].x.value(), y = layout.hubs[i].y.value();
    if (!(std::fabs(x) < Real(1e6)) || !(std::fabs(y) < Real(1e6))) return false;
    if (layout.spins[i] != 1 && layout.spins[i] != -1) return false;
    if (!(drag_scale[i] > kSmallestDragScale) || !(drag_scale[i] < kLargestDragScale)) return false;
  }
  return true;
}

Real within_reason(Real demand, bool& odd) noexcept {
  odd = odd || std::isnan(demand);
  return std::isnan(demand) ? Real(0) : std::min(std::max(demand, -kLargestDemand), kLargestDemand);
}

WithinLimits::Limits within_reason(const ThrustLimits& limits, std::size_t count, bool& odd) noexcept {
  WithinLimits::Limits result{Row(count), Row(count)};
  for (std::size_t i = 0; i < count; ++i) {
    const Real low = i < limits.smallest.size() ? limits.smallest[i].value() : Real(0);
    const Real high = i < limits.largest.size() ? limits.largest[i].value() : Real(0);
    odd = odd || !(low <= high);
    result.low[i] = low > 0 ? std::min(low, kLargestDemand) : Real(0);
    result.high[i] = high > result.low[i] ? std::min(high, kLargestDemand) : result.low[i];
  }
  return result;
}

bool within(const Row& thrusts, const WithinLimits::Limits& limits) noexcept {
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

Row negative(Row row) noexcept {
  for (Real& value : row) value = -value;
  return row;
}

}  // namespace

std::optional<Mixer> Mixer::build(const RotorLayout& layout, DragTorque drag) noexcept {
  const Real per_newton = drag.per_newton.value();
  if (!(per_newton > kSmallestTorque) || !(per_newton < Real(1e6)) ||
      !(std::fabs(drag.per_square_newton) < Real(1e6))) {
    return std::nullopt;
  }
  Mixer mixer(drag);
  if (!mixer.set_layout(layout)) return std::nullopt;
  return mixer;
}

bool Mixer::set_layout(const RotorLayout& layout, const Rotors<Real>& drag_scale) noexcept {
  const std::size_t count = layout.hubs.size();
  Mixer next(drag_);
  next.drag_scale_ = drag_scale.size() == 0 ? Row(count, 1) : drag_scale;
  if (!usable(layout, next.drag_scale_)) return false;
  next.x_ = next.y_ = next.spins_ = Row(count);
  const Real share = 1 / static_cast<Real>(count);
  Real mean_x = 0, mean_y = 0;
  for (std::size_t i = 0; i < count; ++i) {
    next.x_[i] = layout.hubs[i].x.value();
    next.y_[i] = layout.hubs[i].y.value();
    next.spins_[i] = static_cast<Real>(layout.spins[i]);
    mean_x += next.x_[i] * share;
    mean_y += next.y_[i] * share;
  }
  Row x = next.x_, y = next.y_;  // about their mean
  Real reach = 0, xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < count; ++i) {
    x[i] -= mean_x;
    y[i] -= mean_y;
    xx += x[i] * x[i];
    xy += x[i] * y[i];
    yy += y[i] * y[i];
    reach = std::max({reach, std::fabs(x[i]), std::fabs(y[i])});
  }
  const Real determinant = xx * yy - xy * xy;
  if (!(determinant > kFlat * reach * reach * reach * reach)) return false;
  // The least squares of all thrusts that make a roll about the mean are along y and x, the thrust is 1/n of each.
  next.per_thrust_ = next.per_roll_ = next.per_pitch_ = Row(count);
  for (std::size_t i = 0; i < count; ++i) {
    next.per_roll_[i] = (xx * y[i] - xy * x[i]) / determinant;
    next.per_pitch_[i] = (xy * y[i] - yy * x[i]) / determinant;
    next.per_thrust_[i] = share - mean_y * next.per_roll_[i] + mean_x * next.per_pitch_[i];
  }
  next.arms_ = next.yaw_arms(Row(count));
  next.free_ = next.torque_free(next.arms_);
  const Real square = dot(next.free_, next.free_);
  next.yaws_ = count > kFewestRotors;
  if (next.yaws_ && !(square > kFlat * kFlat * dot(next.arms_, next.arms_))) return false;
  *this = next;
  return true;
}

Row Mixer::yaw_arms(const Row& thrusts) const noexcept {
  const Real per_newton = drag_.per_newton.value();
  Row arms(rotors());
  for (std::size_t i = 0; i < rotors(); ++i) {
    const Real uncovered = drag_scale_[i] * std::max(thrusts[i], Real(0));
    const Real torque = per_newton + drag_.per_square_newton * uncovered;
    arms[i] = spins_[i] * drag_scale_[i] * std::min(std::max(torque, per_newton / 2), 2 * per_newton);
  }
  return arms;
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

void Mixer::add_yaw(Row& thrusts, Real yaw, Row& arms) const noexcept {
  const auto give = [&](const Row& free) { return moved(thrusts, (yaw - dot(arms, thrusts)) / dot(free, free), free); };
  Row given = give(free_);
  for (int i = 0; i < kTorqueIterations && std::fabs(drag_.per_square_newton) > 0; ++i) {
    arms = yaw_arms(given);
    const Row free = torque_free(arms);
    if (std::fabs(dot(arms, given) - yaw) <= kYawTolerance * dot(free, free)) break;
    given = give(free);
  }
  thrusts = given;
}

Row Mixer::give_up(const Row& wanted, const Asked& asked, const WithinLimits::Limits& held, Real assured,
                   int& steps) const noexcept {
  const Range promised = yaw_from(0, asked.yaw), kept = yaw_from(assured, asked.yaw);
  const auto search_with = [&](const Row& arms) {
    WithinLimits search(held, wanted);
    if (yaws_) search.reach(arms, promised, WithinLimits::Keep::within);
    search.reach(y_, negative(x_), asked.roll, asked.pitch);
    if (yaws_) search.reach(arms, kept, WithinLimits::Keep::within);
    search.reach(Row(rotors(), 1), {asked.thrust, asked.thrust});
    if (yaws_) search.reach(arms, {asked.yaw, asked.yaw}, WithinLimits::Keep::within);
    steps += search.steps();
    return search.thrusts();
  };
  Row arms = yaw_arms(wanted), given = search_with(arms);
  if (!yaws_ || !(std::fabs(drag_.per_square_newton) > 0)) return given;
  // What yaw is out of its promise by, with the torque of these thrusts.
  const auto out_by = [&](const Row& thrusts) {
    const Real yaw = dot(yaw_arms(thrusts), thrusts);
    return std::fabs(yaw - std::min(std::max(yaw, promised.low), promised.high));
  };
  Row safe = held.low;
  for (int i = 1; i < kSearches; ++i) {
    const Row next = yaw_arms(given);
    if (std::fabs(dot(next, given) - dot(arms, given)) <= kTorqueTolerance * size_of(arms) * size_of(given)) break;
    if (!(out_by(given) > 0)) safe = given;
    arms = next;
    given = search_with(arms);
  }
  // It may go to and fro between two sets of limits, or end a little outside. Then towards what keeps the promise.
  if (!(out_by(given) > 0)) return given;
  Real good = 1, bad = 0;
  const auto between = [&](Real share) { return moved(moved(given, -share, given), share, safe); };
  for (int i = 0; i < kHalvings; ++i) {
    const Real middle = (good + bad) / 2;
    (out_by(between(middle)) > 0 ? bad : good) = middle;
  }
  return between(good);
}

MixedThrusts Mixer::mix(const Wrench& demand, const ThrustLimits& limits, NewtonMetres assured_yaw) const noexcept {
  bool odd = false;
  const Real thrust = within_reason(demand.thrust.value(), odd), roll = within_reason(demand.roll.value(), odd),
             pitch = within_reason(demand.pitch.value(), odd), yaw = within_reason(demand.yaw.value(), odd);
  const WithinLimits::Limits held = within_reason(limits, rotors(), odd);

  Row wanted(rotors());
  for (std::size_t i = 0; i < rotors(); ++i) {
    wanted[i] = thrust * per_thrust_[i] + roll * per_roll_[i] + pitch * per_pitch_[i];
  }
  Row arms = arms_;
  if (yaws_) add_yaw(wanted, yaw, arms);

  MixedThrusts mixed;
  if (!within(wanted, held))
    wanted = give_up(wanted, {thrust, roll, pitch, yaw}, held, assured_yaw.value(), mixed.steps);
  mixed.thrusts = Rotors<Newtons>(rotors());
  Real most = 1;
  for (std::size_t i = 0; i < rotors(); ++i) {
    mixed.thrusts[i] = Newtons(wanted[i]);
    most = std::max(most, std::fabs(wanted[i]));
  }
  mixed.achieved = wrench_of(mixed.thrusts);
  const auto missed = [&](Real got, Real asked, Real arm) { return std::fabs(got - asked) > kRounding * most * arm; };
  const Real arm = std::max(size_of(x_), size_of(y_));
  mixed.concessions = Concessions()
                          .with(Concession::demand_nan, odd)
                          .with(Concession::thrust, missed(mixed.achieved.thrust.value(), thrust, 1))
                          .with(Concession::roll_pitch, missed(mixed.achieved.roll.value(), roll, arm) ||
                                                            missed(mixed.achieved.pitch.value(), pitch, arm))
                          .with(Concession::yaw, missed(mixed.achieved.yaw.value(), yaw, size_of(arms)));
  return mixed;
}

Wrench Mixer::wrench_of(const Rotors<Newtons>& thrusts) const noexcept {
  Row f(rotors());
  Real sum = 0;
  for (std::size_t i = 0; i < rotors(); ++i) sum += f[i] = i < thrusts.size() ? thrusts[i].value() : Real(0);
  return {Newtons(sum), NewtonMetres(dot(y_, f)), NewtonMetres(-dot(x_, f)), NewtonMetres(dot(yaw_arms(f), f))};
}

}  // namespace kphi::compensation
