// A programmable bench supply, whatever wire it hangs on. Calls block for as long as the wire needs and belong to one
// thread at a time; Worker gives them a thread of their own.
//
// Safety. Nothing but a PoweredOutput can switch the output on, and that switches it off when it dies.
#pragma once

#include <cstdint>
#include <string>

#include "compensation/units.hpp"
#include "drivers/clock.hpp"

namespace kphi::supply {

/// Why the supply has switched its output off by itself.
enum class Protection : std::uint8_t {
  none,
  over_voltage,
  over_current,
  over_power,
  over_temperature,
  short_circuit,
  unknown,  ///< tripped, and the supply's code is in no manual
};

/// What the supply holds.
enum class Regulation : std::uint8_t { constant_voltage, constant_current, unknown };

/// What is asked of the supply. Steps of the device: see Identity.
struct Limits {
  Volts voltage{0};
  Amperes current{0};       ///< beyond this the supply goes from constant voltage to constant current
  Volts over_voltage{0};    ///< beyond this it switches off
  Amperes over_current{0};  ///< beyond this it switches off
  friend bool operator==(const Limits&, const Limits&) = default;
};

/// Whom we speak to, and what it can do.
struct Identity {
  std::string device;                             ///< for messages: "supply RD6006 on /dev/ttyUSB1"
  std::string model;                              ///< "RD6006P"
  std::string serial;                             ///< empty: the device tells none
  std::string firmware;                           ///< "1.28"; empty: the device tells none
  double voltage_max_v = 0, current_max_a = 0;    ///< largest settings
  double voltage_step_v = 0, current_step_a = 0;  ///< one count of settings and readings
};

/// One look at the supply. A trip or an episode in constant current that begins and ends between two looks is not seen.
struct Reading {
  Instant at{0};            ///< bench time: midpoint of request and answer
  Duration uncertainty{0};  ///< half of the time between the two: the true moment is at ± uncertainty
  double voltage_v = 0;     ///< at the terminals
  double current_a = 0;
  double set_voltage_v = 0;    ///< as the supply has it now: somebody may have turned a knob
  double current_limit_a = 0;  ///< likewise
  Protection protection = Protection::none;
  Regulation regulation = Regulation::unknown;
  bool output = false;

  /// The product of what was measured; the supplies' own power registers have disputed scales.
  [[nodiscard]] double power_w() const noexcept { return voltage_v * current_a; }
};

/// What happened on the wire. Malformed input is counted; only what stays wrong after all retries is an error.
struct Counters {
  std::uint64_t requests = 0;     ///< sent, retries included
  std::uint64_t replies = 0;      ///< used
  std::uint64_t timeouts = 0;     ///< no answer, or only its beginning
  std::uint64_t damaged = 0;      ///< bad CRC or framing, foreign sender, wrong shape
  std::uint64_t refused = 0;      ///< the device answered that it will not
  std::uint64_t implausible = 0;  ///< whole, with values that cannot be
  std::uint64_t retries = 0;
  std::uint64_t flushes = 0;  ///< times the wire was left to fall silent and emptied
};

class PoweredOutput;

/// All members throw DeviceError when the device does not answer after bounded retries, refuses, or does not do what it
/// has acknowledged. None of them retries for longer than a few seconds.
class Supply {
 public:
  Supply() = default;
  virtual ~Supply() = default;
  Supply(const Supply&) = delete;
  Supply& operator=(const Supply&) = delete;

  /// Known since the construction; no traffic.
  [[nodiscard]] virtual const Identity& identity() const noexcept = 0;
  /// Sets all four, thresholds first, reads back what can be read, and returns what the device has been told, rounded
  /// to its steps. Throws std::invalid_argument for what is not finite, negative, or beyond Identity's largest.
  virtual Limits apply(const Limits& limits) = 0;
  [[nodiscard]] virtual Reading read() = 0;
  /// Returns when the device has reported that its output is off; also when it was off before.
  virtual void switch_off() = 0;
  [[nodiscard]] virtual Counters counters() const noexcept = 0;

 private:
  friend class PoweredOutput;
  /// Returns when the device has reported that its output is on.
  virtual void switch_on() = 0;
};

/// The output is on while this lives.
class [[nodiscard]] PoweredOutput {
 public:
  /// When this throws, an order to switch off has been tried already.
  explicit PoweredOutput(Supply& supply);
  /// Tries to switch off and stays silent about a failure: call off() to learn of it.
  ~PoweredOutput();
  PoweredOutput(const PoweredOutput&) = delete;
  PoweredOutput& operator=(const PoweredOutput&) = delete;

  /// Switches off; empty, or why that could not be confirmed. Once.
  [[nodiscard]] std::string off() noexcept;

 private:
  Supply* supply_;
};

}  // namespace kphi::supply
