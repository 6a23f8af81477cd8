// What the box says about itself (netftapi2.xml of the active slot), in SI.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/tcp.hpp"
#include "drivers/netbox/wire/status.hpp"

namespace kphi::netbox {

/// Largest and smallest counts since the box was switched on or the peaks were reset.
struct Peaks {
  std::array<double, 6> high{}, low{};
};

/// A condition that the box checks with each internal sample, at any output rate: once it was true, bit 16 of the
/// status stays set until somebody resets it on the box's web pages.
struct MonitorCondition {
  int axis = 0;          ///< 0..5 = Fx..Tz
  bool above = true;     ///< true of a load above the threshold; else below
  double threshold = 0;  ///< N or Nm
};

/// Where a Net Box answers.
struct Address {
  std::string host;
  std::uint16_t rdt_port = 49152;
  std::uint16_t http_port = 80;
  std::string from{};  ///< address of this computer to speak from; empty: as the kernel routes

  [[nodiscard]] Host where() const { return {host, from}; }
};

struct Configuration {
  std::string product;  ///< prodname; empty if the box reports none
  Product kind = Product::net_box;
  std::string firmware;            ///< mfgdigver
  std::string serial;              ///< mfgdigsn, of the box; empty if it reports none
  std::string calibration_serial;  ///< cfgcalsn
  int slot = 0;                    ///< setcfgsel: zero-based, the box's web pages count from one
  int calibration = 0;             ///< cfgcalsel, zero-based, too; the slot's number if the box reports none
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
  std::optional<Peaks> peaks;         ///< runpkmx, runpkmn; nullopt if the box does not keep them (setpke)

  bool monitoring = false;  ///< setmce: the box judges its monitor conditions
  /// The enabled ones; nullopt if the box reports them in an unknown form.
  std::optional<std::vector<MonitorCondition>> monitor_conditions;

  std::string xml;  ///< as read, verbatim

  /// `axis`: 0..5 = Fx..Tz.
  [[nodiscard]] double counts_per_unit(std::size_t axis) const noexcept {
    return axis < 3 ? counts_per_newton : counts_per_newton_metre;
  }
};

/// Cutoff of a Net Box's filter code in Hz, 0 = no filter; nullopt for a code that no manual names.
[[nodiscard]] std::optional<double> filter_cutoff_hz(int filter_code) noexcept;
/// Cutoff of the box's filter; nullopt for an Axia, whose table depends on its rate and is unknown.
[[nodiscard]] std::optional<double> filter_cutoff_hz(const Configuration& box) noexcept;

/// Throws DeviceError, naming `device`, if the scale or the rate is not certain: missing, repeated or
/// unreadable elements, an unknown unit, counts per unit or ranges not above zero, an empty calibration (FT0000), a
/// product that is neither a Net Box nor an Ethernet Axia, a rate that its product does not have. Independent of the
/// locale.
[[nodiscard]] Configuration parse_configuration(std::string_view xml, const std::string& device = "Net Box");

/// Bits of Changes.
enum class Change : std::uint32_t {
  product = 1u << 0,
  firmware = 1u << 1,
  calibration = 1u << 2,
  slot = 1u << 3,
  units = 1u << 4,
  counts_per_unit = 1u << 5,
  ranges = 1u << 6,
  rate = 1u << 7,
  records_per_datagram = 1u << 8,
  filter = 1u << 9,
  tool_transform = 1u << 10,
  gage_bias = 1u << 11,
};
using Changes = std::uint32_t;

[[nodiscard]] constexpr bool has(Changes changes, Change change) noexcept {
  return (changes & static_cast<Changes>(change)) != 0;
}
/// The records must be counted and timed in another way.
[[nodiscard]] constexpr bool changes_stream(Changes changes) noexcept {
  return has(changes, Change::product) || has(changes, Change::rate) || has(changes, Change::records_per_datagram);
}

[[nodiscard]] Changes compare(const Configuration& before, const Configuration& after);
/// "calibration, filter"; empty without changes.
[[nodiscard]] std::string to_words(Changes changes);

/// The box's peaks are narrower than before, so the box has booted (or somebody has reset the peaks on its Snapshot
/// page).
[[nodiscard]] bool forgot_peaks(const Configuration& before, const Configuration& after) noexcept;

}  // namespace kphi::netbox
