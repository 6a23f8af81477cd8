#include "drivers/ambient/source.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "drivers/ambient/bme280.hpp"
#include "drivers/usb/bus.hpp"

namespace kphi::ambient {

ManualAmbient::ManualAmbient(const Air& air) : air_(air) {
  if (!plausible(air)) throw std::invalid_argument("air: temperature, pressure or humidity out of range");
}

namespace {

struct OpenBridge {
  explicit OpenBridge(const UsbAddress& address) : device(bus.open(address)), bridge(*device) {}
  usb::Bus bus;
  std::unique_ptr<usb::Transport> device;
  Mcp2221 bridge;
};

/// Owns bus, device and bridge, which outlive the sensor.
class UsbBme280 final : OpenBridge, public Bme280Sensor {
 public:
  explicit UsbBme280(const UsbAddress& address) : OpenBridge(address), Bme280Sensor(bridge, device->name()) {}
};

struct Opener {
  std::unique_ptr<Ambient> operator()(const Unknown&) const { return nullptr; }
  std::unique_ptr<Ambient> operator()(const Air& air) const { return std::make_unique<ManualAmbient>(air); }
  std::unique_ptr<Ambient> operator()(const UsbAddress& address) const { return std::make_unique<UsbBme280>(address); }
};

}  // namespace

Source source_of(std::string_view text) {
  if (text == "unknown") return Unknown{};
  const UsbAddress address = UsbAddress::parse(text);
  if (address.vendor == Mcp2221::kVendor && address.product == Mcp2221::kProduct) return address;
  throw std::invalid_argument(fmt::format(
      "\"{}\" is not a known sensor of the air; write usb:04d8:00dd (a BME280 behind an MCP2221A), manual: and the "
      "values, or unknown",
      text));
}

std::unique_ptr<Ambient> open(const Source& source) { return std::visit(Opener{}, source); }

}  // namespace kphi::ambient
