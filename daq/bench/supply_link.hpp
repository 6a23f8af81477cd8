// The bench supply as guard and runner see it.
#pragma once

#include <span>
#include <string>

#include "results/supply_reading.hpp"

namespace kphi::daq {

class OutputEnable;

/// switch_off() failed to confirm.
inline constexpr const char* kNotOff = "supply: output NOT confirmed off, it may be ON; cut the 12 V at the switch";

/// Only OutputEnable can switch the output on; its destructor switches it off.
class SupplyLink {
 public:
  virtual ~SupplyLink() = default;
  /// One line: model, serial, firmware, and where.
  [[nodiscard]] virtual std::string identity() const = 0;
  /// Takes its readings since the last call. The guard's thread.
  virtual std::size_t take(std::span<results::SupplyReading> out) = 0;
  /// Why the link failed; empty while it works. Thread-safe.
  [[nodiscard]] virtual std::string failure() const = 0;
  /// Output off. Thread-safe; does not wait.
  virtual void cut() noexcept = 0;
  /// Output off, and waits until the supply confirms it. Returns why it may still be on; empty: it is off.
  [[nodiscard]] virtual std::string switch_off() noexcept = 0;

 private:
  friend class OutputEnable;
  /// Sets and verifies the limits, then switches the output on; returns once the voltage is there. Throws DeviceError.
  virtual void switch_on() = 0;
};

/// The motor has power while this lives.
class [[nodiscard]] OutputEnable {
 public:
  explicit OutputEnable(SupplyLink& supply) : supply_(supply) {
    try {
      supply_.switch_on();
    } catch (...) {
      (void)supply_.switch_off();
      throw;
    }
  }
  ~OutputEnable() { (void)supply_.switch_off(); }
  OutputEnable(const OutputEnable&) = delete;
  OutputEnable& operator=(const OutputEnable&) = delete;

 private:
  SupplyLink& supply_;
};

}  // namespace kphi::daq
