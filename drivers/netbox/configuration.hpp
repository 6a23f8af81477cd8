// What the box says about itself (netftapi2.xml of the active slot), in SI.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace kphi::netbox {

struct Configuration {
  std::string product;             ///< empty when the box does not say
  std::string firmware;            ///< mfgdigver
  std::string calibration_serial;  ///< cfgcalsn
  int slot = 0;                    ///< setcfgsel: zero-based, the box's web pages count from one
  std::string slot_name;
  std::string force_unit, torque_unit;  ///< as the box spells them
  double counts_per_newton = 0, counts_per_newton_metre = 0;
  std::array<double, 6> range{};  ///< sensing range Fx Fy Fz in N, Tx Ty Tz in Nm

  double device_rate_hz = 0;  ///< internal samples per second: what ft_sequence counts
  unsigned divisor = 1;       ///< ft_sequence per record
  double rdt_rate_hz = 0;     ///< device_rate_hz / divisor; the rate the box shows is rounded down
  int records_per_datagram = 1;
  bool rdt_enabled = false;
  int filter_code = 0;  ///< setuserfilter

  /// Dx Dy Dz Rx Ry Rz in `tool_distance_unit` and `tool_angle_unit`. Already applied to what the box sends.
  std::array<double, 6> tool_transform{};
  std::string tool_distance_unit, tool_angle_unit;
  std::array<double, 6> gage_bias{};  ///< setbias, already applied too

  std::string xml;  ///< what was read, verbatim
};

/// Cutoff of a filter code in Hz, 0 = no filter; nothing for a code that no manual names.
[[nodiscard]] std::optional<double> filter_cutoff_hz(int filter_code) noexcept;

/// Throws DeviceError, naming `device`, for whatever leaves the scale or the rate in doubt: missing, repeated or
/// unreadable elements, an unknown unit, counts per unit or ranges not above zero, an empty calibration (FT0000), an
/// Ethernet Axia. Independent of the locale.
[[nodiscard]] Configuration parse_configuration(std::string_view xml, const std::string& device = "Net Box");

}  // namespace kphi::netbox
