// Faults of USB, of the bridge with its sensor, and of an SCPI instrument. In a script, kinds begin with ambient_:
// {at_s: 0, count: 3, kind: ambient_nack}; times are bench time.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "base/clock.hpp"
#include "drivers/sim/script/fault_table.hpp"

namespace kphi::sim {

enum class UsbFaultKind : std::uint8_t {
  unplug,    ///< pulled out during for_s, then plugged in again
  no_reply,  ///< the command was obeyed, its answer never comes
  late,      ///< its answer comes after `delay_s`
  stall,     ///< the endpoint of the answers halts
  // the bridge and its bus
  nack,       ///< nobody acknowledges the address
  busy,       ///< the bridge is still occupied
  stuck_bus,  ///< somebody holds SDA low: no start condition
  // the sensor
  reads_as,  ///< `register` reads `value`, say a damaged byte of the calibration
  // the instrument
  wrong_tag,      ///< the answer bears the tag of another request
  empty_first,    ///< an empty packet before the answer
  packets,        ///< the answer comes in packets of `size` bytes
  parts,          ///< the answer comes in messages of `size` bytes, the last of them marked as the end
  deaf_to_abort,  ///< it acknowledges abort and clear, and sends the old answer all the same
  closed,         ///< TCP: the connection ends instead of an answer
};

struct UsbFault : ScriptedFault<UsbFaultKind> {
  Duration delay{0};
  std::uint64_t size = 16;
  std::uint8_t address = 0, value = 0;  ///< of a register
};

using UsbFaultScript = std::vector<UsbFault>;

/// Of the air sensor and its bridge; a script cannot have those of an instrument.
[[nodiscard]] const FaultTable<UsbFault>& ambient_faults();

/// A script in progress. Thread-safe.
class UsbFaults {
 public:
  /// `clock` must outlive this.
  explicit UsbFaults(const Clock& clock, UsbFaultScript script = {}) : clock_(clock), script_(std::move(script)) {}

  /// The fault of this kind (and of this register) that is active now, if any; counts it.
  [[nodiscard]] std::optional<UsbFault> strikes(UsbFaultKind kind, int at_register = -1);
  /// The same without counting it.
  [[nodiscard]] bool active(UsbFaultKind kind) const;
  /// Windows during which the device is pulled out, in order.
  [[nodiscard]] UsbFaultScript unplugged() const;
  void set(UsbFaultScript script);
  [[nodiscard]] Instant now() const noexcept { return clock_.now(); }
  [[nodiscard]] const Clock& clock() const noexcept { return clock_; }

 private:
  [[nodiscard]] bool is_active(const UsbFault& fault, std::size_t number) const noexcept;

  const Clock& clock_;
  mutable std::mutex mutex_;
  UsbFaultScript script_;
  std::vector<std::uint64_t> struck_ = std::vector<std::uint64_t>(script_.size(), 0);
};

}  // namespace kphi::sim
