#include "drivers/ambient/bme280.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "base/error.hpp"

namespace kphi::ambient {

namespace bme280 {
namespace {

// Wider than the data sheet's 32 and 64 bits: the results agree wherever those suffice, and no input overflows.
using Wide = std::int64_t;
__extension__ using Wider = __int128;  // for damaged calibrations

std::uint16_t u16(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}
std::int16_t s16(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::int16_t>(u16(bytes, at));
}
std::int16_t sign_extended_12(int value) noexcept {
  return static_cast<std::int16_t>(value >= 0x800 ? value - 0x1000 : value);
}

Wide fine_temperature(Wide adc, const Calibration& c) noexcept {
  const Wide first = (((adc >> 3) - (Wide{c.t1} * 2)) * c.t2) >> 11;
  const Wide offset = (adc >> 4) - c.t1;
  return first + ((((offset * offset) >> 12) * c.t3) >> 14);
}

std::uint32_t pressure(Wide adc, Wide t_fine, const Calibration& c) noexcept {
  const Wider v = t_fine - 128000;
  const Wider v2 = v * v * c.p6 + v * c.p5 * (Wider{1} << 17) + Wider{c.p4} * (Wider{1} << 35);
  const Wider v1 = (((Wider{1} << 47) + ((v * v * c.p3) >> 8) + v * c.p2 * 4096) * c.p1) >> 33;
  if (v1 == 0) return 0;
  Wider p = ((Wider{1048576 - adc} * (Wider{1} << 31) - v2) * 3125) / v1;
  const Wider square = (Wider{c.p9} * (p >> 13) * (p >> 13)) >> 25;
  p = ((p + square + ((Wider{c.p8} * p) >> 19)) >> 8) + Wider{c.p7} * 16;
  return p < 0 || p > Wider{0xFFFFFFFF} ? 0 : static_cast<std::uint32_t>(p);
}

std::uint32_t humidity(Wide adc, Wide t_fine, const Calibration& c) noexcept {
  const Wider v = t_fine - 76800;
  const Wider a = (Wider{adc} * 16384 - Wider{c.h4} * 1048576 - c.h5 * v + 16384) >> 15;
  const Wider damp = ((((v * c.h6) >> 10) * (((v * c.h3) >> 11) + 32768)) >> 10) + 2097152;
  const Wider x = a * ((damp * c.h2 + 8192) >> 14);
  const Wider bent = x - (((((x >> 15) * (x >> 15)) >> 7) * c.h1) >> 4);
  return static_cast<std::uint32_t>(std::clamp<Wider>(bent, 0, 419430400) >> 12);
}

}  // namespace

Calibration calibration_of(std::span<const std::uint8_t, 24> first, std::uint8_t h1,
                           std::span<const std::uint8_t, 7> second) noexcept {
  Calibration c;
  c.t1 = u16(first, 0), c.t2 = s16(first, 2), c.t3 = s16(first, 4);
  c.p1 = u16(first, 6);
  std::size_t at = 8;
  for (std::int16_t* p : {&c.p2, &c.p3, &c.p4, &c.p5, &c.p6, &c.p7, &c.p8, &c.p9}) {
    *p = s16(first, at);
    at += 2;
  }
  c.h1 = h1;
  c.h2 = s16(second, 0);
  c.h3 = second[2];
  c.h4 = sign_extended_12(second[3] << 4 | (second[4] & 0x0F));
  c.h5 = sign_extended_12(second[5] << 4 | second[4] >> 4);
  c.h6 = static_cast<std::int8_t>(second[6]);
  return c;
}

std::string_view refusal_of(const Calibration& c) noexcept {
  if (c.t1 == 0 || c.p1 == 0) return "T1 or P1 is zero";
  if (c.t1 == 0xFFFF && c.p1 == 0xFFFF && c.t2 == -1) return "every byte is ff: nothing drives the bus";
  if (c.t2 == 0) return "T2 is zero";
  return {};
}

Raw raw_of(std::span<const std::uint8_t, 8> d) noexcept {
  const auto twenty = [&](std::size_t at) {
    return static_cast<std::uint32_t>(d[at]) << 12 | static_cast<std::uint32_t>(d[at + 1]) << 4 | d[at + 2] >> 4;
  };
  return {twenty(0), twenty(3), static_cast<std::uint32_t>(d[6]) << 8 | d[7]};
}

bool complete(const Raw& raw) noexcept {
  return raw.pressure != 0x80000 && raw.temperature != 0x80000 && raw.humidity != 0x8000;
}

Measured compensate(const Raw& raw, const Calibration& calibration) noexcept {
  const Wide t_fine = fine_temperature(raw.temperature, calibration);
  return {static_cast<std::int32_t>((t_fine * 5 + 128) >> 8), pressure(raw.pressure, t_fine, calibration),
          humidity(raw.humidity, t_fine, calibration)};
}

}  // namespace bme280

namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kSixteenTimes = 0b101, kForced = 0b01;
constexpr auto kPoll = 5ms;
constexpr int kPolls = 200;  // one second: a measurement takes 113 ms at most (data sheet, 9.1)

}  // namespace

Bme280Sensor::Bme280Sensor(Mcp2221& bus, const std::string& where, Mcp2221::Pause pause)
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
    why += fmt::format("{}0x{:02X}: ", why.empty() ? "" : "; ", address);
    try {
      const std::uint8_t id = get(bme280::kIdRegister);
      if (id == bme280::kId) return;
      why += fmt::format("chip id 0x{:02X} instead of 0x60", id);
    } catch (const DeviceError& error) {
      why += error.what();
    }
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

namespace {

struct OpenBridge {
  explicit OpenBridge(const UsbAddress& address) : device(bus.open(address)), bridge(*device) {}
  usb::Bus bus;
  std::unique_ptr<usb::Transport> device;
  Mcp2221 bridge;
};

/// Owns bus, device and bridge, which outlive the sensor.
class UsbBme280 final : OpenBridge, public Bme280Sensor {
 public:
  explicit UsbBme280(const UsbAddress& address) : OpenBridge(address), Bme280Sensor(bridge, device->name()) {}
};

}  // namespace

UsbAddress sensor_address(std::string_view text) {
  const UsbAddress address = UsbAddress::parse(text);
  if (address.vendor == Mcp2221::kVendor && address.product == Mcp2221::kProduct) return address;
  throw std::invalid_argument(fmt::format(
      "\"{}\" is not a known sensor of the air; write usb:04d8:00dd (a BME280 behind an MCP2221A), manual: and the "
      "values, or unknown",
      text));
}

std::unique_ptr<Ambient> open(const UsbAddress& address) { return std::make_unique<UsbBme280>(address); }

}  // namespace kphi::ambient
