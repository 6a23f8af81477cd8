#include "daq/bench/air_source.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "drivers/ambient/bme280.hpp"

namespace kphi::daq {
namespace {

constexpr std::chrono::seconds kFirstReading{10};  // wall time; a sensor takes 0.2 s
constexpr std::chrono::minutes kOldest{1};         // likewise; weather is slower

}  // namespace

AirSource::AirSource(const profiles::AmbientConfig& config, const Clock& clock) : clock_(clock), config_(config) {
  if (const auto& seen = config.manual) {
    manual_ = configured("ambient", [&] {
      return ambient::density_of({seen->temperature_c, seen->pressure_pa, seen->relative_humidity,
                                  seen->u_temperature_c, seen->u_pressure_pa, seen->u_relative_humidity});
    });
  }
  if (config.sensor.empty()) return;
  const UsbAddress sensor = configured("ambient", [&] { return ambient::sensor_address(config.sensor); });
  (void)ambient::open(sensor);  // throws at once if it is unusable
  sensor_.emplace([sensor] { return ambient::open(sensor); }, clock);
  if (!sensor_->wait_for_first(kFirstReading)) throw DeviceError(sensor_->failure());
}

std::optional<ambient::Density> AirSource::density() const {
  if (!sensor_) return manual_;
  const auto newest = sensor_->newest();
  if (!newest || clock_.shrunk(newest->age) > kOldest) return std::nullopt;
  return ambient::density_of(as_placed(newest->air, config_));
}

ambient::Air as_placed(ambient::Air air, const profiles::AmbientConfig& config) {
  air.u_temperature_c = std::max(air.u_temperature_c, config.u_temperature_c.value_or(0));
  return air;
}

std::string words_of(const ambient::Density& air) {
  return fmt::format("air {:.4f} ± {:.4f} kg/m³", air.kg_m3, air.u_kg_m3);
}

}  // namespace kphi::daq
