#include "drivers/iq/session/module_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace kphi::iq {
namespace {

constexpr const Entry& kDriveMode = entry<"brushless_drive.drive_mode">;

}  // namespace

void DriveWatch::begin(Instant now) noexcept {
  if (watching_) return;
  watching_ = true;
  order_.reset();
  served_ = now;
}

void DriveWatch::told(std::uint64_t order, Instant now) noexcept {
  if (!order_) told_at_ = now;
  order_ = order;
  drives_at_.reset();
}

bool DriveWatch::may_tell(Exchange& exchange, Instant now) noexcept {
  if (!order_ || (drives_at_ && now - *drives_at_ <= fresh_)) return true;
  (void)exchange.ask(kDriveMode, module_id_, now);
  return false;
}

std::optional<DriveMode> DriveWatch::take(const QueryResult& result) noexcept {
  if (!watching_ || !order_ || !result.answers(kDriveMode) || result.request.order < *order_) return std::nullopt;
  const auto mode = static_cast<DriveMode>(static_cast<int>(result.value()));
  if (mode == DriveMode::spin_pwm || mode == DriveMode::spin_volts) {
    drives_at_ = result.end;
    return std::nullopt;
  }
  if (result.request.started < told_at_ + settles_) return std::nullopt;
  return mode;
}

std::optional<DriveWatch::Lapse> DriveWatch::lapsed(Instant last_reply, Instant now) noexcept {
  const Instant before = std::exchange(served_, now);
  if (!watching_) return std::nullopt;
  if (now - before > longest_) return Lapse{true, now - before};
  const Duration unheard = now - std::max(last_reply, told_at_);
  return unheard > longest_ ? std::optional(Lapse{false, unheard}) : std::nullopt;
}

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
