// A running simulated supply, and the driver's view of where it is.
#pragma once

#include <unistd.h>

#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>

#include "drivers/supply/modbus_link.hpp"
#include "drivers/supply/wire.hpp"
#include "test/drivers/sim_equipment/supply_server.hpp"
#include "test/soon.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::supply::test {

/// Short, so that tests are; long beside the pauses of a busy host.
inline constexpr Timing kShort{std::chrono::milliseconds(150), std::chrono::milliseconds(50),
                               std::chrono::milliseconds(60)};

using kphi::test::soon;

enum class Over { rtu, tcp };

/// From now on, for an hour; of reads_as: the register and its value.
inline sim::Fault lasting(sim::FaultKind kind, std::uint16_t address = 0, std::uint16_t value = 0) {
  return {.kind = kind, .lasts = std::chrono::hours(1), .address = address, .value = value};
}
/// The next time only.
inline sim::Fault once(sim::FaultKind kind, Duration delay = {}) { return {.kind = kind, .count = 1, .delay = delay}; }

inline std::string what_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

class SimulatedSupply {
 public:
  explicit SimulatedSupply(
      const std::string& model = "RD6006", double replies_per_s = 0,
      void (*change)(sim::SupplySettings&) = [](sim::SupplySettings&) {})
      : server_({settings(model, replies_per_s, change), sim::SupplyLoad{0, 0.1}, (folder_.path() / "supply").string(),
                 "127.0.0.1", 0}),
        thread_([this] { server_.run(); }) {}
  ~SimulatedSupply() {
    server_.request_stop();
    thread_.join();
  }

  [[nodiscard]] Address address(Over wire = Over::rtu, const std::string& options = {}) const {
    return parse_address(wire == Over::rtu ? "modbus-rtu:" + server_.device() + options
                                           : "modbus-tcp:127.0.0.1:" + std::to_string(server_.port()) + options);
  }
  void inspect(const std::function<void(sim::SupplySlave&)>& look) {
    server_.inspect([&](sim::SupplySlave& slave, sim::SupplyLoad&, Instant) { look(slave); });
  }
  void hang(const sim::SupplyLoad& load) {
    server_.inspect([&](sim::SupplySlave&, sim::SupplyLoad& now, Instant) { now = load; });
  }
  /// `fault.at` counts from now.
  void spoil(sim::Fault fault) {
    server_.inspect([&](sim::SupplySlave& slave, sim::SupplyLoad&, Instant now) {
      fault.at += now;
      slave.add_fault(fault);
    });
  }
  [[nodiscard]] bool output() {
    bool on = false;
    inspect([&](sim::SupplySlave& slave) { on = slave.circuit().output(); });
    return on;
  }
  [[nodiscard]] sim::SupplyTruth truth() {
    sim::SupplyTruth all;
    inspect([&](sim::SupplySlave& slave) { all = slave.truth(); });
    return all;
  }
  /// Writes to calibration or bootloader.
  [[nodiscard]] std::uint64_t harm() {
    std::uint64_t count = 0;
    inspect([&](sim::SupplySlave& slave) { count = slave.registers().harmful_writes(); });
    return count;
  }

 private:
  static sim::SupplySettings settings(const std::string& model, double replies_per_s,
                                      void (*change)(sim::SupplySettings&)) {
    sim::SupplySettings settings;
    settings.model = model;
    settings.replies_per_s = replies_per_s;
    change(settings);
    return settings;
  }

  kphi::test::TemporaryFolder folder_;
  sim::SupplyServer server_;
  std::thread thread_;
};

}  // namespace kphi::supply::test
