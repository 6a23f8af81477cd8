#include "drivers/iq/session/stopping.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace kphi::iq {
namespace {

constexpr int kFewestAttempts = 5;
constexpr const Entry& kDriveMode = entry<"brushless_drive.drive_mode">;
constexpr int kUnderVoltage = 1 << static_cast<int>(FaultBit::under_voltage);
constexpr Duration kRampStep = std::chrono::milliseconds(20);
constexpr double kSlowestClock = 0.9, kUptimeSlack_s = 0.1;  // of a module's uptime
constexpr double kFalling = 0.95;                            ///< of the speed at the coast

std::string rpm(double rad_s) { return fmt::format("{:.0f} RPM", std::abs(rad_s) * 30 / std::numbers::pi); }

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
  denials_ = 0;
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
    // At once if the query was lost or older than the coast; otherwise the module gets some time, and another coast.
    const bool denied = answered && asked_afterwards;
    blocked_ = false;
    ask_at_ = denied ? result.end + exchange.timeout() / 10 : result.end;
    if (denied && ++denials_ > 1) next_ = std::min(next_, ask_at_);
  }
}

bool Coasting::advance(Exchange& exchange, Instant now) noexcept {
  if (!pending_) return false;
  if (now >= next_) {
    if (!silent() && has_tried_enough(now)) {
      attempts_ = 0;
      ask_at_ = kNever;
      next_ = now + silence_;
      return true;
    }
    if (silent()) {
      begun_ = now;
      denials_ = 0;
    }
    ++attempts_;
    exchange.coast(module_id_, 1, true, now);
    next_ = now + exchange.timeout();
    ask_at_ = now;
  }
  if (now >= ask_at_) ask(exchange, now);
  return false;
}

bool Coasting::has_tried_enough(Instant now) const noexcept {
  const Duration tried = now - begun_;
  return (attempts_ >= kFewestAttempts && tried >= reply_timeout_ * kFewestAttempts) ||
         (denials_ >= kFewestAttempts && tried >= reply_timeout_ / 2);
}

void Coasting::ask(Exchange& exchange, Instant now) noexcept {
  blocked_ = !exchange.ask(kDriveMode, module_id_, now);
  ask_at_ = blocked_ ? now : kNever;
}

std::string StopReport::summary() const {
  const std::string coast = time_to_coast ? fmt::format("coast confirmed after {:.2f} s", to_seconds(*time_to_coast))
                                          : std::string("coast NOT CONFIRMED");
  if (outcome == Outcome::standing)
    return fmt::format("{}, at rest after {:.1f} s", coast, to_seconds(time_to_standing.value_or(Duration(0))));
  if (outcome == Outcome::slowing) return fmt::format("{}, slowing down at {}", coast, rpm(speed_at_end));
  if (outcome == Outcome::turning)
    return fmt::format("{}, but STILL TURNING at {}: cut its power", coast, rpm(speed_at_end));
  if (outcome == Outcome::unseen) return coast + ", but its speed was not read afterwards: it may still be turning";
  if (outcome == Outcome::overruled) return "coast overruled by a new speed";
  return coast +
         ": it MAY BE TURNING, cut its power at the switch; without orders its module stops driving after 0.5 s";
}

void Stopping::check(const StopSettings& settings) {
  const double deceleration = settings.deceleration.value_or(1000);
  const bool good = deceleration >= 100 && deceleration <= 1e5 && settings.coast_below >= 0 &&
                    settings.coast_below <= 1e4 && settings.standing_below > 0 && settings.limit > Duration{0};
  if (!good) throw std::invalid_argument("a stop needs a deceleration of 100..100000 rad/s² and speeds above zero");
}

void Stopping::begin(const StopSettings& settings, double speed, bool ramped, Instant now) noexcept {
  settings_ = settings;
  phase_ = ramped ? Phase::ramping : Phase::coasting;
  asked_ = next_ = coasted_ = now;
  speed_at_coast_ = speed_ = speed;
  measured_after_coast_ = false;
  report_.reset();
  open_ = {};
  open_.speed_at_start = speed;
}

std::optional<double> Stopping::ramp(Instant now) noexcept {
  if (phase_ != Phase::ramping || now < next_) return std::nullopt;
  next_ = now + kRampStep;
  const double left = std::abs(open_.speed_at_start) - *settings_.deceleration * to_seconds(now - asked_);
  return left > settings_.coast_below ? std::copysign(left, open_.speed_at_start) : 0.0;
}

