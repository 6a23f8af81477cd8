// A Bosch BME280 on an I²C bus: its registers and what its raw values mean (data sheet BST-BME280-DS002, pure bytes),
// and the sensor with one forced measurement per reading, so that it does not heat itself between them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "drivers/ambient/air.hpp"
#include "drivers/ambient/mcp2221.hpp"

namespace kphi::ambient {

namespace bme280 {

inline constexpr std::uint8_t kAddressLow = 0x76, kAddressHigh = 0x77;  ///< on the I²C bus: SDO to ground, to supply
inline constexpr std::uint8_t kIdRegister = 0xD0, kId = 0x60;
inline constexpr std::uint8_t kResetRegister = 0xE0, kReset = 0xB6;
inline constexpr std::uint8_t kStatusRegister = 0xF3, kMeasuring = 0x08, kCopying = 0x01;
inline constexpr std::uint8_t kHumidityControl = 0xF2;  ///< takes effect with the next write of kMeasureControl
inline constexpr std::uint8_t kMeasureControl = 0xF4;
inline constexpr std::uint8_t kConfiguration = 0xF5;
inline constexpr std::uint8_t kFirstCalibration = 0x88, kSecondCalibration = 0xE1, kHumidityCalibration = 0xA1;
inline constexpr std::uint8_t kData = 0xF7;  ///< eight bytes, to be read in one burst

/// Data sheet table 1, the accuracy between 0 and 65 °C, taken as the half widths of rectangular distributions.
inline constexpr double kTemperatureTolerance = 1.0, kPressureTolerance = 100, kHumidityTolerance = 0.03;  // K, Pa, 1

struct Calibration {
  std::uint16_t t1 = 0;
  std::int16_t t2 = 0, t3 = 0;
  std::uint16_t p1 = 0;
  std::int16_t p2 = 0, p3 = 0, p4 = 0, p5 = 0, p6 = 0, p7 = 0, p8 = 0, p9 = 0;
  std::uint8_t h1 = 0, h3 = 0;
  std::int16_t h2 = 0, h4 = 0, h5 = 0;
  std::int8_t h6 = 0;
  friend bool operator==(const Calibration&, const Calibration&) = default;
};

/// `first`: 24 bytes from 0x88, `h1`: 0xA1, `second`: 7 bytes from 0xE1.
[[nodiscard]] Calibration calibration_of(std::span<const std::uint8_t, 24> first, std::uint8_t h1,
                                         std::span<const std::uint8_t, 7> second) noexcept;

/// Why this calibration cannot come from a working sensor (all zeros, all ones, a divisor of zero); empty: plausible.
[[nodiscard]] std::string_view refusal_of(const Calibration& calibration) noexcept;

/// ADC values; 20, 20 and 16 bits.
struct Raw {
  std::uint32_t pressure = 0, temperature = 0, humidity = 0;
  friend bool operator==(const Raw&, const Raw&) = default;
};

[[nodiscard]] Raw raw_of(std::span<const std::uint8_t, 8> data) noexcept;
/// All three were measured: a channel that was not reads as its reset value (data sheet, 5.4.7 to 5.4.9).
[[nodiscard]] bool complete(const Raw& raw) noexcept;

/// In the integers of the data sheet's section 4.2.3.
struct Measured {
  std::int32_t temperature_centi_c = 0;  ///< 0.01 °C
  std::uint32_t pressure_256th_pa = 0;   ///< Pa/256; 0: the calibration allows none
  std::uint32_t humidity_1024th_rh = 0;  ///< %RH/1024
  [[nodiscard]] double temperature_c() const noexcept { return temperature_centi_c * 0.01; }
  [[nodiscard]] double pressure_pa() const noexcept { return pressure_256th_pa / 256.0; }
  [[nodiscard]] double relative_humidity() const noexcept { return humidity_1024th_rh / 102400.0; }
};

/// Section 4.2.3: temperature and humidity in 32 bits, pressure in 64. Defined for all inputs.
[[nodiscard]] Measured compensate(const Raw& raw, const Calibration& calibration) noexcept;

}  // namespace bme280

class Bme280Sensor : public Ambient {
 public:
  /// Searches at 0x76, then at 0x77; resets the sensor, waits until it has loaded its calibration, and reads that
  /// twice, because damage is unlikely to repeat. `bus` must outlive this; `where` names it in messages. Throws
  /// DeviceError: no answer, another chip, calibration damaged.
  Bme280Sensor(Mcp2221& bus, const std::string& where, Mcp2221::Pause pause = Mcp2221::sleep);

  /// 16 samples of each quantity, about 110 ms. Throws DeviceError also for implausible values.
  [[nodiscard]] Air read() override;
  [[nodiscard]] const std::string& identity() const noexcept override { return identity_; }

 private:
  void find();
  void reset();
  void wait_while(std::uint8_t status_bits, const char* operation);
  [[nodiscard]] bme280::Calibration read_calibration();
  [[nodiscard]] std::uint8_t get(std::uint8_t register_number);
  void set(std::uint8_t register_number, std::uint8_t value);
  [[noreturn]] void fail(const char* operation, const std::string& cause, const char* next_move) const;

  Mcp2221& bus_;
  const Mcp2221::Pause pause_;
  std::string identity_;
  std::uint8_t address_ = bme280::kAddressLow;
  bme280::Calibration calibration_;
};

/// The address in a bench file of a BME280 behind an MCP2221A: "usb:04d8:00dd", with :SERIAL or @PORT behind it if
/// there are several. Throws std::invalid_argument with one line that says what to write.
[[nodiscard]] UsbAddress sensor_address(std::string_view text);

/// Throws DeviceError: not plugged in, no sensor behind it.
[[nodiscard]] std::unique_ptr<Ambient> open(const UsbAddress& address);

}  // namespace kphi::ambient
