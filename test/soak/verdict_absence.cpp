#include <fmt/format.h>

#include <algorithm>

#include "test/soak/verdict_checks.hpp"

namespace kphi::soak {
namespace {

using namespace std::chrono_literals;

constexpr Duration kFresh = 250ms;

}  // namespace

void check_absence(const Evidence& evidence, Lines& wrong) {
  if (!evidence.mixture.absence || !evidence.story.comeback) return;
  const Absence& absence = *evidence.mixture.absence;
  const Comeback& seen = *evidence.story.comeback;
  const auto has = [&](EventKind kind) {
    return std::find(seen.events.begin(), seen.events.end(), kind) != seen.events.end();
  };
  const auto unless = [&](bool right, const std::string& what) {
    if (!right) wrong.push_back(fmt::format("absence: {} (\"{}\")", what, seen.failure));
  };
  unless(has(EventKind::silent), "nobody noticed that the stream fell silent");
  if (!absence.returns) {
    unless(seen.starts == 1, fmt::format("{} starts of a stream that another client has taken", seen.starts));
    unless(has(EventKind::taken_over), "the event does not say that the stream was taken over");
    return unless(!seen.failure.empty(), "the stream of another client counts as working");
  }
  unless(seen.newest + kFresh >= seen.ended,
         fmt::format("the box answers from {:.3f} s on, the newest sample of {:.3f} s is from {:.3f} s",
                     to_seconds(absence.ends), to_seconds(seen.ended), to_seconds(seen.newest)));
  unless(seen.failure.empty(), "the stream counts as failed although the box is back");
  unless(has(absence.is_started ? EventKind::reconnected : EventKind::resumed),
         "no event says that the stream came back");
}

}  // namespace kphi::soak
