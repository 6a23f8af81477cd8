#include "commands/at_the_bench.hpp"

#include <fmt/chrono.h>
#include <unistd.h>

#include <cstdlib>

#include "daq/guard/interlock.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/run/console.hpp"
#include "drivers/sim/control_line.hpp"

namespace kphi::commands {

bool has_terminal() {
  const char* term = std::getenv("TERM");
  return isatty(STDERR_FILENO) && !(term && std::string(term) == "dumb");
}

std::optional<daq::Key> KeysAtTheStand::next() {
  if (const auto key = terminal_.next_key()) return key;
  return view_.take_key();
}

void KeysAtTheStand::forget(const std::function<void()>& poll) {
  terminal_.forget_keys(poll);
  while (view_.take_key()) {
  }
}

bool simulator_is_missing(const profiles::BenchConfig& config) {
  if (!config.simulation || config.simulation->in_process || config.simulation->control.empty()) return false;
  try {
    (void)sim::tell(sim::control_path(config.simulation->control), "status");
    return false;
  } catch (const DeviceError&) {
    return true;
  }
}

void require_simulator(const profiles::BenchConfig& config) {
  if (simulator_is_missing(config))
    throw DeviceError(
        fmt::format("{0}: its simulator does not run; start it in another terminal: kphi sim {0}", config.path));
}

void announce_origin(const profiles::BenchConfig& config) {
  if (config.simulation) daq::put(stderr, "SIMULATED: no propeller turns, no device measures\n");
}

std::string stamp_of(const daq::Bench& bench) {
  const auto began = std::chrono::time_point_cast<std::chrono::seconds>(bench.clock().epoch_utc());
  return fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(began)));
}

std::unique_ptr<daq::Bench> connect_awake(const profiles::BenchConfig& config,
                                          const std::function<bool()>& stop_asked) {
  const SteadyClock wall;
  std::unique_ptr<daq::Bench> bench;
  try {
    bench = daq::connect(config, stop_asked);
  } catch (const daq::Interrupted&) {
    throw;
  } catch (const std::exception&) {
    daq::require_awake(wall);
    require_simulator(config);
    throw;
  }
  daq::require_awake(wall);
  return bench;
}

}  // namespace kphi::commands
