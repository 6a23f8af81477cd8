// What a bench file says of the bench supply.
#pragma once

#include <string>

#include "compensation/units.hpp"

namespace kphi::profiles {

struct SupplyPlace {
  std::string uri;  ///< modbus-rtu:/dev/..., modbus-tcp:host:port, each with ?baud=, slave=, model=; scpi-tcp:host,
                    ///< scpi-usb:VID:PID
  Volts voltage;    ///< to be set
  Amperes current_limit;  ///< at which it goes over to constant current
  Volts over_voltage;     ///< at which it switches off
  Amperes over_current;   ///< at which it switches off
};

}  // namespace kphi::profiles
