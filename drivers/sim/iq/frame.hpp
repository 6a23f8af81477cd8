// Frames of IQUART as the module sees them: 55 LEN TYPE payload CRC_L CRC_H. Bytes only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace kphi::sim {

/// CRC-16/CCITT-FALSE: poly 0x1021, init 0xFFFF; "123456789" gives 0x29B1.
[[nodiscard]] std::uint16_t iq_crc(std::span<const std::uint8_t> bytes) noexcept;

/// Appends one frame: `access` is module id * 4 + code, `data` at most 57 bytes.
void append_iq_frame(std::vector<std::uint8_t>& out, std::uint8_t type, std::uint8_t sub, std::uint8_t access,
                     std::span<const std::uint8_t> data);

struct IqFrame {
  std::uint8_t type = 0;
  std::span<const std::uint8_t> payload;  ///< SUB ACCESS data...; valid until the scanner is used again
};

/// The module's receiver: skips to 0x55; LEN over 59 restarts at that very byte; after a wrong CRC it rescans from the
/// byte behind the failed 0x55. A partial frame waits without a time limit.
class IqScanner {
 public:
  /// `capacity`: bytes that it holds, 64 or more; 0: without limit.
  explicit IqScanner(std::size_t capacity = 0) noexcept : capacity_(capacity) {}
  /// Takes as many bytes as there is room for, and says how many that was.
  std::size_t feed(std::span<const std::uint8_t> bytes);
  /// Next whole frame, or none until more bytes come.
  [[nodiscard]] std::optional<IqFrame> next() noexcept;
  void clear() noexcept;

 private:
  std::size_t capacity_;
  std::vector<std::uint8_t> bytes_;
  std::size_t position_ = 0;
};

}  // namespace kphi::sim
