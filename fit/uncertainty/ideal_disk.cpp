#include "fit/uncertainty/ideal_disk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/number.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

constexpr double kMetresPerInch = 0.0254;
/// The mean of a few steps scatters, and so does the air where it is not known.
constexpr double kRoom = 1.1;

/// Sums of powers over the steps that have both of the two compared.
struct Powers {
  double part = 0, whole = 0;
  void add(double a, double b) {
    if (!std::isfinite(a) || !(b > 0)) return;
    part += a;
    whole += b;
  }
  [[nodiscard]] double share() const { return whole > 0 ? part / whole : std::numeric_limits<double>::quiet_NaN(); }
};

double electrical_w(const results::StepMean& step) {
  return std::isnan(step.supply_w) ? step.supply_voltage_v * step.supply_current_a : step.supply_w;
}

}  // namespace

std::vector<std::string> broken_laws_of_power(const Identification& identification) {
  std::vector<std::string> broken;
  const OcclusionCoefficient& open = identification.table.front();
  if (open.phi_deg != 0 || open.measured.empty()) return broken;
  const double density = identification.air ? identification.air->value : kStandardDensity;
  const double disk_m2 = kPi / 4 * std::pow(identification.diameter_in * kMetresPerInch, 2);
  double fastest = 0;
  for (const results::StepMean& step : open.measured) fastest = std::max(fastest, step.speed_rad_s);
  Powers of_shaft, of_supply, efficiency;
  for (const results::StepMean& step : open.measured) {
    if (step.speed_rad_s < 0.5 * fastest || !(step.thrust_n > 0)) continue;
    const double ideal_w = disk_m2 > 0 ? std::pow(step.thrust_n, 1.5) / std::sqrt(2 * density * disk_m2)
                                       : std::numeric_limits<double>::quiet_NaN();
    const double shaft_w = std::abs(step.torque_nm) * step.speed_rad_s;
    of_shaft.add(ideal_w, shaft_w);
    of_supply.add(ideal_w, electrical_w(step));
    efficiency.add(shaft_w > 0 ? shaft_w : std::numeric_limits<double>::quiet_NaN(), electrical_w(step));
  }
  struct Law {
    double share, least, largest;
    const char *too_small, *too_large;  ///< {} is the share, too small in percent
  };
  for (const Law& law : std::array<Law, 3>{{
           {of_shaft.share(), kLeastFigureOfMerit, kLargestFigureOfMerit,
            "thrust and torque do not belong together: {} % of the shaft's power goes into the thrust, usual is 30 to "
            "70 %; "
            "check the units of thrust, torque and speed",
            "thrust and torque are impossible: an ideal disk of this diameter needs {} times the power that the torque "
            "gives; check the units of thrust, torque and speed, the torque's lever arm, and the diameter"},
           {of_supply.share(), kLeastOfElectrical, kLargestFigureOfMerit,
            "thrust and electrical power do not belong together: {} % of the power goes into the thrust; check the "
            "units of "
            "thrust, voltage and current",
            "thrust and electrical power are impossible: an ideal disk of this diameter needs {} times the power that "
            "the "
            "motor took; check the units of thrust, voltage and current, and the current's shunt"},
           {efficiency.share(), 0, kLargestEfficiency, "",
            "torque and electrical power are impossible: the shaft gives {} times the power that the motor takes; "
            "check "
            "speed (pole count), torque and current"},
       }}) {
    if (law.share > kRoom * law.largest)
      broken.push_back(fmt::format(fmt::runtime(law.too_large), two_digits(law.share)));
    if (law.share < law.least / kRoom)
      broken.push_back(fmt::format(fmt::runtime(law.too_small), two_digits(100 * law.share)));
  }
  return broken;
}

}  // namespace kphi::fit
