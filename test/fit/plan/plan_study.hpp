// A stand in time, bin by bin, and campaigns on it reduced as the bench reduces them: what a plan promises can be held
// against what such campaigns scatter.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "base/random.hpp"
#include "fit/plan/prediction.hpp"
#include "profiles/plan.hpp"
#include "results/reduction/bin_statistics.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {

struct SimulatedStand {
  const char* name = "";
  double noise_n = 0.0005;  ///< deviation of the mean over 1 s of noise without memory
  double memory_s = 0;      ///< correlation time of all noise; 0: none
  double zero_walk_n = 0;   ///< deviation after a minute
  double runs = 0.0003;     ///< from run to run, share
  double mounting = 0;      ///< from mounting to mounting, share
  double bend = 0;          ///< of k(φ) at half of the range, share of K_T
  double rise = 0;          ///< of k from the lowest to the highest speed, share
  double settle_s = 1;      ///< until the thrust stands
  double thrust = 1;        ///< of the propeller, over that of CampaignTruth
};

inline const std::vector<SimulatedStand>& stands() {
  static const std::vector<SimulatedStand> kStands{
      {.name = "quiet"},
      {.name = "mounting scatters by 0.3 %", .mounting = 0.003},
      {.name = "noise remembers 1 s, zero wanders", .noise_n = 0.003, .memory_s = 1, .zero_walk_n = 0.006}};
  return kStands;
}

class StandInTime {
 public:
  static constexpr double kBin = 0.05;  ///< s
  StandInTime(const SimulatedStand& stand, Random& random) : stand_(stand), random_(random) {}

  /// The next `n` bins: noise and zero, N.
  std::vector<double> next(int n) {
    std::vector<double> bins;
    const double keep = stand_.memory_s > 0 ? std::exp(-kBin / stand_.memory_s) : 0;
    for (int i = 0; i < n; ++i) {
      zero_ += stand_.zero_walk_n * std::sqrt(kBin / 60) * random_.normal();
      noise_ = keep * noise_ + std::sqrt(1 - keep * keep) * random_.normal();
      const double deviation = stand_.memory_s > 0 ? stand_.noise_n : stand_.noise_n / std::sqrt(kBin);
      bins.push_back(zero_ + deviation * noise_);
    }
    return bins;
  }

 private:
  const SimulatedStand& stand_;
  Random& random_;
  double zero_ = 0, noise_ = 0;
};

inline constexpr double kSpinDown = 3;  ///< s, from the last step to the zero behind it

inline std::size_t bins_in(double seconds) {
  return static_cast<std::size_t>(std::lround(seconds / StandInTime::kBin));
}

/// k(φ) at one share of the highest speed.
inline double true_k(const SimulatedStand& stand, double phi_deg, double share = 0.5) {
  const CampaignTruth line;
  const double u = phi_deg / 270;
  return (line.k(phi_deg) + (phi_deg > 0 ? stand.bend * line.K_T * 4 * u * (1 - u) : 0)) * stand.thrust *
         (1 + stand.rise * (share - 0.5));
}

/// A step as it was held: thrust and zero bin by bin, N, and how much of its begin is not averaged.
struct HeldStep {
  std::vector<double> bins_n;
  double discard_s = 0;
};
/// Holds a step of this thrust, the zero before the run being `zero_n`; nullopt: the run leaves it out.
using Hold = std::function<std::optional<HeldStep>(const profiles::PlannedStep& step, double thrust_n, double zero_n,
                                                   StandInTime& time)>;
/// How the steps of a run are held.
using HoldOfRun = std::function<Hold(const profiles::PlannedRun&)>;

/// To the end of the campaign's dwell.
inline Hold to_its_end(const profiles::Campaign& campaign, const SimulatedStand& stand) {
  return [&](const profiles::PlannedStep&, double thrust_n, double, StandInTime& time) {
    HeldStep held{time.next(static_cast<int>(bins_in(campaign.profile.dwell.value()))), stand.settle_s};
    for (double& bin : held.bins_n) bin += thrust_n;
    return held;
  };
}

