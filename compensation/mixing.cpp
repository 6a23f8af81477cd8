#include "compensation/mixing.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::compensation {
namespace {

using Four = std::array<double, 4>;

constexpr double kLargestDemand = 1e9;     // N, N m: beyond it the arithmetic could overflow
constexpr double kLargestDragScale = 1e6;  // and a layout could, too
constexpr int kTorqueIterations = 10;
constexpr double kYawTolerance = 1e-13;

double dot(const Four& a, const Four& b) noexcept { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }

Four moved(const Four& from, double distance, const Four& along) noexcept {
  Four result = from;
  for (std::size_t i = 0; i < 4; ++i) result[i] += distance * along[i];
  return result;
}

/// Twice the signed area of the triangle of three hubs.
double area(const Four& x, const Four& y, std::size_t a, std::size_t b, std::size_t c) noexcept {
  return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a]);
}

struct Range {
  double low;
  double high;
};

struct Limits {
  Four low;
  Four high;
};

bool usable(const RotorLayout& layout, const Four& drag_scale) noexcept {
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = layout.hubs[i].x.value(), y = layout.hubs[i].y.value();
    if (!(std::fabs(x) < 1e6) || !(std::fabs(y) < 1e6)) return false;
    if (layout.spins[i] != 1 && layout.spins[i] != -1) return false;
    if (!(drag_scale[i] > 0.0) || !(drag_scale[i] < kLargestDragScale)) return false;
  }
  return true;
}

double within_reason(double demand, bool& odd) noexcept {
  odd = odd || demand != demand;
  return demand != demand ? 0.0 : std::min(std::max(demand, -kLargestDemand), kLargestDemand);
}

Limits within_reason(const ThrustLimits& limits, bool& odd) noexcept {
  Limits result{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double low = limits.smallest[i].value(), high = limits.largest[i].value();
    odd = odd || !(low <= high);
    result.low[i] = low > 0.0 ? std::min(low, kLargestDemand) : 0.0;
    result.high[i] = high > result.low[i] ? std::min(high, kLargestDemand) : result.low[i];
  }
  return result;
}

/// Thrusts f = start + shift along_thrust + turn along_yaw, the two moves that leave roll and pitch alone: `shift` [N]
/// is the change of collective thrust, `turn` [N m] that of yaw.
class Plane {
 public:
  Plane(const Four& start, const Four& along_thrust, const Four& along_yaw, const Limits& limits, Range turns) noexcept
      : start_(start), along_thrust_(along_thrust), along_yaw_(along_yaw), limits_(limits), turns_(turns) {
    double largest = 0.0;
    for (const double step : along_yaw_) largest = std::max(largest, std::fabs(step));
    for (double& step : along_yaw_) {  // a rotor that yaw hardly moves bounds the shift, by a very steep line
      if (std::fabs(step) < 1e-9 * largest) step = std::copysign(1e-9 * largest, step);
    }
  }

  struct Point {
    double shift;
    double turn;
  };

  /// The smallest |shift| for which any turn keeps all rotors within their limits, and the smallest |turn| then.
  [[nodiscard]] Point nearest() const noexcept {
    // The room for turning is concave in the shift and made of straight pieces: Newton's steps from outside never pass
    // its zero, and end after at most as many steps as there are pieces.
    double shift = 0.0, last_shift = 0.0;
    Room room = room_at(shift), last = room;
    for (int step = 0; step < kSteps && room.width() < 0.0; ++step) {
      if (step > 0 && room.slope() * last.slope() <= 0.0) {  // passed the summit, which is below zero: nothing fits
        const double bend = last.slope() - room.slope();
        if (bend != 0.0) {
          shift = (room.width() - last.width() + last.slope() * last_shift - room.slope() * shift) / bend;
        }
        room = room_at(shift);
        break;
      }
      if (room.slope() == 0.0) break;
      last = room;
      last_shift = shift;
      shift -= room.width() / room.slope();
      room = room_at(shift);
    }
    const double middle = 0.5 * (room.low + room.high);
    const double turn = room.width() < 0.0 ? middle : std::min(std::max(0.0, room.low), room.high);
    return {shift, std::min(std::max(turn, turns_.low), turns_.high)};
  }

