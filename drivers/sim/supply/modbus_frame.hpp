// Modbus requests out of bytes, and replies into bytes, for a slave: RTU (Modbus over serial line 1.02) and TCP
// (Modbus messaging on TCP/IP 1.0b). Independent of the library that the driver uses.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/clock.hpp"

namespace kphi::sim {

enum class ModbusFraming : std::uint8_t { rtu, tcp };

/// CRC-16/MODBUS: reflected 0xA001, begins with 0xFFFF; its low byte travels first.
[[nodiscard]] std::uint16_t modbus_crc(std::span<const std::uint8_t> bytes) noexcept;

struct ModbusRequest {
  int unit = 0;                   ///< slave address; 0: everybody
  std::uint16_t transaction = 0;  ///< TCP only
  std::vector<std::uint8_t> pdu;  ///< function code first; never empty
  std::vector<std::uint8_t> adu;  ///< the whole frame as it came
};

[[nodiscard]] std::vector<std::uint8_t> modbus_frame(ModbusFraming framing, int unit, std::uint16_t transaction,
                                                     std::span<const std::uint8_t> pdu);

class ModbusScanner {
 public:
  explicit ModbusScanner(ModbusFraming framing) noexcept : framing_(framing) {}
  /// RTU: 50 ms of silence end a frame, whole or not.
  void feed(std::span<const std::uint8_t> bytes, Instant now);
  [[nodiscard]] std::optional<ModbusRequest> next();
  /// Frames with a bad CRC, an odd header, or no end.
  [[nodiscard]] std::uint64_t damaged() const noexcept { return damaged_; }
  /// TCP: the stream is broken; close it.
  [[nodiscard]] bool broken() const noexcept { return broken_; }

 private:
  [[nodiscard]] std::optional<ModbusRequest> next_rtu();
  [[nodiscard]] std::optional<ModbusRequest> next_tcp();

  ModbusFraming framing_;
  std::vector<std::uint8_t> waiting_;
  Instant last_{0};
  std::uint64_t damaged_ = 0;
  bool broken_ = false;
};

}  // namespace kphi::sim
