#include "daq/campaign/dry_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/number.hpp"
#include "drivers/netbox/receive/audit.hpp"
#include "results/campaign_folder.hpp"
#include "results/disk_trial.hpp"
#include "results/reduction/bin_statistics.hpp"
#include "results/reduction/quality_flags.hpp"
#include "results/run_writer.hpp"

namespace kphi::daq {
namespace {

using nlohmann::json;
using profiles::Campaign;

constexpr double kSpeedOfSound = 343;  // m/s, at 20 °C
constexpr double kAliasHz = 2;         // a line aliased below this is constant over a step

double time_scale(const profiles::BenchConfig& config) {
  return config.simulation ? config.simulation->time_scale : 1.0;
}

RadPerSec top_speed(const Campaign& campaign) { return std::max(campaign.profile.first, campaign.profile.last); }

/// The folder itself, or its nearest existing parent.
std::filesystem::path existing(const std::filesystem::path& folder) {
  std::filesystem::path path = std::filesystem::absolute(folder);
  while (!std::filesystem::exists(path) && path.has_relative_path()) path = path.parent_path();
  return path;
}

std::string minutes(double seconds) {
  const auto whole = std::llround(seconds);
  return whole < 120 ? fmt::format("{} s", whole) : fmt::format("{} min {:02} s", whole / 60, whole % 60);
}

std::string samples_in_words(std::uint64_t samples) {
  return samples < 100'000 ? fmt::format("{}", samples)
                           : fmt::format("{:.1f} million", 1e-6 * static_cast<double>(samples));
}

/// Fills the list, one member per check.
class Checks {
 public:
  Checks(const Campaign& campaign, const profiles::BenchConfig& config) : campaign_(campaign), config_(config) {}

  void speed() {
    const RadPerSec top = top_speed(campaign_);
    try {
      profiles::require_within(campaign_, config_);
    } catch (const ConfigurationError& refused) {
      return add(Severity::fault, "speed", refused.what());
    }
    const double tip = top.value() * 0.0127 * campaign_.propeller.diameter_in;
    add(Severity::note, "speed",
        fmt::format("{:.0f} RPM at most; the campaign allows {:.0f}, the motor {:.0f} RPM; blade tips at {:.0f} m/s, "
                    "Mach {:.2f}",
                    to_rpm(top), *campaign_.limits["speed_max_rpm"], to_rpm(config_.iq.speed_max), tip,
                    tip / kSpeedOfSound));
  }

  void occlusions() {
    for (const std::string& doubt : profiles::doubts_of(campaign_)) {
      const std::size_t end = doubt.rfind("; ");
      add(Severity::warning, "occlusions", doubt.substr(0, end), doubt.substr(end + 2));
    }
  }

  void thrust() {
    const double limit = limit_of(Watched::thrust);
    const auto prior = profiles::thrust_prior(campaign_.propeller);
    if (!prior)
      return tell("thrust", fmt::format("limit {:g} N; no published thrust data for such a propeller", limit));
    const double low = thrust_at(prior->low, top_speed(campaign_)).value();
    const double high = thrust_at(prior->high, top_speed(campaign_)).value();
    const std::string words = fmt::format("about {:.1f} to {:.1f} N expected at top speed ({}), limit {:g} N", low,
                                          high, prior->source, limit);
    warn_if(high > limit, "thrust", words, low > limit ? "the limit will stop the run" : "the limit may stop the run");
  }

  void sampling() {
    std::vector<double> speeds_rpm;
    for (const RadPerSec level : campaign_.profile.levels()) speeds_rpm.push_back(to_rpm(level));
    const auto lines = netbox::aliased_lines(config_.netbox.rate_hz, speeds_rpm, campaign_.propeller.blades, kAliasHz);
    const double pass_hz = to_rpm(top_speed(campaign_)) / 60 * campaign_.propeller.blades;
    const std::string words = fmt::format("{:g} Hz, blades pass at {:.0f} Hz at most", config_.netbox.rate_hz, pass_hz);
    if (lines.empty()) return add(Severity::note, "sampling", words + "; no level aliases to a constant force");
    const netbox::AliasedLine& line = lines.front();
    add(Severity::warning, "sampling",
        fmt::format(
            "{}; at {} levels a rotor harmonic aliases to nearly constant, first at {:.0f} RPM ({:.1f} Hz appears as "
            "{:.2f} Hz)",
            words, lines.size(), line.speed_rpm, line.true_hz, line.apparent_hz),
        "choose another rate or levels, or a filter in the box");
  }

