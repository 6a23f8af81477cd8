// A simulated campaign at the level of step means, with everything that goes wrong on a bench: what its estimators say
// can be held against the truth.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "fit/uncertainty/analysis.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {

struct StudyTruth {
  CampaignTruth line{};         ///< at standard density
  double bend = 0;              ///< of k(φ): a parabola that adds bend · K_T at half the range
  double rise = 0;              ///< of k from the lowest to the highest speed, as a share
  double between_runs = 0.003;  ///< mounting, bearing: deviation as a share of k
  double clock = 2e-4, calibration = 2e-3, density = 3e-3;  ///< standard deviations, relative

  [[nodiscard]] double k(double phi_deg) const {
    const double u = phi_deg / 270;
    return line.k(phi_deg) + (phi_deg > 0 ? bend * line.K_T * 4 * u * (1 - u) : 0);
  }
};

struct StudyCampaign {
  std::vector<results::StepMean> steps;
  double density = 0;           ///< true, kg/m³
  double measured_density = 0;  ///< as the bench's instrument said
};

inline StudyCampaign study_campaign(const StudyTruth& truth, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  StudyCampaign campaign;
  campaign.density = 1.10 + 0.15 * uniform(random);
  campaign.measured_density = campaign.density * (1 + truth.density * normal(random));
  const double clock = 1 + truth.clock * normal(random), calibration = 1 + truth.calibration * normal(random);
  const double lag_s = 0.04 + 0.11 * uniform(random);
  double time = 0;
  for (const double phi : {0.0, 45.0, 90.0, 180.0, 270.0}) {
    for (int repetition = 1; repetition <= 3; ++repetition) {
      const double run_k =
          truth.k(phi) * campaign.density / kStandardDensity * (1 + truth.between_runs * normal(random));
      // The zero jumps once, anywhere: a line between the two zeros of the run misses it by up to half of the jump.
      const double moved = 0.02 * normal(random), jump = uniform(random);
      double slow = 0, before = 0;
      for (int i = 0; i < 40; ++i) {
        const double part = (i + 0.5) / 40;
        results::StepMean step = step_at(phi, repetition, i);
        const double speed = step.commanded_speed_rad_s * (1 + 2e-4 * normal(random));
        step.speed_rad_s = speed / clock;
        const double share = speed / from_rpm(19100).value();
        const double held = run_k * (1 + truth.rise * (share - 0.5)) * speed * speed;
        // Means over 1 s from 1 s after the command: what the lag has left by then.
        const double late = (before - held) * lag_s * std::exp(-1 / lag_s);
        slow = 0.3 * slow + std::sqrt(1 - 0.09) * normal(random);  // neighbouring steps are alike
        const double zero_error = moved * ((part > jump ? 1.0 : 0.0) - part);
        const double noise = std::hypot(0.008, 0.0015 * held) * slow;
        step.thrust_n = calibration * (held + late + noise) + zero_error;
        step.zero_n = 0.3 + moved * part;
        step.thrust_sd_n = std::hypot(0.05, 0.02 * held);
        step.torque_nm = -0.013 * held;
        step.torque_sd_nm = 1e-3;
        step.air_density_kg_m3 = campaign.measured_density;
        step.window_begin_s = time += 2;
        step.window_end_s = time + 1;
        before = held;
        campaign.steps.push_back(step);
      }
    }
  }
  return campaign;
}

inline AnalysisOptions study_options(const StudyTruth& truth) {
  AnalysisOptions options;
  options.bench.cell_calibration = truth.calibration;
  options.bench.motor_clock = truth.clock;
  options.bench.air_density = truth.density;
  options.bench.cross_axis = options.bench.alignment_rad = 0;  // of this stand they are known to be none
  options.prediction_deg = {135};
  return options;
}

/// How often intervals cover the truth, and how far the estimates are off on average.
struct Coverage {
  int draws = 0, within = 0;
  double error_sum = 0, u_sum = 0;
  void add(const Budget& found, double truth) {
    ++draws;
    within += std::abs(found.value - truth) <= found.expanded() ? 1 : 0;
    error_sum += found.value - truth;
    u_sum += found.combined();
  }
  [[nodiscard]] double share() const { return 100.0 * within / draws; }
  [[nodiscard]] double bias() const { return error_sum / u_sum; }  ///< in standard uncertainties
};

inline std::map<std::string, Coverage> coverage_study(const StudyTruth& truth, unsigned campaigns,
                                                      Estimator estimator = Estimator::through_origin) {
  std::map<std::string, Coverage> table;
  for (unsigned seed = 1; seed <= campaigns; ++seed) {
    const StudyCampaign campaign = study_campaign(truth, seed);
    const Identification found = identify(campaign.steps, {.estimator = estimator});
    const Analysis analysis = analyse(found, study_options(truth));
    const double air = campaign.density / kStandardDensity;
    for (std::size_t i = 0; i < found.table.size(); ++i) {
      const double k = truth.k(found.table[i].phi_deg);
      table[analysis.coefficients[i].quantity].add(analysis.coefficients[i], k * air);
      table[analysis.standard[i].quantity].add(analysis.standard[i], k);
    }
    table["intercept"].add(analysis.parameters[0], truth.line.intercept * air);
    table["slope"].add(analysis.parameters[1], truth.line.slope_per_deg * air);
    table["line at 135 deg"].add(analysis.predictions.front().k, truth.k(135) * air);
    table["k_i(135 deg)"].add(analysis.predictions.front().scaling_factor, truth.k(135) / truth.k(0));
  }
  return table;
}

/// How many campaigns of a truth, and of how many occlusions in them, are called bent.
struct BentCount {
  int line = 0;  ///< campaigns whose line bends, by both tests
  int line_lack_of_fit = 0;
  int everywhere = 0;              ///< campaigns in which k depends on speed at every φ
  int lack_of_fit = 0, trend = 0;  ///< occlusions, T = k ω² rejected
  std::map<double, int> speed;     ///< campaigns in which k depends on speed, by φ
};

inline BentCount count_bent(const StudyTruth& truth, unsigned campaigns) {
  BentCount count;
  for (unsigned seed = 1; seed <= campaigns; ++seed) {
    const StudyCampaign campaign = study_campaign(truth, seed);
    const Analysis analysis = analyse(identify(campaign.steps), study_options(truth));
    count.line += analysis.curvature.bends() ? 1 : 0;
    count.line_lack_of_fit += analysis.curvature.lack_of_fit.rejected() ? 1 : 0;
    count.everywhere += std::all_of(analysis.speed.begin(), analysis.speed.end(),
                                    [](const SpeedDependence& one) { return one.depends(); })
                            ? 1
                            : 0;
    for (const SpeedDependence& one : analysis.speed) {
      count.lack_of_fit += one.lack_of_fit.rejected() ? 1 : 0;
      count.trend += one.trend.rejected() ? 1 : 0;
      count.speed[one.phi_deg] += one.depends() ? 1 : 0;
    }
  }
  return count;
}

/// k falls along the line from K_T on, without a plateau before the first occlusion.
inline StudyTruth without_kink() { return {.line = {.K_T = CampaignTruth().intercept}}; }

/// Real propellers of 5 inch rise by 11 to 21 %.
inline StudyTruth bent_truth() { return {.bend = 0.03, .rise = 0.15}; }

}  // namespace kphi::fit
