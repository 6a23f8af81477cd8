// Where a bench file says that the state of the air comes from.
#pragma once

#include <memory>
#include <string_view>
#include <variant>

#include "drivers/ambient/ambient.hpp"
#include "drivers/usb/address.hpp"

namespace kphi::ambient {

/// Nobody knows: k cannot be compared with that of another day.
struct Unknown {
  friend bool operator==(const Unknown&, const Unknown&) = default;
};

/// Unknown; what a person has read off; or a BME280 behind the MCP2221A at this address.
using Place = std::variant<Unknown, Air, usb::Address>;

/// "unknown", or "usb:04d8:00dd" with :SERIAL or @PORT behind it if there are several. Throws std::invalid_argument
/// with one sentence that says what to write.
[[nodiscard]] Place place_of(std::string_view text);

/// Nothing for Unknown. Throws DeviceError: not plugged in, no sensor behind it; std::invalid_argument: no air is like
/// what was written by hand.
[[nodiscard]] std::unique_ptr<Ambient> open(const Place& place);

}  // namespace kphi::ambient
