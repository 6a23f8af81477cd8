#include "drivers/ambient/bme280_sensor.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "base/error.hpp"

namespace kphi::ambient {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kSixteenTimes = 0b101, kForced = 0b01;
constexpr auto kPoll = 5ms;
constexpr int kPolls = 200;  // one second: a measurement takes 113 ms at most (data sheet, 9.1)

}  // namespace

Bme280Sensor::Bme280Sensor(I2c& bus, const std::string& where, Mcp2221::Pause pause)
    : bus_(bus), pause_(std::move(pause)), identity_("BME280 behind " + where) {
  find();
  identity_ = fmt::format("BME280 at 0x{:02X} behind {}", address_, where);
  reset();
  calibration_ = read_calibration();
  reset();
  if (calibration_ != read_calibration())
    fail("read its calibration", "two readings differ", "check the wiring of the bus");
  if (const auto refusal = bme280::refusal_of(calibration_); !refusal.empty())
    fail("read its calibration", std::string(refusal), "replace the sensor");
  set(bme280::kConfiguration, 0);
}

Air Bme280Sensor::read() {
  set(bme280::kHumidityControl, kSixteenTimes);
  set(bme280::kMeasureControl, kSixteenTimes << 5 | kSixteenTimes << 2 | kForced);
  pause_(kPoll);
  wait_while(bme280::kMeasuring, "measure");
  std::array<std::uint8_t, 8> data{};
  bus_.read(address_, bme280::kData, data);
  const bme280::Raw raw = bme280::raw_of(data);
  if (!bme280::complete(raw))
    fail("measure", "a quantity was not measured", "try again; the sensor may have been reset");
  const bme280::Measured measured = bme280::compensate(raw, calibration_);
  const double rectangular = 1 / std::sqrt(3.0);
  const Air air{measured.temperature_c(),
                measured.pressure_pa(),
                measured.relative_humidity(),
                bme280::kTemperatureTolerance * rectangular,
                bme280::kPressureTolerance * rectangular,
                bme280::kHumidityTolerance * rectangular};
  if (!plausible(air)) {
    fail("measure",
         fmt::format("{:.1f} °C, {:.0f} Pa, {:.0f} %RH: implausible for air", air.temperature_c, air.pressure_pa,
                     100 * air.relative_humidity),
         "check the wiring, replace the sensor");
  }
  return air;
}

void Bme280Sensor::find() {
  std::string why;
  for (const std::uint8_t address : {bme280::kAddressLow, bme280::kAddressHigh}) {
    address_ = address;
    std::uint8_t id = 0;
    try {
      id = get(bme280::kIdRegister);
    } catch (const DeviceError& error) {
      why += fmt::format("{}0x{:02X}: {}", why.empty() ? "" : "; ", address, error.what());
      continue;
    }
    if (id == bme280::kId) return;
    why += fmt::format("{}0x{:02X}: chip id 0x{:02X} instead of 0x60", why.empty() ? "" : "; ", address, id);
  }
  fail("find", why, "a BMP280 (0x58) has no humidity and is not supported");
}

void Bme280Sensor::reset() {
  set(bme280::kResetRegister, bme280::kReset);
  pause_(kPoll);
  wait_while(bme280::kCopying, "load its calibration");
}

void Bme280Sensor::wait_while(std::uint8_t status_bits, const char* operation) {
  for (int i = 0; i < kPolls; ++i) {
    if ((get(bme280::kStatusRegister) & status_bits) == 0) return;
    pause_(kPoll);
  }
  fail(operation, "not finished in time", "plug the sensor in again");
}

bme280::Calibration Bme280Sensor::read_calibration() {
  std::array<std::uint8_t, 24> first{};
  std::array<std::uint8_t, 7> second{};
  bus_.read(address_, bme280::kFirstCalibration, first);
  const std::uint8_t h1 = get(bme280::kHumidityCalibration);
  bus_.read(address_, bme280::kSecondCalibration, second);
  return bme280::calibration_of(first, h1, second);
}

std::uint8_t Bme280Sensor::get(std::uint8_t register_number) {
  std::uint8_t value = 0;
  bus_.read(address_, register_number, {&value, 1});
  return value;
}

void Bme280Sensor::set(std::uint8_t register_number, std::uint8_t value) {
  const std::array<std::uint8_t, 2> bytes{register_number, value};
  bus_.write(address_, bytes);
}

void Bme280Sensor::fail(const char* operation, const std::string& cause, const char* next_move) const {
  throw DeviceError(identity_, operation, cause, next_move);
}

}  // namespace kphi::ambient
