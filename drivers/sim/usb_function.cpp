#include "drivers/sim/usb_function.hpp"

namespace kphi::sim {
namespace {

void append16(std::vector<std::uint8_t>& bytes, std::size_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value));
  bytes.push_back(static_cast<std::uint8_t>(value >> 8));
}

}  // namespace

std::vector<std::uint8_t> descriptors_of(const UsbShape& shape) {
  std::vector<std::uint8_t> device{18, 1, 0x00, 0x02, 0, 0, 0, 64};
  append16(device, shape.vendor);
  append16(device, shape.product);
  append16(device, 0x0100);
  device.insert(device.end(), {1, 2, static_cast<std::uint8_t>(shape.serial.empty() ? 0 : 3), 1});

  std::vector<std::uint8_t> inner;
  for (std::size_t i = 0; i < shape.interfaces.size(); ++i) {
    const UsbInterfaceShape& one = shape.interfaces[i];
    const auto endpoints = static_cast<std::uint8_t>(one.endpoints.size());
    inner.insert(inner.end(),
                 {9, 4, static_cast<std::uint8_t>(i), 0, endpoints, one.class_code, one.subclass, one.protocol, 0});
    for (const UsbEndpointShape& endpoint : one.endpoints) {
      inner.insert(inner.end(), {7, 5, endpoint.address, endpoint.attributes});
      append16(inner, endpoint.packet_bytes);
      inner.push_back(1);
    }
  }
  std::vector<std::uint8_t> configuration{9, 2};
  append16(configuration, 9 + inner.size());
  configuration.insert(configuration.end(), {static_cast<std::uint8_t>(shape.interfaces.size()), 1, 0, 0x80, 50});

  device.insert(device.end(), configuration.begin(), configuration.end());
  device.insert(device.end(), inner.begin(), inner.end());
  return device;
}

}  // namespace kphi::sim
