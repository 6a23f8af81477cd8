// The status word of each record: Net Box (manual 9620-05-NET FT, Table 17.1) and Ethernet Axia, which differ.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/netbox/wire/codes.hpp"
#include "drivers/netbox/wire/product.hpp"

namespace kphi::netbox {

[[nodiscard]] constexpr bool has(std::uint32_t status, StatusBit bit) noexcept {
  return (status >> static_cast<unsigned>(bit) & 1u) != 0;
}
[[nodiscard]] constexpr bool has(std::uint32_t status, AxiaStatusBit bit) noexcept {
  return (status >> static_cast<unsigned>(bit) & 1u) != 0;
}

/// 0, or nothing but a latched monitor condition (0x80010000).
[[nodiscard]] constexpr bool healthy(std::uint32_t status) noexcept { return status == 0 || status == 0x80010000u; }

/// The bits of transducer saturation or A/D error: such a sample is worthless, the box is well.
[[nodiscard]] constexpr std::uint32_t saturation_bits(Product product) noexcept {
  if (product == Product::axia) {
    return 1u << static_cast<unsigned>(AxiaStatusBit::out_of_range) |
           1u << static_cast<unsigned>(AxiaStatusBit::gage_out_of_range);
  }
  return 1u << static_cast<unsigned>(StatusBit::saturation);
}
[[nodiscard]] constexpr bool saturated(std::uint32_t status, Product product = Product::net_box) noexcept {
  return (status & saturation_bits(product)) != 0;
}

/// What a status word says about the sample that carries it.
enum class StatusVerdict : std::uint8_t {
  sound,          ///< see healthy()
  saturated,      ///< the load is beyond what the cell can measure; the box is well
  communication,  ///< trouble with a network or a field bus only, which no count goes through; Net Box only
  faulty,         ///< whatever else: the counts may be anything
};
[[nodiscard]] StatusVerdict verdict_of(std::uint32_t status, Product product) noexcept;

/// What is set, most significant bit first, without the error summary; a bit the table does not know is "bit N".
[[nodiscard]] std::vector<std::string> names(std::uint32_t status, Product product = Product::net_box);

}  // namespace kphi::netbox
