#include "fit/uncertainty/bench_uncertainty.hpp"

#include <fmt/format.h>

#include <array>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

struct Entry {
  const char* name;
  std::optional<double> BenchUncertainty::*member;
  double unit;
};

constexpr std::array<Entry, 5> kEntries{{
    {"calibration", &BenchUncertainty::cell_calibration, 1},
    {"cross-axis", &BenchUncertainty::cross_axis, 1},
    {"alignment-deg", &BenchUncertainty::alignment_rad, kPi / 180},
    {"clock", &BenchUncertainty::motor_clock, 1},
    {"density", &BenchUncertainty::air_density, 1},
}};

}  // namespace

void set_uncertainty(BenchUncertainty& bench, const std::string& text) {
  const std::size_t equals = text.find('=');
  const double value = equals == std::string::npos ? -1 : parse_number(text.substr(equals + 1)).value_or(-1);
  for (const Entry& entry : kEntries) {
    if (text.substr(0, equals) != entry.name || !(value >= 0)) continue;
    bench.*entry.member = value * entry.unit;
    return;
  }
  throw ConfigurationError(fmt::format(
      "--u {}: expected NAME=VALUE, NAME one of calibration, cross-axis, clock, density (relative: 0.002 is 0.2 %) or "
      "alignment-deg, VALUE a standard uncertainty, 0 or above",
      text));
}

std::vector<std::pair<std::string, double>> known_uncertainties(const BenchUncertainty& bench) {
  std::vector<std::pair<std::string, double>> known;
  for (const Entry& entry : kEntries)
    if (const auto& value = bench.*entry.member) known.emplace_back(entry.name, *value / entry.unit);
  return known;
}

}  // namespace kphi::fit
