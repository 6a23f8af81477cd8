#include "test/soak/soak_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <filesystem>
#include <map>

#include "daq/zero_limits.hpp"
#include "drivers/netbox/session.hpp"
#include "profiles/plan.hpp"
#include "results/campaign_verification.hpp"
#include "results/journal.hpp"
#include "results/run_reader.hpp"
#include "results/sha256.hpp"
#include "results/steps_csv.hpp"
#include "test/soak/fault_reach.hpp"

namespace kphi::soak {
namespace {

using namespace std::chrono_literals;
using results::Doubt;
using Lines = std::vector<std::string>;

constexpr double kTrueDensity = 1.225;  // kg/m³, of the simulated bench
constexpr Duration kHeard = 50ms;
constexpr Duration kOwnTimeout = 600ms;
constexpr Duration kOldest = 250ms;
constexpr double kSafeToTouch = 5.0;   // rad/s
constexpr Duration kMisplaced = 20ms;  ///< by the clock map and the delays of a wire
/// What short steps may say of themselves though nothing is wrong: three of them need not tell the lag, and a test of
/// significance errs at times.
constexpr auto kNeedNotTell = static_cast<std::uint32_t>(Doubt::lag_unknown);
constexpr auto kByChance = static_cast<std::uint32_t>(Doubt::unsettled) | static_cast<std::uint32_t>(Doubt::drifted);

std::string name_of(const std::filesystem::path& path) { return path.filename().string(); }

// Account.

const Story::Stream* stream_of(const Story& story, const results::RunRecording& run) {
  if (run.phases.empty()) return nullptr;
  const Story::Stream* found = nullptr;
  for (const Story::Stream& stream : story.streams) {
    if (stream.began.count() <= run.phases.front().time_ns) found = &stream;
  }
  return found;
}

bool same(const results::LoadCellRecord& record, const netbox::test::Ideal::Delivered& true_one) {
  return record.rdt_sequence == true_one.rdt && record.ft_sequence == true_one.ft &&
         record.arrival_ns == true_one.arrival.count();
}

void check_records(const FileOfRun& file, const netbox::test::Ideal& truth, Lines& wrong) {
  const auto& records = file.run.load_cell;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (i < truth.delivered.size() && same(records[i], truth.delivered[i])) continue;
    wrong.push_back(fmt::format("account: {}: record {} of {} (rdt {}, ft {}, arrived {} ns) is not the one in truth",
                                file.name(), i, records.size(), records[i].rdt_sequence, records[i].ft_sequence,
                                records[i].arrival_ns));
    return;
  }
}

void check_numbers(const FileOfRun& file, const Story::Stream& stream, const netbox::test::Ideal& truth, Lines& wrong) {
  const results::SampleAccount& account = file.run.account;
  const auto compare = [&](const char* what, std::uint64_t counted, std::uint64_t is) {
    if (counted != is)
      wrong.push_back(fmt::format("account: {}: {}: counted {}, in truth {}", file.name(), what, counted, is));
  };
  compare("received", account.received, truth.received);
  compare("records in the file", file.run.load_cell.size(), truth.received);
  compare("lost in the network", account.lost_network, truth.lost);
  compare("lost in the host", account.lost_host, 0);
  compare("sum", account.received + account.lost_network + account.lost_host, account.expected);
  if (stream.strays == 0) {
    compare("duplicates", account.duplicates, truth.duplicates);
    compare("late", account.late, truth.late);
  }
  compare("discarded", account.duplicates + account.late, truth.duplicates + truth.late + stream.strays);
  compare("stalled", account.stalled, truth.stalled);
  compare("restarts", account.restarts, truth.restarts);
  compare("reboots", account.reboots, truth.reboots);
  compare("irregular", account.irregular, truth.irregular);
  if (account.malformed > stream.malformed.size()) compare("malformed", account.malformed, stream.malformed.size());
}

void check_account(const Evidence& evidence, Lines& wrong) {
  if (evidence.wire == nullptr) return;
  for (const FileOfRun& file : evidence.files) {
    const Story::Stream* stream = file.inherited ? nullptr : stream_of(evidence.story, file.run);
    if (stream == nullptr) continue;
    const auto truth = netbox::test::ideal_of(*evidence.wire, stream->arrivals, file.run.header.load_cell.ft_stride,
                                              netbox::StreamSettings{}.reorder_patience);
    check_records(file, truth, wrong);
    if (file.path.extension() != ".part") check_numbers(file, *stream, truth, wrong);
  }
}

// Motion.

/// When the power stage was open for good.
Instant coasting_since(const Story& story) {
  if (story.stages.empty()) return Instant{0};
  if (story.stages.back().mode != sim::PowerStage::Mode::coast) return kNever;
  return story.stages.size() == 1 ? Instant{0} : story.stages.back().at;
}

void check_end_of_motion(const Evidence& evidence, const Reaches& reaches, Lines& wrong) {
  const Story& story = evidence.story;
  const Instant since = coasting_since(story);
  if (since == kNever) return wrong.push_back("motion: the motor never coasts");
  if (story.end == End::finished) {
    if (since > story.ended) wrong.push_back("motion: the campaign has ended and the motor does not coast");
    return;
  }
  const Instant decided = evidence.killed() ? story.ended : story.last_good_tick + 10ms;
  const bool alone = evidence.killed() || reaches.line_silenced(decided - kOwnTimeout, decided + kOwnTimeout);
  const Duration limit = alone ? kOwnTimeout : kHeard;
  if (since > decided + limit)
    wrong.push_back(
        fmt::format("motion: coasts {:.0f} ms after {}, {:.0f} ms are allowed", 1e3 * to_seconds(since - decided),
                    evidence.killed() ? "the kill" : "the last look that found all well", 1e3 * to_seconds(limit)));
}

/// Somebody is about to reach into the propeller.
void check_prompts(const Story& story, Lines& wrong) {
  for (const Story::Prompt& prompt : story.prompts) {
    if (prompt.mode != sim::PowerStage::Mode::coast) wrong.push_back("motion: at a prompt the motor does not coast");
    if (prompt.speed_rad_s > kSafeToTouch) wrong.push_back("motion: at a prompt the propeller turns");
  }
}

/// A module that no order reaches drives until its own timeout.
void check_freshness(const Story& story, const Reaches& reaches, Lines& wrong) {
  std::vector<Instant> arrivals;
  for (const auto& stream : story.streams)
    for (const auto& arrival : stream.arrivals) arrivals.push_back(arrival.at);
  std::sort(arrivals.begin(), arrivals.end());
  const auto& stages = story.stages;
  const Instant end = story.ended;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    if (stages[i].mode != sim::PowerStage::Mode::drive || stages[i].at > end) continue;
    const Instant until = std::min(end, i + 1 < stages.size() ? stages[i + 1].at : end);
    Instant last = stages[i].at;
    const auto note = [&](Instant at) {
      const Instant told = last + kOldest;
      const bool alone = reaches.line_silenced(told - kOwnTimeout, at);
      if (at > told + (alone ? kOwnTimeout : Duration(0)))
        wrong.push_back(fmt::format("motion: driven at {:.3f} s though no record came for {:.3f} s", to_seconds(at),
                                    to_seconds(at - last)));
      last = at;
    };
    for (auto at = std::lower_bound(arrivals.begin(), arrivals.end(), stages[i].at);
         at != arrivals.end() && *at < until; ++at)
      note(*at);
    note(until);
  }
}

