#include "drivers/ambient/manual_ambient.hpp"

#include <stdexcept>

namespace kphi::ambient {

ManualAmbient::ManualAmbient(const Air& air) : air_(air) {
  if (!plausible(air)) throw std::invalid_argument("air: temperature, pressure or humidity out of range");
}

}  // namespace kphi::ambient