void Stopping::coasted(Instant now) noexcept {
  if (phase_ != Phase::ramping) return;
  phase_ = Phase::coasting;
  coasted_ = now;
  speed_at_coast_ = speed_;
}

void Stopping::confirmed(Instant now) noexcept {
  if (phase_ == Phase::coasting && !open_.time_to_coast) open_.time_to_coast = now - asked_;
}

void Stopping::measured(double speed, Instant time) noexcept {
  if (phase_ == Phase::none) return;
  speed_ = speed;
  if (phase_ != Phase::coasting || time < coasted_) return;
  if (!measured_after_coast_) speed_at_coast_ = speed;
  measured_after_coast_ = true;
  if (std::abs(speed) < settings_.standing_below && !open_.time_to_standing) open_.time_to_standing = time - asked_;
}

void Stopping::advance(Instant now) noexcept {
  if (phase_ != Phase::coasting) return;
  if (open_.time_to_coast && open_.time_to_standing) return end(StopReport::Outcome::standing);
  if (now < coasted_ + settings_.limit) return;
  if (!open_.time_to_coast) return end(StopReport::Outcome::unconfirmed);
  if (!measured_after_coast_) return end(StopReport::Outcome::unseen);
  const bool falling = std::abs(speed_) < kFalling * std::abs(speed_at_coast_);
  end(falling ? StopReport::Outcome::slowing : StopReport::Outcome::turning);
}

void Stopping::end(StopReport::Outcome outcome) noexcept {
  if (phase_ == Phase::none) return;
  phase_ = Phase::none;
  open_.outcome = outcome;
  open_.speed_at_end = speed_;
  report_ = open_;
}

Instant Stopping::deadline() const noexcept {
  if (phase_ == Phase::ramping) return next_;
  return phase_ == Phase::coasting ? coasted_ + settings_.limit : kNever;
}

void DriveWatch::begin(Instant now) noexcept {
  if (watching_) return;
  watching_ = true;
  order_.reset();
  served_ = now;
}

void DriveWatch::told(std::uint64_t order, Instant now) noexcept {
  if (!order_) told_at_ = now;
  order_ = order;
  drives_at_.reset();
}

bool DriveWatch::may_tell(Exchange& exchange, Instant now) noexcept {
  if (!order_ || (drives_at_ && now - *drives_at_ <= fresh_)) return true;
  (void)exchange.ask(kDriveMode, module_id_, now);
  return false;
}

std::optional<DriveMode> DriveWatch::take(const QueryResult& result) noexcept {
  if (!watching_ || !order_ || !result.answers(kDriveMode) || result.request.order < *order_) return std::nullopt;
  const auto mode = static_cast<DriveMode>(static_cast<int>(result.value()));
  if (mode == DriveMode::spin_pwm || mode == DriveMode::spin_volts) {
    drives_at_ = result.end;
    return std::nullopt;
  }
  if (result.request.started < told_at_ + settles_) return std::nullopt;
  return mode;
}

std::optional<DriveWatch::Lapse> DriveWatch::lapsed(Instant last_reply, Instant now) noexcept {
  const Instant before = std::exchange(served_, now);
  if (!watching_) return std::nullopt;
  if (now - before > longest_) return Lapse{true, now - before};
  const Duration unheard = now - std::max(last_reply, told_at_);
  return unheard > longest_ ? std::optional(Lapse{false, unheard}) : std::nullopt;
}

std::optional<std::string> ResetWatch::take(const QueryResult& result) {
  if (result.answers(entry<"system_control.time">) && std::isfinite(result.value())) {
    const auto before = std::exchange(uptime_, Uptime{result.value(), result.time + result.uncertainty});
    if (!before) return std::nullopt;
    if (result.value() < before->seconds)
      return fmt::format("its uptime went from {:.3f} s back to {:.3f} s", before->seconds, result.value());
    // One that restarts soon after it was switched on has counted further by the next look than by the last. Not one
    // that repeats itself.
    const double passed_s = to_seconds(result.time - result.uncertainty - before->latest);
    if (result.value() > before->seconds &&
        result.value() < before->seconds + kSlowestClock * passed_s - kUptimeSlack_s)
      return fmt::format("its uptime went from {:.3f} s to {:.3f} s, where {:.3f} s have passed", before->seconds,
                         result.value(), passed_s);
  }
  if (result.answers(entry<"power_safety.fault_ever">)) {
    const int now = static_cast<int>(result.value()), before = std::exchange(faults_, now).value_or(now);
    if ((now & ~before & kUnderVoltage) != 0) return "it reports an under-voltage (fault bit 0)";
  }
  return std::nullopt;
}

}  // namespace kphi::iq
