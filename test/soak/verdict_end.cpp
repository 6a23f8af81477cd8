#include <fmt/format.h>

#include <algorithm>

#include "results/digest.hpp"
#include "test/soak/verdict_checks.hpp"

namespace kphi::soak {
namespace {

using namespace std::chrono_literals;

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
  if (story.end == End::refused && mentions(story.reason, {"aliases to a constant force"})) return;
  // What lets less air through than was said leaves less thrust than was expected.
  if (evidence.mixture.mounted_instead_deg && mentions(story.reason, {"N expected: is the propeller mounted"})) return;
  const auto blame = device_of(story.reason);
  const std::string told = fmt::format("verdict: {}, \"{}\"", name_of(story.end), story.reason);
  if (!blame) return wrong.push_back(told + " names no device");
  const Instant until = story.ended + 1s;  // a bench that could not be made has no time
  const auto faulty = [&](Device device) { return reaches.any(device, Instant{0}, until); };
  const bool one_circuit = *blame == Device::motor || *blame == Device::supply;
  const bool right = one_circuit ? faulty(Device::motor) || faulty(Device::supply) : faulty(*blame);
  if (!right) wrong.push_back(told + ", where no fault of that device was");
}

constexpr Duration kOldest = 250ms;
constexpr double kSafeToTouch = 5.0;  // rad/s

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
  const bool slept = story.woke && *story.woke - evidence.mixture.sleep->lasts <= decided + kHeard;
  const bool alone = evidence.killed() || slept || reaches.line_silenced(decided - kOwnTimeout, decided + kOwnTimeout);
  // Its own timeout begins anew with what is ordered after a short sleep, whether it obeys or not.
  const bool woke_in_time = slept && evidence.mixture.sleep->lasts < kOwnTimeout;
  const Duration limit = (alone ? kOwnTimeout : kHeard) + (woke_in_time ? evidence.mixture.sleep->lasts : Duration{});
  if (since > decided + limit)
    wrong.push_back(
        fmt::format("motion: coasts {:.0f} ms after {}, {:.0f} ms are allowed", 1e3 * to_seconds(since - decided),
                    evidence.killed() ? "the kill" : "the last look that found all well", 1e3 * to_seconds(limit)));
}

/// The module let the motor go while the computer slept, or coasts since: whatever was ordered before is void.
void check_waking(const Story& story, Lines& wrong) {
  if (!story.woke) return;
  for (const Story::StageChange& change : story.stages) {
    if (change.at > *story.woke && change.mode == sim::PowerStage::Mode::drive)
      wrong.push_back(fmt::format("motion: driven at {:.3f} s, though the computer slept until {:.3f} s",
                                  to_seconds(change.at), to_seconds(*story.woke)));
  }
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

}  // namespace

void check_end(const Evidence& evidence, const Reaches& reaches, Lines& wrong) {
  const Story& story = evidence.story;
  const Mixture& mixture = evidence.mixture;
  const auto unless = [&](bool right) {
    if (!right) wrong.push_back(fmt::format("verdict: {}, \"{}\": why?", name_of(story.end), story.reason));
  };
  if (must_refuse(evidence))
    return unless(story.end == End::refused && mentions(story.reason, {"the fault script has changed"}));
  const bool told_of_sleep = story.reason.starts_with("this computer slept");
  if (story.end == End::stopped && told_of_sleep) return unless(story.woke.has_value());
  // What else stopped it was seen before, in the same moment, or while what had stopped it was told.
  if (story.woke && story.end == End::finished) return unless(false);
  switch (story.end) {
    case End::finished:  // without an answer only where no run was left to do
      return unless(mixture.answers_are_good ||
                    (!evidence.files.empty() && std::ranges::all_of(evidence.files, &FileOfRun::inherited)));
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

void check_motion(const Evidence& evidence, const Reaches& reaches, Lines& wrong) {
  check_prompts(evidence.story, wrong);
  check_waking(evidence.story, wrong);
  check_end_of_motion(evidence, reaches, wrong);
  if (!evidence.killed()) check_freshness(evidence.story, reaches, wrong);
}

}  // namespace kphi::soak
