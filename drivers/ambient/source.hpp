// Where a bench file says that the state of the air comes from.
#pragma once

#include <memory>
#include <string_view>
#include <variant>

#include "base/uri.hpp"
#include "drivers/ambient/ambient.hpp"

namespace kphi::ambient {

/// No density is known: k cannot be compared with the k of another day.
struct Unknown {
  friend bool operator==(const Unknown&, const Unknown&) = default;
};

/// Unknown; values written by hand; or a BME280 behind the MCP2221A at this address.
using Source = std::variant<Unknown, Air, UsbAddress>;

/// "unknown", or "usb:04d8:00dd" with :SERIAL or @PORT behind it if there are several. Throws std::invalid_argument
/// with one line that says what to write.
[[nodiscard]] Source source_of(std::string_view text);

/// nullptr for Unknown. Throws DeviceError: not plugged in, no sensor behind it; std::invalid_argument: implausible
/// values.
[[nodiscard]] std::unique_ptr<Ambient> open(const Source& source);

}  // namespace kphi::ambient
