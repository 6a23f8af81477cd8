// What a simulated Net Box is set to: what a person can write into it over its web pages, and what nobody has measured
// yet and this box therefore does either way.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "drivers/sim/load_cell.hpp"

namespace kphi::sim {

inline constexpr int kSlots = 16;  ///< configurations, calibrations and monitor conditions: sixteen of each

/// One configuration. Units are the box's codes (manual, TCP interface): see netbox_units.hpp.
struct Slot {
  std::string name = "empty";
  int calibration = 0;      ///< 0..15
  int force_unit = 2;       ///< N
  int torque_unit = 3;      ///< N m
  int distance_unit = 3;    ///< mm
  int angle_unit = 1;       ///< degrees
  Wrench tool_transform{};  ///< Dx Dy Dz Rx Ry Rz in the two units above
  std::string user_a = "empty", user_b = "empty";
};

/// One statement that the box judges 7000 times a second.
struct MonitorCondition {
  bool enabled = false;
  int axis = -1;            ///< 0..5 = Fx..Tz, -1: none
  int comparison = 1;       ///< 1: '>', -1: '<'
  std::int32_t counts = 0;  ///< threshold
  int output = 0;           ///< code, 0..255
};

/// Open questions of the box; the first value is the likeliest.
struct NetBoxHabits {
  enum class RateWrite : std::uint8_t { stops, continues, pauses };  ///< of a running stream; the pause is 50 ms
  enum class LastBlock : std::uint8_t { partial, padded, dropped };
  bool bias_stops_stream = false;         ///< 0x0042
  bool bias_vector_survives = true;       ///< setbias over a power cycle
  bool software_bias_survives = false;    ///< 0x0042 over a power cycle
  bool software_bias_in_setbias = false;  ///< 0x0042 shows in the XML
  RateWrite rate_write = RateWrite::stops;
  LastBlock last_block = LastBlock::partial;  ///< of a finite buffered request
  bool command_one_streams = false;           ///< 0x0001 as real-time mode
  bool command_four_streams = true;           ///< 0x0004 as real-time mode
  std::uint32_t first_rdt_sequence = 1;       ///< 0 in one public simulator
  bool ft_counts_samples = true;              ///< false: it counts records
  bool torque_text_with_hyphen = false;       ///< N-m instead of Nm
  bool flags_as_digits = false;               ///< 1 and 0 instead of Enabled and Disabled
  char array_separator = ';';                 ///< ';', ',' or ' ', of arrays in the XML
  bool product_name = true;                   ///< prodname is in the XML
  bool axia = false;                          ///< Ethernet Axia: other commands, other status bits
  bool close_on_unknown_tcp = false;          ///< WRITETRANSFORM, WRITETHRESHOLD; false: no answer
  bool only_three_writes = false;             ///< of CGI within a second
  bool readft_sets_conditions = true;         ///< READFT's MCEnable persists
  bool one_http_connection = true;            ///< at a time
};

struct NetBoxSettings {
  double rate_hz = 7000;                       ///< comrdtrate as asked for; the box rounds up to 7000/n
  int records_per_datagram = 40;               ///< comrdtbsiz, 1..40
  std::uint32_t first_ft_sequence = 0;         ///< of the first sample after power-up
  Wrench range{20, 20, 60, 1, 1, 1};           ///< N and N m, of calibration 0: Mini40 SI-20-1
  std::int32_t counts_per_force = 1'000'000;   ///< per N, of slots in N
  std::int32_t counts_per_torque = 1'000'000;  ///< per N m, of slots in N m
  std::string serial = "FT21001";              ///< of calibration 0; the others are empty
  std::string address = "127.0.0.1";           ///< as the box reports it
  bool rdt_enabled = true;                     ///< comrdte
  bool ethernet_ip = false;                    ///< comeipe
  int active_slot = 0;                         ///< setcfgsel
  int filter = 0;                              ///< setuserfilter, 0..12
  bool peaks = true;                           ///< setpke
  std::array<int, 6> bias_vector{};            ///< setbias, gage counts; see NetBoxSignal
  bool monitoring = false;                     ///< setmce
  std::array<MonitorCondition, kSlots> conditions{};
  std::array<Slot, kSlots> slots = numbered_slots();
  NetBoxHabits habits;

  /// Slot n uses calibration n; only the first has one.
  [[nodiscard]] static std::array<Slot, kSlots> numbered_slots();
};

}  // namespace kphi::sim
