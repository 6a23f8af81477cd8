#include "daq/hardware/wake_ups.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "base/real_time.hpp"
#include "base/thread.hpp"
#include "daq/guard/guard_limits.hpp"
#include "daq/hardware/realtime_kit.hpp"

namespace kphi::daq {
namespace {

using std::chrono::steady_clock;

constexpr auto kPeriod = std::chrono::milliseconds(5);        // of guard and recorder
constexpr Duration kTooLate = std::chrono::milliseconds(30);  // half of what a speed and its reading may take

struct Lateness {
  int count = 0;
  Duration worst{0};
};

Lateness sleep_until(steady_clock::time_point end) {
  Lateness seen;
  while (steady_clock::now() < end) {
    const auto due = steady_clock::now() + kPeriod;
    std::this_thread::sleep_until(due);
    seen.worst = std::max<Duration>(seen.worst, steady_clock::now() - due);
    ++seen.count;
  }
  return seen;
}

double ms(Duration duration) { return 1e3 * to_seconds(duration); }

}  // namespace

WakeUps measure_wake_ups(double seconds) {
  real_time::ask_through(&ask_realtime_kit);
  const auto end =
      steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(std::chrono::duration<double>(seconds));
  Lateness with, without;
  std::thread prompt = start_thread({"prompt", true}, [&] { with = sleep_until(end); });
  std::thread ordinary = start_thread({"ordinary"}, [&] { without = sleep_until(end); });
  prompt.join();
  ordinary.join();
  WakeUps seen;
  seen.count = std::min(with.count, without.count);
  seen.with = with.worst;
  seen.without = without.worst;
  seen.refusal = real_time::refusal();
  seen.memory_stays = real_time::may_lock_memory();
  return seen;
}

DeviceAnswer answer_of(const WakeUps& seen, const profiles::BenchConfig& config) {
  DeviceAnswer answer{"this computer", true};
  const bool granted = seen.refusal.empty();
  answer.says = fmt::format("late by at most {:.2g} ms", ms(seen.with));
  answer.lines = {
      fmt::format("real-time priority {}: {:.2g} ms late at most; {:.2g} ms as an ordinary program ({} wake-ups each)",
                  granted ? "granted" : "refused", ms(seen.with), ms(seen.without), seen.count),
      fmt::format("memory {}", seen.memory_stays ? "stays in place during a run" : "may be paged out"),
      fmt::format(
          "it must not be late by more than 60 ms with a speed, {:.0f} ms with samples and readings, 400 ms with "
          "kphi itself: then the motor coasts and the run ends",
          ms(spin_patience(config))),
      "until then a limit is noticed as much later, and nothing is lost: samples wait in the kernel"};
  answer.details = {{"real_time_priority", granted},
                    {"memory_stays", seen.memory_stays},
                    {"wake_ups", seen.count},
                    {"late_ms", ms(seen.with)},
                    {"late_ordinary_ms", ms(seen.without)}};
  std::vector<Finding> findings;
  if (!granted) {
    findings.push_back({Severity::note, "no real-time priority: " + seen.refusal, kGrantPriority});
  }
  if (seen.with > kTooLate) {
    findings.push_back({Severity::warning, fmt::format("this computer woke kphi {:.0f} ms late", ms(seen.with)),
                        granted ? "close other programs" : kGrantPriority});
  }
  answer.add(findings);
  return answer;
}

}  // namespace kphi::daq
