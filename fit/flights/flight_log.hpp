// What a flight controller wrote down, each quantity on its own clock, in one frame and one set of units whatever the
// format. Body axes: x forward, y left, z up (FLU).
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/finding.hpp"
#include "fit/flights/flight_layout.hpp"

namespace kphi::fit {

/// Values of one quantity, all finite. Times in s since the log's start, ascending.
struct FlightChannel {
  std::vector<double> time_s, values;
};

struct FlightLog {
  std::string format;                                   ///< "PX4 ULog", "Crazyflie card log", "table"
  std::array<FlightChannel, 3> specific_force{};        ///< m/s²; z: +9.81 at rest
  std::array<FlightChannel, 3> angular_rate{};          ///< rad/s
  std::array<FlightChannel, 3> angular_acceleration{};  ///< rad/s²; empty: derive it from the rate
  std::vector<FlightChannel> rotor_speed{};             ///< rad/s, ≥ 0, by rotor; empty: not logged
  std::vector<FlightChannel> command{};                 ///< 0 to 1, by rotor, stopped is 0; empty: not logged
  std::vector<FlightChannel> arm_angle{};               ///< rad, by arm; empty: not logged
  FlightChannel voltage{};                              ///< V; this and the next three empty: not logged
  FlightChannel density{};                              ///< kg/m³
  FlightChannel height{};                               ///< m over ground (or over the start: a note says so)
  FlightChannel climb{};                                ///< m/s, up
  std::vector<Finding> findings{};                      ///< gaps, saturation, clocks that step back, odd frames
};

/// Reads a PX4 ULog, a Crazyflie card log, or a table of text by its layout; tells them apart by their first bytes.
/// Memory: the file, 1 GiB at most, and 16 bytes a value, kMostFlightValues at most. Throws ConfigurationError (one
/// line).
[[nodiscard]] FlightLog read_flight(const std::filesystem::path& path, const FlightLayout& layout = {});
/// The same of a file's bytes; `path` is for messages.
[[nodiscard]] FlightLog parse_flight(std::string_view bytes, const std::string& path, const FlightLayout& layout = {});

inline constexpr std::size_t kMostFlightValues = 100'000'000;

}  // namespace kphi::fit
