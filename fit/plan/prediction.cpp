#include "fit/plan/prediction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "fit/model/step_selection.hpp"
#include "profiles/plan.hpp"
#include "profiles/run_certainty.hpp"
#include "results/reduction/bin_statistics.hpp"
#include "results/reduction/run_scatter.hpp"
#include "results/reduction/run_zero.hpp"

namespace kphi::fit {
namespace {

constexpr double kTick = 0.01;  // s
constexpr double kEndless = std::numeric_limits<double>::infinity();

bool is_fitted(const profiles::PlannedStep& step) { return to_rpm(step.speed) >= kSpeedMinRpm; }

/// One run at φ as its noise will leave it.
struct RunToCome {
  RunSums sums;
  WithinRuns within;
};

RunToCome run_to_come(const profiles::Campaign& campaign, const StandNoise& noise, double phi_deg,
                      const profiles::PlannedRun& planned) {
  const double k = noise.k_at(phi_deg), dwell_s = campaign.profile.dwell.value(), window_s = dwell_s - noise.settle_s;
  const double zero_s = std::max(campaign.zero.value(), 1e-3);
  const double ends_s = dwell_s * static_cast<double>(planned.steps.size());
  const double measured = noise.zero_u_n(zero_s);
  RunToCome run;
  run.sums.phi_deg = phi_deg;
  double noisy = 0, parts = 0, squares = 0, steps = 0, begin_s = -dwell_s;
  results::SharedZero zero;
  for (const profiles::PlannedStep& step : planned.steps) {
    begin_s += dwell_s;
    if (!is_fitted(step)) continue;
    const double x = step.speed.value() * step.speed.value(), share = begin_s / ends_s;
    zero.add(std::sqrt(2.0) * measured * std::hypot(1 - share, share), begin_s, begin_s + dwell_s, x);
    ++steps;
    run.sums.x += x;
    run.sums.xx += x * x;
    noisy += x * x * std::pow(noise.step_n(k * x, window_s), 2);
    parts += x * x;
    squares += std::pow(x, 4);
  }
  run.sums.xt = k * run.sums.xx;
  const double runs = campaign.repetitions;
  run.within.variance = noisy / (run.sums.xx * run.sums.xx);
  // As scatter_within_runs() counts them.
  run.within.freedom = parts * parts / squares * (runs > 1 ? runs - 1 : 1) * (steps - 1) / steps;
  run.sums.zero_u_n = zero.u_n(noise.zero_walk_n * std::sqrt(ends_s / 60));
  return run;
}

/// Scatter from run to run as this campaign shows it, and what one mounting for all its runs hides.
void take_scatter(const profiles::Campaign& campaign, const StandNoise& noise, Repeatability& all) {
  const bool remounts = campaign.order.remount_each_repetition;
  const double u = remounts ? std::hypot(noise.runs, noise.mounting.value_or(kAssumedMounting)) : noise.runs;
  all.repeated = campaign.repetitions > 1;
  std::vector<std::vector<results::RunShare>> shares;
  for (const AngleScatter& angle : all.angles) {
    const double zero = angle.runs.front().zero_u_n * angle.zero_sensitivity;
    shares.emplace_back(angle.runs.size(),
                        results::RunShare{1, (angle.within.variance + zero * zero) / (angle.k * angle.k),
                                          angle.zero_sensitivity / angle.k});
  }
  const results::RunScatter scatter = results::scatter_expected(u, noise.runs_n, shares);
  all.between = {0, u, all.repeated ? std::max(1.0, scatter.share_freedom) : noise.runs_freedom};
  all.zero_beyond = {0, noise.runs_n, all.repeated ? std::max(1.0, scatter.zero_freedom) : noise.runs_freedom};
  all.mounted_once = !remounts;
  if (remounts) return;
  all.mounting = noise.mounting.value_or(kAssumedMounting);
  all.mounting_assumed = !noise.mounting;
}

const CurveOptions kLine{};

}  // namespace

std::string Wanted::name() const {
  switch (kind) {
    case Kind::thrust_coefficient:
      return "K_T";
    case Kind::slope:
      return "slope";
    case Kind::k:
      return fmt::format("k({:g})", phi_deg);
    case Kind::scaling_factor:
      return fmt::format("k_i({:g})", phi_deg);
  }
  return {};
}

Wish parse_wish(const std::string& text) {
  static const std::regex form(R"(\s*(K_T|slope|(k|k_i)\(([0-9.]+)\))\s*([0-9.eE+-]+)\s*%\s*)");
  std::smatch parts;
  const auto refuse = [&]() -> ConfigurationError {
    return ConfigurationError(fmt::format(
        "--want \"{}\": expected a number and how well it is wanted: \"K_T 0.2 %\", \"slope 1 %\", \"k(135) 0.5 %\" "
        "or \"k_i(135) 0.5 %\"; half of the 95 % interval",
        text));
  };
  if (!std::regex_match(text, parts, form)) throw refuse();
  const auto percent = parse_number(parts[4].str());
  const auto phi = parts[3].matched ? parse_number(parts[3].str()) : std::optional<double>(0);
  if (!percent || !(*percent > 0) || !phi || !(*phi >= 0 && *phi < 360)) throw refuse();
  Wish wish{{}, *percent / 100};
  wish.of.phi_deg = *phi;
  wish.of.kind = parts[1] == "K_T"     ? Wanted::Kind::thrust_coefficient
                 : parts[1] == "slope" ? Wanted::Kind::slope
                 : parts[2] == "k"     ? Wanted::Kind::k
                                       : Wanted::Kind::scaling_factor;
  return wish;
}

std::vector<Wanted> usual_wants(const profiles::Campaign& campaign) {
  const double widest = *std::ranges::max_element(campaign.occlusions_deg);
  return {{Wanted::Kind::thrust_coefficient, 0}, {Wanted::Kind::slope, 0}, {Wanted::Kind::k, widest / 2}};
}

profiles::Campaign as_expected(profiles::Campaign campaign, const StandNoise& noise) {
  auto& profile = campaign.profile;
  if (!profile.until) return campaign;
  const double least_s =
      std::clamp(noise.settle_s + results::kLeastWindow, profile.until->dwell_least.value(), profile.dwell.value());
  const std::vector<profiles::PlannedStep> steps =
      profiles::steps_in_order(profile.levels(), profiles::StepOrderKind::up, 0);
  profiles::RunCertainty certainty(*profile.until, steps);
  double held_s = 0;
  int held = 0;
  for (const profiles::PlannedStep& step : steps) {
    if (!certainty.needs(step)) {
      certainty.left_out(step);
      continue;
    }
    const double thrust_n = noise.k_at(0) * step.speed.value() * step.speed.value();
    const double enough_n = certainty.enough_n(step, thrust_n);
    const auto u_n = [&](double dwell_s) { return noise.step_n(thrust_n, dwell_s - noise.settle_s); };
    double dwell_s = least_s, longest_s = profile.dwell.value();
    while (longest_s - dwell_s > kTick && !(u_n(dwell_s) <= enough_n)) {
      const double middle_s = 0.5 * (dwell_s + longest_s);
      (u_n(middle_s) <= enough_n ? longest_s : dwell_s) = middle_s;
    }
    if (!(u_n(dwell_s) <= enough_n)) dwell_s = longest_s;
    certainty.held(step, thrust_n, u_n(dwell_s), dwell_s);
    held_s += dwell_s;
    ++held;
  }
  profile.dwell = Seconds(held_s / held);
  profile.steps = held;
  profile.until.reset();
  return campaign;
}

Prediction::Prediction(const profiles::Campaign& written, const StandNoise& noise, const BenchUncertainty& bench,
                       const CurveOptions& curve)
    : noise_(noise), phis_(written.occlusions_deg) {
  const profiles::Campaign campaign = as_expected(written, noise);
  std::ranges::sort(phis_);
  if (phis_.empty() || phis_.front() != 0)
    throw ConfigurationError("occlusions_deg has no 0: K_T is measured without an occlusion; add 0");
  if (!(noise.K_T > 0))
    throw ConfigurationError(
        "K_T of the propeller is not known; give a --pilot, or --stand k-t=, intercept=, "
        "slope-per-deg= and the noise");
  const profiles::PlannedRun run = profiles::extra_run(campaign, 0, 1);
  if (std::ranges::count_if(run.steps, is_fitted) < 2)
    throw ConfigurationError(fmt::format("the profile has fewer than two speeds from {:g} RPM on", kSpeedMinRpm));
  std::vector<SpeedDependence> speed;
  for (const double phi : phis_) {
    const RunToCome to_come = run_to_come(campaign, noise, phi, run);
    const std::vector<RunSums> runs(static_cast<std::size_t>(campaign.repetitions), to_come.sums);
    repeatability_.angles.push_back(scatter_of_angle(noise.k_at(phi), runs, to_come.within));
    speed.emplace_back();
    speed.back().inadequacy = noise.model * noise.k_at(phi);
  }
  take_scatter(campaign, noise, repeatability_);
  sources_ = error_sources(repeatability_, speed, bench);
  if (noise.campaigns > 0) {
    ErrorSource source{"campaign to campaign", Evaluation::type_a, "1", "from the campaigns before", true};
    for (const double k : sources_.k) source.effects.push_back({noise.campaigns, k});
    sources_.sources.push_back(std::move(source));
  }
  std::vector<CurvePoint> points;
  for (std::size_t i = 0; i < phis_.size(); ++i)
    points.push_back({phis_[i], noise.k_at(phis_[i]), repeatability_.independent_u(i)});
  curve_ = fit_curve(points, curve);
  line_ = fit_curve(points, kLine);
}

Budget Prediction::of(const Wanted& wanted) const {
  std::vector<double> weights(phis_.size());
  double value = 0, misfit = 0;  // how often the deviation of a point gets into it
  const auto squares = [&](double beside) {
    double sum = beside;
    for (std::size_t i = 1; i < weights.size(); ++i) sum += weights[i] * weights[i];
    return std::sqrt(sum);
  };
  using Kind = Wanted::Kind;
  if (wanted.phi_deg > phis_.back())
    throw ConfigurationError(
        fmt::format("{}: the widest occlusion of the campaign is {:g}°", wanted.name(), phis_.back()));
  if (wanted.kind == Kind::thrust_coefficient || (wanted.kind == Kind::k && wanted.phi_deg == 0)) {
    weights[0] = 1;
    value = noise_.K_T;
  } else if (wanted.kind == Kind::slope) {
    const CurveParameter& slope = *line_.find("slope_per_deg");
    weights = slope.weights;
    value = slope.value;
    misfit = squares(0);
  } else {
    weights = curve_.weights_at(wanted.phi_deg);
    value = curve_.k_at(wanted.phi_deg);
    misfit = squares(1);
    if (wanted.kind == Kind::scaling_factor) {
      const double k = value;
      value = k / noise_.K_T;
      for (double& weight : weights) weight /= noise_.K_T;
      weights.front() -= k / (noise_.K_T * noise_.K_T);
      misfit /= noise_.K_T;
    }
  }
  Budget budget = sources_.budget(wanted.name(), "", value, weights);
  if (noise_.bend > 0 && misfit > 0)
    budget.rows.push_back({.source = fmt::format("{} k(phi)", name_of(curve_.form)),
                           .u = noise_.bend * noise_.K_T,
                           .unit = kUnitOfK,
                           .sensitivity = misfit,
                           .note = "by how much the pilot's k(phi) misses it"});
  return budget;
}

double Prediction::bend_seen() const {
  // What is left of a parabola that adds 1 at half of the range once the line has taken its share of it.
  const double widest = phis_.back();
  std::vector<CurvePoint> bent;
  for (std::size_t i = 0; i < phis_.size(); ++i) {
    const double u = phis_[i] / widest;
    bent.push_back({phis_[i], i == 0 ? noise_.K_T : noise_.K_T * 4 * u * (1 - u), repeatability_.independent_u(i)});
  }
  if (bent.size() < 4) return kEndless;
  const CurveFit left = fit_curve(bent, kLine);
  double squares = 0;
  for (std::size_t i = 0; i < left.residuals.size(); ++i) {
    const double u = std::max(bent[i + 1].standard_error, 1e-6 * noise_.K_T);
    squares += std::pow(left.residuals[i] / u, 2);
  }
  // Student's test at 5 %, passed by 19 of 20; a fit states zeros somewhat less certain than they are, so its test is
  // less sensitive than this noise allows.
  constexpr double kCautious = 1.3;
  const double freedom = repeatability_.freedom();
  const double factor = kCautious * (coverage_factor(freedom, 0.95) + coverage_factor(freedom, 0.90));
  return squares > 0 ? factor / std::sqrt(squares) : kEndless;
}

double share_of(const Budget& budget) { return budget.expanded() / std::abs(budget.value); }

std::string in_percent(double share) {
  const double value = 100 * share;
  return fmt::format("{:.{}f}", value, value < 0.1 ? 3 : value < 10 ? 2 : 1);
}

const BudgetRow* largest_row(const Budget& budget) {
  const auto largest = std::ranges::max_element(budget.rows, {}, &BudgetRow::contribution);
  return largest == budget.rows.end() || !(largest->contribution() > 0) ? nullptr : &*largest;
}

}  // namespace kphi::fit
