// The motor module's session joined to the simulated line in virtual time.
#pragma once

#include <functional>
#include <vector>

#include "daq/bench/bench.hpp"
#include "daq/bench/device_records.hpp"
#include "drivers/iq/session/connecting.hpp"
#include "drivers/iq/session/session.hpp"
#include "drivers/sim/iq/line.hpp"

namespace kphi::daq {

class DeterministicMotor final : public MotorLink {
 public:
  /// `step` lets a little bench time pass, in which exchange() and advance() are called. Line and clock outlive this.
  DeterministicMotor(const profiles::MotorConfig& config, sim::IqLine& line, const Clock& clock,
                     std::function<void()> step);

  /// Connects and reads the module's parameters. Throws DeviceError.
  void connect();
  /// kphi sends nothing until wake().
  void rest() noexcept override { resting_ = true; }
  void wake(const StopAsked&) override;
  /// Carries bytes both ways, at the clock's time.
  void exchange();
  void advance(Instant now) {
    if (!resting_) session_.advance(now);
  }
  /// The program is gone: no byte crosses the line any more.
  void abandon() noexcept { abandoned_ = true; }
  /// When the next event is due at either end of the line.
  [[nodiscard]] Instant deadline() const {
    return resting_ ? line_.next_event() : std::min(session_.deadline(), line_.next_event());
  }

  void spin_at(RadPerSec signed_speed) override;
  // One thread: the caller and the watchdog cannot fail separately.
  void renew() noexcept override {}
  void emergency_stop() noexcept override;
  void begin_stop(const iq::StopSettings& settings) override;
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override;
  [[nodiscard]] const iq::AuditRecord& parameters() const override { return parameters_; }
  [[nodiscard]] std::optional<Celsius> coil_temperature() override;
  std::size_t take(std::span<MotorReading> out) override { return session_.take(out); }
  [[nodiscard]] std::vector<StreamEvent> take_events() override;
  [[nodiscard]] std::string failure() const override;
  [[nodiscard]] results::MotorCounts counts() const override { return to_counts(session_.counters()); }
  [[nodiscard]] std::string identity() const override { return session_.identity().summary(); }

 private:
  [[nodiscard]] std::vector<iq::Reply> ask(const std::vector<iq::Inquiry>& asked);
  void watch_plug();
  void discard(Instant now);

  sim::IqLine& line_;
  const Clock& clock_;
  std::function<void()> step_;
  iq::Session session_;
  iq::AuditRecord parameters_;
  bool plugged_ = true;
  bool abandoned_ = false;
  bool resting_ = false;
  std::string failure_;
};

}  // namespace kphi::daq