  [[nodiscard]] Four at(Point point) const noexcept {
    return moved(moved(start_, point.shift, along_thrust_), point.turn, along_yaw_);
  }

 private:
  static constexpr int kSteps = 12;

  struct Room {
    double low, high;              // of the turn
    double low_slope, high_slope;  // per shift
    [[nodiscard]] double width() const noexcept { return high - low; }
    [[nodiscard]] double slope() const noexcept { return high_slope - low_slope; }
  };

  [[nodiscard]] Room room_at(double shift) const noexcept {
    Room room{turns_.low, turns_.high, 0.0, 0.0};
    for (std::size_t i = 0; i < 4; ++i) {
      const double thrust = start_[i] + shift * along_thrust_[i], step = along_yaw_[i];
      const double slope = -along_thrust_[i] / step;
      double low = (limits_.low[i] - thrust) / step, high = (limits_.high[i] - thrust) / step;
      if (step < 0.0) std::swap(low, high);
      if (low > room.low) {
        room.low = low;
        room.low_slope = slope;
      }
      if (high < room.high) {
        room.high = high;
        room.high_slope = slope;
      }
    }
    return room;
  }

  Four start_, along_thrust_, along_yaw_;
  Limits limits_;
  Range turns_;
};

/// Yaw may go towards zero, no further than to what is assured.
Range turns_allowed(double yaw, double assured) noexcept {
  const double give = std::max(0.0, std::fabs(yaw) - (assured > 0.0 ? assured : 0.0));
  return yaw > 0.0 ? Range{-give, 0.0} : Range{0.0, give};
}

bool within(const Four& thrusts, const Limits& limits) noexcept {
  for (std::size_t i = 0; i < 4; ++i) {
    if (!(thrusts[i] >= limits.low[i] && thrusts[i] <= limits.high[i])) return false;
  }
  return true;
}

/// How far, relative to the thrusts at hand, a cut may go that is only rounding.
double rounding_of(const Four& thrusts) noexcept {
  double largest = 1.0;
  for (const double thrust : thrusts) largest = std::max(largest, std::fabs(thrust));
  return 1e-9 * largest;
}

}  // namespace

std::optional<Mixer> Mixer::build(const RotorLayout& layout, DragTorque drag) noexcept {
  const double per_newton = drag.per_newton.value();
  if (!(per_newton > 0.0) || !(per_newton < 1e6) || !(std::fabs(drag.per_square_newton) < 1e6)) return std::nullopt;
  Mixer mixer(drag);
  if (!mixer.set_layout(layout)) return std::nullopt;
  return mixer;
}

bool Mixer::set_layout(const RotorLayout& layout, const std::array<double, 4>& drag_scale) noexcept {
  if (!usable(layout, drag_scale)) return false;
  Mixer next(drag_);
  next.drag_scale_ = drag_scale;
  double reach = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    next.x_[i] = layout.hubs[i].x.value();
    next.y_[i] = layout.hubs[i].y.value();
    next.spins_[i] = layout.spins[i];
    next.mean_x_ += next.x_[i] / 4;
    next.mean_y_ += next.y_[i] / 4;
  }
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    next.spread_x_[i] = next.x_[i] - next.mean_x_;
    next.spread_y_[i] = next.y_[i] - next.mean_y_;
    xx += next.spread_x_[i] * next.spread_x_[i];
    xy += next.spread_x_[i] * next.spread_y_[i];
    yy += next.spread_y_[i] * next.spread_y_[i];
    reach = std::max({reach, std::fabs(next.spread_x_[i]), std::fabs(next.spread_y_[i])});
  }
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 1e-6 * reach * reach * reach * reach)) return false;
  next.xx_ = xx / determinant;
  next.xy_ = xy / determinant;
  next.yy_ = yy / determinant;
  next.torque_free_ = {area(next.x_, next.y_, 1, 2, 3), -area(next.x_, next.y_, 0, 2, 3),
                       area(next.x_, next.y_, 0, 1, 3), -area(next.x_, next.y_, 0, 1, 2)};
  const Four arms = next.yaw_arms({{0, 0, 0, 0}});
  double possible = 0.0;
  for (std::size_t i = 0; i < 4; ++i) possible += std::fabs(arms[i] * next.torque_free_[i]);
  if (!(std::fabs(dot(arms, next.torque_free_)) > 1e-6 * possible)) return false;
  *this = next;
  return true;
}

