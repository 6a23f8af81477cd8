#include "daq/spin/spin.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <optional>

#include "commands/at_the_bench.hpp"
#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "daq/audit/bench_audit.hpp"
#include "daq/guard/cell_trust.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/hardware/device_locks.hpp"
#include "results/reduction/reduction.hpp"

namespace kphi::commands {
namespace {

using namespace daq;

struct SpinOptions {
  std::string bench;
  std::optional<double> rpm, percent;
  std::optional<double> for_s;
  double slew_rpm_s = 2000, step_rpm = 500, dead_man_s = 30;
  std::string campaign;
  std::string out = "results";
  bool yes = false, json = false;
  live::LiveOptions live;
};

/// Propeller and limits of a campaign, or an unknown propeller under the limits of the bench.
profiles::Campaign campaign_of(const SpinOptions& options, const profiles::BenchConfig& config) {
  profiles::Campaign campaign;
  if (!options.campaign.empty()) campaign = profiles::load_campaign(options.campaign);
  if (options.campaign.empty()) {
    campaign.propeller = {"spin", "unknown propeller", 0, 0};
    campaign.supply = config.supply ? config.supply->voltage : Volts(0);
    campaign.zero = campaign.minimum_discard = Seconds(1);
  }
  campaign.name = "spin";
  campaign.box_bias = false;
  campaign.occlusions_deg = {0};
  campaign.repetitions = 1;
  campaign.profile.slew_rad_s2 = from_rpm(options.slew_rpm_s).value();
  return campaign;
}

RadPerSec highest(const profiles::Campaign& campaign, const profiles::BenchConfig& config) {
  const double limit_rpm = limit_of_files(Watched::speed, campaign, config) / kOvershoot;
  return limit_rpm > 0 ? std::min(config.iq.speed_max, from_rpm(limit_rpm)) : config.iq.speed_max;
}

HandControl::Settings speeds_of(const SpinOptions& options, RadPerSec top, const Clock& clock) {
  HandControl::Settings speeds;
  speeds.highest = top;
  speeds.start = options.rpm ? from_rpm(*options.rpm) : 0.01 * *options.percent * top;
  speeds.step = from_rpm(options.step_rpm);
  if (options.for_s) speeds.lasts = from_seconds(*options.for_s);
  speeds.dead_man = clock.stretched(from_seconds(options.dead_man_s));
  if (speeds.start > top)
    throw ConfigurationError(fmt::format("spin: {:.0f} RPM is above the {:.0f} RPM that bench and campaign allow",
                                         to_rpm(speeds.start), to_rpm(top)));
  return speeds;
}

void require_somebody(const SpinOptions& options, const Terminal& terminal) {
  if (options.live.port || options.for_s) return;
  if (!terminal.is_in_foreground())
    throw ConfigurationError(
        "spin: nobody can press a key: kphi runs in the background, where keys go to the shell; start it without &");
  if (isatty(STDIN_FILENO)) return;
  throw ConfigurationError(
      "spin: nobody can press a key: standard input is not a terminal; give --for SECONDS, or --live for a page");
}

std::unique_ptr<Operator> person_of(const SpinOptions& options, Terminal& terminal, const StopAsked& stop_asked) {
  if (options.yes) return std::make_unique<AutoConfirmOperator>();
  if (!isatty(STDIN_FILENO))
    throw ConfigurationError(
        "spin: cannot ask whether the stand is clear: standard input is not a terminal; --yes says that it is");
  return std::make_unique<TerminalOperator>(terminal, stderr, stop_asked);
}

std::filesystem::path file_of(const SpinOptions& options, const Bench& bench) {
  std::filesystem::create_directories(options.out);
  return std::filesystem::path(options.out) / (stamp_of(bench) + "_spin.h5");
}

/// The doubts that are at this speed: once more at the end, since a log scrolls away.
void summarise(const SpinResult& result, const profiles::BenchConfig& config, bool json, Progress& printed) {
  Json all{{"file", result.run.file.string()},
           {"lost", result.run.account.lost_network + result.run.account.lost_host}};
  all["held"] = Json::array();
  std::string text;
  for (const results::StepMean& step : result.held) {
    const double watts = step.supply_voltage_v * step.supply_current_a;
    all["held"].push_back({{"speed_rpm", to_rpm(RadPerSec(step.speed_rad_s))},
                           {"thrust_n", step.thrust_n},
                           {"thrust_u_n", step.thrust_u_n},
                           {"torque_nm", step.torque_nm},
                           {"power_w", watts}});
    text += fmt::format("{:6.0f} RPM  thrust {:7.3f} ± {:.3f} N  torque {:7.2f} mN m  {:5.1f} W\n",
                        to_rpm(RadPerSec(step.speed_rad_s)), step.thrust_n, 2 * step.thrust_u_n, 1e3 * step.torque_nm,
                        watts);
  }
  std::optional<std::string> doubt;
  if (!result.held.empty())
    doubt = doubt_about_signs(result.held.back().thrust_n, result.held.back().torque_nm, config.iq.spin);
  if (doubt) all["doubt"] = *doubt;
  if (result.held.empty()) text = "no speed was held for long enough to be measured\n";
  printed.say(text.substr(0, text.size() - 1));  // which clears the live line first
  if (doubt) printed.say("warning: " + *doubt);
  put(stdout, (json ? all.dump() : result.run.file.string()) + "\n");
}

ExitCode spin(const SpinOptions& options) {
  if (options.rpm.has_value() == options.percent.has_value())
    throw ConfigurationError("spin: give either --rpm or --percent");
  const profiles::BenchConfig config = profiles::load_bench(options.bench);
  const profiles::Campaign campaign = campaign_of(options, config);
  Terminal terminal(STDIN_FILENO, stderr);
  require_somebody(options, terminal);
  const SignalWatch signals;
  const RadPerSec top = highest(campaign, config);
  live::Subject subject = live::subject_of(campaign, config);
  subject.by_hand = true;
  subject.speed_max_rpm = to_rpm(top);
  live::LiveSession view(options.live, subject);
  const StopAsked end_asked = [&view] { return SignalWatch::count() > 0 || view.stop_asked(); };
  const StopAsked stop_asked = [&] { return end_asked() || SignalWatch::is_suspension_asked(); };
  const auto person = person_of(options, terminal, end_asked);
  const auto devices = lock_devices(lock_names(config));
  const auto bench = connect_awake(config, stop_asked);
  leave_without_power(*bench, [&] {
    if (!options.campaign.empty()) bench->mounted(campaign.propeller.id, 0);
    const HandControl::Settings speeds = speeds_of(options, top, bench->clock());
    for (const BenchFinding& found : audit_bench(*bench, campaign, config))
      if (found.finding.severity != Severity::note) put(stderr, found.line() + "\n");
    announce_origin(config);
    put(stderr, live_greeting(view));
    put(stderr,
        fmt::format("keys: ↑ + faster, ↓ - slower by {:.0f} RPM, Enter or h holds, any other stops{}\n",
                    options.step_rpm,
                    speeds.lasts ? "" : fmt::format("; without a key it stops after {:g} s", options.dead_man_s)));
    PrintedProgress printed(stderr, has_terminal(), &describe_by_hand);
    const auto progress = view.beside(printed, bench->clock());
    KeysAtTheStand keys(terminal, view);
    const SpinResult result = view.tell_the_end([&] {
      return spin_by_hand(
          {*bench, campaign, config, *person, *progress, stop_asked, speeds, keys, file_of(options, *bench)});
    });
    terminal.end_keys();
    summarise(result, config, options.json, printed);
  });
  return ExitCode::ok;
}

}  // namespace

void add_spin(CLI::App& program, ExitCode& exit_code) {
  const auto [command, options] =
      add_verb<SpinOptions>(program, exit_code, "spin", "turn the motor by hand, guarded and recorded as a run",
                            "kphi spin --bench my_bench.yaml --rpm 6000", spin);
  add_value(command, "--bench", "FILE", options.bench, "bench file")->required()->check(kExistingFile);
  auto* rpm = add_value(command, "--rpm", "RPM", options.rpm, "speed to begin with")->check(CLI::Range(1.0, 1e5));
  add_value(command, "--percent", "P", options.percent, "speed to begin with, of the highest that is allowed")
      ->check(CLI::Range(0.1, 100.0))
      ->excludes(rpm);
  add_value(command, "--step", "RPM", options.step_rpm, "change of speed by a key")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e4));
  add_value(command, "--for", "SECONDS", options.for_s, "stop after SECONDS at the first speed")
      ->check(CLI::Range(0.1, 3600.0));
  add_value(command, "--campaign", "FILE", options.campaign, "propeller and limits of this campaign")
      ->check(kExistingFile);
  add_value(command, "--out", "DIR", options.out, "folder of the record")->capture_default_str();
  add_live_options(command, options.live);
  begin_group(command, "Without a person, and fine tuning");
  add_value(command, "--slew", "RPM/S", options.slew_rpm_s, "change speed no faster")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e5));
  add_value(command, "--dead-man", "SECONDS", options.dead_man_s, "without --for: stop after SECONDS without a key")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 600.0));
  command.add_flag("--yes", options.yes, "nobody is near the propeller: do not ask");
  command.add_flag("--json", options.json, "print the result as one JSON object");
}

}  // namespace kphi::commands
