#include "drivers/ambient/source.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "drivers/ambient/bme280_sensor.hpp"
#include "drivers/ambient/manual_ambient.hpp"
#include "drivers/usb/bus.hpp"

namespace kphi::ambient {
namespace {

/// Bus, device, bridge and sensor, destroyed in the opposite order.
class UsbBme280 final : public Ambient {
 public:
  explicit UsbBme280(const UsbAddress& address)
      : device_(bus_.open(address)), bridge_(*device_), sensor_(bridge_, device_->name()) {}
  [[nodiscard]] Air read() override { return sensor_.read(); }
  [[nodiscard]] const std::string& identity() const noexcept override { return sensor_.identity(); }

 private:
  usb::Bus bus_;
  std::unique_ptr<usb::Transport> device_;
  Mcp2221 bridge_;
  Bme280Sensor sensor_;
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
