#include "drivers/netbox/stream/reconnect.hpp"

#include <algorithm>

namespace kphi::netbox {

void Reconnect::silent(Instant now) noexcept {
  phase_ = Phase::to_ask;
  pause_ = policy_.first_pause;
  give_up_at_ = now + policy_.give_up_after;
  away_ = has_answer_ = false;
}

bool Reconnect::answered(BoxAnswer answer, bool booted, Instant now) noexcept {
  if (phase_ != Phase::asking) return false;
  const bool news = !has_answer_ || answer != answer_;
  has_answer_ = true;
  answer_ = answer;
  away_ = away_ || booted || answer != BoxAnswer::ready;
  if (!policy_.reconnect || !away_) {
    phase_ = Phase::resting;
  } else if (answer == BoxAnswer::ready) {
    phase_ = Phase::to_start;
  } else {
    pause(now);
  }
  return news;
}

void Reconnect::start_failed(Instant now) noexcept { pause(now); }

void Reconnect::pause(Instant now) noexcept {
  phase_ = Phase::pausing;
  due_ = now + pause_;
  pause_ = std::min(2 * pause_, policy_.longest_pause);
}

Reconnect::Move Reconnect::next(Instant now) noexcept {
  switch (phase_) {
    case Phase::to_ask:
      phase_ = Phase::asking;
      return Move::ask;
    case Phase::to_start:
      phase_ = Phase::starting;
      return Move::start;
    case Phase::pausing:
      if (now >= give_up_at_) {
        phase_ = Phase::resting;
        return Move::give_up;
      }
      if (now < due_) return Move::none;
      phase_ = Phase::asking;
      return Move::ask;
    case Phase::resting:
    case Phase::asking:
    case Phase::starting:
      break;
  }
  return Move::none;
}

Instant Reconnect::deadline() const noexcept { return phase_ == Phase::pausing ? std::min(due_, give_up_at_) : kNever; }

}  // namespace kphi::netbox
