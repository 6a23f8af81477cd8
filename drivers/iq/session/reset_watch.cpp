#include "drivers/iq/session/reset_watch.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace kphi::iq {
namespace {

constexpr int kUnderVoltage = 1 << static_cast<int>(FaultBit::under_voltage);

}  // namespace

void ResetWatch::begin(const Identity& identity) noexcept {
  uptime_ = identity.uptime_s;
  faults_ = identity.fault_ever < 0 ? 0 : identity.fault_ever;
}

std::optional<std::string> ResetWatch::take(const QueryResult& result) {
  if (result.answers(entry<"system_control.time">) && std::isfinite(result.value())) {
    const auto before = std::exchange(uptime_, result.value());
    if (before && result.value() < *before) {
      return fmt::format("its uptime went from {:.3f} s back to {:.3f} s", *before, result.value());
    }
  }
  if (result.answers(entry<"power_safety.fault_ever">)) {
    const int before = std::exchange(faults_, static_cast<int>(result.value()));
    if ((faults_ & ~before & kUnderVoltage) != 0) return "it reports an under-voltage (fault bit 0)";
  }
  return std::nullopt;
}

}  // namespace kphi::iq
