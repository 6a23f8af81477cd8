// Where a SCPI instrument is, as a person writes it:
//
//     scpi-tcp:192.168.1.30:5025
//     scpi-usb:VVVV:PPPP            with :SERIAL or @PORT behind it if there are several
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "drivers/clock.hpp"
#include "drivers/scpi/line.hpp"
#include "drivers/supply/supply.hpp"

namespace kphi::scpi {

[[nodiscard]] bool is_scpi(std::string_view uri) noexcept;

/// Owns what the line needs. Throws std::invalid_argument with one sentence that says what to write; DeviceError: not
/// there, or no instrument.
[[nodiscard]] std::unique_ptr<Line> open_line(const std::string& uri);

/// Throws as open_line() does. `clock` outlives it.
[[nodiscard]] std::unique_ptr<supply::Supply> open_supply(const std::string& uri, const Clock& clock);

}  // namespace kphi::scpi
