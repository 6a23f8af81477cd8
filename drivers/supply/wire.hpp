// Modbus supplies on the wire: their addresses, the registers of each family, the scales of each model.
//
//     modbus-rtu:/dev/ttyUSB1?baud=115200&slave=1&model=RD6006
//     modbus-tcp:192.168.1.20:502?slave=1
//
// Every option after `?` is optional: baud defaults to the model's usual one (115200 without a model), slave to 1, port
// to 502; without a model the device is asked for its model.
//
// Families: Riden RD60xx, RuiDeng DPS/DPH, Hanmatek HM3xx (eTommens). Registers are 16 bit; a double one has its high
// word first. Left out because sources disagree: Riden 12 (charge, energy or half of the power), 13 (scale of the power
// on P models: power is the product), 19 (preset: not reliable to read).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/last_word.hpp"
#include "base/uri.hpp"
#include "drivers/supply/supply.hpp"

namespace kphi::supply {

struct Address {
  enum class Wire : std::uint8_t { rtu, tcp };
  std::string uri;  ///< as written, for messages
  Wire wire = Wire::rtu;
  std::string device;  ///< rtu: absolute path
  unsigned baud = 0;   ///< rtu: one that known_baud() knows
  HostPort tcp;
  int slave = 1;       ///< 1 to 247; tcp also 255
  std::string model;   ///< of the table of models; empty: any of them
  unsigned looks = 4;  ///< readings per second; more only where a module is known to bear them

  /// "/dev/ttyUSB1" or "192.168.1.20:502".
  [[nodiscard]] std::string where() const;
};

/// Rates that libmodbus sets as asked; for any other it silently runs at 9600 baud.
[[nodiscard]] bool known_baud(unsigned baud) noexcept;

/// Strict. Throws std::invalid_argument with one line that ends in what to write instead.
[[nodiscard]] Address parse_address(const std::string& text);

struct Block {
  std::uint16_t first = 0, count = 0;
};

/// A register that may be written. Riden's 55 to 62 calibrate the device and 256 starts its bootloader: such an
/// address does not compile.
class Writable {
 public:
  consteval Writable(std::uint16_t address) : address_(address) {  // NOLINT: a table reads better without its name
    if ((address >= 55 && address <= 62) || address >= 256) throw "this register must never be written";
  }
  constexpr operator std::uint16_t() const noexcept { return address_; }  // NOLINT

 private:
  std::uint16_t address_;
};

inline constexpr int kAbsent = -1;

struct RegisterMap {
  std::string_view family;
  unsigned usual_baud;
  bool write_multiple = true;  ///< settings are written with function 0x10, else 0x06
  /// No other block has its number of registers, so an answer to it proves that no older answer can follow.
  Block identity;
  std::uint16_t model;
  int serial = kAbsent, firmware = kAbsent, decimals = kAbsent;  ///< serial: high word
  std::array<Block, 3> look;                                     ///< what a reading needs; count 0: unused
  Writable set_voltage, current_limit;
  std::uint16_t voltage, current;
  std::uint16_t protection;
  bool protection_bits = false;  ///< one bit per cause, else a number
  int regulation = kAbsent;
  Writable output;
  int current_range = kAbsent;
  Block thresholds;
  Writable over_voltage, over_current;
  int keypad = kAbsent;  ///< 1 while it is locked, as its own firmware does while it is asked
};

/// Counts per ampere, and the largest setting, of one position of the current range.
struct CurrentRange {
  double counts_per_a = 0, max_a = 0;
};

struct Model {
  std::string_view name;
  std::uint16_t first_id, last_id;  ///< the last digit is a variant of the hardware
  const RegisterMap* map;
  double counts_per_v, max_v;
  std::array<CurrentRange, 2> ranges;    ///< the second only where the map has current_range
  double over_current_counts_per_a = 0;  ///< where thresholds count otherwise; 0: as the range does
};

[[nodiscard]] const std::vector<Model>& models();
[[nodiscard]] std::vector<std::string_view> model_names();
/// Families in the order in which an unknown device is identified.
[[nodiscard]] std::vector<const RegisterMap*> families();
/// nullptr when there is none.
[[nodiscard]] const Model* find_model(std::string_view name);
[[nodiscard]] const Model* find_model(const RegisterMap& map, std::uint16_t id);

/// Switches the output of the `device` off, how it acknowledges that (function 0x06, which echoes), and how its
/// register is read back (0x03).
[[nodiscard]] LastWord off_word(const Address& address, const RegisterMap& map, std::string device);

/// The device's word for why it has switched off.
[[nodiscard]] SupplyProtection protection_of(const RegisterMap& map, std::uint16_t code) noexcept;

/// To the nearest count. `value` is finite and not negative, and the result fits: see fits().
[[nodiscard]] std::uint16_t to_counts(double value, double counts_per_unit) noexcept;
/// Finite, not negative, at most `max` (to the nearest count) and 16 bits.
[[nodiscard]] bool fits(double value, double counts_per_unit, double max) noexcept;

}  // namespace kphi::supply
