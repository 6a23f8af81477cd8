#include "daq/hardware/realtime_kit.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdint>

#include "daq/hardware/system_bus.hpp"

namespace kphi::daq {
namespace {

constexpr SystemBus::Service kKit{"org.freedesktop.RealtimeKit1", "/org/freedesktop/RealtimeKit1",
                                  "org.freedesktop.RealtimeKit1"};
constexpr rlim_t kLongest_us = 200'000;  // its default RTTimeUSecMax
constexpr auto kLimit = std::chrono::seconds(1);

std::string words(const std::string& cause) { return "RealtimeKit: " + cause; }

}  // namespace

std::string ask_realtime_kit(pid_t thread, int priority) {
  rlimit computing{};
  (void)getrlimit(RLIMIT_RTTIME, &computing);
  if (computing.rlim_max > kLongest_us) {
    computing = {kLongest_us, kLongest_us};
    if (setrlimit(RLIMIT_RTTIME, &computing) != 0) return words("RLIMIT_RTTIME cannot be set");
  }
  SystemBus bus;
  if (bus.error() != 0) return words("no system bus");
  const auto answer = bus.call(kKit, "MakeThreadRealtime", std::chrono::steady_clock::now() + kLimit, "tu",
                               static_cast<std::uint64_t>(thread), static_cast<std::uint32_t>(priority));
  return answer.error < 0 ? words(answer.cause) : "";
}

std::string priority_words(const std::string& refusal) {
  if (refusal.empty()) return "";
  return fmt::format("other programs may delay kphi and so stop a run: no real-time priority ({}); {}", refusal,
                     kGrantPriority);
}

}  // namespace kphi::daq
