#include "compensation/flight/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "compensation/flight/tables.hpp"

namespace kphi::flight {
namespace {

const Percentiles& merit(const Findings& findings, std::string_view key) {
  const auto found = std::find_if(kMerits.begin(), kMerits.end(), [&](const Merit& one) { return one.key == key; });
  return findings.merits[static_cast<std::size_t>(found - kMerits.begin())];
}

/// "in 12 of 400 draws", or of one set of circumstances.
std::string in_draws(std::size_t count, const Findings& findings) {
  if (findings.draws == 1) return "in the one set of circumstances flown";
  return "in " + std::to_string(count) + " of " + std::to_string(findings.draws) + " draws";
}

void doubt_losses(Judgement& judgement, const Findings& found) {
  if (static_cast<double>(found.lost_compensated) <= kLostShare * static_cast<double>(found.draws)) return;
  judgement.fitness = Fitness::loses_the_vehicle;
  judgement.doubts.push_back(
      "would lose the vehicle " + in_draws(found.lost_compensated, found) +
      ", with compensation or in X, where nothing is covered; check K_T and its unit, the mass, and "
      "which arm's angle goes to which rotor");
}

void doubt_thrust(Judgement& judgement, const Findings& found) {
  // Of every draw that hovered in X, also of one that is lost later, in O without compensation.
  const double off = found.hover_z_x.value_or(0);
  if (std::fabs(off) <= kHoverInX) return;
  judgement.doubts.push_back(words(
      "hovers %.2f m %s its reference in X, where nothing is covered: K_T of the file is too %s, or the mass of the "
      "vehicle file too %s; weigh the vehicle, and measure K_T again",
      std::fabs(off), off > 0 ? "below" : "above", off > 0 ? "large" : "small", off > 0 ? "small" : "large"));
}

void doubt_help(Judgement& judgement, const Findings& found) {
  if (2 * found.kept < found.draws || found.kept == 0) return;  // the few that were not lost say little of it
  const double plain = merit(found, "hover_z_plain_m").p50 - merit(found, "hover_z_x_m").p50;
  const double left = merit(found, "hover_z_compensated_m").p50 - merit(found, "hover_z_x_m").p50;
  if (left < -kOverCompensated * plain) {
    judgement.doubts.push_back(
        words("over-compensates: in O it hovers %.2f m above where it hovers in X, without compensation %.2f m below; "
              "k(φ) falls "
              "too steeply, check the slope and how φ is measured",
              -left, plain));
  } else if (found.hover_z_better < kBetterShare || left > 0.7 * plain) {
    judgement.doubts.push_back(
        words("does not help: in O it hovers %.2f m below where it hovers in X, without compensation %.2f m; nearer in "
              "%.0f %% of "
              "the draws; k(φ) falls too little, check the slope",
              left, plain, 100 * found.hover_z_better));
  }
  // Where all rotors lose alike nothing pushes sideways, and the ratio is one of two noises.
  const double sideways = merit(found, "hover_xy_ratio").p50;
  const double more = merit(found, "hover_xy_compensated_m").p50 - merit(found, "hover_xy_plain_m").p50;
  if (sideways > kSidewaysRatio && more > kSidewaysNoise) {
    judgement.doubts.push_back(
        words("pushes the vehicle sideways: in O it hovers %.1f times as far from its place as without compensation; "
              "check which "
              "arm's angle goes to which rotor",
              sideways));
  }
}

}  // namespace

Judgement judgement_of(const Findings& findings) {
  Judgement judgement;
  doubt_losses(judgement, findings);
  doubt_thrust(judgement, findings);
  doubt_help(judgement, findings);
  if (!judgement.doubts.empty() && judgement.fitness == Fitness::fit_to_fly) judgement.fitness = Fitness::not_better;
  return judgement;
}

namespace {

bool is_fit(const Scene& scene, const Shadow& shadow) {
  return judgement_of(findings_of({{scene, fly_all(scene, shadow)}})).fitness == Fitness::fit_to_fly;
}

/// Makes the file worse step by step while it is still called fit to fly; the last such step, 1 if there is none.
template <std::size_t N, class With>
double last_fit(const std::array<double, N>& steps, const Shadow& shadow, const With& with) {
  double last = 1;
  for (const double step : steps) {
    const std::optional<Scene> scene = with(step);
    if (!scene || !is_fit(*scene, shadow)) break;
    last = step;
  }
  return last;
}

}  // namespace

BlindZone blind_zone_of(const Scene& nominal, const Shadow& shadow) {
  constexpr std::array<double, 6> kLess{0.9, 0.8, 0.7, 0.6, 0.5, 0.3}, kMore{1.1, 1.25, 1.5, 1.75, 2, 3};
  constexpr std::array<double, 5> kSmaller{0.97, 0.95, 0.92, 0.9, 0.8}, kLarger{1.03, 1.05, 1.08, 1.1, 1.2};
  const auto with_fall = [&](double steepness) -> std::optional<Scene> {
    Scene scene = nominal;
    for (compensation::ThrustCurve& curve : scene.curves) {
      const auto changed = curve.perturbed(ThrustCoefficient(0), steepness);
      if (!changed) return std::nullopt;
      curve = *changed;
    }
    return scene;
  };
  const auto with_k_t = [&](double share) -> std::optional<Scene> {
    Scene scene = nominal;
    scene.truth.thrust_coefficient = scene.truth.thrust_coefficient / share;
    return scene;
  };
  return {last_fit(kLess, shadow, with_fall), last_fit(kMore, shadow, with_fall), last_fit(kSmaller, shadow, with_k_t),
          last_fit(kLarger, shadow, with_k_t)};
}

std::string words_of(const BlindZone& blind, bool k_t_judged) {
  std::string text = words(
      "it would say the same of a k(φ) that falls %g to %g times as much as the file's, in the one set of "
      "circumstances "
      "that every file gets\n",
      blind.least_fall, blind.most_fall);
  if (k_t_judged)
    return text + words("and of a K_T that is %.0f %% too small to %.0f %% too large\n\n", 100 * (1 - blind.least_k_t),
                        100 * (blind.most_k_t - 1));
  return text +
         "and of any K_T that such a propeller may have: the air has that of the file; --world FILE with a K_T from "
         "elsewhere judges it\n\n";
}

std::string words_of(const Judgement& judgement, const Findings& findings) {
  if (judgement.fitness == Fitness::fit_to_fly) {
    if (findings.draws == 1) {
      return "verdict: fit to fly in this world, in the one set of circumstances flown; --draws 300 flies more of "
             "them\n";
    }
    return "verdict: fit to fly in this world; the vehicle is lost " + in_draws(findings.lost_compensated, findings) +
           " with compensation or in X, " + in_draws(findings.lost_plain, findings) + " in O without\n";
  }
  std::string text = "verdict: NOT fit to fly in this world\n";
  for (const std::string& doubt : judgement.doubts) text += "- " + doubt + "\n";
  return text + "\n";
}

}  // namespace kphi::flight