void check_motion(const Evidence& evidence, const Reaches& reaches, Lines& wrong) {
  check_prompts(evidence.story, wrong);
  check_end_of_motion(evidence, reaches, wrong);
  if (!evidence.killed()) check_freshness(evidence.story, reaches, wrong);
}

// Record.

/// Finished, renamed, and killed or refused before the journal could tell.
bool is_unannounced(const std::string& problem) {
  return problem.find("the journal holds no SHA-256 of it") != std::string::npos;
}

/// What was synced once can be read whatever happens, unless the program died while it wrote.
void check_readable(const Evidence& evidence, Lines& wrong) {
  const bool torn = evidence.killed() && evidence.mixture.kill && evidence.mixture.kill->at == Kill::At::write;
  for (const Unreadable& file : evidence.unreadable) {
    const bool promised = file.path.extension() != ".part" || (evidence.secured.contains(name_of(file.path)) && !torn);
    if (promised) wrong.push_back(fmt::format("record: {} cannot be read: {}", name_of(file.path), file.why));
  }
}

/// Resumed, and over before it had looked at what was left behind.
bool has_not_gone_on(const Evidence& evidence) {
  const std::size_t whole_lines = evidence.inherited.journal.size();
  return whole_lines > 0 && results::read_text(evidence.left->journal()).rfind('\n') + 1 == whole_lines;
}

