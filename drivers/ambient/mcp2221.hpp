// Microchip's MCP2221A, a bridge from USB to I²C: 64-byte reports by interrupt transfers, one command outstanding.
// Codes as in the drivers of Linux and NetBSD.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <span>

#include "drivers/usb/bus.hpp"

namespace kphi::ambient {

/// Blocking; one thread.
class Mcp2221 {
 public:
  static constexpr std::uint16_t kVendor = 0x04d8, kProduct = 0x00dd;
  using Report = std::array<std::uint8_t, 64>;
  /// Waits this long; the bridge needs a millisecond between two commands.
  using Pause = std::function<void(std::chrono::microseconds)>;

  /// Claims the HID interface, discards answers that a killed process did not fetch, frees a bus that it left in the
  /// middle of a transfer, and sets 100 kHz. `transport` must outlive this. Throws DeviceError: not such a bridge, no
  /// answer, bus stuck.
  explicit Mcp2221(usb::Transport& transport, Pause pause = sleep);

  /// Writes, then a stop. Throws DeviceError: no acknowledgement, bus stuck, bridge gone.
  void write(std::uint8_t address, std::span<const std::uint8_t> bytes);
  /// Writes one register number, repeats the start and reads. Throws DeviceError.
  void read(std::uint8_t address, std::uint8_t register_number, std::span<std::uint8_t> into);

  /// Sleeps.
  static void sleep(std::chrono::microseconds wall);

 private:
  Report exchange(const Report& command, const char* operation);
  Report converse(const Report& command, const char* operation);
  void set_speed();
  void cancel();
  void send(std::uint8_t command, std::uint8_t address, std::size_t total, std::span<const std::uint8_t> data,
            const char* operation);
  void wait_until_idle(const char* operation);
  [[noreturn]] void fail(const char* operation, const std::string& cause, const char* next_move) const;
  [[noreturn]] void fail(const char* operation, std::uint8_t engine_state);

  usb::Transport& transport_;
  const Pause pause_;
  usb::Endpoint in_, out_;
  bool in_step_ = false;  ///< false: answers to earlier commands may still come
};

}  // namespace kphi::ambient
