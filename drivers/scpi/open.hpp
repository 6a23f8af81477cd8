// The address of a SCPI instrument:
//
//     scpi-tcp:192.168.1.30:5025
//     scpi-usb:VVVV:PPPP            then :SERIAL or @PORT if several are alike
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "base/clock.hpp"
#include "drivers/scpi/line.hpp"
#include "drivers/supply/supply.hpp"

namespace kphi::scpi {

[[nodiscard]] bool is_scpi(std::string_view uri) noexcept;

/// Throws std::invalid_argument with one line that says what to write; DeviceError: not there, or not an instrument.
[[nodiscard]] std::unique_ptr<Line> open_line(const std::string& uri);

/// Throws as open_line() does. `clock` outlives it.
[[nodiscard]] std::unique_ptr<supply::Supply> open_supply(const std::string& uri, const Clock& clock);

}  // namespace kphi::scpi
