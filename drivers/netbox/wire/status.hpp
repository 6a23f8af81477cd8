// The status word of each record: Net Box (manual 9620-05-NET FT, Table 17.1) and Ethernet Axia, which differ.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/netbox/wire/codes.hpp"

namespace kphi::netbox {

[[nodiscard]] constexpr bool has(std::uint32_t status, StatusBit bit) noexcept {
  return (status >> static_cast<unsigned>(bit) & 1u) != 0;
}
[[nodiscard]] constexpr bool has(std::uint32_t status, AxiaStatusBit bit) noexcept {
  return (status >> static_cast<unsigned>(bit) & 1u) != 0;
}

/// 0, or only a latched monitor condition (0x80010000).
[[nodiscard]] constexpr bool healthy(std::uint32_t status) noexcept { return status == 0 || status == 0x80010000u; }

/// Transducer saturation or A/D error: the sample is worthless, the box works.
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

/// Verdict of the status word on its sample.
enum class StatusVerdict : std::uint8_t {
  sound,          ///< see healthy()
  saturated,      ///< the load exceeds the range of the cell; the box works
  communication,  ///< trouble with a network or field bus only: the counts are valid; Net Box only
  faulty,         ///< any other error: the counts may be wrong
};
[[nodiscard]] StatusVerdict verdict_of(std::uint32_t status, Product product) noexcept;

/// Names of the bits set, most significant first, without the error summary; an unknown bit is "bit N".
[[nodiscard]] std::vector<std::string> names(std::uint32_t status, Product product = Product::net_box);

}  // namespace kphi::netbox
