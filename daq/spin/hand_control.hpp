// Steering with four keys: up and down by a step, hold where it is, and stop. Whoever steers must be there: without a
// key for a while it stops, unless a time was set before.
#pragma once

#include <functional>

#include "daq/run/steering.hpp"

namespace kphi::daq {

class HandControl final : public Steering {
 public:
  struct Settings {
    RadPerSec start;                               ///< the speed to begin with
    RadPerSec step;                                ///< of a key
    RadPerSec highest;                             ///< no key goes beyond it; down ends at one step
    std::optional<Duration> lasts{};               ///< bench time from the first moment at `start`; then it stops
    Duration dead_man = std::chrono::seconds(30);  ///< bench time without a key; where nothing is set in `lasts`
  };
  /// `next_key`: the oldest that was pressed since; nullopt: none.
  HandControl(const Settings& settings, std::function<std::optional<Key>()> next_key)
      : settings_(settings), next_key_(std::move(next_key)), target_(settings.start) {}

  /// What was pressed until now does not count. From now on it does, also before the motor turns: stop keeps it at
  /// rest.
  void forget_keys() {
    while (next_key_()) {
    }
  }
  [[nodiscard]] std::optional<RadPerSec> wanted(Instant now, RadPerSec commanded) override;
  [[nodiscard]] std::string why() const override { return why_; }

 private:
  void take(Key key, RadPerSec commanded);

  const Settings settings_;
  const std::function<std::optional<Key>()> next_key_;
  RadPerSec target_;
  std::optional<Instant> newest_key_;  ///< or the first call
  std::optional<Instant> reached_;     ///< `start`
  std::string why_;
};

}  // namespace kphi::daq
