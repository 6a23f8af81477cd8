#include "drivers/iq/session/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace kphi::iq {
namespace {

constexpr int kSilentTimeouts = 10;  ///< longest reply time-outs without any reply after which the module is gone
constexpr int kRestartTimeouts = 3;  ///< within which a restart explains why the module stopped driving
constexpr std::uint64_t kRoundTrips = 100;  ///< enough to judge their median
constexpr int kSlowShare = 25;              ///< of the reply time-out: a longer median, 4 ms, is slow
constexpr const Entry& kVelocity = entry<"propeller_motor_control.ctrl_velocity">;

}  // namespace

Session::Session(Settings settings)
    : settings_(completed(std::move(settings))),
      exchange_(settings_),
      coasting_(settings_),
      drive_(settings_),
      connecting_(settings_),
      polling_(settings_),
      inquiries_(settings_.module_id) {}

void Session::connect(Instant now) {
  exchange_.withdraw();
  restart(now);
}

void Session::connect_anew(Instant now) {
  exchange_.change_line();
  coasting_.end();
  restart(now);
}

void Session::restart(Instant now) {
  state_ = State::connecting;
  failure_.clear();
  connecting_.begin(known_);
  reset_watch_.begin();
  if (settings_.inspects) connecting_.skip();
  inquiries_.abandon();
  polling_.end();
  last_reply_ = now;
  coasting_.forget_mode();
  coast(1, now);
  service(now);
}

void Session::rearm() {
  if (state_ != State::ready) throw std::logic_error("cannot rearm before the module is connected again");
  armed_ = true;
}

void Session::fail(EventKind kind, const std::string& why, Instant now) {
  state_ = State::failed;
  failure_ = why;
  armed_ = false;
  polling_.end();
  inquiries_.abandon();
  note(kind, why, now);
  let_go_.clear();
  if (!coasting_.pending()) coast(3, now);
}

void Session::spin_at(RadPerSec signed_speed, Instant now) {
  const double speed = signed_speed.value();
  if (!(std::abs(speed) <= kFastest)) {
    throw std::invalid_argument(fmt::format("speed {} rad/s is not within ±{} rad/s", speed, kFastest));
  }
  if (!armed()) throw std::logic_error("cannot spin: the module is not ready and armed");
  if (speed == 0) return coast(now);
  stopping_.end(StopReport::Outcome::overruled);
  check_drive(now);
  if (!armed()) return;
  if (!std::exchange(spinning_, true)) {  // each spin is judged by its own round trips
    judged_until_ = exchange_.round_trips();
    round_trip_judged_ = false;
  }
  commanded_speed_ = speed;
  drive_.begin(now);
  coasting_.end();
  wanted_speed_ = static_cast<float>(speed);
  flush_speed(now);
}

void Session::coast(int times, Instant now) noexcept {
  if (spinning_ && !stopping_.active()) stopping_.begin({}, commanded_speed_, false, now);
  stopping_.coasted(now);
  wanted_speed_.reset();
  spinning_ = false;
  let_go_.clear();
  drive_.end();
  coasting_.begin(exchange_, times, now);
}

void Session::stop(const StopSettings& settings, Instant now) {
  Stopping::check(settings);
  const double measured = polling_.speed();
  // Never faster than it turns: the motor may still be accelerating.
  const bool slower = std::isfinite(measured) && std::abs(measured) < std::abs(commanded_speed_);
  const double from = spinning_ ? (slower ? std::copysign(measured, commanded_speed_) : commanded_speed_)
                                : (std::isfinite(measured) ? measured : 0.0);
  const bool ramped = spinning_ && settings.deceleration.has_value();
  stopping_.begin(settings, from, ramped, now);
  if (!ramped) coast(1, now);
  service(now);
}

void Session::expire_lease(Instant now) {
  note(EventKind::motor_lease_expired, "no caller renewed the command in time", now);
  emergency_stop(now);
}

void Session::inquire(const std::vector<Inquiry>& inquiries, Instant now) {
  if (state_ != State::ready) throw std::logic_error("cannot ask before the module is connected");
  if (!inquiries_.done()) throw std::logic_error("the previous inquiry is not finished");
  Inquiries::check(inquiries);
  inquiries_.begin(inquiries);
  service(now);
}

void Session::receive(std::span<const std::uint8_t> bytes, Instant now) {
  check_drive(now);
  take_results(exchange_.receive(bytes, now), now);
  service(now);
}

void Session::advance(Instant now) {
  check_drive(now);
  take_results(exchange_.advance(now), now);
  service(now);
}

Instant Session::deadline() const noexcept {
  Instant earliest = std::min({exchange_.deadline(), coasting_.deadline(), polling_.deadline(), stopping_.deadline()});
  if (!let_go_.empty()) earliest = std::min(earliest, let_go_at_ + settings_.reply_timeout * kRestartTimeouts);
  return std::min(earliest, silence_limit());
}

void Session::take_results(std::span<const QueryResult> all, Instant now) {
  for (const QueryResult& result : all) {
    if (result.kind != QueryResult::Kind::timeout) last_reply_ = std::max(last_reply_, result.end);
    coasting_.take(result, exchange_);
    if (coasting_.confirmed()) stopping_.confirmed(result.end);
    if (state_ == State::connecting) connecting_.take(result);
    take_restart(result, now);
    check_mode(result, now);
    inquiries_.take(result);
    polling_.take(result, exchange_.counters());
    if (result.answers(entry<"brushless_drive.obs_velocity">))
      stopping_.measured(polling_.speed(), polling_.speed_time());
  }
}

