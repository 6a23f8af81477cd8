// Any text as the box's configuration: refused, or a scale that can be divided by.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "base/error.hpp"
#include "drivers/netbox/configuration/configuration.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kphi;
  try {
    const netbox::Configuration read =
        netbox::parse_configuration({reinterpret_cast<const char*>(data), size}, "Net Box");
    const bool usable = std::isfinite(read.counts_per_newton) && read.counts_per_newton > 0 &&
                        std::isfinite(read.counts_per_newton_metre) && read.counts_per_newton_metre > 0 &&
                        read.divisor >= 1 && read.records_per_datagram >= 1 && read.records_per_datagram <= 40;
    if (!usable) std::abort();
  } catch (const DeviceError&) {
  }
  return 0;
}
