#include "drivers/iq/session/coasting.hpp"

namespace kphi::iq {
namespace {

constexpr int kFewestAttempts = 5;
constexpr const Entry& kDriveMode = entry<"brushless_drive.drive_mode">;

}  // namespace

Coasting::Coasting(const Settings& settings)
    : module_id_(settings.module_id),
      reply_timeout_(settings.reply_timeout),
      silence_(settings.longest_silence * 3 / 2 + settings.reply_timeout) {}

void Coasting::begin(Exchange& exchange, int times, Instant now) noexcept {
  if (silent()) return;
  exchange.coast(module_id_, times, false, now);
  if (pending_) return;
  pending_ = true;
  confirmed_ = false;
  order_ = exchange.order();
  begun_ = now;
  attempts_ = 1;
  next_ = now + exchange.timeout();
  ask(exchange, now);
}

void Coasting::take(const QueryResult& result, const Exchange& exchange) noexcept {
  if (&result.entry() != &kDriveMode) return;
  const bool answered = result.kind == QueryResult::Kind::answer;
  if (answered) last_mode_ = static_cast<int>(result.value());
  if (!pending_) return;
  const bool asked_afterwards = result.request.order > order_;
  if (answered && asked_afterwards && last_mode_ == static_cast<int>(DriveMode::coast)) {
    pending_ = false;
    confirmed_ = true;
  } else if (!silent()) {
    // At once if the query was lost or older than the coast; otherwise the module gets some time.
    blocked_ = false;
    ask_at_ = answered && asked_afterwards ? result.end + exchange.timeout() / 10 : result.end;
  }
}

bool Coasting::advance(Exchange& exchange, Instant now) noexcept {
  if (!pending_) return false;
  if (now >= next_) {
    const bool tried_enough = attempts_ >= kFewestAttempts && now - begun_ >= reply_timeout_ * kFewestAttempts;
    if (tried_enough && !silent()) {
      attempts_ = 0;
      ask_at_ = kNever;
      next_ = now + silence_;
      return true;
    }
    if (silent()) begun_ = now;
    ++attempts_;
    exchange.coast(module_id_, 1, true, now);
    next_ = now + exchange.timeout();
    ask_at_ = now;
  }
  if (now >= ask_at_) ask(exchange, now);
  return false;
}

void Coasting::ask(Exchange& exchange, Instant now) noexcept {
  blocked_ = !exchange.ask(kDriveMode, module_id_, now);
  ask_at_ = blocked_ ? now : kNever;
}

}  // namespace kphi::iq
