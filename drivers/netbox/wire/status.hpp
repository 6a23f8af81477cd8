// The boxes that speak RDT, and the status word of each record: Net Box (manual 9620-05-NET FT, Table 17.1) and
// Ethernet Axia, which differ.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kphi::netbox {

/// They differ in commands, status word and rates.
enum class Product : std::uint8_t {
  net_box,
  axia,  ///< Ethernet Axia (9610-05-Ethernet Axia), Schunk FTN-Axia
};

[[nodiscard]] constexpr const char* name_of(Product product) noexcept {
  return product == Product::axia ? "Axia" : "Net Box";
}

inline constexpr std::uint32_t kMonitorCondition = 1u << 16;  ///< latched; no error
inline constexpr std::uint32_t kErrorSummary = 1u << 31;      ///< also set together with kMonitorCondition
/// RDT and network: the Net Box reports failed communication. The Axia has no such bits.
inline constexpr std::uint32_t kStreamTrouble = 1u << 20 | 1u << 22;

/// 0, or only a latched monitor condition.
[[nodiscard]] constexpr bool healthy(std::uint32_t status) noexcept {
  return status == 0 || status == (kErrorSummary | kMonitorCondition);
}

/// Transducer saturation or A/D error; of an Axia: out of range, gage out of range. The sample is worthless, the box
/// works.
[[nodiscard]] constexpr std::uint32_t saturation_bits(Product product) noexcept {
  return product == Product::axia ? 1u << 30 | 1u << 27 : 1u << 17;
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