void check_folder(const Evidence& evidence, Lines& wrong) {
  int unannounced = 0;
  const bool may_be_one = evidence.cut_short() || has_not_gone_on(evidence);
  for (const std::string& problem : results::verify_campaign(*evidence.left).problems) {
    if (may_be_one && is_unannounced(problem) && ++unannounced == 1) continue;
    wrong.push_back("record: " + problem);
  }
  for (const FileOfRun& file : evidence.files) {
    if (file.inherited) continue;
    if (file.path.extension() == ".part") {
      if (!evidence.cut_short()) wrong.push_back(fmt::format("record: {} is left over", file.name()));
    } else if (file.run.outcome != results::Outcome::complete) {
      for (const std::string& problem : results::verify_run(file.path).problems)
        wrong.push_back(fmt::format("record: {}: {}", file.name(), problem));
    }
  }
}

/// Files of the journal's accepted runs, in their order.
std::vector<std::string> accepted_runs(const results::JournalReading& journal) {
  std::vector<std::string> names;
  for (const auto& entry : journal.entries)
    if (entry.event == results::kRunAccepted) names.push_back(entry.data.at("file").get<std::string>());
  return names;
}

void check_steps(const Evidence& evidence, const std::vector<std::string>& accepted, Lines& wrong) {
  if (evidence.cut_short() || has_not_gone_on(evidence) || accepted.empty()) return;  // between two files
  std::vector<results::StepMean> again;
  for (const std::string& name : accepted) {
    const auto file = std::find_if(evidence.files.begin(), evidence.files.end(),
                                   [&](const FileOfRun& one) { return "runs/" + one.name() == name; });
    if (file != evidence.files.end()) again.insert(again.end(), file->steps.begin(), file->steps.end());
  }
  if (results::format_steps(again) != results::read_text(evidence.left->steps()))
    wrong.push_back("record: steps.csv is not the reduction of the accepted runs");
}

void check_journal(const Evidence& evidence, const results::JournalReading& journal, Lines& wrong) {
  const Story& story = evidence.story;
  if (evidence.cut_short()) return;
  const std::string expected = story.end == End::finished ? "campaign_finished" : "campaign_stopped";
  if (journal.entries.empty() || journal.entries.back().event != expected)
    return wrong.push_back(fmt::format("record: the journal does not end with {}", expected));
  if (story.end != End::finished && journal.entries.back().data.value("reason", "") != story.reason)
    wrong.push_back("record: the journal ends with another reason than the campaign");
}

/// Of a finished campaign.
void check_plan(const Evidence& evidence, const std::vector<std::string>& accepted, Lines& wrong) {
  if (evidence.story.end != End::finished) return;
  for (const auto& planned : profiles::make_plan(evidence.campaign, evidence.place).runs) {
    const std::string name =
        "runs/" + results::run_file_name(evidence.campaign.propeller.id, planned.occlusion_deg, planned.repetition);
    const auto times = std::count(accepted.begin(), accepted.end(), name);
    if (times != 1) wrong.push_back(fmt::format("record: finished, and {} was accepted {} times", name, times));
  }
}

void check_record(const Evidence& evidence, Lines& wrong) {
  if (!evidence.left) return;
  check_readable(evidence, wrong);
  if (!std::filesystem::exists(evidence.left->journal())) return;
  check_folder(evidence, wrong);
  const auto journal = results::read_journal(evidence.left->journal());
  const auto accepted = accepted_runs(journal);
  check_steps(evidence, accepted, wrong);
  check_plan(evidence, accepted, wrong);
  // A program that was refused before it began has nothing to say in it.
  if (evidence.wire != nullptr) check_journal(evidence, journal, wrong);
}

// Resumed.

/// Written anew each time, or not a file yet.
bool may_change(const std::string& name) {
  return name == "journal.jsonl" || name.ends_with(".csv") || (name.ends_with(".part") && !name.ends_with(".h5.part"));
}

