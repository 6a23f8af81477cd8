// What to do about a stream that has fallen silent: when to ask the box, when to start it again, when to give up. A
// state machine: answers and the time go in, moves come out. One thread.
#pragma once

#include <cstdint>

#include "base/clock.hpp"
#include "drivers/netbox/stream/batching.hpp"

namespace kphi::netbox {

/// Wall time where it is a setting of LoadCell, bench time inside.
struct StreamPolicy {
  bool reconnect = true;  ///< start again by itself; never a stream that another client has taken
  Duration first_pause = std::chrono::milliseconds(250);  ///< between two questions; doubles
  Duration longest_pause = std::chrono::seconds(8);
  Duration give_up_after = std::chrono::seconds(60);  ///< since the silence was noticed
  /// 0: the box streams until it is told to stop. Otherwise it is asked for so much at a time, and again when half of
  /// it has passed: when this host dies, the box stops by itself. Each renewal costs what the box has gathered for the
  /// datagram under way (Counters::lost_at_renewals); nothing in real-time mode.
  Duration lease{0};
  HandOver hand_over = HandOver::as_asked;
};

/// What a box said when it was asked.
enum class BoxAnswer : std::uint8_t {
  unreachable,   ///< nothing, over HTTP
  unusable,      ///< a configuration that cannot be measured with
  rdt_disabled,  ///< RDT is switched off
  ready,
};

class Reconnect {
 public:
  enum class Move : std::uint8_t { none, ask, start, give_up };

  explicit Reconnect(const StreamPolicy& policy) noexcept : policy_(policy) {}

  /// The stream has fallen silent: the box is to be asked at once.
  void silent(Instant now) noexcept;
  /// `booted`: the box has started anew since it streamed. True: this is news, not the answer of the time before.
  bool answered(BoxAnswer answer, bool booted, Instant now) noexcept;
  /// The start that was last told brought no record.
  void start_failed(Instant now) noexcept;
  /// Records come: all is well.
  void streaming() noexcept { phase_ = Phase::resting; }
  /// Each move is told once.
  [[nodiscard]] Move next(Instant now) noexcept;
  /// When next() will have a move; kNever when none is due by itself.
  [[nodiscard]] Instant deadline() const noexcept;
  /// The next move is a start.
  [[nodiscard]] bool will_start() const noexcept { return phase_ == Phase::to_start; }
  /// A start was told, and neither start_failed() nor streaming() since.
  [[nodiscard]] bool starting() const noexcept { return phase_ == Phase::starting; }

 private:
  enum class Phase : std::uint8_t { resting, to_ask, asking, pausing, to_start, starting };
  void pause(Instant now) noexcept;

  const StreamPolicy policy_;
  Phase phase_ = Phase::resting;
  Instant give_up_at_ = kNever, due_ = kNever;
  Duration pause_{0};
  bool away_ = false;  // the box was not ready at some time of this silence: nobody else can have had its stream
  bool has_answer_ = false;
  BoxAnswer answer_ = BoxAnswer::ready;
};

}  // namespace kphi::netbox
