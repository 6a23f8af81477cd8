// A BME280 on an I²C bus: one forced measurement per reading, so that it does not heat itself between them.
#pragma once

#include "drivers/ambient/ambient.hpp"
#include "drivers/ambient/bme280.hpp"
#include "drivers/ambient/i2c.hpp"
#include "drivers/ambient/mcp2221.hpp"

namespace kphi::ambient {

class Bme280Sensor final : public Ambient {
 public:
  /// Searches at 0x76, then at 0x77; resets the sensor, waits until it has loaded its calibration, and reads that
  /// twice, because damage is unlikely to repeat. `bus` must outlive this; `where` names it in messages. Throws
  /// DeviceError: no answer, another chip, calibration damaged.
  Bme280Sensor(I2c& bus, const std::string& where, Mcp2221::Pause pause = Mcp2221::sleep);

  /// 16 samples of each quantity, about 110 ms. Throws DeviceError also for implausible values.
  [[nodiscard]] Air read() override;
  [[nodiscard]] const std::string& identity() const noexcept override { return identity_; }
  [[nodiscard]] const bme280::Calibration& calibration() const noexcept { return calibration_; }

 private:
  void find();
  void reset();
  void wait_while(std::uint8_t status_bits, const char* operation);
  [[nodiscard]] bme280::Calibration read_calibration();
  [[nodiscard]] std::uint8_t get(std::uint8_t register_number);
  void set(std::uint8_t register_number, std::uint8_t value);
  [[noreturn]] void fail(const char* operation, const std::string& cause, const char* next_move) const;

  I2c& bus_;
  const Mcp2221::Pause pause_;
  std::string identity_;
  std::uint8_t address_ = bme280::kAddressLow;
  bme280::Calibration calibration_;
};

}  // namespace kphi::ambient
