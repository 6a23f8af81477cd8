#include "fit/coefficients/error_in_flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/number.hpp"
#include "base/text.hpp"
#include "compensation/occlusion.hpp"
#include "profiles/vehicle.hpp"

namespace kphi::fit {
namespace {

/// Widest φ of any arm within the reach of its servo, deg.
double widest_occlusion(const profiles::Vehicle& vehicle) {
  constexpr int kPieces = 720;
  const compensation::Airframe airframe = profiles::airframe_of(vehicle);
  const Radians from = vehicle.arm_angle_min, width = vehicle.arm_angle_max - vehicle.arm_angle_min;
  double widest = 0;
  for (std::size_t arm = 0; arm < compensation::rotors_of(airframe); ++arm)
    for (int i = 0; i <= kPieces; ++i)
      widest = std::max(widest,
                        to_degrees(compensation::occlusion_of_arm(airframe, arm, from + (1.0 * i / kPieces) * width)));
  return widest;
}

/// Of the row that holds φ and the column that holds the speeds; NaN beyond them.
double share_at(const compensation::Coefficients::ThrustErrorWithin& within, double phi_deg, double off_rad_s) {
  constexpr double kRounding = 1e-3;  // of φ and speed, as the file has them
  const auto row =
      std::ranges::find_if(within.rows, [&](const auto& one) { return one.phi_deg >= phi_deg - kRounding; });
  if (row == within.rows.end()) return std::numeric_limits<double>::quiet_NaN();
  const auto column = std::ranges::find_if(within.off_rad_s, [&](double off) { return off >= off_rad_s - kRounding; });
  const auto at = std::min<std::ptrdiff_t>(column - within.off_rad_s.begin(), std::ssize(row->shares) - 1);
  return row->shares[static_cast<std::size_t>(at)];
}

}  // namespace

std::optional<ErrorInFlight> error_in_flight(const compensation::Coefficients& file, const profiles::Vehicle& vehicle) {
  const auto& within = file.thrust_error_within;
  if (within.rows.empty() || file.alone()) return std::nullopt;
  ErrorInFlight error{.phi_deg = widest_occlusion(vehicle),
                      .slowest_rad_s = vehicle.speed_min.value(),
                      .fastest_rad_s = vehicle.speed_max.value()};
  if (file.slowest_speed && file.fastest_speed) {
    const double slow = file.slowest_speed->value(), fast = file.fastest_speed->value();
    error.slowest_rad_s = std::clamp(error.slowest_rad_s, slow, fast);
    error.fastest_rad_s = std::clamp(error.fastest_rad_s, slow, fast);
    error.beyond_speeds = !same_level(error.slowest_rad_s, vehicle.speed_min.value()) ||
                          !same_level(error.fastest_rad_s, vehicle.speed_max.value());
  }
  const double off =
      std::max(within.reference_rad_s - error.slowest_rad_s, error.fastest_rad_s - within.reference_rad_s);
  error.share = share_at(within, error.phi_deg, off);
  const ReadinessLimits usual;
  const Readiness by_number =
      error.share <= file.thrust_error.fit_to_fly.value_or(usual.fit_to_fly) ? Readiness::fit_to_fly
      : error.share <= file.thrust_error.with_care.value_or(usual.with_care) ? Readiness::with_care
                                                                             : Readiness::not_yet;
  error.readiness = std::max(by_number, readiness_named(file.doubts_allow).value_or(Readiness::not_yet));
  return error;
}

void judge_for(compensation::Coefficients& file, const ErrorInFlight& error, const profiles::Vehicle& vehicle) {
  file.verdict = name_of(error.readiness);
  file.thrust_error.share_95 = std::isnan(error.share) ? std::nullopt : std::optional(error.share);
  file.thrust_error.phi_deg.reset();
  file.thrust_error.where = vehicle.name;
}

std::string words(const ErrorInFlight& error, const profiles::Vehicle& vehicle) {
  const std::string name = printable(vehicle.name);
  if (std::isnan(error.share))
    return fmt::format("{}: {} reaches φ {:.0f}°, beyond the widest at which the error of the thrust is known",
                       words(error.readiness), name, error.phi_deg);
  const auto rpm = [](double speed) { return to_rpm(RadPerSec(speed)); };
  return fmt::format("{}: thrust within {} % (95 %) where {} flies, φ up to {:.0f}°, {:.0f} to {:.0f} RPM{}",
                     words(error.readiness), two_digits(100 * error.share), name, error.phi_deg,
                     rpm(error.slowest_rad_s), rpm(error.fastest_rad_s),
                     error.beyond_speeds ? fmt::format(" (of its {:.0f} to {:.0f} RPM what was measured)",
                                                       to_rpm(vehicle.speed_min), to_rpm(vehicle.speed_max))
                                         : "");
}

}  // namespace kphi::fit
