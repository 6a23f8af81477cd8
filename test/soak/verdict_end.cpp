#include <fmt/format.h>

#include <algorithm>

#include "results/file_layer.hpp"
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
  const auto blame = device_of(story.reason);
  const std::string told = fmt::format("verdict: {}, \"{}\"", name_of(story.end), story.reason);
  if (!blame) return wrong.push_back(told + " names no device");
  const Instant until = story.ended + 1s;  // a bench that could not be made has no time
  const auto faulty = [&](Device device) { return reaches.any(device, Instant{0}, until); };
  const bool one_circuit = *blame == Device::motor || *blame == Device::supply;
  const bool right = one_circuit ? faulty(Device::motor) || faulty(Device::supply) : faulty(*blame);
  if (!right) wrong.push_back(told + ", where no fault of that device was");
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

}  // namespace kphi::soak