void check_inheritance(const Evidence& evidence, Lines& wrong) {
  const Inheritance& inherited = evidence.inherited;
  if (inherited.files.empty() || !evidence.left) return;
  const auto files = files_below(evidence.left->path());
  const auto is_there = [&](const std::string& bytes) {
    return std::any_of(files.begin(), files.end(), [&](const auto& file) { return file.second == bytes; });
  };
  for (const auto& [name, bytes] : inherited.files) {
    const auto same = files.find(name);
    if (inherited.accepted.contains(name)) {
      if (same == files.end() || same->second != bytes)
        wrong.push_back(fmt::format("resumed: {} was accepted and is not what it was", name));
    } else if (!may_change(name) && !is_there(bytes)) {
      wrong.push_back(fmt::format("resumed: what {} held is lost", name));
    }
  }
  const auto journal = files.find("journal.jsonl");
  if (!inherited.journal.empty() && (journal == files.end() || !journal->second.starts_with(inherited.journal)))
    wrong.push_back("resumed: the journal does not go on where it ended");
  if (evidence.wire == nullptr && evidence.story.end == End::refused && files != inherited.files)
    wrong.push_back("resumed: refused before it began, and something was touched");
}

// Verdict.

struct Means {
  double speed = 0, thrust = 0;
  std::size_t n = 0;
};

Means true_means(const Story& story, double begin_s, double end_s) {
  Means means;
  for (const auto& moment : story.moments) {
    const double at = to_seconds(moment.at);
    if (at < begin_s || at > end_s) continue;
    means.speed += moment.speed_rad_s;
    means.thrust += moment.thrust_n;
    ++means.n;
  }
  if (means.n > 0) means.speed /= static_cast<double>(means.n), means.thrust /= static_cast<double>(means.n);
  return means;
}

std::string step_name(const FileOfRun& file, const results::StepMean& step) {
  return fmt::format("verdict: {} step {}", file.name(), step.step);
}

void check_truth(const Evidence& evidence, const FileOfRun& file, const results::StepMean& step, Lines& wrong) {
  const Means truth = true_means(evidence.story, step.window_begin_s, step.window_end_s);
  if (truth.n < 10) return;
  const double thrust = std::abs(truth.thrust);  // it may push
  const double allowed_thrust = 6 * step.thrust_u_n + daq::tolerated_drift(thrust) + 0.003 * thrust;
  const double allowed_speed = 6 * step.speed_u_rad_s + 0.003 * truth.speed + 1;
  if (!(std::abs(step.thrust_n - truth.thrust) <= allowed_thrust))
    wrong.push_back(fmt::format("{}: {:.4f} N without a doubt, in truth {:.4f} N (u {:.4f})", step_name(file, step),
                                step.thrust_n, truth.thrust, step.thrust_u_n));
  if (!(std::abs(step.speed_rad_s - truth.speed) <= allowed_speed))
    wrong.push_back(fmt::format("{}: {:.2f} rad/s without a doubt, in truth {:.2f} rad/s (u {:.2f})",
                                step_name(file, step), step.speed_rad_s, truth.speed, step.speed_u_rad_s));
}

/// Samples that the box took well inside the window and sent, and that are not in the file.
void check_missing(const Evidence& evidence, const FileOfRun& file, const results::StepMean& step, Lines& wrong) {
  if ((step.doubts & static_cast<std::uint32_t>(Doubt::lost_samples)) != 0) return;
  const Instant begin = from_seconds(step.window_begin_s) + kMisplaced,
                end = from_seconds(step.window_end_s) - kMisplaced;
  const sim::WireTruth& wire = *evidence.wire;
  for (const auto& sent : wire.log) {
    if (sent.arrivals > 0 || sent.records == 0) continue;
    const Instant first = wire.sampled[sent.first_sample], last = wire.sampled[sent.first_sample + sent.records - 1];
    if (last < begin || first > end) continue;
    return wrong.push_back(
        fmt::format("{}: records are missing in its window, it does not say so", step_name(file, step)));
  }
}

