#include "drivers/usb/transport.hpp"

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

}  // namespace kphi::usb
