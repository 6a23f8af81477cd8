// What the box says about itself (netftapi2.xml of the active slot), in SI.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/netbox/wire/product.hpp"

namespace kphi::netbox {

/// Largest and smallest counts since the box was switched on, or since they were reset.
struct Peaks {
  std::array<double, 6> high{}, low{};
};

/// A statement that the box judges with each internal sample, whatever rate it sends: once it has been true, bit 16 of
/// the status stays set until LoadCell::reset_latch().
struct MonitorCondition {
  int number = 0;        ///< 0..15
  int axis = 0;          ///< 0..5 = Fx..Tz
  bool above = true;     ///< true of a load above the threshold; else below
  double threshold = 0;  ///< N or Nm
};

struct Configuration {
  std::string product;  ///< prodname; empty when the box does not say
  Product kind = Product::net_box;
  std::string firmware;            ///< mfgdigver
  std::string serial;              ///< mfgdigsn, of the box; empty when it does not say
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
  std::optional<Peaks> peaks;         ///< runpkmx, runpkmn; nothing when the box does not keep them (setpke)

  bool monitoring = false;  ///< setmce: the box judges its monitor conditions
  /// Those switched on; nothing when the box does not tell them in a way that is understood.
  std::optional<std::vector<MonitorCondition>> monitor_conditions;

  std::string xml;  ///< what was read, verbatim
};

/// Cutoff of a Net Box's filter code in Hz, 0 = no filter; nothing for a code that no manual names.
[[nodiscard]] std::optional<double> filter_cutoff_hz(int filter_code) noexcept;
/// That of the box; nothing for an Axia's filter, whose table depends on its rate and is not known.
[[nodiscard]] std::optional<double> filter_cutoff_hz(const Configuration& box) noexcept;

/// Throws DeviceError, naming `device`, for whatever leaves the scale or the rate in doubt: missing, repeated or
/// unreadable elements, an unknown unit, counts per unit or ranges not above zero, an empty calibration (FT0000), a
/// product that is neither a Net Box nor an Ethernet Axia, a rate that its product has not. Independent of the locale.
[[nodiscard]] Configuration parse_configuration(std::string_view xml, const std::string& device = "Net Box");

}  // namespace kphi::netbox
