// The coefficients as files for other programs. Each target lists the values that its format cannot store.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/file/coefficient_file.hpp"

namespace kphi::profiles {
struct Vehicle;
}

namespace kphi::fit {

/// Seen from above.
enum class Turn : std::uint8_t { counter_clockwise, clockwise };

/// "ccw,cw,…". Throws ConfigurationError.
[[nodiscard]] std::vector<Turn> parse_turns(const std::string& text);

struct ExportOptions {
  double phi_deg = 0;                     ///< for targets with one constant per motor
  std::optional<double> speed_max_rpm{};  ///< at full output; default: the highest speed of the file
  int motors = 4;
  std::vector<Turn> turns{};                   ///< of the motors, in their order; empty: not known
  const profiles::Vehicle* vehicle = nullptr;  ///< for targets that compute k from arm angles; outlives the call
};

struct Export {
  std::string text;               ///< bytes, for mcap
  std::vector<std::string> lost;  ///< values that the format cannot store, with the reason; one line each
};

/// "measured", "SIMULATED, no propeller turned", "unknown".
[[nodiscard]] std::string origin_words(const compensation::Coefficients& file);
/// "fit to fly", …, "unknown".
[[nodiscard]] std::string verdict_words(const compensation::Coefficients& file);

/// Throws ConfigurationError for a φ outside the measured range, an unknown speed at full output, turning directions of
/// another number of motors, or a vehicle that is missing or cannot be flown.
[[nodiscard]] Export to_agilicious(const compensation::Coefficients& file, const ExportOptions& options);
[[nodiscard]] Export to_px4(const compensation::Coefficients& file, const ExportOptions& options);
[[nodiscard]] Export to_gazebo(const compensation::Coefficients& file, const ExportOptions& options);
[[nodiscard]] Export to_ros2(const compensation::Coefficients& file, const ExportOptions& options);
/// With a vehicle the script; without one MOT_THST_EXPO, of a file with a throttle law.
[[nodiscard]] Export to_ardupilot(const compensation::Coefficients& file, const ExportOptions& options);
/// thrust_linear, of a file with a throttle law.
[[nodiscard]] Export to_betaflight(const compensation::Coefficients& file, const ExportOptions& options);
/// VMOTOR2THRUST0 to 3, of a file with the law of a log that has throttle and voltage.
[[nodiscard]] Export to_crazyflie(const compensation::Coefficients& file, const ExportOptions& options);
[[nodiscard]] Export to_c(const compensation::Coefficients& file, const ExportOptions& options);
/// phi_deg, k and its u first: `kphi fit` reads the table.
[[nodiscard]] Export to_csv(const compensation::Coefficients& file, const ExportOptions& options);
[[nodiscard]] Export to_mcap(const compensation::Coefficients& file, const ExportOptions& options);

struct Target {
  const char* name;
  const char* what;
  Export (*write)(const compensation::Coefficients&, const ExportOptions&);
  bool takes_vehicle = false;   ///< computes k from arm angles
  bool for_each_motor = false;  ///< a block for each motor, with its turn
  bool needs_curve = false;     ///< K_T alone is refused
};
[[nodiscard]] std::span<const Target> targets();

}  // namespace kphi::fit
