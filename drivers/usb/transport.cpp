#include "drivers/usb/transport.hpp"

#include <fmt/format.h>

namespace kphi::usb {

const char* name_of(Outcome outcome) noexcept {
  switch (outcome) {
    case Outcome::done:
      return "done";
    case Outcome::timed_out:
      return "no answer in time";
    case Outcome::stalled:
      return "the endpoint stalled";
    case Outcome::gone:
      return "the device was unplugged";
    case Outcome::cancelled:
      return "cancelled";
    case Outcome::failed:
      break;
  }
  return "the transfer failed";
}

bool fits(const UsbAddress& wanted, const Listing& found) noexcept {
  return wanted.fits(found.vendor, found.product, found.serial) &&
         (wanted.port_path.empty() || wanted.port_path == found.port_path);
}

std::string to_string(const Listing& l) {
  return fmt::format("{:04x}:{:04x}{}{}, port {}{}", l.vendor, l.product, l.serial.empty() ? "" : ", serial ", l.serial,
                     l.port_path, l.readable ? "" : " (not readable by this user)");
}

}  // namespace kphi::usb
