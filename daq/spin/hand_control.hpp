// Steering with four keys: up and down by a step, hold where it is, and stop. Whoever steers must be there: without a
// key for a while it stops, unless a time was set before.
#pragma once

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
  /// Keys count from now on, also before the motor turns: stop keeps it at rest. `keys` outlives this.
  HandControl(const Settings& settings, Keys& keys) : settings_(settings), keys_(keys), target_(settings.start) {
    keys_.begin();
  }

  /// Somebody pressed stop before a speed was wanted for the first time. To be asked until then.
  [[nodiscard]] bool is_called_off();
  [[nodiscard]] std::optional<RadPerSec> wanted(Instant now, RadPerSec commanded) override;
  [[nodiscard]] std::string why() const override { return why_; }

 private:
  /// True: there were some.
  bool take_keys();
  void take(Key key);

  const Settings settings_;
  Keys& keys_;
  RadPerSec target_;  ///< a key moves it by at most one step beyond what is commanded
  RadPerSec commanded_{0};
  std::optional<Instant> newest_key_;  ///< or the first call
  std::optional<Instant> reached_;     ///< `start`
  std::string why_;
};

}  // namespace kphi::daq
