// The air of a bench file as the density of which thrust depends.
#pragma once

#include "drivers/ambient/air.hpp"
#include "profiles/ambient_place.hpp"

namespace kphi::daq {

[[nodiscard]] inline ambient::Density density_of(const profiles::AmbientPlace& place) {
  return ambient::density_of({place.temperature_c, place.pressure_pa, place.relative_humidity, place.u_temperature_c,
                              place.u_pressure_pa, place.u_relative_humidity});
}

}  // namespace kphi::daq
