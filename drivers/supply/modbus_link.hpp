// One Modbus line on libmodbus, guarded against its pitfalls: one request per call. One thread.
//
// libmodbus 3.1.6 takes a late answer for the answer to the next request when their lengths agree (RTU has no
// transaction number), does not recover from bytes before a frame until it is flushed, and runs at 9600 baud when it
// does not know the rate. Hence fall_silent(), and a rate that is checked before and after.
#pragma once

#include <modbus/modbus.h>

#include <array>
#include <chrono>
#include <memory>
#include <string>

#include "drivers/supply/wire.hpp"

namespace kphi::supply {

/// Deadlines, wall time.
struct Timing {
  std::chrono::milliseconds answer{700};  ///< stock Riden firmware takes 50 to 500 ms
  std::chrono::milliseconds byte{100};    ///< within an answer
  std::chrono::milliseconds quiet{150};   ///< silence after which a late answer is no longer expected
};

/// Registers by address; zero until read.
using RegisterImage = std::array<std::uint16_t, 128>;

enum class Failure : std::uint8_t {
  none,
  timeout,  ///< no answer, or only its beginning
  damaged,  ///< bad CRC, foreign sender, wrong shape
  busy,     ///< the device is not ready yet
  refused,  ///< the device refuses: retrying is useless
  lost,     ///< the port or connection is gone
};

struct Outcome {
  Failure failure = Failure::none;
  std::string words;
  [[nodiscard]] bool ok() const noexcept { return failure == Failure::none; }
};

class ModbusLink {
 public:
  /// Opens nothing yet. `address`: of parse_address().
  ModbusLink(const Address& address, const Timing& timing);
  ~ModbusLink();

  /// Opens, or reopens. A serial port is opened exclusively.
  [[nodiscard]] Outcome open();
  /// False also once it was lost.
  [[nodiscard]] bool is_open() const noexcept { return open_; }
  /// One request, one answer. `block` lies within the image.
  [[nodiscard]] Outcome read(const Block& block, RegisterImage& into);
  /// One register, by function 0x10 if `multiple`, else 0x06.
  [[nodiscard]] Outcome write(Writable at, std::uint16_t value, bool multiple);
  /// Waits until nothing has arrived for Timing::quiet (2 s at most) and discards all bytes received.
  void fall_silent();

 private:
  [[nodiscard]] Outcome outcome(int result, int expected);
  [[nodiscard]] Outcome take_port();
  void close() noexcept;
  void keep_gap() const;

  Address address_;
  Timing timing_;
  std::unique_ptr<modbus_t, decltype(&modbus_free)> context_;
  std::chrono::steady_clock::time_point last_;  ///< of the wire's traffic
  bool open_ = false;
};

}  // namespace kphi::supply
