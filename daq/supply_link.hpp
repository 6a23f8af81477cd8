// The bench supply as runner and recorder see it.
#pragma once

#include <span>
#include <string>

#include "results/supply_reading.hpp"

namespace kphi::daq {

class Powered;

/// Nothing but a Powered switches it on, and that switches it off when it goes.
class SupplyLink {
 public:
  virtual ~SupplyLink() = default;
  /// One line: model, serial, firmware, and where.
  [[nodiscard]] virtual std::string identity() const = 0;
  /// Takes what it showed since the last call. The guard's thread.
  virtual std::size_t take(std::span<results::SupplyReading> out) = 0;
  /// Why the link is dead; empty while it lives. Any thread.
  [[nodiscard]] virtual std::string failure() const = 0;
  /// Output off. Any thread; waits for nothing.
  virtual void cut() noexcept = 0;
  /// Output off, and waits until the supply has said so; empty, or why it may still be on.
  [[nodiscard]] virtual std::string switch_off() noexcept = 0;

 private:
  friend class Powered;
  /// Limits first, read back; then output on; returns when the voltage stands at the terminals. Throws DeviceError.
  virtual void switch_on() = 0;
};

/// The motor has power while this lives.
class [[nodiscard]] Powered {
 public:
  explicit Powered(SupplyLink& supply) : supply_(supply) {
    try {
      supply_.switch_on();
    } catch (...) {
      (void)supply_.switch_off();
      throw;
    }
  }
  ~Powered() { (void)supply_.switch_off(); }
  Powered(const Powered&) = delete;
  Powered& operator=(const Powered&) = delete;

 private:
  SupplyLink& supply_;
};

}  // namespace kphi::daq
