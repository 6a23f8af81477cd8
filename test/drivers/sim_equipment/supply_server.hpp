// A simulated supply on its true transports: a pseudo-terminal and a TCP port. One thread, poll().
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include "base/clock.hpp"
#include "base/descriptor.hpp"
#include "drivers/sim/supply/port.hpp"
#include "drivers/sim/supply/slave.hpp"

namespace kphi::sim {

struct SupplyServerSettings {
  SupplySettings supply;
  SupplyLoad load{0, 0.1};         ///< on its terminals
  std::string device;              ///< symlink to its pseudo-terminal; empty: its own /dev/pts name only
  std::string host = "127.0.0.1";  ///< to listen on
  std::uint16_t port = 0;          ///< 0: any free one; 502 on a real one
};

class SupplyServer {
 public:
  /// Opens everything. Throws DeviceError, std::invalid_argument for an unknown model.
  explicit SupplyServer(const SupplyServerSettings& settings);
  SupplyServer(const SupplyServer&) = delete;
  SupplyServer& operator=(const SupplyServer&) = delete;

  /// Where a client opens the serial line.
  [[nodiscard]] const std::string& device() const noexcept { return port_.device(); }
  [[nodiscard]] std::uint16_t port() const noexcept { return port_.port(); }
  /// Runs until request_stop().
  void run();
  /// From any thread, and from a signal handler.
  void request_stop() noexcept;
  /// From any thread: looks into the device, or changes it, between two of its steps. `now` is its time.
  void inspect(const std::function<void(SupplySlave& slave, SupplyLoad& load, Instant now)>& look);

 private:
  [[nodiscard]] int patience();
  void step();

  SupplyServerSettings settings_;
  SteadyClock clock_;
  Descriptor stop_;
  SupplyPort port_;

  std::mutex mutex_;  ///< run()'s thread and those who inspect
  SupplySlave slave_;
};

}  // namespace kphi::sim
