#include "drivers/iq/link/motor.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/error.hpp"

namespace kphi::iq {
namespace {

using std::chrono::steady_clock;
constexpr std::size_t kEvents = 256;
constexpr auto kAnswerLimit = std::chrono::seconds(20);

}  // namespace

void Motor::spin_at(RadPerSec signed_speed) {
  if (!(std::abs(signed_speed.value()) <= kFastest)) {
    throw std::invalid_argument(fmt::format("speed {} rad/s is beyond what the module takes", signed_speed.value()));
  }
  {
    const std::lock_guard lock(mutex_);
    if (!alive_) refuse("spin", ended_ ? "connect again" : "find the cause, then connect again");
    renew();
    commands_.speed = signed_speed;
    commands_.after_coasts = coasts_asked_;
    commands_.stop.reset();
  }
  commanded_.raise();
}

void Motor::renew() noexcept {
  lease_end_ns_ = std::chrono::nanoseconds((steady_clock::now() + kLease).time_since_epoch()).count();
}

std::uint64_t Motor::order_coast() noexcept {
  const std::uint64_t ticket = ++coasts_asked_;  // voids every speed of before
  commanded_.raise();
  return ticket;
}

bool Motor::await_coast(std::uint64_t ticket, Duration wall) noexcept {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, wall, [&] { return ended_ || !line_ || coasts_done_ >= ticket; });
  return coasts_done_ >= ticket;
}

std::uint64_t Motor::begin_stop(const StopSettings& settings) {
  Stopping::check(settings);
  const std::lock_guard lock(mutex_);
  commands_.speed.reset();
  commands_.stop = settings;
  const std::uint64_t ticket = ++stops_.asked;
  renew();
  commanded_.raise();
  return ticket;
}

std::optional<StopReport> Motor::stop_report(std::uint64_t ticket) const {
  const std::lock_guard lock(mutex_);
  if (stops_.done >= ticket) return stop_report_;
  return ended_ ? std::optional(StopReport{}) : std::nullopt;
}

StopReport Motor::stop(const StopSettings& settings) {
  const std::uint64_t ticket = begin_stop(settings);
  std::unique_lock lock(mutex_);
  // A caller that waits here is alive.
  do {
    renew();
  } while (!changed_.wait_for(lock, kLease / 4, [&] { return ended_ || stops_.done >= ticket; }));
  return stops_.done >= ticket ? stop_report_ : StopReport{};
}

std::vector<Reply> Motor::inquire(std::vector<Inquiry> inquiries) {
  Inquiries::check(inquiries);
  const std::lock_guard turn(inquiring_);
  std::unique_lock lock(mutex_);
  if (state_ != Session::State::ready || ended_) refuse("ask", "wait until it is connected");
  commands_.inquiry = std::move(inquiries);
  const std::uint64_t ticket = ++inquiries_.asked;
  commanded_.raise();
  changed_.wait_for(lock, kAnswerLimit, [&] { return ended_ || inquiries_.done >= ticket; });
  if (inquiries_.done < ticket) refuse("ask", "connect again");
  return replies_;
}

std::vector<StreamEvent> Motor::take_events() {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  return lock ? std::exchange(events_, {}) : std::vector<StreamEvent>();
}

std::string Motor::failure() const {
  if (!has_failed_) return "";
  const std::unique_lock lock(mutex_, std::try_to_lock);
  return lock ? failure_ : "it has failed";
}

void Motor::refuse(const char* operation, const char* next_move) const {
  throw DeviceError("motor module on " + device_, operation, failure_.empty() ? "it is not connected" : failure_,
                    next_move);
}

bool Motor::take_coast() noexcept {
  const std::uint64_t asked = coasts_asked_;
  return asked != std::exchange(coasts_taken_, asked);
}

std::optional<Commands> Motor::take_commands() {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return std::nullopt;
  for (Ticket* ticket : {&stops_, &inquiries_}) ticket->taken = ticket->asked;
  return std::exchange(commands_, {});
}

void Motor::move_readings(Session& session) {
  std::array<MotorReading, 64> batch;
  while (const std::size_t n = session.take(batch)) dropped_readings_ += n - readings_.push(batch.data(), n);
}

bool Motor::publish(Session& session, bool line) {
  bool news = false;
  {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return false;
    news = note_state(session);
    if (line != std::exchange(line_, line)) news = true;
    if (close_tickets(session)) news = true;
    for (StreamEvent& event : session.take_events()) {
      if (events_.size() == kEvents) events_.erase(events_.begin());
      events_.push_back(std::move(event));
    }
    counters_ = session.counters();
    counters_.dropped_readings += dropped_readings_;
    counters_.lease_expiries = lease_expiries_;
    counters_.reconnections = reconnections_;
    round_trips_ = session.round_trips();
  }
  if (news) changed_.notify_all();
  return true;
}

bool Motor::note_state(const Session& session) {
  if (!session.failure().empty()) {
    failure_ = session.failure();
    has_failed_ = true;
  }
  const bool alive = session.armed() || (alive_ && session.state() == Session::State::connecting);
  const bool news = state_ != session.state() || alive_ != alive;
  state_ = session.state();
  alive_ = alive;
  if (news && state_ == Session::State::ready) identity_ = session.identity();
  return news;
}

bool Motor::close_tickets(const Session& session) {
  bool news = false;
  const auto close = [&](Ticket& ticket, bool done) {
    if (!ticket.open() || !done) return false;
    ticket.done = ticket.taken;
    return news = true;
  };
  if (coasts_done_ != coasts_taken_ && session.coasting()) {
    coasts_done_ = coasts_taken_;
    news = true;
  }
  if (close(stops_, !session.stopping() && session.stop_report().has_value())) stop_report_ = *session.stop_report();
  if (close(inquiries_, session.inquiries().done())) replies_ = session.inquiries().replies();
  return news;
}

void Motor::end(const std::string& why) {
  {
    const std::lock_guard lock(mutex_);
    if (failure_.empty()) failure_ = why;
    ended_ = has_failed_ = true;
    alive_ = false;
  }
  changed_.notify_all();
}

}  // namespace kphi::iq
