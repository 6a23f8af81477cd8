// A motor on a drone's ESC, to which a small board speaks DShot. To the board, a hundred times a second:
// $T,<throttle>*hh, 0 (the motor coasts) to 2000. From it, as often: $R,<throttle that it sends>,<electrical RPM>,
// <V / 100>,<A / 100>,<°C of the ESC>*hh. The board coasts by itself 250 ms after the last order. An ESC takes a
// throttle, not a speed: this driver closes the loop. It cannot brake, and knows neither the coil nor faults.
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daq/bench/bench.hpp"
#include "drivers/serial/port.hpp"
#include "examples/second_bench/checked_lines.hpp"
#include "examples/second_bench/speed_loop.hpp"

namespace kphi::second_bench {

class EscMotor final : public daq::MotorLink {
 public:
  /// Opens the board, orders it to coast and waits until it says so. Settings: pole_pairs, kv_rpm_per_v, proportional,
  /// integral. Throws DeviceError.
  EscMotor(const profiles::BenchConfig& bench, const Clock& clock);
  /// Coasts.
  ~EscMotor() override;
  void spin_at(RadPerSec signed_speed) override;
  void renew() noexcept override;
  void emergency_stop() noexcept override;
  void begin_stop(const iq::StopSettings& settings) override;
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override;
  std::size_t take(std::span<MotorReading> out) override;
  [[nodiscard]] std::vector<StreamEvent> take_events() override;
  [[nodiscard]] std::string failure() const override;
  [[nodiscard]] results::MotorCounts counts() const override;
  [[nodiscard]] std::string identity() const override { return "ESC on " + port_.device(); }

 private:
  void serve();
  void quit() noexcept;
  void hear();
  void take(const std::vector<std::int64_t>& line, Instant at);
  void order(Instant now);
  void give_up(Instant now, EventKind kind, const char* why);
  void send(int throttle) noexcept;
  void coast(Instant now) noexcept;
  [[nodiscard]] bool stands_by() const;

  const Clock& clock_;
  const int spin_;
  SpeedLoop loop_;
  serial::Port port_;
  CheckedLines lines_;  ///< the thread's
  mutable std::mutex mutex_;
  std::vector<MotorReading> readings_;
  std::vector<StreamEvent> events_;
  iq::Stopping stopping_;
  results::MotorCounts counts_{};
  double wanted_ = 0;  ///< rad/s, unsigned; 0: coast
  double speed_ = 0, volts_ = 0;
  int throttle_ = 0, applied_ = -1;  ///< ordered; as the board says, -1 before its first line
  Instant renewed_{0}, heard_{0}, next_order_{0};
  Duration served_{0};  ///< wall time, with this computer's sleep
  bool drives_ = false, quit_ = false;
  std::string lost_;
  std::thread thread_;  ///< last: it uses the members above
};

}  // namespace kphi::second_bench
