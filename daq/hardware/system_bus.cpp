#include "daq/hardware/system_bus.hpp"

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace kphi::daq {
namespace {

/// At least 1: sd-bus takes 0 for its own limit of 25 s.
std::uint64_t microseconds_until(SystemBus::SteadyTime end) {
  const auto left = end - std::chrono::steady_clock::now();
  return static_cast<std::uint64_t>(
      std::max<std::int64_t>(std::chrono::duration_cast<std::chrono::microseconds>(left).count(), 1));
}

}  // namespace

// sd_bus_call would wait 90 s for a bus that does not greet.
SystemBus::SystemBus() noexcept {
  sd_bus* opened = nullptr;
  if (const int failed = sd_bus_open_system(&opened); failed < 0) {
    error_ = -failed;
    return;
  }
  bus_.reset(opened);
  const SteadyTime end = std::chrono::steady_clock::now() + kOneAnswer;
  while (sd_bus_is_ready(opened) <= 0) {
    if (std::chrono::steady_clock::now() >= end) {
      error_ = ETIMEDOUT;
      return;
    }
    int progress = sd_bus_process(opened, nullptr);
    if (progress == 0) progress = sd_bus_wait(opened, microseconds_until(end));
    if (progress >= 0 || progress == -EINTR) continue;
    error_ = -progress;
    return;
  }
}

void SystemBus::limit_until(SteadyTime end) noexcept {
  const SteadyTime one = std::chrono::steady_clock::now() + kOneAnswer;
  sd_bus_set_method_call_timeout(bus_.get(), microseconds_until(std::min(end, one)));
}

SystemBus::Answer SystemBus::answer(int error, sd_bus_error& why, sd_bus_message* message) {
  Answer answer{std::min(error, 0), "", Message(message)};
  if (error < 0) answer.cause = why.message != nullptr ? why.message : std::generic_category().message(-error);
  sd_bus_error_free(&why);
  return answer;
}

}  // namespace kphi::daq
