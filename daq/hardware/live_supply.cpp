#include "daq/hardware/live_supply.hpp"

#include <fmt/format.h>

#include <thread>

#include "base/error.hpp"
#include "daq/guard/run_stopped.hpp"
#include "drivers/scpi/scpi_supply.hpp"
#include "drivers/supply/modbus_supply.hpp"
#include "drivers/supply/wire.hpp"

namespace kphi::daq {
namespace {

constexpr double kLooksOfAnInstrument = 8;    // per second; SCPI instruments bear that
constexpr std::chrono::seconds kRise{3};      // wall time until the voltage must be there
constexpr std::chrono::seconds kConfirm{5};   // wall time for the order to switch off
constexpr std::chrono::milliseconds kAsk{2};  // between two checks of the newest reading

double looks_per_second(const profiles::SupplyConfig& config) {
  return scpi::is_scpi(config.uri) ? kLooksOfAnInstrument : supply::parse_address(config.uri).looks;
}

}  // namespace

std::unique_ptr<supply::Supply> open_supply(const profiles::SupplyConfig& config, const Clock& clock) {
  return configured("supply.uri", [&]() -> std::unique_ptr<supply::Supply> {
    if (scpi::is_scpi(config.uri)) return std::make_unique<scpi::ScpiSupply>(scpi::open_line(config.uri), clock);
    return std::make_unique<supply::ModbusSupply>(supply::parse_address(config.uri), clock);
  });
}

std::string summary(const supply::Identity& identity) {
  std::string text = identity.model;
  if (!identity.serial.empty()) text += ", serial " + identity.serial;
  if (!identity.firmware.empty()) text += ", firmware " + identity.firmware;
  return text;
}

LiveSupply::LiveSupply(const profiles::SupplyConfig& config, const Clock& clock)
    : config_(config), clock_(clock), worker_(open_supply(config, clock), clock, looks_per_second(config)) {}

std::string LiveSupply::identity() const { return summary(worker_.identity()); }

void LiveSupply::switch_on(const StopAsked& stop_asked) {
  configured("supply", [&] {
    worker_.apply({config_.voltage, config_.current_limit, config_.over_voltage, config_.over_current});
  });
  require_no_stop(stop_asked, "before the supply was switched on");
  worker_.switch_on();
  const Instant on_at = clock_.now();
  const auto begun = std::chrono::steady_clock::now();
  const double enough = (1 - results::kSupplySag) * config_.voltage.value();
  for (;; std::this_thread::sleep_for(kAsk)) {
    const std::optional<SupplyReading> seen = worker_.newest();
    require_no_stop(stop_asked, "while the supply was switched on");
    if (seen && seen->output && seen->voltage_v >= enough) return;
    if (!worker_.alive()) throw DeviceError(worker_.identity().device, "switch on", worker_.failure());
    // A reading under way is from before, and a slow supply takes as long again for the next.
    const Duration wall = std::chrono::steady_clock::now() - begun;
    if (wall < kRise + 3 * clock_.shrunk(worker_.longest_look())) continue;
    if (!seen || Instant(seen->time_ns) < on_at)
      throw DeviceError(worker_.identity().device, "switch on",
                        fmt::format("its voltage was not read within {:.1f} s", to_seconds(wall)),
                        "close other programs that ask it; look at its display");
    throw DeviceError(worker_.identity().device, "switch on",
                      fmt::format("{:.4g} V at the terminals, {:g} V set", seen->voltage_v, config_.voltage.value()),
                      "check for a short circuit, or a current limit that is too low");
  }
}

std::string LiveSupply::failure() const {
  if (worker_.alive()) return "";
  const std::string why = worker_.failure();
  if (why.empty()) return "supply: its thread has ended";
  return why.starts_with("supply") ? why : "supply: " + why;  // an instrument on USB is named by its address
}

std::string LiveSupply::switch_off() noexcept { return worker_.switch_off_and_confirm(kConfirm) ? "" : kNotOff; }

}  // namespace kphi::daq
