// The one clock: nanoseconds of bench time since the epoch of whoever owns the clock. It is handed to all that
// waits or stamps. Sessions and simulated devices hold no clock: they are told the time.
#pragma once

#include <time.h>

#include <chrono>
#include <cstdint>

namespace kphi {

using Duration = std::chrono::nanoseconds;
/// Bench time since the clock's epoch, in ns. Stored in files as `*_ns`.
using Instant = std::chrono::nanoseconds;

/// Later than anything: the deadline of who waits for nothing.
inline constexpr Instant kNever = Instant::max();

[[nodiscard]] constexpr double to_seconds(Duration duration) noexcept {
  return 1e-9 * static_cast<double>(duration.count());
}
[[nodiscard]] constexpr Duration from_seconds(double seconds) noexcept {
  return Duration(static_cast<std::int64_t>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5)));
}

/// All members may be called from any thread.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual Instant now() const noexcept = 0;
  /// Bench time that passes while `wall` passes for a person: deadlines of protocols are given in wall time.
  [[nodiscard]] virtual Duration stretched(Duration wall) const noexcept = 0;
  /// Wall time that passes while `bench` passes on the bench: what a thread may sleep.
  [[nodiscard]] virtual Duration shrunk(Duration bench) const noexcept = 0;
  /// Bench time of a kernel receive stamp (SO_TIMESTAMPNS, CLOCK_REALTIME).
  [[nodiscard]] virtual Instant at_realtime(const timespec& stamp) const noexcept = 0;
  /// Calendar time of the epoch, UTC.
  [[nodiscard]] virtual std::chrono::system_clock::time_point epoch_utc() const noexcept = 0;
  /// Wall time for which this computer was suspended since the epoch. now() stands still meanwhile.
  [[nodiscard]] virtual Duration suspended() const noexcept = 0;
};

/// A shorter suspension cannot be told from the time between two readings of a clock. No computer sleeps that briefly.
inline constexpr Duration kShortestSleep = std::chrono::milliseconds(50);

/// CLOCK_MONOTONIC, `scale` times as fast as a person's: 1 on a real bench, N on a simulated one. Epoch: construction.
class SteadyClock final : public Clock {
 public:
  explicit SteadyClock(double scale = 1.0) noexcept;
  [[nodiscard]] Instant now() const noexcept override;
  [[nodiscard]] Duration stretched(Duration wall) const noexcept override;
  [[nodiscard]] Duration shrunk(Duration bench) const noexcept override;
  [[nodiscard]] Instant at_realtime(const timespec& stamp) const noexcept override;
  [[nodiscard]] std::chrono::system_clock::time_point epoch_utc() const noexcept override;
  /// By how much CLOCK_BOOTTIME has got ahead of CLOCK_MONOTONIC.
  [[nodiscard]] Duration suspended() const noexcept override;

 private:
  double scale_;
  std::int64_t epoch_monotonic_ns_;
  std::int64_t epoch_realtime_ns_;
  std::int64_t epoch_lead_ns_;  ///< of CLOCK_BOOTTIME over CLOCK_MONOTONIC
};

/// Stands still until told: tests, and the deterministic bench. One thread.
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
