// The deterministic bench, looked at every millisecond: when did the motor's bridge open?
#pragma once

#include <functional>
#include <memory>

#include "daq/deterministic_bench.hpp"

namespace kphi::daq {

/// A supply whose answers end.
class FallingSilent final : public SupplyLink {
 public:
  FallingSilent(SupplyLink& inner, const Clock& clock) : inner_(inner), clock_(clock) {}
  [[nodiscard]] std::string identity() const override { return inner_.identity(); }
  std::size_t take(std::span<results::SupplyReading> out) override {
    const std::size_t n = inner_.take(out);
    return clock_.now() < silent_from ? n : 0;
  }
  [[nodiscard]] std::string failure() const override { return ""; }
  void cut() noexcept override { inner_.cut(); }
  [[nodiscard]] std::string switch_off() noexcept override { return inner_.switch_off(); }
  Instant silent_from = kNever;

 private:
  void switch_on() override {}
  SupplyLink& inner_;
  const Clock& clock_;
};

class CoastingBench final : public Bench {
 public:
  explicit CoastingBench(const profiles::Bench& place) : bench(place) {
    if (bench.supply() != nullptr) silent_supply = std::make_unique<FallingSilent>(*bench.supply(), bench.clock());
  }
  [[nodiscard]] const Clock& clock() const override { return bench.clock(); }
  [[nodiscard]] MotorLink& motor() override { return bench.motor(); }
  [[nodiscard]] LoadCellLink& load_cell() override { return bench.load_cell(); }
  [[nodiscard]] SupplyLink* supply() override { return silent_supply.get(); }
  [[nodiscard]] results::FileLayer& files() override { return bench.files(); }
  [[nodiscard]] Duration sync_interval() const override { return bench.sync_interval(); }
  void mounted(const std::string& propeller, double occlusion) override { bench.mounted(propeller, occlusion); }
  [[nodiscard]] std::unique_ptr<Background> keep_calling(std::function<void()> work) override {
    return bench.keep_calling(std::move(work));
  }
  void wait_until(Instant when) override {
    while (clock().now() < when) {
      bench.wait_until(std::min(when, clock().now() + std::chrono::milliseconds(1)));
      const bool coasts = bench.simulation().motor().stage().mode == sim::PowerStage::Mode::coast;
      if (coasts && !coasts_) coasts_at = clock().now();
      coasts_ = coasts;
    }
  }

  DeterministicBench bench;
  std::unique_ptr<FallingSilent> silent_supply;
  Instant coasts_at{0};  ///< the bridge has been open since

 private:
  bool coasts_ = true;
};

}  // namespace kphi::daq
