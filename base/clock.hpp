// The one clock: nanoseconds of bench time since the clock's own epoch. Everything that waits or stamps gets it as an
// argument. Sessions and simulated devices hold no clock: their callers pass the time.
#pragma once

#include <time.h>

#include <chrono>
#include <cstdint>

namespace kphi {

using Duration = std::chrono::nanoseconds;
/// Bench time since the clock's epoch, in ns. Stored in files as `*_ns`.
using Instant = std::chrono::nanoseconds;

/// Later than any time: no deadline.
inline constexpr Instant kNever = Instant::max();

[[nodiscard]] constexpr double to_seconds(Duration duration) noexcept {
  return 1e-9 * static_cast<double>(duration.count());
}
[[nodiscard]] constexpr Duration from_seconds(double seconds) noexcept {
  return Duration(static_cast<std::int64_t>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5)));
}
[[nodiscard]] constexpr Duration to_duration(const timespec& time) noexcept {
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}
[[nodiscard]] constexpr timespec to_timespec(Duration duration) noexcept {
  return {duration.count() / 1'000'000'000, duration.count() % 1'000'000'000};
}

/// Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual Instant now() const noexcept = 0;
  /// Bench time that passes during `wall` of wall time: deadlines of protocols are given in wall time.
  [[nodiscard]] virtual Duration stretched(Duration wall) const noexcept = 0;
  /// Wall time that passes during `bench` of bench time: how long a thread may sleep.
  [[nodiscard]] virtual Duration shrunk(Duration bench) const noexcept = 0;
  /// Bench time of a kernel receive stamp (SO_TIMESTAMPNS, CLOCK_REALTIME).
  [[nodiscard]] virtual Instant at_realtime(const timespec& stamp) const noexcept = 0;
  /// Calendar time of the epoch, UTC.
  [[nodiscard]] virtual std::chrono::system_clock::time_point epoch_utc() const noexcept = 0;
  /// Wall time for which this computer was suspended since the epoch; now() stopped meanwhile.
  [[nodiscard]] virtual Duration suspended() const noexcept = 0;
};

/// Shortest suspension that is told apart from the time between two readings of a clock. No computer sleeps as briefly.
inline constexpr Duration kShortestSleep = std::chrono::milliseconds(50);

/// CLOCK_MONOTONIC, `scale` times as fast as the wall clock: 1 on a real bench, N simulated. Epoch: construction.
class SteadyClock final : public Clock {
 public:
  explicit SteadyClock(double scale = 1.0) noexcept;
  [[nodiscard]] Instant now() const noexcept override;
  [[nodiscard]] Duration stretched(Duration wall) const noexcept override;
  [[nodiscard]] Duration shrunk(Duration bench) const noexcept override;
  [[nodiscard]] Instant at_realtime(const timespec& stamp) const noexcept override;
  [[nodiscard]] std::chrono::system_clock::time_point epoch_utc() const noexcept override;
  /// Growth of CLOCK_BOOTTIME over CLOCK_MONOTONIC.
  [[nodiscard]] Duration suspended() const noexcept override;

 private:
  double scale_;
  std::int64_t epoch_monotonic_ns_;
  std::int64_t epoch_realtime_ns_;
  std::int64_t epoch_lead_ns_;  ///< of CLOCK_BOOTTIME over CLOCK_MONOTONIC
};

/// Moves only by set() and advance(): for tests and the deterministic bench. One thread.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(Instant start = Instant{0}) noexcept : now_(start) {}
  void set(Instant now) noexcept { now_ = now; }
  void advance(Duration by) noexcept { now_ += by; }
  [[nodiscard]] Instant now() const noexcept override { return now_; }
  [[nodiscard]] Duration stretched(Duration wall) const noexcept override { return wall; }
  [[nodiscard]] Duration shrunk(Duration bench) const noexcept override { return bench; }
  [[nodiscard]] Instant at_realtime(const timespec&) const noexcept override { return now_; }
  /// 2021-05-30T00:00:00Z, always: files of the deterministic bench depend on nothing but the seed.
  [[nodiscard]] std::chrono::system_clock::time_point epoch_utc() const noexcept override {
    return std::chrono::system_clock::time_point(std::chrono::seconds(1622332800));
  }
  [[nodiscard]] Duration suspended() const noexcept override { return suspended_; }
  void suspend(Duration wall) noexcept { suspended_ += wall; }

 private:
  Instant now_;
  Duration suspended_{0};
};

}  // namespace kphi
