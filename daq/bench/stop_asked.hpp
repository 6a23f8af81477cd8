// A person's or the system's request to stop.
#pragma once

#include <functional>

namespace kphi::daq {

/// Whether a person or the system asks the program to stop. The runner's thread asks after each wait, and before
/// anything is switched on.
using StopAsked = std::function<bool()>;

}  // namespace kphi::daq
