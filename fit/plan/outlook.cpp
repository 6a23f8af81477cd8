#include "fit/plan/outlook.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "base/error.hpp"
#include "fit/model/step_selection.hpp"
#include "profiles/plan.hpp"

namespace kphi::fit {
namespace {

using Kind = Wanted::Kind;

/// What the fit itself says of a number; nullptr if it does not know it.
const Budget* budget_of(const Wanted& wanted, const Analysis& analysis, bool alone) {
  if (wanted.kind == Kind::thrust_coefficient || (wanted.kind == Kind::k && wanted.phi_deg == 0))
    return &analysis.coefficients.front();
  if (alone) return nullptr;
  if (wanted.kind == Kind::slope) return &analysis.line.slope;
  for (const CurvePrediction& one : analysis.predictions)
    if (one.phi_deg == wanted.phi_deg) return wanted.kind == Kind::k ? &one.k : &one.scaling_factor;
  return nullptr;
}

/// A number as the fit knows it, and how many times better the prediction is for `later` than for `now`.
std::optional<Reached> reached(const Wanted& wanted, const Fitted& fitted, const std::optional<Prediction>& now,
                               const std::optional<Prediction>& later) {
  const Budget* budget = budget_of(wanted, fitted.analysis, fitted.identification.alone());
  if (budget == nullptr || !std::isfinite(share_of(*budget))) return std::nullopt;
  Reached result{wanted, share_of(*budget)};
  if (!now || !later) return result;
  const double before = share_of(now->of(wanted)), after = share_of(later->of(wanted));
  if (before > 0) result.then = result.now * after / before;
  return result;
}

/// With steps that ended by themselves as many and as long as they were.
profiles::Campaign as_held(std::span<const results::StepMean> steps, profiles::Campaign campaign) {
  if (!campaign.profile.until) return campaign;
  const RadPerSec least = from_rpm(kSpeedMinRpm);  // the fit takes none below
  double held_s = 0, held = 0, planned = 0;
  std::set<std::pair<double, int>> runs;
  for (const results::StepMean& step : steps) {
    runs.emplace(step.occlusion_deg, step.repetition);
    held_s += (step.window_end_s - step.window_begin_s + step.discarded_s) / static_cast<double>(steps.size());
    held += step.commanded_speed_rad_s >= least.value();
  }
  for (const profiles::PlannedStep& step : profiles::extra_run(campaign, 0, 1).steps) planned += step.speed >= least;
  if (held_s > 0) campaign.profile.dwell = Seconds(held_s);  // false where a step does not know it
  if (held > 0 && planned > 0) {
    const double share = std::min(1.0, held / (planned * static_cast<double>(runs.size())));
    campaign.profile.steps = std::max(2, static_cast<int>(std::lround(campaign.profile.steps * share)));
  }
  campaign.profile.until.reset();
  return campaign;
}

/// What was run of the campaign so far: these occlusions, as often as the one that was run most.
profiles::Campaign as_run(const Identification& identification, const profiles::Campaign& written) {
  profiles::Campaign campaign = as_held(identification.selection.used, written);
  campaign.occlusions_deg.clear();
  campaign.repetitions = 1;
  for (const OcclusionCoefficient& row : identification.table) {
    campaign.occlusions_deg.push_back(row.phi_deg);
    campaign.repetitions = std::max(campaign.repetitions, static_cast<int>(row.repetitions));
  }
  return campaign;
}

StandNoise noise_of_one(const Fitted& fitted, const profiles::Campaign& campaign, const BenchUncertainty& bench) {
  const PilotCampaign pilot{fitted, campaign.zero.value(), !campaign.order.remount_each_repetition};
  StandNoise noise = noise_of(std::span(&pilot, 1));
  if (!noise.mounting) noise.mounting = bench.mounting;
  return noise;
}

/// Predictions from where a campaign is.
struct Ahead {
  StandNoise noise;
  std::optional<Prediction> now, planned;

