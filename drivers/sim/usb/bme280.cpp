#include "drivers/sim/usb/bme280.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kId = 0xD0, kReset = 0xE0, kControlHumidity = 0xF2, kStatus = 0xF3, kControlMeasure = 0xF4,
                       kConfig = 0xF5, kPressure = 0xF7, kTemperature = 0xFA, kHumidity = 0xFD;
constexpr Duration kLoading = 2ms;
constexpr double kLargestCount = 1048575, kLargestHumidCount = 65535;  // largest counts

/// Times that a channel is sampled, by its oversampling code; 0: skipped.
int samples_of(int code) noexcept { return code == 0 ? 0 : 1 << std::min(code - 1, 4); }

/// The smaller root of a·x² + b·x = y, for b > 0, also when a is 0.
double small_root(double a, double b, double y) noexcept {
  return 2 * y / (b + std::sqrt(std::max(0.0, b * b + 4 * a * y)));
}

double counts(double value, double most) noexcept { return std::clamp(std::round(value), 0.0, most); }

// The compensation of appendix 8.1 (floating point), solved for the counts.

double temperature_counts(double celsius, const Bme280Constants& c) noexcept {
  const double x = small_root(c.t3 / 64.0, c.t2, celsius * 5120);
  return counts((x + c.t1 / 1024.0) * 16384, kLargestCount);
}

/// What the temperature's counts tell the other two channels.
double t_fine(double adc, const Bme280Constants& c) noexcept {
  const double x = adc / 16384 - c.t1 / 1024.0;
  return std::floor(x * c.t2 + x * x / 64 * c.t3);
}

double pressure_counts(double pascal, double fine, const Bme280Constants& c) noexcept {
  const auto p = [&](int number) { return static_cast<double>(c.p[static_cast<std::size_t>(number - 1)]); };
  const double v = fine / 2 - 64000;
  const double offset = (v * v * p(6) / 32768 + v * p(5) * 2) / 4 + p(4) * 65536;
  const double scale = (1 + (p(3) * v * v / 524288 + p(2) * v) / 524288 / 32768) * p(1);
  const double linear = small_root(p(9) / 34359738368.0, 1 + p(8) / 524288, pascal - p(7) / 16);
  return counts(1048576 - (linear * scale / 6250 + offset / 4096), kLargestCount);
}

double humidity_counts(double percent, double fine, const Bme280Constants& c) noexcept {
  const double v = fine - 76800;
  const double gain = c.h2 / 65536.0 * (1 + c.h6 / 67108864.0 * v * (1 + c.h3 / 67108864.0 * v));
  const double bent = small_root(-c.h1 / 524288.0, 1, percent);
  return counts(bent / gain + c.h4 * 64 + c.h5 / 16384.0 * v, kLargestHumidCount);
}

/// Vapour pressure of saturated air, any unit (Magnus).
double saturation(double celsius) { return std::exp(17.62 * celsius / (243.12 + celsius)); }

}  // namespace

Bme280::Bme280(const TrueAir& air, std::uint8_t address, const Bme280Constants& constants)
    : air_(air), address_(address), constants_(constants) {
  reset(Instant{0});
}

void Bme280::write(std::span<const std::uint8_t> bytes, Instant now) {
  if (bytes.empty()) return;
  advance(now);
  pointer_ = bytes[0];
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) put(bytes[i], bytes[i + 1], now);
}

std::uint8_t Bme280::read(Instant now) { return peek(pointer_++, now); }

std::uint8_t Bme280::peek(std::uint8_t at, Instant now) {
  advance(now);
  const bool calibration = at < kReset ? at != kId : at < kControlHumidity;
  if (calibration && now < loaded_) return 0;
  if (at != kStatus) return registers_[at];
  return static_cast<std::uint8_t>((measured_ != kNever ? 0x08 : 0) | (now < loaded_ ? 0x01 : 0));
}

