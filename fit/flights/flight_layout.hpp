// Which series of a flight log is which channel, where its format alone does not say so: columns of a table, a servo
// that moves an arm.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kphi::fit {

enum class FlightQuantity : std::uint8_t {
  time,
  specific_force,  ///< this and the next two: index is the axis
  angular_rate,
  angular_acceleration,
  rotor_speed,  ///< index is the rotor, as for the command
  command,
  arm_angle,  ///< index is the arm
  voltage,
  density,
  height,
  climb,
};

/// "specific_force"
[[nodiscard]] const char* name_of(FlightQuantity quantity);

/// Measured by the inertial sensor: force, rate, acceleration.
[[nodiscard]] constexpr bool is_sensor(FlightQuantity quantity) {
  return quantity == FlightQuantity::specific_force || quantity == FlightQuantity::angular_rate ||
         quantity == FlightQuantity::angular_acceleration;
}

/// A channel's value is series · factor + offset, in the unit and the axes of FlightLog.
struct FlightSource {
  FlightQuantity quantity{};
  std::size_t index = 0;
  std::string series;  ///< column "gyroADC[0]", variable "gyro.x", field of a topic "actuator_servos.control[0]"
  double factor = 1;   ///< not 0
  double offset = 0;
};

/// Sources told here replace all that the format has by itself for their quantity.
struct FlightLayout {
  std::vector<FlightSource> sources{};
  std::optional<char> decimal{};  ///< of a table whose numbers do not tell; '.' or ','
  [[nodiscard]] bool has(FlightQuantity quantity) const;
};

/// The layout file, format kphi-flight-layout/1. Throws RefusedFile.
[[nodiscard]] FlightLayout parse_flight_layout(const std::string& text, const std::string& path);

/// A line for each source.
[[nodiscard]] std::string describe(const FlightLayout& layout);

}  // namespace kphi::fit