  void window() {
    const double left = shortest_dwell(campaign_.profile).value() - campaign_.minimum_discard.value();
    const std::string words = fmt::format("{:g} s of each step averaged after minimum_discard_s, zeros of {:g} s", left,
                                          campaign_.zero.value());
    warn_if(left < results::kLeastWindow - 1e-9, "averages", words,
            fmt::format("at least {:g} s needed to see the thrust settle", results::kLeastWindow));
  }

  void supply() {
    const double most = limit_of(Watched::supply_current);
    if (!config_.supply)
      return add(Severity::note, "supply",
                 fmt::format("{:g} V expected, not controlled by kphi; the motor coasts above {:g} A",
                             campaign_.supply.value(), most));
    const auto& set = *config_.supply;
    const std::string words =
        fmt::format("set to {:g} V, at most {:g} A; the campaign expects {:g} V and coasts above {:g} A",
                    set.voltage.value(), set.current_limit.value(), campaign_.supply.value(), most);
    warn_if(std::abs(set.voltage / campaign_.supply - 1) > results::kSupplyBand, "supply", words,
            "every step would be flagged; make the two voltages agree");
  }

  /// A supply that cannot sink current has nowhere to put what a decelerating rotor feeds back.
  void braking(const profiles::Plan& plan) {
    const bool slows_down = std::ranges::any_of(plan.runs, [](const profiles::PlannedRun& run) {
      return !std::ranges::is_sorted(run.steps, {}, &profiles::PlannedStep::speed);
    });
    if (!slows_down) return;
    if (const auto& slew = campaign_.profile.slew_rad_s2)
      return add(Severity::note, "braking",
                 fmt::format("the speed falls by {:.0f} RPM/s at most", to_rpm(RadPerSec(*slew))));
    if (!config_.supply) return tell("braking", "no ramp: the power supply must absorb what the rotor feeds back");
    add(Severity::warning, "braking",
        fmt::format("no ramp: the supply cannot absorb what the rotor feeds back and switches off above {:g} V",
                    config_.supply->over_voltage.value()),
        "set profile.slew_rpm_s, for example 2000");
  }

  void coil() {
    const auto& cooling = campaign_.limits.cooling;
    const double most = limit_of(Watched::coil_temperature);
    if (!cooling)
      return add(Severity::note, "coil", fmt::format("the motor coasts above {:g} °C; no pauses for cooling", most));
    const std::string words =
        fmt::format("runs start below {:g} °C, otherwise kphi waits for {:g} °C; the motor coasts above {:g} °C",
                    cooling->pause_above.value(), cooling->resume_below.value(), most);
    warn_if(cooling->pause_above.value() >= most, "coil", words,
            "set cooling.pause_above_degc below the limit, or runs start that cannot finish");
  }

  void disk(std::uint64_t needed, std::uint64_t free, const std::filesystem::path& folder) {
    const std::string words =
        fmt::format("{} needed, {} free in {}", bytes_in_words(needed), bytes_in_words(free), folder.string());
    if (needed > free)
      return add(Severity::fault, "disk", words, "free some space, or choose another folder with --out");
    add(Severity::note, "disk", words);
  }

  void files(const std::filesystem::path& folder, const std::vector<Finding>& found) {
    for (const Finding& finding : found) add(finding.severity, "files", finding.what, finding.next_move);
    if (found.empty())
      add(Severity::note, "files", fmt::format("tried in {}: create, lock, sync, rename, read-only", folder.string()));
  }

  void answers(const profiles::Answers& answers, const profiles::Plan& plan) {
    try {
      profiles::require_mountings(answers, plan);
      add(Severity::note, "answers", fmt::format("{}: one answer per mounting", answers.path));
    } catch (const ConfigurationError& refused) {
      add(Severity::fault, "answers", refused.what());
    }
  }

  /// Not judged.
  void tell(std::string subject, std::string what) {
    checks_.push_back({std::move(subject), {Severity::note, std::move(what), {}}, false});
  }
  [[nodiscard]] std::vector<PlanCheck> take() { return std::move(checks_); }

