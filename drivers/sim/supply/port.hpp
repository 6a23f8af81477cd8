// Where clients reach a simulated supply: a pseudo-terminal, a TCP port, or both. No thread, no clock.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "base/descriptor.hpp"
#include "drivers/sim/supply/slave.hpp"
#include "drivers/sim/transport/conversations.hpp"
#include "drivers/sim/transport/pty.hpp"

namespace kphi::sim {

struct SupplyAddresses {
  std::optional<std::string> device;  ///< symlink to a pseudo-terminal; empty text: its own /dev/pts name only
  std::optional<std::string> host;    ///< to listen on
  std::uint16_t port = 0;             ///< 0: any free one; 502 on a real one
};

class SupplyPort {
 public:
  /// Opens everything. Throws DeviceError.
  explicit SupplyPort(SupplyAddresses addresses);

  /// Where a client opens the serial line; empty: there is none.
  [[nodiscard]] const std::string& device() const noexcept { return device_; }
  /// 0: none.
  [[nodiscard]] std::uint16_t port() const noexcept { return addresses_.port; }
  /// Gives the slave what clients have sent; closes and opens as its faults require.
  void receive(SupplySlave& slave, Instant now);
  /// Sends the replies that have left the slave by `now`.
  void send(SupplySlave& slave, Instant now);

 private:
  void open();
  void open_or_close(SupplySlave& slave, Instant now);
  void hear_line(SupplySlave& slave, Instant now);
  void welcome();
  void hear_clients(SupplySlave& slave, Instant now);

  SupplyAddresses addresses_;
  std::optional<Pty> pty_;
  std::optional<Listening> listening_;
  bool open_ = false;
  std::string device_;
  std::map<int, Descriptor> clients_;  ///< by number; 0 is the serial line's
  int last_client_ = 0;
};

/// The supply.uri of a bench file: "modbus-rtu:/tmp/supply?model=RD6018" or "modbus-tcp:127.0.0.1:1502?slave=1".
struct SupplyUri {
  SupplyAddresses addresses;
  std::string model = "RD6024";  ///< if the file gives none
  int slave = 1;
};
/// Throws std::invalid_argument in one line.
[[nodiscard]] SupplyUri parse_supply_uri(const std::string& uri);

}  // namespace kphi::sim
