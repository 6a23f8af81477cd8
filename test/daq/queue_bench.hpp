// A bench whose devices say what a test puts in.
#pragma once

#include <cmath>
#include <deque>
#include <stdexcept>
#include <utility>

#include "daq/bench/bench.hpp"
#include "daq/bench/device_records.hpp"
#include "daq/guard/run_stopped.hpp"

namespace kphi::daq {

template <class T>
std::size_t move_out(std::deque<T>& from, std::span<T> out) {
  const std::size_t n = std::min(from.size(), out.size());
  for (std::size_t i = 0; i < n; ++i) {
    out[i] = from.front();
    from.pop_front();
  }
  return n;
}

/// A supply that shows the readings that a test puts in, and may refuse to confirm that it is off.
class QueueSupply final : public SupplyLink {
 public:
  [[nodiscard]] std::string identity() const override { return "test"; }
  std::size_t take(std::span<SupplyReading> out) override { return move_out(readings, out); }
  [[nodiscard]] std::string failure() const override { return {}; }
  [[nodiscard]] SupplyKeypad keypad() const override { return keys; }
  void cut() noexcept override { ++cuts; }
  [[nodiscard]] std::string switch_off() noexcept override {
    if (unconfirmed.empty()) on = false;
    return unconfirmed;
  }
  std::deque<SupplyReading> readings;
  int cuts = 0;
  bool on = false;
  bool refuses = false, interrupted = false;  ///< halfway through switch_on()
  std::string unconfirmed;
  SupplyKeypad keys = SupplyKeypad::free;

 private:
  void switch_on(const StopAsked&) override {
    on = true;
    if (refuses) throw std::runtime_error("no");
    if (interrupted) throw Interrupted("stopped by request");
  }
};

/// A motor that says what a test puts in.
class QueueMotor : public MotorLink {
 public:
  void spin_at(RadPerSec) override {}
  void renew() noexcept override {}
  void emergency_stop() noexcept override { ++coasted; }
  void rest() override { ++rests; }
  void wake(const StopAsked&) override { ++wakes; }
  void begin_stop(const iq::StopSettings&) override {}
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override { return std::nullopt; }
  [[nodiscard]] const iq::AuditRecord& parameters() const override { return parameters_; }
  [[nodiscard]] std::optional<Celsius> coil_temperature() override { return std::nullopt; }
  std::size_t take(std::span<MotorReading> out) override { return move_out(readings, out); }
  [[nodiscard]] std::string identity() const override { return "test"; }
  [[nodiscard]] std::vector<StreamEvent> take_events() override { return std::exchange(events, {}); }
  [[nodiscard]] std::string failure() const override { return lost; }
  [[nodiscard]] results::MotorCounts counts() const override { return {}; }

  std::deque<MotorReading> readings;
  std::vector<StreamEvent> events;
  std::string lost;
  int coasted = 0, rests = 0, wakes = 0;

 private:
  iq::AuditRecord parameters_;
};

/// 20 N, 60 N along Fz, 1 N m.
inline results::LoadCellScale mini40() {
  results::LoadCellScale scale;
  scale.range = {20, 20, 60, 1, 1, 1};
  return scale;
}

/// What a mini40() shows; the other axes 0.
inline LoadCellRecord load_of(double fz_n, double tz_nm = 0) {
  LoadCellRecord record;
  record.counts[2] = static_cast<std::int32_t>(std::lround(1e6 * fz_n));
  record.counts[5] = static_cast<std::int32_t>(std::lround(1e6 * tz_nm));
  return record;
}

/// A bench of queues that a test fills, with a mini40().
class QueueBench : public Bench, private LoadCellLink {
 public:
  QueueBench() {
    configuration.counts_per_newton = mini40().counts_per_newton;
    configuration.counts_per_newton_metre = mini40().counts_per_newton_metre;
    configuration.range = mini40().range;
  }
  [[nodiscard]] const Clock& clock() const override { return time; }
  [[nodiscard]] MotorLink& motor() override { return queue_motor; }
  [[nodiscard]] LoadCellLink& load_cell() override { return *this; }
  [[nodiscard]] SupplyLink* supply() override { return supply_link; }
  void wait_until(Instant when) override { time.set(when); }
  [[nodiscard]] std::shared_ptr<void> run_periodically(const ThreadRole&, std::function<void()>) override {
    return nullptr;
  }
  [[nodiscard]] results::FileLayer& files() override { return *layer; }
  [[nodiscard]] Duration sync_interval() const override { return std::chrono::milliseconds(500); }
  void mounted(const std::string&, double) override {}
  void hung(int, double) override {}
  [[nodiscard]] bool switch_off_power() override { return false; }
  void restore_power(const StopAsked&) override {}

  ManualClock time;
  results::FileLayer* layer = &results::disk();
  std::deque<LoadCellRecord> records;
  QueueMotor queue_motor;
  SupplyLink* supply_link = nullptr;
  std::deque<MotorReading>& readings = queue_motor.readings;
  std::vector<StreamEvent> events;
  netbox::Configuration configuration;

 private:
  [[nodiscard]] results::LoadCellScale scale() const override { return to_scale(configuration); }
  [[nodiscard]] const netbox::Configuration* box() const override { return &configuration; }
  [[nodiscard]] std::vector<Finding> findings() const override { return {}; }
  results::LoadCellScale start() override { return {}; }
  void stop() noexcept override {}
  std::size_t take(std::span<LoadCellRecord> out) override { return move_out(records, out); }
  [[nodiscard]] std::vector<StreamEvent> take_events() override { return std::exchange(events, {}); }
  std::string page() override { return {}; }
  void set_bias() noexcept override {}
  [[nodiscard]] SampleAccount account() const override { return {}; }
  [[nodiscard]] StreamHealth health() const override { return {}; }
  [[nodiscard]] std::string failure() const override { return {}; }
};

}  // namespace kphi::daq
