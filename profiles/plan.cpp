#include "profiles/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/random.hpp"
#include "profiles/strict_yaml.hpp"

namespace kphi::profiles {
namespace {

/// "path:line:column"; the path alone if there is no text to look in.
std::string place(const std::string& path, const std::string& text, const std::string& pointer) {
  if (text.empty()) return path;
  const Mark mark = parse_strict_yaml(text, path).value_mark(pointer);
  return fmt::format("{}:{}:{}", path, mark.line, mark.column);
}

/// Of one run: the same whatever else the campaign holds.
std::uint64_t seed_of(const Order& order, double occlusion_deg, int repetition) {
  SplitMix64 draw(order.seed ^ static_cast<std::uint64_t>(std::llround(1e6 * occlusion_deg)));
  return draw() + static_cast<std::uint64_t>(static_cast<std::int64_t>(repetition));
}

PlannedRun planned(const Campaign& campaign, double occlusion_deg, int repetition) {
  PlannedRun run{occlusion_deg, repetition};
  run.steps = steps_in_order(campaign.profile.levels(), campaign.order.steps,
                             seed_of(campaign.order, occlusion_deg, repetition));
  return run;
}

/// All but the reference runs.
std::vector<PlannedRun> measuring_runs(const Campaign& campaign) {
  const Order& order = campaign.order;
  SplitMix64 draw(order.seed);
  std::vector<double> occlusions_deg = campaign.occlusions_deg;
  if (order.runs == RunOrderKind::shuffled && !order.remount_each_repetition) shuffle(occlusions_deg, draw);
  std::vector<PlannedRun> runs;
  for (const double occlusion_deg : occlusions_deg) {
    for (int repetition = 1; repetition <= campaign.repetitions; ++repetition)
      runs.push_back(planned(campaign, occlusion_deg, repetition));
  }
  if (order.runs == RunOrderKind::shuffled && order.remount_each_repetition) shuffle(runs, draw);
  return runs;
}

/// Repetitions are numbered in the order in which they are run, and what hangs there already need not be mounted.
void number_and_mount(std::vector<PlannedRun>& runs, const Campaign& campaign) {
  for (std::size_t i = 0; i < runs.size(); ++i) {
    int repetition = 1;
    for (std::size_t j = 0; j < i; ++j)
      repetition += !runs[j].is_reference() && runs[j].occlusion_deg == runs[i].occlusion_deg;
    if (!runs[i].is_reference()) runs[i] = planned(campaign, runs[i].occlusion_deg, repetition);
    runs[i].mount =
        i == 0 || campaign.order.remount_each_repetition || runs[i].occlusion_deg != runs[i - 1].occlusion_deg;
  }
}

}  // namespace

std::vector<double> Plan::mounting_angles() const {
  std::vector<double> angles_deg;
  for (const PlannedRun& run : runs)
    if (run.mount) angles_deg.push_back(run.occlusion_deg);
  return angles_deg;
}

Plan make_plan(const Campaign& campaign, const BenchConfig& bench) {
  Plan plan;
  plan.runs = measuring_runs(campaign);
  if (campaign.order.reference) {
    plan.runs.insert(plan.runs.begin(), planned(campaign, 0, -1));
    plan.runs.push_back(planned(campaign, 0, -2));
  }
  number_and_mount(plan.runs, campaign);
  Seconds ramps;
  for (const PlannedRun& run : plan.runs) {
    plan.steps += static_cast<int>(run.steps.size());
    ramps = ramps + ramp_time(campaign.profile, run);
  }
  const auto runs = static_cast<int>(plan.runs.size());
  plan.mountings = static_cast<int>(plan.mounting_angles().size());
  plan.mounts_more = campaign.repetitions_most && campaign.order.remount_each_repetition;
  plan.spinning = campaign.profile.dwell * plan.steps + ramps;
  plan.bench = plan.spinning + campaign.zero * ((campaign.box_bias ? 4.0 : 2.0) * runs) + kSpinDown * runs;
  plan.samples = static_cast<std::uint64_t>(std::llround(plan.bench.value() * bench.netbox.rate_hz));
  return plan;
}

PlannedRun extra_run(const Campaign& campaign, double occlusion_deg, int repetition) {
  PlannedRun run = planned(campaign, occlusion_deg, repetition);
  run.mount = campaign.order.remount_each_repetition;
  return run;
}

Seconds ramp_time(const StepProfile& profile, const PlannedRun& run) {
  if (!profile.slew_rad_s2) return Seconds(0);
  double change = 0, before = 0;
  for (const PlannedStep& step : run.steps) {
    change += std::abs(step.speed.value() - before);
    before = step.speed.value();
  }
  return Seconds(change / *profile.slew_rad_s2);
}

void require_within(const Campaign& campaign, const BenchConfig& bench) {
  const bool last_is_top = campaign.profile.last >= campaign.profile.first;
  const RadPerSec top = last_is_top ? campaign.profile.last : campaign.profile.first;
  const std::string key = last_is_top ? "last_rpm" : "first_rpm";
  const auto require = [&](RadPerSec most, const char* limit) {
    if (top <= most) return;
    throw ConfigurationError(
        fmt::format("{}: profile.{}: {:.6g} RPM is above {:.6g} RPM, the bench's {} ({}); lower the profile or choose "
                    "another bench",
                    place(campaign.path, campaign.text, "/profile/" + key), key, to_rpm(top), to_rpm(most),
                    dotted(limit), place(bench.path, bench.text, limit)));
  };
  require(bench.iq.speed_max, "/iq/speed_max_rpm");
  if (const auto& rpm = bench.limits["speed_max_rpm"]) require(from_rpm(*rpm), "/limits/speed_max_rpm");
}

std::vector<PlannedStep> steps_in_order(const std::vector<RadPerSec>& levels, StepOrderKind kind,
                                        std::uint64_t run_seed) {
  std::vector<PlannedStep> steps;
  for (std::size_t i = 0; i < levels.size(); ++i) steps.push_back({static_cast<int>(i), levels[i]});
  if (kind == StepOrderKind::down) std::reverse(steps.begin(), steps.end());
  if (kind == StepOrderKind::shuffled) {
    SplitMix64 draw(run_seed);
    shuffle(steps, draw);
  }
  if (kind == StepOrderKind::up_and_down) {
    for (std::size_t i = levels.size() - 1; i-- > 0;) steps.push_back({static_cast<int>(steps.size()), levels[i]});
  }
  return steps;
}

}  // namespace kphi::profiles