Mixer::Four Mixer::yaw_arms(const Four& thrusts) const noexcept {
  const double per_newton = drag_.per_newton.value();
  Four arms{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double uncovered = drag_scale_[i] * std::max(thrusts[i], 0.0);
    const double torque = per_newton + drag_.per_square_newton * uncovered;
    arms[i] = spins_[i] * drag_scale_[i] * std::min(std::max(torque, 0.5 * per_newton), 2 * per_newton);
  }
  return arms;
}

Mixer::Four Mixer::without_yaw(double thrust, double roll, double pitch) const noexcept {
  // f_i = thrust/4 + a y'_i + b x'_i with y', x' about the hubs' mean: the least squares of all thrusts that do it.
  const double about_x = roll - mean_y_ * thrust, about_y = -pitch - mean_x_ * thrust;
  const double a = xx_ * about_x - xy_ * about_y, b = yy_ * about_y - xy_ * about_x;
  return moved(moved({{thrust / 4, thrust / 4, thrust / 4, thrust / 4}}, a, spread_y_), b, spread_x_);
}

MixedThrusts Mixer::mix(const Wrench& demand, const ThrustLimits& limits, NewtonMetres assured_yaw) const noexcept {
  bool odd = false;
  const double thrust = within_reason(demand.thrust.value(), odd), roll = within_reason(demand.roll.value(), odd),
               pitch = within_reason(demand.pitch.value(), odd), yaw = within_reason(demand.yaw.value(), odd);
  const Limits held = within_reason(limits, odd);

  const Four base = without_yaw(thrust, roll, pitch);
  Four arms = yaw_arms({{thrust / 4, thrust / 4, thrust / 4, thrust / 4}});
  Four wanted = base;
  for (int i = 0; i < kTorqueIterations; ++i) {
    wanted = moved(base, (yaw - dot(arms, base)) / dot(arms, torque_free_), torque_free_);
    if (drag_.per_square_newton == 0.0) break;
    const Four next = yaw_arms(wanted);
    const bool met = std::fabs(dot(next, wanted) - yaw) <= kYawTolerance * std::fabs(dot(next, torque_free_));
    if (met || dot(next, torque_free_) * dot(arms, torque_free_) <= 0.0) break;
    arms = next;
  }

  Concessions concessions = Concessions().with(Concession::demand_nan, odd);
  Four given = wanted;
  if (!within(wanted, held)) {
    Four per_yaw{};
    per_yaw = moved(per_yaw, 1.0 / dot(arms, torque_free_), torque_free_);
    const Four unit = without_yaw(1.0, 0.0, 0.0);
    const Four per_thrust = moved(unit, -dot(arms, unit), per_yaw);
    const Plane plane(wanted, per_thrust, per_yaw, held, turns_allowed(yaw, assured_yaw.value()));
    const Plane::Point point = plane.nearest();
    given = plane.at(point);
    concessions = concessions.with(Concession::yaw, point.turn != 0.0).with(Concession::thrust, point.shift != 0.0);
  }

  MixedThrusts mixed;
  const double rounding = rounding_of(given);
  for (std::size_t i = 0; i < 4; ++i) {
    const double cut = given[i] > held.low[i] ? std::min(given[i], held.high[i]) : held.low[i];
    concessions = concessions.with(Concession::roll_pitch, !(std::fabs(cut - given[i]) <= rounding));
    mixed.thrusts[i] = Newtons(cut);
  }
  mixed.achieved = wrench_of(mixed.thrusts);
  mixed.concessions = concessions;
  return mixed;
}

Wrench Mixer::wrench_of(const std::array<Newtons, 4>& thrusts) const noexcept {
  const Four f{{thrusts[0].value(), thrusts[1].value(), thrusts[2].value(), thrusts[3].value()}};
  return {Newtons(f[0] + f[1] + f[2] + f[3]), NewtonMetres(dot(y_, f)), NewtonMetres(-dot(x_, f)),
          NewtonMetres(dot(yaw_arms(f), f))};
}

}  // namespace kphi::compensation
