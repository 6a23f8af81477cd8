// Somebody is near the propeller: the state that the stand is in meanwhile, and questions to that person.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "daq/bench/bench.hpp"
#include "daq/campaign/operator.hpp"
#include "daq/guard/rest_guard.hpp"

namespace kphi::daq {

/// The rotor was seen at rest, is without power if kphi controls the supply, and a RestGuard watches it while this
/// lives. The power stays off afterwards.
class StandAtRest {
 public:
  /// Waits until the rotor is at rest. Throws SafetyStop, Interrupted.
  StandAtRest(Bench& bench, const std::function<bool()>& stop_asked);
  /// Throws SafetyStop once the rotor turned, or could. Any thread.
  void check() const { guard_->check(); }
  /// The motor may have power: kphi has not switched its supply off.
  [[nodiscard]] bool has_power() const { return has_power_; }
  /// One sentence on motor and supply, for whoever comes near.
  [[nodiscard]] std::string condition() const;

 private:
  std::optional<RestGuard> guard_;
  bool has_power_ = true;
};

/// For a person who comes near for the first time: that the supply's keys switch nothing; empty: they may.
[[nodiscard]] std::string about_keypad(Bench& bench);

/// Asks while the stand is at rest. Throws SafetyStop, Interrupted, and what `ask` throws.
[[nodiscard]] MountConfirmation ask_at_the_stand(Bench& bench, Operator& person,
                                                 const std::function<bool()>& stop_asked,
                                                 const std::function<MountConfirmation(const StandAtRest& stand)>& ask);

}  // namespace kphi::daq
