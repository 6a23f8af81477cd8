#include "daq/virtual/per_run_bench.hpp"

#include <bit>

#include "base/random.hpp"

namespace kphi::daq {
namespace {

/// Neighbouring keys give unrelated streams.
std::uint64_t mixed(std::uint64_t key) noexcept { return SplitMix64(key)(); }

profiles::BenchConfig seeded(profiles::BenchConfig config, const RunBeginning& run) {
  const auto angle = std::bit_cast<std::uint64_t>(run.occlusion_deg);
  const auto repetition = static_cast<std::uint64_t>(run.repetition);
  config.simulation->seed = mixed(mixed(mixed(config.simulation->seed) ^ angle) ^ repetition);
  return config;
}

}  // namespace

PerRunBench::PerRunBench(const profiles::BenchConfig& config)
    : config_(config), bench_(std::make_unique<DeterministicBench>(config)) {
  if (config.simulation && config.simulation->durable) files_ = &results::disk();
  bench_->use_files(*files_);
}

void PerRunBench::begin_run(const RunBeginning& run) {
  sim::BenchSettings settings;
  settings.begin = run.after;
  bench_.reset();
  bench_ = std::make_unique<DeterministicBench>(seeded(config_, run), settings);
  bench_->use_files(*files_);
  if (mounted_) bench_->mounted(mounted_->first, mounted_->second);
}

void PerRunBench::mounted(const std::string& propeller_id, double occlusion_deg) {
  bench_->mounted(propeller_id, occlusion_deg);
  mounted_ = {propeller_id, occlusion_deg};
}

void PerRunBench::use_files(results::FileLayer& files) noexcept {
  files_ = &files;
  bench_->use_files(files);
}

}  // namespace kphi::daq
