// The deterministic bench, looked at every millisecond: since when is the motor neither driven nor braked?
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "test/daq/wrapped_bench.hpp"

namespace kphi::daq {

/// A supply whose answers are spoilt, or end.
class SpoiltSupply final : public SupplyLink {
 public:
  SpoiltSupply(SupplyLink& inner, const Clock& clock) : inner_(inner), clock_(clock) {}
  [[nodiscard]] std::string identity() const override { return inner_.identity(); }
  std::size_t take(std::span<SupplyReading> out) override {
    const std::size_t n = inner_.take(out);
    for (std::size_t i = 0; spoil && i < n; ++i) spoil(out[i]);
    return clock_.now() < silent_from ? n : 0;
  }
  [[nodiscard]] std::string failure() const override { return lost; }
  void cut() noexcept override { inner_.cut(); }
  [[nodiscard]] std::string switch_off() noexcept override { return inner_.switch_off(); }
  Instant silent_from = kNever;
  std::function<void(SupplyReading&)> spoil;
  std::string lost;  ///< why the link is dead

 private:
  void switch_on(const StopAsked&) override {}
  SupplyLink& inner_;
  const Clock& clock_;
};

/// A motor whose readings are spoilt, whose link fails, or that obeys no order to stop.
class SpoiltMotor final : public MotorLink {
 public:
  explicit SpoiltMotor(MotorLink& inner) : inner_(inner) {}
  void spin_at(RadPerSec signed_speed) override {
    if (before_speed) before_speed();
    inner_.spin_at(signed_speed);
  }
  void renew() noexcept override { inner_.renew(); }
  void emergency_stop() noexcept override {
    if (is_deaf) {
      ++ignored;
    } else {
      inner_.emergency_stop();
    }
  }
  void begin_stop(const iq::StopSettings& settings) override { inner_.begin_stop(settings); }
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override { return inner_.stop_report(); }
  [[nodiscard]] const iq::AuditRecord& parameters() const override { return inner_.parameters(); }
  [[nodiscard]] std::optional<Celsius> coil_temperature() override { return inner_.coil_temperature(); }
  [[nodiscard]] std::vector<StreamEvent> take_events() override { return inner_.take_events(); }
  [[nodiscard]] std::string failure() const override { return lost.empty() ? inner_.failure() : lost; }
  [[nodiscard]] results::MotorCounts counts() const override { return inner_.counts(); }
  [[nodiscard]] std::string identity() const override { return inner_.identity(); }
  std::size_t take(std::span<MotorReading> out) override {
    const std::size_t n = inner_.take(out);
    for (std::size_t i = 0; spoil && i < n; ++i) spoil(out[i]);
    return n;
  }
  std::function<void()> before_speed;  ///< each
  std::function<void(MotorReading&)> spoil;
  std::string lost;  ///< why the link is dead
  bool is_deaf = false;
  int ignored = 0;  ///< orders

 private:
  MotorLink& inner_;
};

class CoastingBench final : public WrappedBench {
 public:
  static constexpr double kNothing = 0.1;  ///< A in the winding; a step of a campaign takes 2 to 20
  explicit CoastingBench(const profiles::BenchConfig& config) : WrappedBench(config) {
    if (bench.supply() != nullptr) spoilt_supply = std::make_unique<SpoiltSupply>(*bench.supply(), bench.clock());
  }
  [[nodiscard]] MotorLink& motor() override { return spoilt_motor; }
  [[nodiscard]] SupplyLink* supply() override { return spoilt_supply.get(); }
  void wait_until(Instant when) override {
    while (clock().now() < when) {
      bench.wait_until(std::min(when, clock().now() + std::chrono::milliseconds(1)));
      const bool coasts = bench.simulation().motor().stage().mode == sim::PowerStage::Mode::coast ||
                          std::abs(bench.simulation().plant().motor().motor_amps) < kNothing;
      if (coasts && !coasts_) coasts_at = clock().now();
      coasts_ = coasts;
    }
  }

  /// The guard's first, then the recorder's.
  [[nodiscard]] std::shared_ptr<void> run_periodically(const ThreadRole& role, std::function<void()> work) override {
    const bool is_recorder = works_++ % 2 == 1;
    return bench.run_periodically(role, [this, is_recorder, work = std::move(work)] {
      if (!is_recorder || !recorder_hangs) work();
    });
  }

  SpoiltMotor spoilt_motor{bench.motor()};
  std::unique_ptr<SpoiltSupply> spoilt_supply;
  /// Since then the bridge is open, or (its supply cut, the bus down to what the rotor itself induces) it carries less
  /// than kNothing.
  Instant coasts_at{0};
  bool recorder_hangs = false;

 private:
  int works_ = 0;
  bool coasts_ = true;
};

}  // namespace kphi::daq