  /// nullopt while its repetitions do not tell the noise.
  static std::optional<Ahead> of(const Fitted& fitted, const profiles::Campaign& campaign,
                                 const BenchUncertainty& bench) {
    try {
      Ahead ahead{noise_of_one(fitted, campaign, bench), {}, {}};
      ahead.now.emplace(as_run(fitted.identification, campaign), ahead.noise, bench);
      ahead.planned.emplace(campaign, ahead.noise, bench);
      return ahead;
    } catch (const ConfigurationError&) {
      return std::nullopt;
    }
  }
  /// Repetitions beyond the plan until the number is as wanted.
  [[nodiscard]] int more_for(const Reached& one, profiles::Campaign campaign, const BenchUncertainty& bench) const {
    if (!one.wanted || !one.then || *one.then <= *one.wanted) return 0;
    const double planned_share = share_of(planned->of(one.of));
    for (int more = 1; more < kMostMore; ++more) {
      ++campaign.repetitions;
      const double share = share_of(Prediction(campaign, noise, bench).of(one.of));
      if (*one.then * share / planned_share <= *one.wanted) return more;
    }
    return kMostMore;
  }
};

std::vector<Wanted> wants_of(std::span<const Wish> wishes) {
  std::vector<Wanted> wants;
  for (const Wish& wish : wishes) wants.push_back(wish.of);
  if (wants.empty()) wants = {{Kind::thrust_coefficient, 0}, {Kind::slope, 0}};
  return wants;
}

}  // namespace

std::optional<OneMore> one_more_repetition(const Fitted& fitted, const profiles::Campaign& campaign,
                                           const profiles::BenchConfig& config, const BenchUncertainty& bench) {
  if (fitted.identification.alone()) return std::nullopt;
  OneMore more;
  try {
    const StandNoise noise = noise_of_one(fitted, campaign, bench);
    const profiles::Campaign now = as_run(fitted.identification, campaign);
    profiles::Campaign later = now;
    ++later.repetitions;
    const profiles::Plan plan_now = profiles::make_plan(now, config), plan_later = profiles::make_plan(later, config);
    more.minutes = (plan_later.bench.value() - plan_now.bench.value()) / 60;
    more.mountings = static_cast<int>(now.occlusions_deg.size());
    const std::optional<Prediction> before(std::in_place, now, noise, bench), after(std::in_place, later, noise, bench);
    for (const Wanted& wanted : wants_of({}))
      if (const auto one = reached(wanted, fitted, before, after)) more.numbers.push_back(*one);
  } catch (const ConfigurationError&) {
    return std::nullopt;  // too few repetitions to know the noise
  }
  return more;
}

nlohmann::ordered_json to_json(const OneMore& more) {
  nlohmann::ordered_json numbers = nlohmann::ordered_json::array();
  for (const Reached& one : more.numbers)
    numbers.push_back(
        {{"quantity", one.of.name()}, {"share_95", one.now}, {"then_share_95", one.then.value_or(one.now)}});
  return {{"bench_min", more.minutes}, {"mountings", more.mountings}, {"numbers", numbers}};
}

std::string to_words(const OneMore& more) {
  std::string words =
      fmt::format("one more   repetition of each occlusion ({:.1f} min, {} mountings):", more.minutes, more.mountings);
  for (std::size_t i = 0; i < more.numbers.size(); ++i)
    words +=
        fmt::format("{} {} ± {} -> {} %", i == 0 ? "" : ",", more.numbers[i].of.name(), in_percent(more.numbers[i].now),
                    in_percent(more.numbers[i].then.value_or(more.numbers[i].now)));
  return words;
}

Standing reached_so_far(std::span<const results::StepMean> steps, const profiles::Campaign& campaign,
                        const BenchUncertainty& bench, std::span<const Wish> wishes) {
  Standing standing;
  if (steps.empty()) return standing;
  std::set<std::pair<double, int>> runs;
  for (const results::StepMean& step : steps) runs.emplace(step.occlusion_deg, step.repetition);
  const profiles::Plan plan = profiles::make_plan(as_held(steps, campaign), {});
  const double planned = static_cast<double>(plan.runs.size());
  standing.minutes_left = plan.bench.value() / 60 * std::max(0.0, 1 - static_cast<double>(runs.size()) / planned);
  try {
    IdentificationOptions options;
    options.mounted_once = !campaign.order.remount_each_repetition;
    options.mounting = bench.mounting;
    AnalysisOptions asked;
    asked.bench = bench;
    for (const Wish& wish : wishes) asked.prediction_deg.push_back(wish.of.phi_deg);
    Identification identification = identify(steps, options);
    Analysis analysis = analyse(identification, asked);
    const Fitted fitted{std::move(identification), std::move(analysis)};
    std::optional<Ahead> ahead;
    if (!fitted.identification.alone()) ahead = Ahead::of(fitted, campaign, bench);
    for (const Wanted& wanted : wants_of(wishes)) {
      auto one = ahead ? reached(wanted, fitted, ahead->now, ahead->planned)
                       : reached(wanted, fitted, std::nullopt, std::nullopt);
      if (!one) continue;
      for (const Wish& wish : wishes)
        if (wish.of.name() == wanted.name()) one->wanted = wish.share;
      if (ahead) one->more_repetitions = ahead->more_for(*one, campaign, bench);
      standing.numbers.push_back(*one);
    }
  } catch (const ConfigurationError&) {
  } catch (const FitError&) {  // no K_T yet, or nothing but flagged steps
  }
  return standing;
}

std::string to_words(const Standing& standing) {
  std::string words, then, more;
  for (const Reached& one : standing.numbers) {
    words += fmt::format("{} {} ± {} %", words.empty() ? "so far" : ",", one.of.name(), in_percent(one.now));
    if (one.wanted) words += fmt::format(" of {} % wanted", in_percent(*one.wanted));
    if (one.then && standing.minutes_left > 0)
      then += fmt::format("{}{} %", then.empty() ? "; the plan ends at " : ", ", in_percent(*one.then));
    if (one.more_repetitions > 0)
      more += fmt::format("; {} ± {} % takes {}{} {} more than planned", one.of.name(), in_percent(*one.wanted),
                          one.more_repetitions == kMostMore ? "over " : "", one.more_repetitions,
                          one.more_repetitions == 1 ? "repetition" : "repetitions");
  }
  if (!then.empty()) then += fmt::format(" in {:.0f} min", std::max(1.0, standing.minutes_left));
  return words + then + more;
}

}  // namespace kphi::fit
