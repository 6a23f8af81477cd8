#include "daq/guard/cell_trust.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace kphi::daq {
namespace {

constexpr double kImpossible = 30;  // -ln of the probability of a repetition that noise is not blamed for: 1e-13
constexpr double kRounding = 0.25;  // counts²: what rounding alone can add to the mean square of a difference / 2
constexpr std::uint32_t kLeastPairs = 20;
constexpr double kJudgedSeconds = 0.1;
constexpr double kShareOfLeast = 0.35;  // less counts as missing thrust
constexpr double kThrustSeen = 0.05;    // N: less says nothing of a sign
constexpr double kTorqueSeen = 0.0005;  // N m

}  // namespace

FrozenWatch::FrozenWatch(double rate_hz)
    : least_(std::max<double>(kLeastRecords, std::round(kLeastSeconds * rate_hz))) {}

void FrozenWatch::learn(bool zero) {
  if (zero == learning_) return;
  learning_ = zero;
  for (Axis& axis : axes_) {
    if (!zero) {
      axis.limit = axis.limit_of(least_);
      if (axis.longest >= axis.limit) axis.run = axis.limit - 1;  // it froze in the zero: the next sample tells
    } else {
      axis = Axis{.last = axis.last, .run = 0};
    }
  }
}

void FrozenWatch::Axis::learn(std::int32_t count) {
  if (!std::exchange(begun, true)) return;
  const double difference = static_cast<double>(count) - last;
  squares += difference * difference;
  ++pairs;
  equal += count == last;
  longest = std::max(longest, count == last ? run + 1 : 0);
}

std::uint32_t FrozenWatch::Axis::limit_of(double least) const {
  // Without the longest repetition, which may be that of a cell that froze meanwhile.
  const double others = static_cast<double>(pairs) - longest;
  if (others < kLeastPairs) return kNone;
  const double variance = squares / others / 2 - kRounding;
  if (variance <= 0) return kNone;
  const double seen = (equal - longest) / others, between = std::erf(0.5 / std::sqrt(2 * variance));
  const double most = std::max(seen, between);
  if (most >= 1) return kNone;
  return static_cast<std::uint32_t>(std::min(std::max(least, std::ceil(-kImpossible / std::log(most))), 1e9));
}

std::optional<std::uint32_t> FrozenWatch::limit(std::size_t axis) const {
  return axes_[axis].limit == kNone ? std::nullopt : std::optional(axes_[axis].limit);
}

ThrustWatch::ThrustWatch(double rate_hz)
    : samples_(static_cast<std::uint32_t>(std::max(3.0, std::round(kJudgedSeconds * rate_hz)))) {}

void ThrustWatch::begin(RadPerSec speed) noexcept {
  speed_ = speed;
  taken_ = 0;
  thrust_ = torque_ = 0;
}

std::optional<std::string> ThrustWatch::doubt(int spin, const ThrustExpectation& expected) const {
  if (expected.floor_n <= 0) return std::nullopt;
  const double thrust = thrust_ / samples_, torque = torque_ / samples_;
  const double least = expected.least_k * speed_.value() * speed_.value();
  const std::string seen = fmt::format("thrust {:.3g} N at {:.0f} RPM", thrust, to_rpm(speed_));
  if (thrust < -std::max(expected.floor_n, kShareOfLeast * least)) {
    const auto doubt = doubt_about_signs(thrust, torque, spin);
    return fmt::format("{}: {}", seen,
                       doubt.value_or("thrust is negative; check thrust_axis in the bench file, and whether the "
                                      "propeller pushes"));
  }
  if (kShareOfLeast * least > expected.floor_n && thrust < kShareOfLeast * least)
    return fmt::format(
        "{}, at least {:.2g} N expected: is the propeller mounted, and does the load cell carry the motor?", seen,
        least);
  return std::nullopt;
}

std::optional<std::string> doubt_about_signs(double thrust_n, double torque_nm, int spin) {
  // Written so that what is not a number says nothing.
  if (!(std::abs(thrust_n) >= kThrustSeen) || !(std::abs(torque_nm) >= kTorqueSeen)) return std::nullopt;
  const bool pulls = thrust_n > 0, opposes = torque_nm * spin < 0;
  if (pulls && opposes) return std::nullopt;
  if (!pulls && !opposes)
    return "thrust is negative, and so is the sense of the torque: mirror thrust_axis in the bench file";
  if (!pulls)
    return "thrust is negative, its torque is right: the propeller pushes; turn it over, or change spin in the bench "
           "file";
  return "the torque says that the rotor turns the other way than spin in the bench file: change spin, or swap two "
         "phases of the motor";
}

}  // namespace kphi::daq
