// A constexpr header for flight controllers without YAML: C++14, includes nothing, the law of ScalingLaw::clamped.
#include <fmt/format.h>

#include <cctype>

#include "fit/export/wording.hpp"
#include "results/number.hpp"

namespace kphi::fit {
namespace {

std::string identifier(const std::string& id) {
  std::string name = "kphi_";
  for (const char c : id) name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
}

/// A backslash at the end of a comment's line would take in the next.
std::string comment_safe(std::string text) {
  for (char& c : text)
    if (c == '\\') c = '/';
  return text;
}

constexpr const char* kFunctions = R"(
/// k on the line, N/(rad/s)^2; phi in rad. Beyond kLargestPhi it is an extrapolation and may be negative.
constexpr double coefficient_at(double phi) { return kIntercept + kSlope * phi; }

/// k_i in [0.1, 1]: 1 without occlusion (and for a NaN), never a slower propeller, never a diverging one.
constexpr double scaling_factor(double phi) {
  return !(phi > 0) ? 1.0
         : !(coefficient_at(phi) < kThrustCoefficient) ? 1.0
         : coefficient_at(phi) < 0.1 * kThrustCoefficient ? 0.1
                                                          : coefficient_at(phi) / kThrustCoefficient;
}

/// The square of the speed [rad^2/s^2] that gives `thrust` [N] with occlusion `phi` [rad]: equation 4, squared.
constexpr double squared_speed(double thrust, double phi) {
  return thrust / (kThrustCoefficient * scaling_factor(phi));
}
)";

}  // namespace

Export to_header(const compensation::Coefficients& file, const ExportOptions&) {
  using results::yaml_number;
  Export result;
  for (const std::string& line : provenance_lines(file)) result.text += "// " + comment_safe(line) + "\n";
  result.text += fmt::format("#pragma once\n\nnamespace {} {{\n\n", identifier(file.propeller.id));
  const auto constant = [&](const char* name, double value, const char* what) {
    result.text += fmt::format("constexpr double {} = {};  ///< {}\n", name, yaml_number(value), what);
  };
  constant("kThrustCoefficient", file.thrust_coefficient.value(), "K_T, N/(rad/s)^2");
  if (file.thrust_coefficient_error)
    constant("kThrustCoefficientError", file.thrust_coefficient_error->value(), "its standard error");
  constant("kIntercept", file.line.intercept.value(), "of the line, N/(rad/s)^2");
  constant("kSlope", file.line.slope_per_rad, "of the line, N/(rad/s)^2 per rad");
  constant("kLargestPhi", file.largest_occlusion.value(), "rad, the largest occlusion measured");
  if (file.fastest_speed) constant("kFastestSpeed", file.fastest_speed->value(), "rad/s, the fastest measured");
  result.text += kFunctions;
  result.text += fmt::format("\n}}  // namespace {}\n", identifier(file.propeller.id));
  result.lost = {
      "the table per occlusion, covariance, hashes of the runs: the header is for the flight, the line is all "
      "it needs"};
  return result;
}

}  // namespace kphi::fit