/// One run: zero, steps, zero. Returns its length in seconds, without spinning down.
inline double simulate_run(const profiles::Campaign& campaign, const profiles::PlannedRun& planned,
                           const SimulatedStand& stand, double share, const Hold& hold, Random& random,
                           std::vector<results::StepMean>& steps) {
  StandInTime time(stand, random);
  const std::size_t zero_bins = bins_in(campaign.zero.value());
  const results::MeanError before = results::mean_error(time.next(static_cast<int>(zero_bins)));
  const std::size_t first = steps.size();
  const double top = from_rpm(19100).value();
  double now = campaign.zero.value();
  for (const profiles::PlannedStep& step : planned.steps) {
    const double speed = step.speed.value(),
                 thrust = share * true_k(stand, planned.occlusion_deg, speed / top) * speed * speed;
    const auto held = hold(step, thrust, before.mean, time);
    if (!held) continue;
    const std::vector<double> bins(held->bins_n.begin() + static_cast<std::ptrdiff_t>(bins_in(held->discard_s)),
                                   held->bins_n.end());
    const results::MeanError mean = results::mean_error(results::without_trend(bins), 2);
    results::StepMean one = step_at(planned.occlusion_deg, planned.repetition, step.number);
    one.commanded_speed_rad_s = one.speed_rad_s = speed;
    one.thrust_n = std::accumulate(bins.begin(), bins.end(), 0.0) / static_cast<double>(bins.size());
    one.thrust_samples = bins.size() * 350;
    one.thrust_u_n = mean.u;
    one.thrust_n_eff = static_cast<double>(one.thrust_samples) / mean.correlation;
    one.thrust_freedom = mean.freedom;
    one.discarded_s = held->discard_s;
    one.window_begin_s = now + held->discard_s;
    now += static_cast<double>(held->bins_n.size()) * StandInTime::kBin;
    one.window_end_s = now;
    one.thrust_sd_n = 0.05;
    steps.push_back(one);
  }
  (void)time.next(static_cast<int>(bins_in(kSpinDown)));
  const results::MeanError after = results::mean_error(time.next(static_cast<int>(zero_bins)));
  const double moved = after.mean - before.mean;
  for (std::size_t i = first; i < steps.size(); ++i) {
    const double part = (0.5 * (steps[i].window_begin_s + steps[i].window_end_s) - 0.5 * campaign.zero.value()) / now;
    const double zero = before.mean + part * moved;
    steps[i].thrust_n -= zero;
    steps[i].zero_n = zero;
    steps[i].zero_moved_n = moved;
    steps[i].zero_u_n = std::hypot((1 - part) * before.u, part * after.u);
    steps[i].thrust_u_n = std::hypot(steps[i].thrust_u_n, steps[i].zero_u_n);
  }
  return now + campaign.zero.value();
}

/// Asked after each run of an occlusion that has its planned ones: whether to run its occlusion again.
using AskAgain = std::function<bool(const std::vector<results::StepMean>& steps, double occlusion_deg)>;

/// `bench_s`: how long the motor was on and zeros were taken.
inline std::vector<results::StepMean> simulate(const profiles::Campaign& campaign, const SimulatedStand& stand,
                                               std::uint64_t seed, const HoldOfRun& hold, double* bench_s = nullptr,
                                               const AskAgain& again = {}) {
  Random random(seed);
  std::vector<results::StepMean> steps;
  double mounted = 1, lasted = 0;
  std::map<double, int> made;
  const auto make = [&](const profiles::PlannedRun& run) {
    if (run.mount) mounted = 1 + stand.mounting * random.normal();
    const double share = mounted * (1 + stand.runs * random.normal());
    lasted += simulate_run(campaign, run, stand, share, hold(run), random, steps);
    ++made[run.occlusion_deg];
  };
  for (const profiles::PlannedRun& run : profiles::make_plan(campaign, profiles::BenchConfig{}).runs) {
    make(run);
    const double phi = run.occlusion_deg;
    while (again && made[phi] >= campaign.repetitions && again(steps, phi))
      make(profiles::extra_run(campaign, phi, made[phi] + 1));
  }
  if (bench_s != nullptr) *bench_s += lasted;
  return steps;
}

inline std::vector<results::StepMean> simulate(const profiles::Campaign& campaign, const SimulatedStand& stand,
                                               std::uint64_t seed) {
  return simulate(campaign, stand, seed, [&](const auto&) { return to_its_end(campaign, stand); });
}

