// The driver's session joined with the simulated module, its line and its motor: one thread, virtual time. What the
// driver delivers and counts is held against what the simulator knows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/iq/session/session.hpp"
#include "drivers/sim/iq/line.hpp"
#include "drivers/sim/physics/plant.hpp"

namespace kphi::iq::test {

struct Manner {
  double telemetry_hz = 50;
  double slow_hz = 0;
  std::vector<MotorChannel> every_cycle{MotorChannel::speed};
  unsigned baud = 115200;
  bool paced = true;
  int module_id = 0;
  double module_timeout_s = 0.5;
  Duration reply_latency = std::chrono::microseconds(100);
  Duration reply_jitter = std::chrono::microseconds(50);
  Duration usb_tick{0};
  std::size_t port_takes = 0;  ///< bytes that the host's port takes per tick; 0: all
  sim::IqQuirks quirks{};
};

class Joined {
 public:
  Joined(const Manner& manner, sim::FaultScript script, std::uint64_t seed);

  /// Seven thousand ticks a second. Speeds are commanded from the first `ready` on, another one every 0.4 s; after a
  /// failure the session is connected again as soon as it coasts, and nobody rearms it.
  void run_until(Instant end);
  /// Coasts and gives the module two seconds to come to rest.
  void finish();

  /// Commands a speed and takes it back at once.
  void waver();

  /// Everything in which the driver's account and what it delivered differ from the truth; empty when nothing does.
  [[nodiscard]] std::string disagreement() const;
  /// What is not safe: motion after a coast, a motor not coasting at the end.
  [[nodiscard]] std::string danger() const;
  /// From `after` to the next reading of the speed; longer than an hour when none came.
  [[nodiscard]] Duration silence_after(Instant after) const;

  [[nodiscard]] bool saw(EventKind kind) const;
  [[nodiscard]] const Session& session() const noexcept { return session_; }
  [[nodiscard]] const Counters& counters() const noexcept { return session_.counters(); }
  [[nodiscard]] const sim::IqTruth& truth() const noexcept { return line_.truth(); }
  [[nodiscard]] const sim::IqDevice& module() const noexcept { return module_; }
  [[nodiscard]] const sim::MotorState& motor() const noexcept { return plant_.motor(); }
  [[nodiscard]] const std::vector<MotorReading>& readings() const noexcept { return readings_; }
  [[nodiscard]] int failures() const noexcept { return failures_; }
  [[nodiscard]] const std::string& first_failure() const noexcept { return first_failure_; }
  [[nodiscard]] Instant ready_at() const noexcept { return ready_at_; }

 private:
  void pump(Instant now);
  [[nodiscard]] Instant now() const noexcept { return Instant(static_cast<std::int64_t>(tick_ * 1'000'000 / 7)); }
  void command(Instant now);
  void follow_the_plug(Instant now);
  void watch(std::span<const std::uint8_t> bytes, Instant now);
  void connect_again(Instant now);
  [[nodiscard]] std::string wrong_readings() const;

  Manner manner_;
  sim::Plant plant_;
  sim::IqDevice module_;
  sim::IqLine line_;
  Session session_;
  sim::IqScanner host_frames_;  ///< of what the driver says
  std::vector<MotorReading> readings_;
  std::vector<Instant> received_;  ///< when each of them was delivered
  std::uint64_t tick_ = 0;
  std::vector<StreamEvent> events_;
  bool may_spin_ = true, was_plugged_ = true, was_failed_ = false;
  bool coasted_ = true;  ///< no spin_at() since the last coast on the wire
  Instant next_command_{0}, reconnect_at_{0}, ready_at_{-1};
  int commands_ = 0, failures_ = 0, connects_ = 1;
  std::uint64_t forbidden_motions_ = 0;
  Instant forbidden_at_{-1};
  std::string first_failure_;
};

/// A script out of entries as a person writes them.
[[nodiscard]] sim::FaultScript script(std::initializer_list<sim::FaultEntry> entries);

}  // namespace kphi::iq::test
