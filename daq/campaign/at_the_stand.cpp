#include "daq/campaign/at_the_stand.hpp"

#include <optional>

#include "daq/guard/rest_guard.hpp"

namespace kphi::daq {

MountConfirmation ask_at_the_stand(Bench& bench, Operator& person, const std::function<bool()>& stop_asked,
                                   const std::function<MountConfirmation(const std::string& condition)>& ask) {
  std::optional<RestGuard> guard(std::in_place, bench, true);
  guard->await_rest(stop_asked);
  const bool has_power = !bench.switch_off_power();
  if (!has_power) guard.emplace(bench, false);
  struct Waiting {
    explicit Waiting(Operator& asked, std::function<void()> poll) : person(asked) {
      person.while_waiting(std::move(poll));
    }
    ~Waiting() { person.while_waiting({}); }
    Operator& person;
  };
  std::optional<Waiting> waiting(std::in_place, person, [&] { guard->check(); });
  const MountConfirmation confirmed =
      ask(has_power ? "The rotor is at rest and its module coasts, but the motor HAS POWER. Cut it at the switch first."
                    : "The rotor is at rest and the supply's output is off.");
  waiting.reset();
  guard->check();
  if (stop_asked()) throw Interrupted("stopped by request");
  return confirmed;
}

}  // namespace kphi::daq
