// The deterministic bench, made again for every run: a run depends on the seed, its occlusion, its repetition and the
// bench time at which it begins, but not on earlier runs. So a campaign that was killed and resumed gives the same
// bytes as an uninterrupted one. The price: every run begins with a cold motor and its own zero.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "daq/virtual/deterministic_bench.hpp"

namespace kphi::daq {

class PerRunBench final : public Bench {
 public:
  explicit PerRunBench(const profiles::BenchConfig& config);
  void begin_run(const RunBeginning& run) override;
  void mounted(const std::string& propeller_id, double occlusion_deg) override;

  /// Valid for all runs.
  [[nodiscard]] const Clock& clock() const override { return clock_; }
  [[nodiscard]] MotorLink& motor() override { return bench_->motor(); }
  [[nodiscard]] LoadCellLink& load_cell() override { return bench_->load_cell(); }
  [[nodiscard]] SupplyLink* supply() override { return bench_->supply(); }
  [[nodiscard]] std::optional<ambient::Density> air() const override { return bench_->air(); }
  [[nodiscard]] bool switch_off_power() override { return bench_->switch_off_power(); }
  void restore_power() override { bench_->restore_power(); }
  void wait_until(Instant when) override { bench_->wait_until(when); }
  [[nodiscard]] std::unique_ptr<Background> run_periodically(std::function<void()> work) override {
    return bench_->run_periodically(std::move(work));
  }
  [[nodiscard]] results::FileLayer& files() override { return *files_; }
  [[nodiscard]] Duration sync_interval() const override { return bench_->sync_interval(); }

  /// Of the present run; invalid once the next one begins.
  [[nodiscard]] sim::SimulatedBench& simulation() noexcept { return bench_->simulation(); }
  /// For this and all later runs.
  void use_files(results::FileLayer& files) noexcept;

 private:
  /// The time of the present bench.
  class PresentClock final : public Clock {
   public:
    explicit PresentClock(const std::unique_ptr<DeterministicBench>& bench) noexcept : bench_(bench) {}
    [[nodiscard]] Instant now() const noexcept override { return bench_->clock().now(); }
    [[nodiscard]] Duration stretched(Duration wall) const noexcept override { return bench_->clock().stretched(wall); }
    [[nodiscard]] Duration shrunk(Duration bench) const noexcept override { return bench_->clock().shrunk(bench); }
    [[nodiscard]] Instant at_realtime(const timespec& stamp) const noexcept override {
      return bench_->clock().at_realtime(stamp);
    }
    [[nodiscard]] std::chrono::system_clock::time_point epoch_utc() const noexcept override {
      return bench_->clock().epoch_utc();
    }
    [[nodiscard]] Duration suspended() const noexcept override { return bench_->clock().suspended(); }

   private:
    const std::unique_ptr<DeterministicBench>& bench_;
  };

  const profiles::BenchConfig config_;
  results::MemoryOnlySync own_files_;
  results::FileLayer* files_ = &own_files_;
  std::unique_ptr<DeterministicBench> bench_;  ///< of the present run
  const PresentClock clock_{bench_};
  std::optional<std::pair<std::string, double>> mounted_;
};

}  // namespace kphi::daq
