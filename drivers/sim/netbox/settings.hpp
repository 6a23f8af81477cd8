// What a simulated Net Box is set to over its web pages, and its quirks: behaviour that has not been measured yet and
// can therefore be chosen.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "drivers/sim/physics/plant.hpp"

namespace kphi::sim {

// Unit codes, their spellings, and counts per unit (manual, TCP interface). Counts: 1 000 000 for N and 1 for lbf were
// seen on one box; the rest follows the same pattern: SI in millionths, customary units in whole ones.

struct Unit {
  std::string_view name;
  double si;   ///< SI units in one of these
  int counts;  ///< per unit
};

inline constexpr Unit kForceUnits[] = {{"lbf", 4.4482216152605, 1}, {"N", 1, 1'000'000}, {"klbf", 4448.2216152605, 1},
                                       {"kN", 1000, 1'000'000},     {"kgf", 9.80665, 1}, {"gf", 0.00980665, 1}};
inline constexpr Unit kTorqueUnits[] = {
    {"lbf-in", 0.1129848290276167, 1}, {"lbf-ft", 1.3558179483314004, 1}, {"Nm", 1, 1'000'000}, {"Nmm", 0.001, 1000},
    {"kgf-cm", 0.0980665, 1},          {"kNm", 1000, 1'000'000}};

/// Codes count from 1.
[[nodiscard]] constexpr const Unit& unit(std::span<const Unit> units, int code) noexcept {
  return units[static_cast<std::size_t>(code - 1)];
}

inline constexpr int kSlots = 16;  ///< configurations, calibrations and monitor conditions: sixteen of each

/// One configuration: codes of the tables above. Slot n uses calibration n; only the first has one.
struct Slot {
  int force_unit = 2;   ///< N
  int torque_unit = 3;  ///< N m
};

/// Open questions of the box; the first value is the likeliest. A fault script sets them by these names.
struct NetBoxQuirks {
  enum class RateWrite : std::uint8_t { stops, continues, pauses };  ///< of a running stream; the pause is 50 ms
  enum class LastBlock : std::uint8_t { partial, padded, dropped };
  bool bias_stops_stream = false;  ///< 0x0042
  RateWrite rate_write = RateWrite::stops;
  LastBlock last_block = LastBlock::partial;  ///< of a finite buffered request
  bool torque_text_with_hyphen = false;       ///< N-m instead of Nm
  bool flags_as_digits = false;               ///< 1 and 0 instead of Enabled and Disabled
  char array_separator = ';';                 ///< of arrays in the XML: semicolon, comma or blank
  bool axia = false;                          ///< Ethernet Axia: other commands, other status bits
  bool only_three_writes = false;             ///< of CGI within a second; further ones are answered, and ignored
  /// Pages and CGI served within a second: all, or three, and the next connections end without a word or with a status.
  enum class Served : std::uint8_t { all, three_then_closed, three_then_503 };
  Served served = Served::all;
};

/// `name` as above; `value`: true or false, or a word. Throws FaultEntryError.
void set_quirk(NetBoxQuirks& quirks, const std::string& name, const std::string& value);

struct NetBoxSettings {
  double rate_hz = 7000;                ///< comrdtrate as asked for; the box rounds up to 7000/n
  int records_per_datagram = 40;        ///< comrdtbsiz, 1..40
  std::uint32_t first_ft_sequence = 0;  ///< of the first sample after power-up
  Wrench range{20, 20, 60, 1, 1, 1};    ///< N and N m, of calibration 0: Mini40 SI-20-1
  std::string address = "127.0.0.1";    ///< as the box reports it
  int active_slot = 0;                  ///< setcfgsel
  int filter = 0;                       ///< setuserfilter, 0..12
  std::array<int, 6> bias_vector{};     ///< setbias, gage counts; see NetBoxSignal
  std::array<Slot, kSlots> slots{};
  NetBoxQuirks quirks;
};

/// Counts per configured unit of a slot; 0 without a calibration.
[[nodiscard]] inline int counts_per_force(const NetBoxSettings& settings, int slot) noexcept {
  return slot == 0 ? unit(kForceUnits, settings.slots[0].force_unit).counts : 0;
}
[[nodiscard]] inline int counts_per_torque(const NetBoxSettings& settings, int slot) noexcept {
  return slot == 0 ? unit(kTorqueUnits, settings.slots[0].torque_unit).counts : 0;
}

}  // namespace kphi::sim
