// Which of the boxes that speak RDT this is: they differ in commands, status word and rates.
#pragma once

#include <cstdint>

namespace kphi::netbox {

enum class Product : std::uint8_t {
  net_box,
  axia,  ///< Ethernet Axia (9610-05-Ethernet Axia), Schunk FTN-Axia
};

[[nodiscard]] constexpr const char* name_of(Product product) noexcept {
  return product == Product::axia ? "Axia" : "Net Box";
}

}  // namespace kphi::netbox
