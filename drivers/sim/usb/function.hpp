// A simulated USB device without a bus: what it is, how it answers, and the faults that strike it.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "drivers/sim/script/faults.hpp"
#include "drivers/sim/script/script_run.hpp"

namespace kphi::sim {

struct UsbEndpointShape {
  std::uint8_t address = 0;     ///< bit 7: IN
  std::uint8_t attributes = 2;  ///< 2 bulk, 3 interrupt
  std::uint16_t packet_bytes = 64;
};

struct UsbInterfaceShape {
  std::uint8_t class_code = 0, subclass = 0, protocol = 0;
  std::vector<UsbEndpointShape> endpoints;
};

/// What its descriptors state.
struct UsbShape {
  std::uint16_t vendor = 0, product = 0;
  std::string manufacturer, product_name, serial;  ///< an empty serial: it has none
  std::vector<UsbInterfaceShape> interfaces;
};

struct UsbSetup {
  std::uint8_t request_type = 0, request = 0;
  std::uint16_t value = 0, index = 0, length = 0;
};

/// How a function answers: bytes, a stall, or nothing yet.
struct UsbAnswer {
  enum class Kind : std::uint8_t { bytes, stall, nothing_yet } kind = Kind::bytes;
  std::vector<std::uint8_t> bytes;
};

/// Called by one thread, the bus's.
class UsbFunction {
 public:
  virtual ~UsbFunction() = default;
  [[nodiscard]] virtual const UsbShape& shape() const noexcept = 0;
  /// A class or vendor request; `out`: data of an OUT request.
  virtual UsbAnswer control(const UsbSetup& setup, std::span<const std::uint8_t> out) = 0;
  virtual UsbAnswer out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) = 0;
  /// Asked again and again while it has nothing yet, until the host gives up.
  virtual UsbAnswer in(std::uint8_t endpoint, std::size_t at_most) = 0;
  virtual void halt_cleared(std::uint8_t endpoint) { (void)endpoint; }
  /// How long it takes to let its interface go, wall time.
  [[nodiscard]] virtual Duration release_takes() { return {}; }
};

/// A script in progress. Thread-safe.
class UsbFaults {
 public:
  /// `clock` must outlive this.
  explicit UsbFaults(const Clock& clock, FaultScript script = {}) : clock_(clock), script_(std::move(script), 1) {}

  /// The fault of this kind (and of this register) that is active now, if any; counts it.
  [[nodiscard]] std::optional<Fault> strikes(FaultKind kind, int at_register = -1) {
    const std::lock_guard lock(mutex_);
    const Fault* fault = script_.strike(
        clock_.now(), [&](const Fault& f) { return f.kind == kind && (at_register < 0 || f.address == at_register); });
    return fault == nullptr ? std::nullopt : std::optional(*fault);
  }
  /// The same without counting it.
  [[nodiscard]] bool active(FaultKind kind) const {
    const std::lock_guard lock(mutex_);
    return script_.any_active(clock_.now(), [kind](const Fault& f) { return f.kind == kind; });
  }
  [[nodiscard]] FaultScript script() const {
    const std::lock_guard lock(mutex_);
    return script_.faults();
  }
  void set(FaultScript script) {
    const std::lock_guard lock(mutex_);
    script_ = ScriptRun(std::move(script), 1);
  }
  [[nodiscard]] Instant now() const noexcept { return clock_.now(); }
  [[nodiscard]] const Clock& clock() const noexcept { return clock_; }

 private:
  const Clock& clock_;
  mutable std::mutex mutex_;
  ScriptRun script_;
};

}  // namespace kphi::sim