/// The paper's campaign, changed.
inline profiles::Campaign planned_campaign(std::vector<double> occlusions_deg = {0, 45, 90, 180, 270},
                                           int repetitions = 3, bool remounts = false, int steps = 40,
                                           double dwell_s = 2, double zero_s = 2) {
  profiles::Campaign campaign;
  campaign.name = "planned";
  campaign.propeller = {"5x3", "5-inch three-blade", 5, 3};
  campaign.occlusions_deg = std::move(occlusions_deg);
  campaign.repetitions = repetitions;
  campaign.order.remount_each_repetition = remounts;
  campaign.profile = {steps, Seconds(dwell_s), from_rpm(100), from_rpm(19100)};
  campaign.zero = Seconds(zero_s);
  campaign.minimum_discard = Seconds(1);
  return campaign;
}

inline std::vector<profiles::Campaign> designs() {
  return {planned_campaign(), planned_campaign({0, 45, 90, 270}, 2, false, 10, 1.6, 1),
          planned_campaign({0, 45, 90, 180, 270}, 3, true, 20, 2, 2),
          planned_campaign({0, 45, 180, 270}, 5, true, 14, 1.8, 1),
          planned_campaign({0, 45, 90, 180, 270}, 2, false, 28, 3, 4)};
}

/// What `n` pilots of the paper's kind say of a stand, remounted where mountings scatter.
inline StandNoise piloted(const SimulatedStand& stand, int n, std::uint64_t seed) {
  const profiles::Campaign campaign = planned_campaign({0, 45, 90, 180, 270}, 3, stand.mounting > 0);
  std::vector<Fitted> fitted;
  for (int i = 0; i < n; ++i) {
    IdentificationOptions options;
    options.mounted_once = stand.mounting == 0;
    if (options.mounted_once) options.mounting = stand.mounting;
    fitted.push_back(analysed(identify(simulate(campaign, stand, seed + static_cast<std::uint64_t>(i)), options)));
  }
  std::vector<PilotCampaign> pilots;
  for (const Fitted& one : fitted) pilots.push_back({one, campaign.zero.value(), stand.mounting == 0});
  return noise_of(pilots);
}

/// Standard deviation, over `n` campaigns, of what they find, and the mean of the u that they state; of each of `told`.
struct Found {
  std::string name;
  double scatter = 0, stated = 0, covered = 0;
};

inline double value_of(const Wanted& wanted, const Fitted& fitted, double* u = nullptr, double* expanded = nullptr) {
  const Budget* budget = nullptr;
  if (wanted.kind == Wanted::Kind::thrust_coefficient) budget = &fitted.analysis.coefficients.front();
  if (wanted.kind == Wanted::Kind::slope) budget = &fitted.analysis.line.slope;
  if (wanted.kind == Wanted::Kind::k) budget = &fitted.analysis.predictions.front().k;
  if (wanted.kind == Wanted::Kind::scaling_factor) budget = &fitted.analysis.predictions.front().scaling_factor;
  if (u != nullptr) *u = budget->combined();
  if (expanded != nullptr) *expanded = budget->expanded();
  return budget->value;
}

inline std::vector<Found> found_by(const profiles::Campaign& campaign, const SimulatedStand& stand, int n,
                                   const std::vector<Wanted>& told, std::uint64_t seed, const HoldOfRun& hold = {},
                                   double* bench_s = nullptr) {
  std::vector<std::vector<double>> values(told.size());
  std::vector<Found> found(told.size());
  for (int i = 0; i < n; ++i) {
    AnalysisOptions options;
    options.bench = BenchUncertainty::none();
    options.prediction_deg = {135};
    IdentificationOptions known;
    known.mounted_once = !campaign.order.remount_each_repetition;
    if (known.mounted_once) known.mounting = stand.mounting;
    Identification identification =
        identify(simulate(
                     campaign, stand, seed + static_cast<std::uint64_t>(i),
                     hold ? hold : [&](const auto&) { return to_its_end(campaign, stand); }, bench_s),
                 known);
    Analysis analysis = analyse(identification, options);
    const Fitted fitted{std::move(identification), std::move(analysis)};
    for (std::size_t j = 0; j < told.size(); ++j) {
      double u = 0;
      values[j].push_back(value_of(told[j], fitted, &u));
      found[j].stated += u / n;
    }
  }
  for (std::size_t j = 0; j < told.size(); ++j) {
    double mean = 0, squares = 0;
    for (const double value : values[j]) mean += value / n;
    for (const double value : values[j]) squares += (value - mean) * (value - mean);
    found[j].name = told[j].name();
    found[j].scatter = std::sqrt(squares / (n - 1));
  }
  return found;
}

}  // namespace kphi::fit
