#include "drivers/sim/usb/faults.hpp"

#include <algorithm>
#include <iterator>

namespace kphi::sim {

const FaultTable<UsbFault>& ambient_faults() {
  using F = UsbFault;
  using K = UsbFaultKind;
  using E = FaultExtent;
  static const FaultTable<UsbFault> all(
      "the air sensor", {{K::unplug, "ambient_unplug", E::window, {}},
                         {K::no_reply, "ambient_no_reply", E::window_or_count, {}},
                         {K::late, "ambient_late", E::window_or_count, {required<&F::delay>("delay_s")}},
                         {K::stall, "ambient_stall", E::window_or_count, {}},
                         {K::nack, "ambient_nack", E::window_or_count, {}},
                         {K::busy, "ambient_busy", E::window_or_count, {}},
                         {K::stuck_bus, "ambient_stuck_bus", E::window_or_count, {}},
                         {K::reads_as,
                          "ambient_reads_as",
                          E::window_or_count,
                          {required<&F::address>("register", 0, 255), required<&F::value>("value", 0, 255)}}});
  return all;
}

std::optional<UsbFault> UsbFaults::strikes(UsbFaultKind kind, int at_register) {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < script_.size(); ++i) {
    const UsbFault& fault = script_[i];
    if (fault.kind != kind || !is_active(fault, i) || (at_register >= 0 && fault.address != at_register)) continue;
    ++struck_[i];
    return fault;
  }
  return std::nullopt;
}

bool UsbFaults::active(UsbFaultKind kind) const {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < script_.size(); ++i)
    if (script_[i].kind == kind && is_active(script_[i], i)) return true;
  return false;
}

UsbFaultScript UsbFaults::unplugged() const {
  const std::lock_guard lock(mutex_);
  UsbFaultScript windows;
  std::copy_if(script_.begin(), script_.end(), std::back_inserter(windows),
               [](const UsbFault& fault) { return fault.kind == UsbFaultKind::unplug; });
  std::sort(windows.begin(), windows.end(), [](const UsbFault& a, const UsbFault& b) { return a.at < b.at; });
  return windows;
}

void UsbFaults::set(UsbFaultScript script) {
  const std::lock_guard lock(mutex_);
  script_ = std::move(script);
  struck_.assign(script_.size(), 0);
}

bool UsbFaults::is_active(const UsbFault& fault, std::size_t number) const noexcept {
  return fault.active(clock_.now(), struck_[number]);
}

}  // namespace kphi::sim
