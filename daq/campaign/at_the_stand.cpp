#include "daq/campaign/at_the_stand.hpp"

#include <fmt/format.h>

namespace kphi::daq {

StandAtRest::StandAtRest(Bench& bench, const std::function<bool()>& stop_asked) {
  guard_.emplace(bench, true);
  if (const std::string why = bench.unprotected(); !why.empty()) throw SafetyStop(why);
  guard_->await_rest(stop_asked);
  has_power_ = !bench.switch_off_power();
  if (!has_power_) guard_.emplace(bench, false);
}

std::string StandAtRest::condition() const {
  return has_power_ ? "The rotor is at rest and its module coasts, but the motor HAS POWER. Cut it at the switch first."
                    : "The rotor is at rest and the supply's output is off.";
}

std::string about_keypad(Bench& bench) {
  const auto keypad = bench.supply() == nullptr ? SupplyKeypad::free : bench.supply()->keypad();
  if (keypad == SupplyKeypad::free) return "";
  return fmt::format(" The supply's keypad {} locked while kphi asks it: your switch for the 12 V is another one.",
                     keypad == SupplyKeypad::locked ? "is" : "may be");
}

MountConfirmation ask_at_the_stand(Bench& bench, Operator& person, const std::function<bool()>& stop_asked,
                                   const std::function<MountConfirmation(const StandAtRest& stand)>& ask) {
  const StandAtRest stand(bench, stop_asked);
  struct Waiting {
    explicit Waiting(Operator& asked, std::function<void()> poll) : person(asked) {
      person.while_waiting(std::move(poll));
    }
    ~Waiting() { person.while_waiting({}); }
    Operator& person;
  };
  std::optional<Waiting> waiting(std::in_place, person, [&] { stand.check(); });
  const MountConfirmation confirmed = ask(stand);
  waiting.reset();
  stand.check();
  if (stop_asked()) throw Interrupted("stopped by request");
  return confirmed;
}

}  // namespace kphi::daq
