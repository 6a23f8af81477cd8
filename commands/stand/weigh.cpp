#include "daq/weigh/weigh.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <optional>

#include "base/number.hpp"
#include "commands/at_the_bench.hpp"
#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/hardware/device_locks.hpp"
#include "results/file_layer.hpp"
#include "results/version.hpp"

namespace kphi::commands {
namespace {

using namespace daq;

struct WeighOptions {
  std::string bench;
  double kg = 0;
  std::optional<double> u_kg, gravity;
  std::string axis;
  int times = 3;
  double seconds = 3;
  std::string out = "results";
  bool yes = false, json = false;
  live::LiveOptions live;
};

/// Of a weight of class M3 (OIML R 111): within 0.05 %.
constexpr double kWeightShare = 0.0005 / 1.7320508;
constexpr double kGravityU = 0.0005;  // of one that was given, m/s²

results::Weighing order_of(const WeighOptions& options, const profiles::BenchConfig& config) {
  results::Weighing weighing;
  weighing.origin = name_of(config.origin());
  weighing.bench = config.name;
  weighing.tool_version = kVersion;
  weighing.mass_kg = options.kg;
  weighing.mass_u_kg = options.u_kg.value_or(kWeightShare * options.kg);
  weighing.axis = options.axis.empty() ? config.thrust_axis : options.axis[0] - 'x';
  if (!options.gravity) return weighing;
  weighing.gravity_m_s2 = *options.gravity;
  weighing.gravity_u_m_s2 = kGravityU;
  return weighing;
}

void require_somebody(const WeighOptions& options) {
  if (options.yes || options.live.port || isatty(STDIN_FILENO)) return;
  throw ConfigurationError(
      "weigh: nobody can say that the mass is on: standard input is not a terminal; give --live for a page, or --yes "
      "where a robot or a simulated bench does it by itself");
}

std::filesystem::path keep(const results::Weighing& weighing, const WeighOptions& options, const Bench& bench) {
  std::filesystem::create_directories(options.out);
  const std::filesystem::path folder = options.out;
  std::filesystem::path file = folder / (stamp_of(bench) + results::kWeighingEnds);
  for (int i = 2; std::filesystem::exists(file); ++i)
    file = folder / fmt::format("{}-{}{}", stamp_of(bench), i, results::kWeighingEnds);
  results::write_text(file, results::format_weighing(weighing));
  return file;
}

Json json_of(const results::Weighed& number) {
  return {{"value", number.value}, {"u", number.u}, {"expanded_95", number.expanded()}};
}

Json json_of(const results::Weighing& weighing, const results::CellCheck& check, const std::string& file) {
  Json json{{"file", file},
            {"bench", weighing.bench},
            {"axis", std::string(1, "xyz"[weighing.axis])},
            {"force_n", weighing.force_n()},
            {"gain", json_of(check.gain)},
            {"hysteresis", json_of(check.hysteresis)},
            {"tilt_deg", check.tilt_rad * 180 / kPi},
            {"u_calibration", check.u_calibration()}};
  for (int i = 0; i < 6; ++i)
    if (i != weighing.axis)
      json["crosstalk"][kAxisNames[static_cast<std::size_t>(i)]] =
          json_of(check.crosstalk[static_cast<std::size_t>(i)]);
  return json;
}

std::string percent(const results::Weighed& number) {
  return fmt::format("{} %", plain_with_error(100 * number.value, 100 * number.expanded()));
}

/// The other axes from `first` on: forces as shares, torques as a lever.
std::string crosstalk_words(const results::Weighing& weighing, const results::CellCheck& check, int first) {
  std::string words;
  for (int i = first; i < first + 3; ++i) {
    if (i == weighing.axis) continue;
    const results::Weighed& share = check.crosstalk[static_cast<std::size_t>(i)];
    words += fmt::format("{}{} {}", words.empty() ? "" : ", ", kAxisNames[static_cast<std::size_t>(i)],
                         i < 3 ? percent(share) : plain_with_error(1e3 * share.value, 1e3 * share.expanded()) + " mm");
  }
  return words;
}

/// Line by line; the first is the result.
std::vector<std::string> words_of(const results::Weighing& weighing, const results::CellCheck& check,
                                  bool is_thrust_axis, bool gravity_given) {
  std::vector<std::string> lines{
      fmt::format("gain        {}: the cell {}", plain_with_error(check.gain.value, check.gain.expanded()),
                  results::gain_words(weighing, check)),
      fmt::format("cross-talk  {}", crosstalk_words(weighing, check, 0)),
      fmt::format("            {}", crosstalk_words(weighing, check, 3)),
      fmt::format("            the side forces are those of a pull {:.2f}° off {}, or of the cell",
                  check.tilt_rad * 180 / kPi, "xyz"[weighing.axis]),
      fmt::format("hysteresis  {} of the load stays after it is gone, at most", percent(check.hysteresis)),
      "± is 95 %, with the mass, gravity and hysteresis in it"};
  if (std::abs(check.gain.value - 1) > check.gain.expanded())
    lines.push_back(
        "the gain is not 1: look for what touches the cell or its cables, then at the calibration in the box");
  if (!gravity_given)
    lines.push_back("gravity was taken as 9.807 ± 0.030 m/s², anywhere on Earth; --g with that of the place narrows ±");
  lines.push_back(is_thrust_axis ? fmt::format("kphi fit takes it up for campaigns of {} in the same folder, as "
                                               "calibration={:.2g}",
                                               weighing.bench, check.u_calibration())
                                 : "it is not along the bench's thrust_axis, so kphi fit does not take it up");
  return lines;
}

ExitCode weigh(const WeighOptions& options) {
  const profiles::BenchConfig config = profiles::load_bench(options.bench);
  require_somebody(options);
  const SignalWatch signals;
  live::Subject subject = live::subject_of({}, config);
  subject.name = "weigh";
  subject.propeller = fmt::format("{:g} kg along {}", options.kg, "xyz"[order_of(options, config).axis]);
  subject.weighs = true;
  live::LiveSession view(options.live, subject);
  Terminal terminal(STDIN_FILENO, stderr);
  const StopAsked stop_asked = [&] {
    return SignalWatch::count() > 0 || SignalWatch::is_suspension_asked() || view.stop_asked();
  };
  const auto devices = lock_devices(lock_names(config));
  const auto bench = connect_awake(config, stop_asked);
  leave_without_power(*bench, [&] {
    announce_origin(config);
    put(stderr, live_greeting(view));
    PrintedProgress printed(stderr, has_terminal(), &describe_weighing);
    const auto progress = view.beside(printed, bench->clock());
    KeysAtTheStand keys(terminal, view);
    if (!options.yes) keys.begin();
    const Weigh order{*bench,
                      *progress,
                      stop_asked,
                      options.yes ? nullptr : &keys,
                      order_of(options, config),
                      options.times,
                      from_seconds(options.seconds),
                      [&] {
                        if (SignalWatch::take_suspension()) terminal.suspend();
                      }};
    std::string file, in_short;
    results::CellCheck check;
    const results::Weighing weighing = view.tell_the_end(
        [&] {
          results::Weighing done = daq::weigh(order);
          file = keep(done, options, *bench).string();
          check = check_of(done);
          const auto lines = words_of(done, check, done.axis == config.thrust_axis, options.gravity.has_value());
          for (const std::string& line : lines) progress->say(line);
          in_short = "The cell " + results::gain_words(done, check) + ".";
          return done;
        },
        in_short);
    put(stdout, (options.json ? json_of(weighing, check, file).dump() : file) + "\n");
  });
  return ExitCode::ok;
}

}  // namespace

void add_weigh(CLI::App& program, ExitCode& exit_code) {
  const auto [command, options] = add_verb<WeighOptions>(
      program, exit_code, "weigh", "check the load cell with a known mass, on and off, the motor at rest",
      "kphi weigh --bench my_bench.yaml --kg 0.5", weigh);
  add_value(command, "--bench", "FILE", options.bench, "bench file")->required()->check(kExistingFile);
  add_value(command, "--kg", "KG", options.kg, "the mass")->required()->check(CLI::Range(0.001, 1000.0));
  add_value(command, "--u-kg", "KG", options.u_kg, "its standard uncertainty (default: a weight of class M3, 0.03 %)")
      ->check(CLI::Range(0.0, 100.0));
  add_value(command, "--axis", "x|y|z", options.axis, "axis of the cell that it pulls along (default: thrust_axis)")
      ->check(CLI::IsMember({"x", "y", "z"}));
  add_value(command, "--out", "DIR", options.out, "folder of the record, beside the campaigns")->capture_default_str();
  add_live_options(command, options.live);
  begin_group(command, "Without a person, and fine tuning");
  add_value(command, "--g", "M/S2", options.gravity,
            "gravity of the place: 9.780 at the equator, 9.806 at 45°, 9.832 at a pole (default: anywhere)")
      ->check(CLI::Range(9.7, 9.9));
  add_value(command, "--times", "N", options.times, "on and off N times")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  add_value(command, "--seconds", "S", options.seconds, "of samples each time")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 60.0));
  command.add_flag("--yes", options.yes, "ask nobody: the bench is simulated, or a robot moves the mass");
  command.add_flag("--json", options.json, "print the result as one JSON object");
}

}  // namespace kphi::commands
