// Where the state of the air comes from, as a bench file names it.
#pragma once

#include <memory>
#include <string_view>
#include <variant>

#include "base/uri.hpp"
#include "drivers/ambient/air.hpp"

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

/// Values read off a thermometer and a barometer: constant during a campaign.
class ManualAmbient final : public Ambient {
 public:
  /// Throws std::invalid_argument unless plausible.
  explicit ManualAmbient(const Air& air);
  [[nodiscard]] Air read() override { return air_; }
  [[nodiscard]] const std::string& identity() const noexcept override { return identity_; }

 private:
  Air air_;
  std::string identity_ = "values written by hand";
};

}  // namespace kphi::ambient
