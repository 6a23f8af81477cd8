#include "drivers/sim/usb_faults.hpp"

#include <algorithm>
#include <iterator>

#include "drivers/sim/fault_table.hpp"

namespace kphi::sim {
namespace {

using P = FaultParameter<UsbFault>;

const FaultTable<UsbFault>& table() {
  using F = UsbFault;
  using K = UsbFaultKind;
  using E = FaultExtent;
  const P size{"size", P::into<&F::size>, 1, 4096, true, true};
  static const FaultTable<UsbFault> all(
      "USB",
      {{K::unplug, "unplug", E::window, {}},
       {K::no_reply, "no_reply", E::window_or_count, {}},
       {K::late, "late", E::window_or_count, {{"delay_s", P::into<&F::delay>, 0, 3600, false, true}}},
       {K::stall, "stall", E::window_or_count, {}},
       {K::nack, "nack", E::window_or_count, {}},
       {K::busy, "busy", E::window_or_count, {}},
       {K::stuck_bus, "stuck_bus", E::window_or_count, {}},
       {K::reads_as,
        "reads_as",
        E::window_or_count,
        {{"register", P::into<&F::address>, 0, 255, true, true}, {"value", P::into<&F::value>, 0, 255, true, true}}},
       {K::wrong_tag, "wrong_tag", E::window_or_count, {}},
       {K::empty_first, "empty_first", E::window_or_count, {}},
       {K::packets, "packets", E::window_or_count, {size}},
       {K::parts, "parts", E::window_or_count, {size}},
       {K::deaf_to_abort, "deaf_to_abort", E::window_or_count, {}},
       {K::closed, "closed", E::window_or_count, {}}});
  return all;
}

}  // namespace

std::string_view name_of(UsbFaultKind kind) noexcept { return table().name_of(kind); }

UsbFault usb_fault_of(const FaultEntry& entry) { return table().read(entry); }

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
  const Instant now = clock_.now();
  return now >= fault.at && now < fault.end() && (fault.count == 0 || struck_[number] < fault.count);
}

}  // namespace kphi::sim
