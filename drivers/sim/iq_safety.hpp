// power_safety of the simulated module: which limits are crossed, and whether it is in safe mode.
#pragma once

#include <cstdint>

#include "drivers/sim/iq_entries.hpp"
#include "drivers/sim/iq_sensors.hpp"

namespace kphi::sim {

class IqSafety {
 public:
  /// Looks at every limit. True: safe mode has just begun.
  bool check(const IqMemory& memory, const IqReadings& readings) noexcept;
  /// A write of fault_ever: these bits stay.
  void clear(std::uint8_t keep) noexcept { ever_ &= keep; }
  void power_up() noexcept { now_ = ever_ = 0; }

  [[nodiscard]] std::uint8_t now() const noexcept { return now_; }
  [[nodiscard]] std::uint8_t ever() const noexcept { return ever_; }
  /// No spin, no voltage.
  [[nodiscard]] bool safe_mode() const noexcept { return safe_; }

 private:
  std::uint8_t now_ = 0;
  std::uint8_t ever_ = 0;
  bool safe_ = false;
};

}  // namespace kphi::sim