 private:
  [[nodiscard]] double limit_of(Watched watched) const { return limit_of_files(watched, campaign_, config_); }
  void warn_if(bool is_doubtful, std::string subject, std::string what, std::string next_move) {
    if (is_doubtful) return add(Severity::warning, std::move(subject), std::move(what), std::move(next_move));
    add(Severity::note, std::move(subject), std::move(what));
  }
  void add(Severity severity, std::string subject, std::string what, std::string next_move = {}) {
    checks_.push_back({std::move(subject), {severity, std::move(what), std::move(next_move)}, true});
  }
  const Campaign& campaign_;
  const profiles::BenchConfig& config_;
  std::vector<PlanCheck> checks_;
};

/// "40 steps, 100 to 19100 RPM"; every level when shuffled.
std::string steps_text(const Campaign& campaign, const profiles::PlannedRun& run) {
  const auto rpm = [](const profiles::PlannedStep& step) { return to_rpm(step.speed); };
  const std::string number = fmt::format("{} steps, ", run.steps.size());
  if (campaign.order.steps == profiles::StepOrderKind::shuffled) {
    std::string levels;
    for (const auto& step : run.steps) levels += fmt::format(" {:.0f}", rpm(step));
    return number + "RPM:" + levels;
  }
  const bool turns = campaign.order.steps == profiles::StepOrderKind::up_and_down;
  return number + fmt::format("{:.0f}{} to {:.0f} RPM", rpm(run.steps.front()),
                              turns ? fmt::format(" to {:.0f}", to_rpm(campaign.profile.last)) : "",
                              rpm(run.steps.back()));
}

std::string runs_text(const profiles::Plan& plan, const Campaign& campaign) {
  std::string text;
  for (std::size_t i = 0; i < plan.runs.size(); ++i) {
    const profiles::PlannedRun& run = plan.runs[i];
    if (run.mount)
      text += fmt::format("  mount {}\n",
                          run.occlusion_deg == 0 ? "no occlusion" : fmt::format("{:g}°", run.occlusion_deg));
    text += fmt::format("  {:4}  {}  {}\n", i + 1,
                        results::run_file_name(campaign.propeller.id, run.occlusion_deg, run.repetition),
                        steps_text(campaign, run));
  }
  return text;
}

/// The runs that are not in the list.
std::string more_text(const Campaign& campaign) {
  const int more = campaign.repetitions_extra_max;
  const std::string runs = more == 1 ? "1 run" : fmt::format("{} runs", more);
  return campaign.repetitions_most
             ? fmt::format("; in it at most {} more per occlusion, while one would move its k by over {:g} %", runs,
                           100 * campaign.profile.until->k_share)
             : fmt::format(", and at most {} more per occlusion if repetitions disagree", runs);
}

const char* mark_of(const PlanCheck& check) {
  if (check.finding.severity == Severity::fault) return "REFUSED";
  if (check.finding.severity == Severity::warning) return "WARN";
  return check.judged ? "ok" : "not checked";
}

std::string checks_text(const std::vector<PlanCheck>& checks) {
  std::string text;
  for (const PlanCheck& check : checks)
    text += fmt::format("  {:11}  {:<15}  {}\n", mark_of(check), check.subject, check.finding.words());
  return text;
}

json to_json(const profiles::PlannedRun& run, const Campaign& campaign) {
  json steps = json::array();
  for (const auto& [number, speed] : run.steps) steps.push_back({{"step", number}, {"speed_rpm", to_rpm(speed)}});
  return {{"file", results::run_file_name(campaign.propeller.id, run.occlusion_deg, run.repetition)},
          {"mount", run.mount},
          {"occlusion_deg", run.occlusion_deg},
          {"repetition", run.repetition},
          {"reference", run.is_reference()},
          {"steps", steps}};
}

}  // namespace

std::ptrdiff_t DryRun::refused() const {
  return std::ranges::count_if(checks,
                               [](const PlanCheck& check) { return check.finding.severity == Severity::fault; });
}

profiles::Plan longest_plan(Campaign campaign, const profiles::BenchConfig& config) {
  campaign.repetitions = campaign.repetitions_most.value_or(campaign.repetitions);
  return profiles::make_plan(campaign, config);
}

std::uint64_t bytes_needed(const profiles::Plan& plan, const profiles::BenchConfig& config) {
  const auto readings = static_cast<std::uint64_t>(2 * config.iq.telemetry_hz * plan.bench.value());
  return results::RunWriter::bytes_needed(plan.runs.size(), plan.samples, readings);
}

DryRun dry_run(const Campaign& campaign, const profiles::BenchConfig& config, const std::filesystem::path& out,
               const std::optional<profiles::Answers>& answers, results::FileLayer& files) {
  DryRun dry;
  dry.plan = profiles::make_plan(campaign, config);
  dry.bytes_needed = bytes_needed(longest_plan(campaign, config), config);
  const std::filesystem::path folder = existing(out);
  dry.bytes_free = files.free_bytes(folder);
  Checks checks(campaign, config);
  checks.speed();
  checks.occlusions();
  checks.thrust();
  checks.tell("load cell range",
              "read from the box: `kphi devices --bench BENCH --campaign CAMPAIGN`, or when the run starts");
  checks.sampling();
  checks.window();
  checks.supply();
  checks.braking(dry.plan);
  checks.coil();
  checks.disk(dry.bytes_needed, dry.bytes_free, folder);
  dry.files = results::try_disk(folder, files);
  // On another disk.
  if (const auto runs = folder / "runs"; std::filesystem::is_symlink(runs))
    for (Finding& finding : results::try_disk(runs, files)) dry.files.push_back(std::move(finding));
  checks.files(folder, dry.files);
  if (answers) checks.answers(*answers, dry.plan);
  dry.checks = checks.take();
  dry.limits = combine_limits(campaign, config);
  return dry;
}

std::string plan_text(const Campaign& campaign, const profiles::BenchConfig& config, const profiles::Plan& plan) {
  const auto& profile = campaign.profile;
  const profiles::Plan most = longest_plan(campaign, config);
  const auto range = [](auto from, auto to) {
    return from == to ? fmt::format("{}", to) : fmt::format("{} to {}", from, to);
  };
  std::string angles;
  for (const double angle : campaign.occlusions_deg) angles += fmt::format(" {:g}°", angle);
  return fmt::format(
      "{}: propeller {} ({}), occlusions{}, {} repetitions\n"
      "  {} runs of {}{} steps, {:.0f} to {:.0f} RPM, {} each; {} mountings\n"
      "  {}{} spinning, {} on the bench{}, {} samples, {}",
      campaign.name, campaign.propeller.id, campaign.propeller.name, angles,
      range(campaign.repetitions, campaign.repetitions_most.value_or(campaign.repetitions)),
      range(plan.runs.size(), most.runs.size()), profile.until ? "at most " : "", plan.runs.front().steps.size(),
      to_rpm(profile.first), to_rpm(profile.last),
      profile.until ? fmt::format("{:g} to {:g} s", profile.until->dwell_least.value(), profile.dwell.value())
                    : fmt::format("{:g} s", profile.dwell.value()),
      range(plan.mountings, most.mountings), profile.until ? "at most " : "", minutes(most.spinning.value()),
      minutes(most.bench.value()),
      time_scale(config) > 1 ? fmt::format(" ({:g} times as fast here)", time_scale(config)) : "",
      samples_in_words(most.samples), bytes_in_words(bytes_needed(most, config)));
}

std::string to_text(const DryRun& dry, const Campaign& campaign, const profiles::BenchConfig& config) {
  const double slew_s = ramp_time(campaign.profile, dry.plan.runs.front()).value();
  const profiles::Plan most = longest_plan(campaign, config);
  return fmt::format(
      "{}\n\norder: {}\n{}\ntime: {} spinning{}, {} on the bench with zeros and spinning down; plus mounting (waits "
      "for you){}{}\n\nchecks: {}\n{}\nthe motor coasts when the guard sees:\n  {}\n",
      plan_text(campaign, config, dry.plan), profiles::to_words(campaign.order), runs_text(dry.plan, campaign),
      (campaign.profile.until ? "at most " : "") + minutes(most.spinning.value()),
      slew_s > 0 ? fmt::format(" ({} of ramps in the first run)", minutes(slew_s)) : "", minutes(most.bench.value()),
      campaign.limits.cooling ? ", pauses for cooling (of unknown length)" : "", more_text(campaign),
      fmt::format("{} refused, {} not checked", dry.refused(),
                  std::ranges::count(dry.checks, false, &PlanCheck::judged)),
      checks_text(dry.checks), fmt::join(to_lines(dry.limits), "\n  "));
}

json to_json(const profiles::Plan& plan, const profiles::BenchConfig& config) {
  return {{"runs", plan.runs.size()},
          {"mountings", plan.mountings},
          {"mounting_angles_deg", plan.mounting_angles()},
          {"steps", plan.steps},
          {"spinning_s", plan.spinning.value()},
          {"bench_s", plan.bench.value()},
          {"time_scale", time_scale(config)},
          {"samples", plan.samples},
          {"bytes", bytes_needed(plan, config)}};
}

json to_json(const DryRun& dry, const Campaign& campaign, const profiles::BenchConfig& config) {
  json runs = json::array(), checks = json::array();
  for (const auto& run : dry.plan.runs) runs.push_back(to_json(run, campaign));
  for (const PlanCheck& check : dry.checks) {
    checks.push_back(check.finding);
    checks.back().update({{"subject", check.subject}, {"judged", check.judged}});
  }
  json all = to_json(dry.plan, config);
  all.update({{"campaign", campaign.name},
              {"propeller", campaign.propeller.id},
              {"bytes_free", dry.bytes_free},
              {"order", runs},
              {"checks", checks},
              {"guard_limits", dry.limits},
              {"ok", dry.ok()}});
  return all;
}

}  // namespace kphi::daq
