#include "profiles/key_names.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace kphi::profiles {
namespace {

struct UnitSuffix {
  std::string_view suffix;
  std::string_view unit;
};

/// Also units that we do not use and others do.
constexpr std::array<UnitSuffix, 38> kUnits{{
    {"_rad_s", "rad/s"},
    {"_rpm", "RPM"},
    {"_rpm_s", "RPM/s"},
    {"_rad", "rad"},
    {"_degc", "°C"},
    {"_deg", "degrees"},
    {"_hz", "Hz"},
    {"_nm", "N m"},
    {"_in", "inches"},
    {"_n", "N"},
    {"_s", "s"},
    {"_v", "V"},
    {"_a", "A"},
    {"_m", "m"},
    {"_ms", "ms"},
    {"_us", "µs"},
    {"_ns", "ns"},
    {"_min", "minutes"},
    {"_sec", "s"},
    {"_h", "h"},
    {"_khz", "kHz"},
    {"_rps", "1/s"},
    {"_deg_s", "degrees/s"},
    {"_degf", "°F"},
    {"_c", "°C"},
    {"_k", "K"},
    {"_kn", "kN"},
    {"_mn", "mN"},
    {"_gf", "gf"},
    {"_kgf", "kgf"},
    {"_g", "g"},
    {"_kg", "kg"},
    {"_mv", "mV"},
    {"_ma", "mA"},
    {"_mm", "mm"},
    {"_cm", "cm"},
    {"_pa", "Pa"},
    {"_hpa", "hPa"},
}};

/// Edit distance with swapped neighbours (optimal string alignment).
std::size_t slips(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before, previous(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) previous[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({previous[j] + 1, row[j - 1] + 1, previous[j - 1] + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = previous;
    previous = row;
  }
  return previous[b.size()];
}

}  // namespace

KeyParts split_unit(const std::string& key) {
  const UnitSuffix* longest = nullptr;
  for (const UnitSuffix& unit : kUnits) {
    const bool ends = key.size() > unit.suffix.size() &&
                      key.compare(key.size() - unit.suffix.size(), unit.suffix.size(), unit.suffix) == 0;
    if (ends && (longest == nullptr || unit.suffix.size() > longest->suffix.size())) longest = &unit;
  }
  if (longest == nullptr) return {key, ""};
  return {key.substr(0, key.size() - longest->suffix.size()), std::string(longest->unit)};
}

std::optional<std::string> nearest_name(const std::string& name, const std::vector<std::string>& names) {
  std::optional<std::string> nearest;
  std::size_t fewest = std::max<std::size_t>(1, std::min<std::size_t>(3, name.size() / 3)) + 1;
  for (const std::string& candidate : names) {
    const std::size_t distance = slips(name, candidate);
    if (distance < fewest) {
      fewest = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

std::optional<std::string> same_but_for_unit(const std::string& name, const std::vector<std::string>& names) {
  const std::string stem = split_unit(name).stem;
  for (const std::string& candidate : names) {
    if (candidate != name && split_unit(candidate).stem == stem) return candidate;
  }
  return std::nullopt;
}

}  // namespace kphi::profiles
