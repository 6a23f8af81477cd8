// The network cards of this computer, for advice when a device cannot be reached.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kphi::netbox {

struct Interface {
  std::string name;           ///< "eth0"
  std::uint32_t address = 0;  ///< IPv4, host order
  int prefix = 0;             ///< bits of the network, 0..32

  /// "192.168.1.7/24 on eth0".
  [[nodiscard]] std::string text() const;
  [[nodiscard]] bool is_near(std::uint32_t other) const noexcept;
};

/// Those with an IPv4 address that are up, without the loopback.
[[nodiscard]] std::vector<Interface> interfaces();

/// What to do when no card is in the network of `host`: their addresses, and one that would reach it. Empty if one is,
/// or if `host` is no IPv4 address of four numbers, or this computer itself.
[[nodiscard]] std::string advice_to_reach(const std::string& host, const std::vector<Interface>& own);

}  // namespace kphi::netbox
