// A coast, repeated until the module reports drive mode coast to a query sent afterwards. If it does not, the session
// falls silent so that the module's own communication timeout can end the motion, and then starts again, without end.
#pragma once

#include <algorithm>

#include "drivers/iq/exchange/exchange.hpp"

namespace kphi::iq {

class Coasting {
 public:
  /// `settings` are completed.
  explicit Coasting(const Settings& settings);

  /// Sends it `times` times at once, and asks. Sends nothing during the silence, which leaves the motor to the module's
  /// own timeout.
  void begin(Exchange& exchange, int times, Instant now) noexcept;
  /// Motion was commanded.
  void end() noexcept { pending_ = confirmed_ = false; }
  void take(const QueryResult& result, const Exchange& exchange) noexcept;
  /// Does what is due. True when it has just given up.
  [[nodiscard]] bool advance(Exchange& exchange, Instant now) noexcept;
  [[nodiscard]] Instant deadline() const noexcept {
    if (!pending_) return kNever;
    return blocked_ ? next_ : std::min(next_, ask_at_);
  }

  [[nodiscard]] bool pending() const noexcept { return pending_; }
  [[nodiscard]] bool confirmed() const noexcept { return confirmed_; }
  /// Given up for now: nothing must be sent.
  [[nodiscard]] bool silent() const noexcept { return pending_ && attempts_ == 0; }
  /// The drive mode last reported, to any query; -1 before the first.
  [[nodiscard]] int last_mode() const noexcept { return last_mode_; }
  void forget_mode() noexcept { last_mode_ = -1; }

 private:
  void ask(Exchange& exchange, Instant now) noexcept;

  int module_id_;
  Duration reply_timeout_, silence_;
  bool pending_ = false, confirmed_ = false;
  std::uint64_t order_ = 0;  ///< of the first coast
  Instant begun_{0};
  int attempts_ = 0;
  Instant next_{0};
  Instant ask_at_{kNever};
  bool blocked_ = false;  ///< the query is due but had no room: it goes before any poll
  int last_mode_ = -1;
};

}  // namespace kphi::iq
