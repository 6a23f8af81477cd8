// One run: zero, steps, spin-down, zero, recorded into one file. Whatever happens, the motor coasts and what was
// recorded is kept.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "daq/bench/bench.hpp"
#include "daq/run/progress.hpp"
#include "daq/run/run_order.hpp"
#include "drivers/iq/session/stopping.hpp"

namespace kphi::daq {

struct RunResult {
  std::filesystem::path file;
  results::RunDigests digests;
  SampleAccount account;
  std::optional<iq::StopReport> stop;  ///< how the motor came to rest
  int steps_not_needed = 0;            ///< left out because k was certain enough without them
};

/// `stop_asked` is checked on every tick. Throws Interrupted, SafetyStop or RecordError after the motor coasts and the
/// file is closed as aborted; the message names that file and, if the load cell fell silent, the reason. Throws
/// DeviceError if the stream does not start.
[[nodiscard]] RunResult record_run(Bench& bench, const RunOrder& order, Progress& progress,
                                   const std::function<bool()>& stop_asked);

/// Calendar time of bench time `when`: ISO 8601 with seconds, UTC, "2021-05-30T00:00:00Z".
[[nodiscard]] std::string utc_text(const Clock& clock, Instant when);

}  // namespace kphi::daq
