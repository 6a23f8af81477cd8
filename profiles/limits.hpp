// The limits that campaign and bench files set under `limits:`.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "compensation/units.hpp"

namespace kphi::profiles {

class ProfileReader;

/// Each key has its entry in both schemas, and its row in daq/guard/guard_limits.hpp.
inline constexpr auto kLimitKeys = std::to_array<std::string_view>(
    {"speed_max_rpm", "thrust_max_n", "torque_max_nm", "supply_current_max_a", "supply_voltage_min_v",
     "supply_voltage_max_v", "coil_temperature_max_degc", "speed_error_max_percent"});

/// One of kLimitKeys; any other key does not compile.
struct Limit {
  consteval Limit(const char* key)  // NOLINT: a table reads better without its name
      : index(static_cast<std::size_t>(std::ranges::find(kLimitKeys, std::string_view(key)) - kLimitKeys.begin())) {
    if (index == kLimitKeys.size()) throw key;
  }
  std::size_t index;
};

/// The motor rests between runs until its coil has cooled down.
struct Cooling {
  Celsius pause_above;
  Celsius resume_below;

  friend bool operator==(const Cooling&, const Cooling&) = default;
};

/// A plan beyond the speed is refused; exceeding any of them during a run coasts the motor.
struct Limits {
  std::optional<Cooling> cooling{};
  std::array<std::optional<double>, kLimitKeys.size()> values{};  ///< in the unit that the key names

  [[nodiscard]] std::optional<double>& operator[](Limit limit) noexcept { return values[limit.index]; }
  [[nodiscard]] const std::optional<double>& operator[](Limit limit) const noexcept { return values[limit.index]; }
  friend bool operator==(const Limits&, const Limits&) = default;
};

/// `supply_v`: pointer to the voltage of the supply, between whose limits it must be; the file may lack it.
[[nodiscard]] Limits read_limits(ProfileReader& file, const std::string& supply_v);

}  // namespace kphi::profiles