void Session::take_restart(const QueryResult& result, Instant now) {
  if (state_ == State::failed || settings_.inspects) return;
  if (inquiries_.sets(result.entry())) return reset_watch_.expect_new_time();
  const auto sign = reset_watch_.take(result);
  if (!sign) return;
  ++exchange_.counters().module_resets;
  fail(EventKind::motor_reset, "the module restarted by itself: " + *sign + "; its settings are lost", now);
}

void Session::service(Instant now) {
  continue_stopping(now);
  continue_coasting(now);
  continue_connecting(now);
  flush_speed(now);
  polling_.advance(exchange_, now);
  if (state_ == State::ready) inquiries_.advance(exchange_, connecting_.system_control_id(), now);
  if (!coasting_.silent()) exchange_.ask_barrier(settings_.module_id, now);
  check_silence(now);
  conclude_let_go(now);
  judge_round_trip(now);
}

void Session::continue_stopping(Instant now) {
  stopping_.advance(now);
  const auto speed = stopping_.ramp(now);
  if (!speed) return;
  if (*speed == 0) return coast(1, now);
  wanted_speed_ = static_cast<float>(*speed);
}

void Session::continue_coasting(Instant now) {
  if (!coasting_.advance(exchange_, now)) return;
  ++exchange_.counters().unconfirmed_coasts;
  stopping_.end(StopReport::Outcome::unconfirmed);
  if (state_ != State::failed) {
    fail(state_ == State::connecting ? EventKind::motor_no_answer : EventKind::motor_coast_denied, why_no_answer(),
         now);
  }
}

void Session::continue_connecting(Instant now) {
  if (state_ != State::connecting || coasting_.pending()) return;
  connecting_.advance(exchange_, now);
  if (!connecting_.failure().empty()) {
    return fail(connecting_.another_module() ? EventKind::motor_another_module : EventKind::motor_no_answer,
                connecting_.failure(), now);
  }
  if (!connecting_.done()) return;
  state_ = State::ready;
  last_reply_ = now;
  if (settings_.inspects) return;
  if (!known_) armed_ = true;
  known_ = identity();
  polling_.begin(identity(), connecting_.system_control_id(), now);
  note(EventKind::motor_connected, identity().summary(), now);
}

void Session::flush_speed(Instant now) {
  if (!wanted_speed_ || !let_go_.empty() || !drive_.may_tell(exchange_, now)) return;
  const Packet packet = make(kVelocity, Access::set, settings_.module_id, *wanted_speed_);
  if (!exchange_.tell(TxQueue::Kind::motion, packet, now)) return;
  wanted_speed_.reset();
  drive_.told(exchange_.order(), now);
}

Instant Session::silence_limit() const noexcept {
  return state_ == State::ready && !settings_.inspects ? last_reply_ + settings_.reply_timeout * kSilentTimeouts
                                                       : kNever;
}

void Session::check_silence(Instant now) {
  if (now < silence_limit()) return;
  fail(EventKind::motor_silent,
       fmt::format("the module stopped answering: no reply for {:.2f} s", to_seconds(now - last_reply_)), now);
}

void Session::check_drive(Instant now) {
  const auto lapse = drive_.lapsed(last_reply_, now);
  if (!lapse) return;
  const double lasts = to_seconds(lapse->lasts);
  if (lapse->of_host)
    return fail(EventKind::motor_host_absent, fmt::format("this computer did not run kphi for {:.2g} s", lasts), now);
  fail(EventKind::motor_silent, fmt::format("the module stopped answering: no reply for {:.2g} s", lasts), now);
}

void Session::check_mode(const QueryResult& result, Instant now) {
  const auto mode = drive_.take(result);
  if (!mode || !spinning_ || !let_go_.empty()) return;
  let_go_ = fmt::format("the module stopped driving by itself: its drive mode reads {} where {:.0f} RPM were commanded",
                        *mode == DriveMode::coast ? "coast" : fmt::format("{}", static_cast<int>(*mode)),
                        std::abs(commanded_speed_) * 30 / std::numbers::pi);
  let_go_at_ = now;
  wanted_speed_.reset();
  exchange_.coast(settings_.module_id, 3, false, now);
  polling_.look_for_restart(now);
}

void Session::conclude_let_go(Instant now) {
  if (let_go_.empty() || now < let_go_at_ + settings_.reply_timeout * kRestartTimeouts) return;
  fail(EventKind::motor_let_go, std::exchange(let_go_, {}), now);
}

void Session::judge_round_trip(Instant now) {
  if (round_trip_judged_ || exchange_.round_trips().total() < judged_until_.total() + kRoundTrips) return;
  round_trip_judged_ = true;
  const Duration median = exchange_.round_trips().since(judged_until_).quantile(0.5);
  if (median <= settings_.reply_timeout / kSlowShare) return;
  note(
      EventKind::motor_slow_round_trip,
      fmt::format("slow line: median reply time {:.1f} ms, without wire time; set the adapter's latency timer to 1 ms, "
                  "or plug it into its own USB port",
                  1e3 * to_seconds(median)),
      now);
}

void Session::note(EventKind kind, const std::string& words, Instant now) {
  events_.push_back({kind, now.count(), 0, words});
}

std::string Session::why_no_answer() const {
  const Counters& counted = counters();
  if (counted.bytes_in == 0) return "nothing was received";
  if (counted.packets == 0) return "bytes were received, but no valid packet";
  if (counted.replies == 0 && counted.wrong_module > 0) return "only modules with another id answer";
  if (coasting_.last_mode() < 0) return "no reply to get brushless_drive.drive_mode";
  const bool sings = coasting_.last_mode() == static_cast<int>(DriveMode::phase_volts);
  return fmt::format("coast not confirmed: the drive mode last read {}{}", coasting_.last_mode(),
                     sings ? ": old firmware plays its song after a time-out; switch its supply off and on" : "");
}

}  // namespace kphi::iq
