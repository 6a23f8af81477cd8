// Questions to somebody who is near the propeller.
#pragma once

#include <functional>
#include <string>

#include "daq/bench/bench.hpp"
#include "daq/campaign/operator.hpp"

namespace kphi::daq {

/// Asks only once the rotor is seen at rest, without power if kphi controls the supply, while a RestGuard watches. The
/// power stays off. `ask` gets one sentence on the state of motor and supply. Throws SafetyStop, Interrupted, and what
/// `ask` throws.
[[nodiscard]] MountConfirmation ask_at_the_stand(
    Bench& bench, Operator& person, const std::function<bool()>& stop_asked,
    const std::function<MountConfirmation(const std::string& condition)>& ask);

}  // namespace kphi::daq
