#include "drivers/supply/supply.hpp"

#include <exception>
#include <utility>

namespace kphi::supply {

PoweredOutput::PoweredOutput(Supply& supply) : supply_(&supply) {
  try {
    supply.switch_on();
  } catch (...) {
    (void)off();
    throw;
  }
}

PoweredOutput::~PoweredOutput() { (void)off(); }

std::string PoweredOutput::off() noexcept {
  Supply* const supply = std::exchange(supply_, nullptr);
  if (supply == nullptr) return {};
  try {
    supply->switch_off();
    return {};
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "an unknown failure";
  }
}

}  // namespace kphi::supply
