// The deterministic bench, for tests that change a part of it.
#pragma once

#include <memory>
#include <string>

#include "daq/virtual/deterministic_bench.hpp"

namespace kphi::daq {

class WrappedBench : public Bench {
 public:
  explicit WrappedBench(const profiles::BenchConfig& config, const sim::BenchSettings& other = {})
      : bench(config, other) {}
  [[nodiscard]] const Clock& clock() const override { return bench.clock(); }
  [[nodiscard]] MotorLink& motor() override { return bench.motor(); }
  [[nodiscard]] LoadCellLink& load_cell() override { return bench.load_cell(); }
  [[nodiscard]] SupplyLink* supply() override { return bench.supply(); }
  [[nodiscard]] results::FileLayer& files() override { return bench.files(); }
  [[nodiscard]] Duration sync_interval() const override { return bench.sync_interval(); }
  [[nodiscard]] bool switch_off_power() override { return bench.switch_off_power(); }
  void restore_power(const StopAsked& stop_asked) override { bench.restore_power(stop_asked); }
  void mounted(const std::string& propeller, double occlusion) override { bench.mounted(propeller, occlusion); }
  void hung(int axis, double newtons) override { bench.hung(axis, newtons); }
  [[nodiscard]] std::shared_ptr<void> run_periodically(const ThreadRole& role, std::function<void()> work) override {
    return bench.run_periodically(role, std::move(work));
  }
  void wait_until(Instant when) override { bench.wait_until(when); }

  DeterministicBench bench;
};

}  // namespace kphi::daq