/// The module's supply truly was outside of what the campaign tolerates, or at its edge, around the step's window.
bool supply_was_out_of_band(const Evidence& evidence, const results::StepMean& step) {
  constexpr double kBand = 0.095;
  const double set = evidence.campaign.supply.value();
  const auto& moments = evidence.story.moments;
  return std::any_of(moments.begin(), moments.end(), [&](const Story::Moment& moment) {
    const double at = to_seconds(moment.at);
    return at > step.window_begin_s - 0.1 && at < step.window_end_s && std::abs(moment.supply_v / set - 1) > kBand;
  });
}

/// The box itself said, or its numbers did, that what it measured in the middle of the window is worth nothing.
bool box_was_disturbed(const Reaches& reaches, const results::StepMean& step) {
  using K = sim::FaultKind;
  const Instant begin = from_seconds(step.window_begin_s) + 3 * kMisplaced;
  const Instant end = from_seconds(step.window_end_s) - 3 * kMisplaced;
  return std::any_of(reaches.cell().begin(), reaches.cell().end(), [&](const sim::Fault& fault) {
    const bool disturbs = fault.kind == K::stall || fault.kind == K::saturation || fault.kind == K::status;
    return disturbs && std::min(fault.end(), end) - std::max(fault.at, begin) > kMisplaced;
  });
}

/// Three short steps can tell a lag that is not there; its windows are then misplaced, and say so.
bool lag_is_wrong(const results::StepMean& step) { return std::abs(step.lag_s) > 0.1; }

/// The rotor truly came to its speed so late that hardly anything of the step was left: a large step down.
bool speed_came_late(const Evidence& evidence, const results::StepMean& step) {
  const Means truth = true_means(evidence.story, step.window_end_s - 0.15, step.window_end_s - 0.10);
  return std::abs(truth.speed - step.commanded_speed_rad_s) > 0.008 * step.commanded_speed_rad_s;
}

std::string names(const std::vector<results::StepMean>& steps) {
  std::string all;
  for (const auto& step : steps) all += (all.empty() ? "" : ", ") + ("\"" + results::doubt_names(step.doubts) + "\"");
  return all;
}

void check_run(const Evidence& evidence, const FileOfRun& file, const Reaches& reaches, Verdict& verdict) {
  const auto& run = file.run;
  if (run.outcome != results::Outcome::complete || run.phases.empty()) return;
  const Instant begin(run.phases.front().time_ns), end(run.phases.back().time_ns);
  const bool clean = !reaches.any(begin - 200ms, end);
  std::uint32_t doubts = 0;
  for (const auto& step : file.steps) {
    std::uint32_t unexplained = step.doubts;
    if (supply_was_out_of_band(evidence, step)) unexplained &= ~static_cast<std::uint32_t>(Doubt::supply_out_of_band);
    if (!lag_is_wrong(step) && !speed_came_late(evidence, step)) doubts |= unexplained;
    if ((step.doubts & ~kNeedNotTell) == 0) check_truth(evidence, file, step, verdict.wrong);
    check_missing(evidence, file, step, verdict.wrong);
    if (box_was_disturbed(reaches, step) && (step.doubts & ~(kNeedNotTell | kByChance)) == 0)
      verdict.wrong.push_back(step_name(file, step) + ": the box was disturbed in its window, it does not say so");
    verdict.clean_steps += clean;
    verdict.clean_steps_in_doubt += clean && ((step.doubts & kByChance) != 0 || lag_is_wrong(step));
  }
  if (file.steps.size() != static_cast<std::size_t>(evidence.campaign.profile.steps))
    verdict.wrong.push_back(fmt::format("verdict: {} has {} steps", file.name(), file.steps.size()));
  if (clean && (doubts & ~(kNeedNotTell | kByChance)) != 0)
    verdict.wrong.push_back(
        fmt::format("verdict: {} is out of reach of every fault, its doubts are {}", file.name(), names(file.steps)));
}

bool mentions(const std::string& reason, std::initializer_list<const char*> any) {
  return std::any_of(any.begin(), any.end(), [&](const char* word) { return reason.find(word) != std::string::npos; });
}

/// Whose trouble the reason tells of.
std::optional<Device> device_of(const std::string& whole_reason) {
  const std::string reason = whole_reason.substr(0, whole_reason.find(';'));
  if (mentions(reason, {"supply:"})) return Device::supply;
  if (mentions(reason, {"sensor of the air", "BME280"})) return Device::air;
  if (mentions(reason, {"Net Box", "load cell", "load-cell", "thrust"})) return Device::load_cell;
  if (mentions(reason, {"IQ module", "motor", "rotor", "speed", "coil", "RPM", "supply current", "supply voltage"}))
    return Device::motor;
  return std::nullopt;
}

