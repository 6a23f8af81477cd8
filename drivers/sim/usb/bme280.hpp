// A simulated BME280 on an I²C bus, from the tables of the data sheet (BST-BME280-DS002): registers, modes, and the raw
// values that a given air would have left in them. No I/O; the caller passes the time.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/clock.hpp"

namespace kphi::sim {

struct TrueAir {
  double temperature_c = 20;       ///< °C
  double pressure_pa = 101325;     ///< Pa, absolute
  double relative_humidity = 0.5;  ///< 0..1
};

/// Section 4.2.2; the default is the example of the sister chip's data sheet (BMP280, 3.12) and a plausible humidity.
struct Bme280Constants {
  int t1 = 27504, t2 = 26435, t3 = -1000;
  std::array<int, 9> p{36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000};
  int h1 = 75, h2 = 362, h3 = 0, h4 = 326, h5 = 50, h6 = 30;
};

class Bme280 {
 public:
  /// `address`: 0x76 or 0x77. One thread.
  explicit Bme280(const TrueAir& air = {}, std::uint8_t address = 0x76, const Bme280Constants& constants = {});

  void set_air(const TrueAir& air) noexcept { air_ = air; }
  /// The chip is warmer than the air, °C; the air at it is drier by as much.
  void warm_by(double celsius) noexcept { warmth_ = celsius; }
  [[nodiscard]] std::uint8_t address() const noexcept { return address_; }

  /// One I²C write: the number of a register alone, or pairs of a register and its value.
  void write(std::span<const std::uint8_t> bytes, Instant now);
  /// One byte of an I²C read; the next one is of the next register.
  [[nodiscard]] std::uint8_t read(Instant now);
  /// As read, of any register, without moving on.
  [[nodiscard]] std::uint8_t peek(std::uint8_t at, Instant now);
  [[nodiscard]] std::uint8_t pointer() const noexcept { return pointer_; }

 private:
  void put(std::uint8_t at, std::uint8_t value, Instant now);
  void reset(Instant now);
  void burn();
  void begin_measurement(Instant now);
  void finish_measurement();
  void advance(Instant now);

  TrueAir air_;
  double warmth_ = 0;
  const std::uint8_t address_;
  const Bme280Constants constants_;
  std::array<std::uint8_t, 256> registers_{};
  std::uint8_t pointer_ = 0;
  std::uint8_t humidity_control_ = 0;  ///< in effect since the last write of ctrl_meas
  Instant loaded_{0};                  ///< when the copy of the calibration ends
  Instant measured_ = kNever;          ///< when the measurement under way ends
};

}  // namespace kphi::sim
