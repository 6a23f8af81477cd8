// Campaigns of step tables on stands whose runs scatter for different causes: what ± says can be held against what the
// estimates scatter.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "fit/uncertainty/analysis.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {

struct ScatteringStand {
  const char* name = "";
  double noise_n = 0.003;       ///< of a step
  double memory = 0;            ///< correlation of the noise of neighbouring steps
  double zero_noise_n = 0.001;  ///< error of each of a run's two zeros
  bool zero_noise_told = true;  ///< by the samples of the zero
  double walk_n = 0;            ///< of the zero, from begin to end of a run
  double one_jump_n = 0;        ///< of the zero, at any time of one run of the campaign
  double mounting = 0.0003;     ///< from run to run, share of k
  double thrust = 1;            ///< of the propeller, over that of CampaignTruth
};

inline const std::vector<ScatteringStand>& scattering_stands() {
  static const std::vector<ScatteringStand> kStands{
      {.name = "zero walks", .walk_n = 0.03},
      {.name = "zeros noisy", .zero_noise_n = 0.01},
      {.name = "zero jumps in one run", .one_jump_n = 0.1},
      {.name = "zero walks, much thrust", .walk_n = 0.03, .mounting = 0.002, .thrust = 20},
      {.name = "zero walks, mounting alike", .walk_n = 0.03, .mounting = 0.003},
      {.name = "mounting", .mounting = 0.003},
      {.name = "noise", .noise_n = 0.06},
      {.name = "noise with memory", .noise_n = 0.03, .memory = 0.8, .zero_noise_n = 0.01, .zero_noise_told = false}};
  return kStands;
}

inline constexpr int kStudyLevels = 16;

/// Zero before and after, and between them 16 speeds, for 3 runs of each of 5 occlusions.
inline std::vector<results::StepMean> scattering_campaign(const ScatteringStand& stand, unsigned seed) {
  const CampaignTruth truth;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const int jumps = std::uniform_int_distribution<int>(0, 14)(random);
  std::vector<results::StepMean> steps;
  int run = 0;
  for (const double phi : {0.0, 45.0, 90.0, 180.0, 270.0}) {
    for (int repetition = 1; repetition <= 3; ++repetition, ++run) {
      const double k = truth.k(phi) * stand.thrust * (1 + stand.mounting * normal(random));
      const double before = stand.zero_noise_n * normal(random), after = stand.zero_noise_n * normal(random);
      const double jump_n = run == jumps ? stand.one_jump_n : 0, jump_at = uniform(random);
      std::vector<double> walk{0};
      for (int i = 0; i <= kStudyLevels; ++i)
        walk.push_back(walk.back() + stand.walk_n / std::sqrt(kStudyLevels + 1.0) * normal(random));
      const double moved = walk.back() + jump_n + after - before;
      double noise = normal(random);
      for (int i = 0; i < kStudyLevels; ++i) {
        const double part = (i + 1.0) / (kStudyLevels + 1);
        results::StepMean step = step_at(phi, repetition, i);
        step.commanded_speed_rad_s = from_rpm(2000 + 17100.0 * i / (kStudyLevels - 1)).value();
        step.speed_rad_s = step.commanded_speed_rad_s;
        noise = stand.memory * noise + std::sqrt(1 - stand.memory * stand.memory) * normal(random);
        const double zero = walk[static_cast<std::size_t>(i) + 1] + (part > jump_at ? jump_n : 0);
        step.zero_n = before + part * moved;
        step.thrust_n = k * step.speed_rad_s * step.speed_rad_s + stand.noise_n * noise + zero - step.zero_n;
        step.zero_u_n = (stand.zero_noise_told ? 1 : 0.2) * stand.zero_noise_n * std::hypot(1 - part, part);
        step.zero_moved_n = moved;
        step.thrust_u_n = std::hypot(stand.noise_n, step.zero_u_n);
        step.thrust_freedom = 50;
        step.thrust_sd_n = 0.05;
        step.window_begin_s = 2.0 * i + 1;
        step.window_end_s = 2.0 * i + 2;
        steps.push_back(step);
      }
    }
  }
  return steps;
}

/// What a thousand campaigns say of one quantity.
struct Scatter {
  double n = 0, within = 0, sum = 0, squares = 0, u_squares = 0, expanded = 0;
  void add(const Budget& found, double truth) {
    const double error = found.value - truth;
    ++n;
    within += std::abs(error) <= found.expanded() ? 1 : 0;
    sum += error;
    squares += error * error;
    for (const BudgetRow& row : found.rows)
      if (row.source != "model T = k w^2" && row.source != "line k(phi)")
        u_squares += row.contribution() * row.contribution();
    expanded += found.expanded();
  }
  [[nodiscard]] double deviation() const { return std::sqrt((squares - sum * sum / n) / (n - 1)); }
  [[nodiscard]] double share() const { return 100 * within / n; }
  /// Root mean square of u over the deviation of the estimates: without Student's factor, and without what the model
  /// lacks, which tests find by chance.
  [[nodiscard]] double u_over_scatter() const { return std::sqrt(u_squares / n) / deviation(); }
  [[nodiscard]] double half_width_over_scatter() const { return expanded / n / (1.96 * deviation()); }
};

inline std::map<std::string, Scatter> scatter_study(const ScatteringStand& stand, unsigned campaigns) {
  const CampaignTruth truth;
  std::map<std::string, Scatter> table;
  AnalysisOptions options;
  options.bench = BenchUncertainty::none();
  options.prediction_deg = {135};
  for (unsigned seed = 1; seed <= campaigns; ++seed) {
    const Fitted fitted = [&] {
      Identification identification = identify(scattering_campaign(stand, seed));
      Analysis result = analyse(identification, options);
      return Fitted{std::move(identification), std::move(result)};
    }();
    const auto& [found, analysis] = fitted;
    Scatter& number = table["number of the verdict"];
    const double error = true_error(fitted, [&](double phi, double) {
      return std::min(truth.k(0), truth.k(phi)) * stand.thrust;  // no occlusion lifts k above K_T
    });
    ++number.n;
    number.within += error <= analysis.flight.error.share ? 1 : 0;
    number.expanded += analysis.flight.error.share;
    for (std::size_t i = 0; i < found.table.size(); ++i)
      table[analysis.coefficients[i].quantity].add(analysis.coefficients[i],
                                                   truth.k(found.table[i].phi_deg) * stand.thrust);
    table["intercept"].add(analysis.parameters[0], truth.intercept * stand.thrust);
    table["slope"].add(analysis.parameters[1], truth.slope_per_deg * stand.thrust);
    table["line at 135 deg"].add(analysis.predictions.front().k, truth.k(135) * stand.thrust);
  }
  return table;
}

}  // namespace kphi::fit