/// Resumed, though its files are not those it was begun with, and nobody has said that this is right.
bool must_refuse(const Evidence& evidence) {
  const std::string& began_with = evidence.inherited.faults_sha256;
  return !evidence.mixture.accepts_changes && !began_with.empty() &&
         began_with != results::sha256(evidence.mixture.faults);
}

void check_reason(const Evidence& evidence, const Reaches& reaches, Lines& wrong) {
  const Story& story = evidence.story;
  // The audit's word on a rate that does not suit the steps; nothing has turned.
  if (story.end == End::refused && mentions(story.reason, {"folded into a constant force"})) return;
  const auto blame = device_of(story.reason);
  const std::string told = fmt::format("verdict: {}, \"{}\"", name_of(story.end), story.reason);
  if (!blame) return wrong.push_back(told + " names no device");
  const Instant until = story.ended + 1s;  // a bench that could not be made has no time
  const auto faulty = [&](Device device) { return reaches.any(device, Instant{0}, until); };
  const bool one_circuit = *blame == Device::motor || *blame == Device::supply;
  const bool right = one_circuit ? faulty(Device::motor) || faulty(Device::supply) : faulty(*blame);
  if (!right) wrong.push_back(told + ", where no fault of that device was");
}

void check_end(const Evidence& evidence, const Reaches& reaches, Lines& wrong) {
  const Story& story = evidence.story;
  const Mixture& mixture = evidence.mixture;
  const auto unless = [&](bool right) {
    if (!right) wrong.push_back(fmt::format("verdict: {}, \"{}\": why?", name_of(story.end), story.reason));
  };
  if (must_refuse(evidence))
    return unless(story.end == End::refused && mentions(story.reason, {"the fault script has changed"}));
  switch (story.end) {
    case End::finished:
      return unless(mixture.answers_are_good);
    case End::stopped:
    case End::refused:
      return check_reason(evidence, reaches, wrong);
    case End::disk:
      return unless(evidence.refused > 0 && mentions(story.reason, {"disk full"}));
    case End::interrupted:
      return unless(mixture.interrupt.has_value());
    case End::not_mounted:
      return unless(!mixture.answers_are_good);
    case End::killed:
      return unless(mixture.kill.has_value());
    case End::unknown:
      return unless(false);
  }
}

/// With a sensor every run knows its air: no fault here lasts until the newest reading is too old.
void check_air(const Evidence& evidence, const FileOfRun& file, Lines& wrong) {
  const double density = file.run.header.air_density_kg_m3;
  const bool right =
      evidence.place.ambient.sensor.empty() ? density == 0 : std::abs(density / kTrueDensity - 1) < 0.005;
  if (!right) wrong.push_back(fmt::format("verdict: {}: air of {} kg/m³", file.name(), density));
}

void check_verdict(const Evidence& evidence, const Reaches& reaches, Verdict& verdict) {
  check_end(evidence, reaches, verdict.wrong);
  if (evidence.wire == nullptr) return;
  for (const FileOfRun& file : evidence.files) {
    if (file.inherited) continue;
    check_run(evidence, file, reaches, verdict);
    check_air(evidence, file, verdict.wrong);
  }
}

}  // namespace

bool is_chance(std::uint64_t in_doubt, std::uint64_t clean) {
  if (clean == 0) return in_doubt == 0;
  const boost::math::binomial steps(static_cast<double>(clean), kDoubtedByChance);
  return in_doubt == 0 || boost::math::cdf(boost::math::complement(steps, static_cast<double>(in_doubt - 1))) > 1e-6;
}

Verdict judge(const Evidence& evidence) {
  Verdict verdict;
  const Reaches reaches(evidence.mixture.faults);
  check_account(evidence, verdict.wrong);
  check_motion(evidence, reaches, verdict.wrong);
  check_record(evidence, verdict.wrong);
  check_inheritance(evidence, verdict.wrong);
  check_verdict(evidence, reaches, verdict);
  return verdict;
}

}  // namespace kphi::soak
