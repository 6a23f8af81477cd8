#include "drivers/iq/exchange/telemetry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/iq/wire/codes.hpp"

namespace kphi::iq {
namespace {

constexpr std::size_t kSetAndGet = 18;
constexpr double kUsualSlowHz = 50;

void check(const Settings& settings) {
  const auto refuse = [](const std::string& why) { throw std::invalid_argument(why); };
  if (settings.module_id < static_cast<int>(ModuleId::first) || settings.module_id > static_cast<int>(ModuleId::last)) {
    refuse(fmt::format("module id {} is not in 0..62", settings.module_id));
  }
  if (!(settings.telemetry_hz > 0 && settings.telemetry_hz <= 1e5)) {
    refuse(fmt::format("telemetry rate {} Hz is not in 0..100000", settings.telemetry_hz));
  }
  if (!(settings.slow_hz >= 0 && settings.slow_hz <= 1e5)) {
    refuse(fmt::format("slow telemetry rate {} Hz is not in 0..100000", settings.slow_hz));
  }
  if (!(settings.module_timeout_s > 0) || !std::isfinite(settings.module_timeout_s)) {
    refuse(fmt::format("module timeout {} s is not above 0", settings.module_timeout_s));
  }
  if (settings.credit_bytes < kSetAndGet) refuse("less credit than a set and its read-back need");
}

}  // namespace

Settings completed(Settings settings) {
  check(settings);
  const auto otherwise = [](Duration& value, Duration usual) {
    if (value <= Duration{0}) value = usual;
  };
  otherwise(settings.reply_timeout, std::chrono::milliseconds(100));
  otherwise(settings.longest_silence, from_seconds(settings.module_timeout_s));
  if (settings.slow_hz == 0) settings.slow_hz = std::min(settings.telemetry_hz, kUsualSlowHz);
  return settings;
}

}  // namespace kphi::iq
