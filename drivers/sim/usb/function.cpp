#include "drivers/sim/usb/function.hpp"

#include <algorithm>
#include <iterator>

namespace kphi::sim {

std::optional<UsbFault> UsbFaults::strikes(UsbFaultKind kind, int at_register) {
  const std::lock_guard lock(mutex_);
  const UsbFault* fault = script_.strike(
      clock_.now(), [&](const UsbFault& f) { return f.kind == kind && (at_register < 0 || f.address == at_register); });
  return fault == nullptr ? std::nullopt : std::optional(*fault);
}

bool UsbFaults::active(UsbFaultKind kind) const {
  const std::lock_guard lock(mutex_);
  return script_.any_active(clock_.now(), [kind](const UsbFault& f) { return f.kind == kind; });
}

UsbFaultScript UsbFaults::unplugged() const {
  const std::lock_guard lock(mutex_);
  UsbFaultScript windows;
  std::copy_if(script_.faults().begin(), script_.faults().end(), std::back_inserter(windows),
               [](const UsbFault& fault) { return fault.kind == UsbFaultKind::unplug; });
  std::sort(windows.begin(), windows.end(), [](const UsbFault& a, const UsbFault& b) { return a.at < b.at; });
  return windows;
}

void UsbFaults::set(UsbFaultScript script) {
  const std::lock_guard lock(mutex_);
  script_ = ScriptRun<UsbFault>(std::move(script), 1);
}

}  // namespace kphi::sim
