// Step means of a campaign as the bench would leave them, from a known truth and a seed.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "compensation/units.hpp"
#include "fit/uncertainty/analysis.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

struct CampaignTruth {
  double K_T = 1.55e-6;          ///< N/(rad/s)²
  double intercept = 1.5965e-6;  ///< of the occluded line
  double slope_per_deg = -4.4778e-9;
  double noise_n = 0.01;
  [[nodiscard]] double k(double phi_deg) const { return phi_deg == 0 ? K_T : intercept + slope_per_deg * phi_deg; }
};

/// Step `i` of 40 from 100 to 19100 RPM of the propeller 5x3, without what was measured.
[[nodiscard]] inline results::StepMean step_at(double phi, int repetition, int i) {
  results::StepMean step;
  step.propeller = "5x3";
  step.blades = 3;
  step.diameter_in = 5;
  step.occlusion_deg = phi;
  step.repetition = repetition;
  step.step = i;
  step.commanded_speed_rad_s = from_rpm(100 + 19000.0 * i / 39).value();
  step.speed_n = 100;
  step.thrust_samples = 7000;
  return step;
}

/// 40 steps from 100 to 19100 RPM, five angles, three repetitions: the paper's campaign.
[[nodiscard]] inline std::vector<results::StepMean> campaign_steps(const CampaignTruth& truth = {}, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  std::vector<results::StepMean> steps;
  for (const double phi : {0.0, 45.0, 90.0, 180.0, 270.0}) {
    for (int repetition = 1; repetition <= 3; ++repetition) {
      for (int i = 0; i < 40; ++i) {
        results::StepMean step = step_at(phi, repetition, i);
        step.speed_rad_s = step.commanded_speed_rad_s * (1 + 2e-4 * noise(random));
        step.thrust_n = truth.k(phi) * step.speed_rad_s * step.speed_rad_s + truth.noise_n * noise(random);
        step.thrust_sd_n = 0.05;
        steps.push_back(step);
      }
    }
  }
  return steps;
}

/// Largest error of the thrust that flies, over φ up to 270° and speeds up to 19,100 RPM, against the true k(φ, RPM).
inline double true_error(const Fitted& fitted, const std::function<double(double phi_deg, double rpm)>& truth) {
  const auto& [identification, analysis] = fitted;
  const compensation::ThrustCurve curve = identification.curve();
  double worst = 0;
  for (double phi = 0; phi <= 270; phi += 2.5) {
    const double flown = curve.thrust_coefficient().value() * curve.scaling_factor(from_degrees(phi));
    for (const double rpm : {3000.0, 10000.0, 19100.0}) {
      const double speed = from_rpm(rpm).value();
      const double trend =
          analysis.trend ? 1 + analysis.trend->per_rad_s.value * (speed - analysis.trend->reference_rad_s) : 1;
      worst = std::max(worst, std::abs(truth(phi, rpm) / (flown * trend) - 1));
    }
  }
  return worst;
}

inline Fitted analysed(Identification found) {
  Analysis analysis = analyse(found);
  return {std::move(found), std::move(analysis)};
}

}  // namespace kphi::fit
