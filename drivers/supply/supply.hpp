// A programmable bench supply on any wire. Calls block for as long as the wire needs and belong to one
// thread at a time; Worker gives them a thread of their own.
//
// Safety. Only a PoweredOutput can switch the output on; its destructor switches it off.
#pragma once

#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "base/device_data.hpp"
#include "base/last_word.hpp"
#include "compensation/units.hpp"

namespace kphi::supply {

/// The settings of the supply.
struct Limits {
  Volts voltage{0};
  Amperes current{0};       ///< beyond this the supply goes from constant voltage to constant current
  Volts over_voltage{0};    ///< beyond this it switches off
  Amperes over_current{0};  ///< beyond this it switches off
  friend bool operator==(const Limits&, const Limits&) = default;
};

/// The device and its capabilities.
struct Identity {
  std::string device;                           ///< for messages: "supply RD6006 on /dev/ttyUSB1"
  std::string model;                            ///< "RD6006P"
  std::string serial;                           ///< empty: unknown
  std::string firmware;                         ///< "1.28"; empty: unknown
  double voltage_max_v = 0, current_max_a = 0;  ///< largest settings
  std::optional<LastWord> off{};                ///< switches its output off; nullopt: only this process can
  SupplyKeypad keypad = SupplyKeypad::free;     ///< while it is asked
  std::string untold{};                         ///< questions that it does not answer, such as why it went off
};

class PoweredOutput;

/// Empty, or why `act` has failed.
[[nodiscard]] std::string why_failed(const auto& act) noexcept {
  try {
    act();
    return {};
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "an unknown failure";
  }
}

/// All members throw DeviceError when the device does not answer after bounded retries, refuses, or acknowledges
/// without obeying. Retries end after a few seconds.
class Supply {
 public:
  Supply() = default;
  virtual ~Supply() = default;
  Supply(const Supply&) = delete;
  Supply& operator=(const Supply&) = delete;

  /// Read at construction; no traffic.
  [[nodiscard]] virtual const Identity& identity() const noexcept = 0;
  /// Sets all four, thresholds first, reads back every readable one, and returns the settings as sent, rounded to the
  /// device's steps. Throws std::invalid_argument for a value that is negative, not finite, or beyond the maximum.
  virtual Limits apply(const Limits& limits) = 0;
  /// `between` is called before each question after the first, and may throw, to leave the reading.
  [[nodiscard]] virtual SupplyReading read(const std::function<void()>& between) = 0;
  [[nodiscard]] SupplyReading read() {
    return read([] {});
  }
  /// Returns when the device has reported that its output is off; also when it was off before.
  virtual void switch_off() = 0;

 private:
  friend class PoweredOutput;
  /// Returns when the device has reported that its output is on.
  virtual void switch_on() = 0;
};

/// The output is on while this lives.
class [[nodiscard]] PoweredOutput {
 public:
  /// If this throws, it has already tried to switch off.
  explicit PoweredOutput(Supply& supply) : supply_(&supply) {
    try {
      supply.switch_on();
    } catch (...) {
      (void)off();
      throw;
    }
  }
  /// Tries to switch off; a failure is not reported: call off() for that.
  ~PoweredOutput() { (void)off(); }
  PoweredOutput(const PoweredOutput&) = delete;
  PoweredOutput& operator=(const PoweredOutput&) = delete;

  /// Switches off; empty, or why that could not be confirmed. Once.
  [[nodiscard]] std::string off() noexcept {
    Supply* const supply = std::exchange(supply_, nullptr);
    return supply == nullptr ? std::string() : why_failed([&] { supply->switch_off(); });
  }

 private:
  Supply* supply_;
};

}  // namespace kphi::supply
