// A simulated MCP2221A with a BME280 on its I²C bus: 64-byte reports on the interrupt endpoints of its third interface.
// Written from the table of commands in the data sheet, not from the driver.
#pragma once

#include <array>
#include <deque>
#include <mutex>

#include "drivers/sim/usb/bme280.hpp"
#include "drivers/sim/usb/function.hpp"

namespace kphi::sim {

/// What the host did to the bridge. The last three are faults of the host's program.
struct BridgeTruth {
  std::uint64_t commands = 0;
  std::uint64_t nacks = 0;       ///< transactions without an acknowledgement
  std::uint64_t overlapped = 0;  ///< commands that came before the answer to the last was fetched
  std::uint64_t hasty = 0;       ///< less than 0.9 ms after the last answer was fetched
  std::uint64_t malformed = 0;   ///< not a report of 64 bytes, or an impossible length
};

class Mcp2221 final : public UsbFunction {
 public:
  /// `faults` must outlive this.
  Mcp2221(UsbFaults& faults, std::string serial, const Bme280& sensor = Bme280());

  const UsbShape& shape() const noexcept override { return shape_; }
  UsbAnswer control(const UsbSetup& setup, std::span<const std::uint8_t> out) override;
  UsbAnswer out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) override;
  UsbAnswer in(std::uint8_t endpoint, std::size_t at_most) override;
  void halt_cleared(std::uint8_t endpoint) override;
  [[nodiscard]] Duration release_takes() override;

  /// Any thread.
  void set_air(const TrueAir& air);
  [[nodiscard]] BridgeTruth truth() const;

 private:
  using Report = std::array<std::uint8_t, 64>;
  struct Waiting {
    Report report{};
    Instant due{0};
  };

  Report apply(const Report& command);
  void status(const Report& command, Report& answer);
  void write(const Report& command, Report& answer);
  void begin_read(const Report& command, Report& answer);
  void get_data(Report& answer);
  [[nodiscard]] bool takes_transfer(Report& answer);
  [[nodiscard]] bool addressed(std::uint8_t address_byte);
  void occupy(std::size_t bytes);
  [[nodiscard]] std::uint8_t engine() const;
  [[nodiscard]] std::uint8_t sensor_byte();

  const UsbShape shape_;
  UsbFaults& faults_;
  mutable std::mutex mutex_;
  Bme280 sensor_;
  std::deque<Waiting> answers_;
  std::optional<Report> next_command_;
  bool halted_ = false;
  Instant fetched_{-1'000'000'000};

  bool busy_ = false;       ///< by a fault, for the command at hand
  std::uint8_t state_ = 0;  ///< of the I²C engine once it is no longer occupied
  Instant free_at_{0};      ///< the bytes on the bus take their time
  bool nack_ = false;
  std::uint8_t divider_ = 117;
  std::size_t to_read_ = 0;
  BridgeTruth truth_;
};

}  // namespace kphi::sim
