// What verbs that turn the motor have in common.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daq/bench/bench.hpp"
#include "daq/live/live_session.hpp"
#include "daq/run/steering.hpp"
#include "daq/run/terminal.hpp"

namespace kphi::commands {

/// A live line can be rewritten on stderr.
[[nodiscard]] bool has_terminal();

/// Keys of the terminal and of the live page.
class KeysAtTheStand final : public daq::Keys {
 public:
  KeysAtTheStand(daq::Terminal& terminal, daq::live::LiveSession& view) : terminal_(terminal), view_(view) {}
  void begin() override { (void)terminal_.begin_keys(); }
  [[nodiscard]] std::optional<daq::Key> next() override;
  void forget(const std::function<void()>& poll) override;

 private:
  daq::Terminal& terminal_;
  daq::live::LiveSession& view_;
};

/// A simulated bench of `kphi sim` that does not run.
[[nodiscard]] bool simulator_is_missing(const profiles::BenchConfig& config);
/// Throws DeviceError with the command that starts it.
void require_simulator(const profiles::BenchConfig& config);

/// Says on stderr that what follows is simulated, if it is.
void announce_origin(const profiles::BenchConfig& config);

/// When the bench began, as names of records begin: "20210530T080000Z".
[[nodiscard]] std::string stamp_of(const daq::Bench& bench);

/// Refuses a computer that slept while it connected: the answers of the devices are outdated. Throws as connect, and
/// what to start if the bench is simulated and its simulator does not run.
[[nodiscard]] std::unique_ptr<daq::Bench> connect_awake(const profiles::BenchConfig& config,
                                                        const std::function<bool()>& stop_asked);

}  // namespace kphi::commands