void Bme280::put(std::uint8_t at, std::uint8_t value, Instant now) {
  const bool runs = (registers_[kControlMeasure] & 3) == 3;
  if (at == kReset && value == 0xB6) reset(now);
  if (at == kControlHumidity) registers_[at] = value & 7;
  if (at == kConfig && !runs) registers_[at] = value & 0xFD;
  if (at != kControlMeasure) return;
  registers_[at] = value;
  humidity_control_ = registers_[kControlHumidity];
  if ((value & 3) != 0) begin_measurement(now);
}

void Bme280::reset(Instant now) {
  registers_.fill(0);
  burn();
  registers_[kId] = 0x60;
  registers_[kPressure] = registers_[kTemperature] = registers_[kHumidity] = 0x80;
  humidity_control_ = 0;
  loaded_ = now + kLoading;
  measured_ = kNever;
}

/// Table 16: two bytes each, the low one first, but for those of the humidity.
void Bme280::burn() {
  std::size_t at = 0x88;
  const auto pair = [&](int value) {
    registers_[at++] = static_cast<std::uint8_t>(value);
    registers_[at++] = static_cast<std::uint8_t>(value >> 8);
  };
  for (const int value : {constants_.t1, constants_.t2, constants_.t3}) pair(value);
  for (const int value : constants_.p) pair(value);
  registers_[0xA1] = static_cast<std::uint8_t>(constants_.h1);
  at = 0xE1;
  pair(constants_.h2);
  registers_[at++] = static_cast<std::uint8_t>(constants_.h3);
  registers_[at++] = static_cast<std::uint8_t>(constants_.h4 >> 4);
  registers_[at++] = static_cast<std::uint8_t>((constants_.h4 & 15) | (constants_.h5 & 15) << 4);
  registers_[at++] = static_cast<std::uint8_t>(constants_.h5 >> 4);
  registers_[at] = static_cast<std::uint8_t>(constants_.h6);
}

/// Section 9.1, the longest: 1.25 ms, then 2.3 ms for each sample, and 0.575 ms for pressure and humidity if asked for.
void Bme280::begin_measurement(Instant now) {
  const int temperature = samples_of(registers_[kControlMeasure] >> 5);
  const int pressure = samples_of(registers_[kControlMeasure] >> 2 & 7);
  const int humidity = samples_of(humidity_control_);
  const double ms =
      1.25 + 2.3 * (temperature + pressure + humidity) + (pressure > 0 ? 0.575 : 0) + (humidity > 0 ? 0.575 : 0);
  measured_ = now + from_seconds(1e-3 * ms);
}

void Bme280::finish_measurement() {
  const auto twenty = [&](std::uint8_t at, double value) {
    const auto n = static_cast<std::uint32_t>(value);
    registers_[at] = static_cast<std::uint8_t>(n >> 12);
    registers_[at + 1u] = static_cast<std::uint8_t>(n >> 4);
    registers_[at + 2u] = static_cast<std::uint8_t>(n << 4);
  };
  const std::uint8_t control = registers_[kControlMeasure];
  const double celsius = air_.temperature_c + warmth_;
  const double drier = saturation(air_.temperature_c) / saturation(celsius);
  const double temperature = temperature_counts(celsius, constants_);
  const double fine = t_fine(temperature, constants_);
  twenty(kTemperature, control >> 5 != 0 ? temperature : 0x80000);
  twenty(kPressure, (control >> 2 & 7) != 0 ? pressure_counts(air_.pressure_pa, fine, constants_) : 0x80000);
  const double humid =
      humidity_control_ != 0 ? humidity_counts(100 * drier * air_.relative_humidity, fine, constants_) : 0x8000;
  registers_[kHumidity] = static_cast<std::uint8_t>(static_cast<unsigned>(humid) >> 8);
  registers_[kHumidity + 1u] = static_cast<std::uint8_t>(static_cast<unsigned>(humid));
}

void Bme280::advance(Instant now) {
  if (now < measured_) return;
  finish_measurement();
  measured_ = kNever;
  if ((registers_[kControlMeasure] & 3) == 3) {
    begin_measurement(now);
  } else {
    registers_[kControlMeasure] &= 0xFC;  // forced: back to sleep
  }
}

}  // namespace kphi::sim
