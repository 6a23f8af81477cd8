#include "drivers/iq/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/iq/script.hpp"

namespace kphi::iq {
namespace {

constexpr std::size_t kReadings = 4096;
constexpr int kCoastAttempts = 5;
constexpr int kRequiredAttempts = 3;
constexpr int kOptionalAttempts = 2;
constexpr int kSilentTimeouts = 10;  ///< reply time-outs without any reply after which the module counts as gone
constexpr std::size_t kGetFrame = 7;
constexpr std::size_t kVelocityFrame = 11;
constexpr std::size_t kSetAndGet = 18;

constexpr const Entry& kVelocity = entry<"propeller_motor_control.ctrl_velocity">;
constexpr const Entry& kDriveMode = entry<"brushless_drive.drive_mode">;
constexpr Quantity kSlow[] = {Quantity::supply_voltage,   Quantity::supply_current, Quantity::motor_current,
                              Quantity::coil_temperature, Quantity::derate,         Quantity::drive_mode};
constexpr std::size_t kSlowCount = std::size(kSlow);

const Settings& checked(const Settings& settings) {
  if (settings.module_id < static_cast<int>(ModuleId::first) || settings.module_id > static_cast<int>(ModuleId::last)) {
    throw std::invalid_argument(fmt::format("module id {} is not in 0..62", settings.module_id));
  }
  if (!(settings.telemetry_hz > 0 && settings.telemetry_hz <= 1e5)) {
    throw std::invalid_argument(fmt::format("telemetry rate {} Hz is not in 0..100000", settings.telemetry_hz));
  }
  if (!(settings.module_timeout_s > 0) || !std::isfinite(settings.module_timeout_s)) {
    throw std::invalid_argument(fmt::format("module timeout {} s is not above 0", settings.module_timeout_s));
  }
  if (settings.credit_bytes < kSetAndGet) throw std::invalid_argument("less credit than a set and its read-back need");
  return settings;
}

Settings completed(Settings settings) {
  if (settings.reply_timeout <= Duration{0}) settings.reply_timeout = std::chrono::milliseconds(100);
  if (settings.longest_silence <= Duration{0}) settings.longest_silence = from_seconds(settings.module_timeout_s);
  return settings;
}

std::optional<Quantity> quantity_of(const Entry& asked) noexcept {
  if (&asked == &entry<"brushless_drive.obs_velocity">) return Quantity::speed;
  if (&asked == &entry<"power_monitor.volts">) return Quantity::supply_voltage;
  if (&asked == &entry<"power_monitor.amps">) return Quantity::supply_current;
  if (&asked == &entry<"brushless_drive.est_motor_amps">) return Quantity::motor_current;
  if (&asked == &entry<"coil_temperature_estimator.t_coil">) return Quantity::coil_temperature;
  if (&asked == &entry<"temperature_estimator.temp">) return Quantity::coil_temperature;
  if (&asked == &entry<"brushless_drive.derate">) return Quantity::derate;
  if (&asked == &kDriveMode) return Quantity::drive_mode;
  return std::nullopt;
}

}  // namespace

Session::Session(Settings settings)
    : settings_(completed(checked(settings))), requests_(settings_.reply_timeout), readings_(kReadings) {}

void Session::connect(Instant now) {
  state_ = State::connecting;
  failure_.clear();
  identity_ = {};
  parser_.reset();
  partial_since_ = kNever;
  last_reply_ = now;
  step_ = 0;
  step_asked_ = false;
  step_attempts_ = 0;
  step_failure_.clear();
  last_drive_mode_ = -1;
  coast_pending_ = false;
  coast(now);
  service(now);
}

void Session::spin_at(RadPerSec signed_speed, Instant now) {
  const double speed = signed_speed.value();
  if (!(std::abs(speed) <= kVelocity.max)) {
    throw std::invalid_argument(fmt::format("speed {} rad/s is not within ±{} rad/s", speed, kVelocity.max));
  }
  if (state_ != State::ready) throw std::logic_error("the motor may only spin when its module is ready");
  if (speed == 0) return coast(now);
  spinning_ = true;
  coast_pending_ = false;
  coast_confirmed_ = false;
  wanted_speed_ = static_cast<float>(speed);
  flush_speed(now);
}

void Session::coast(Instant now) noexcept {
  wanted_speed_.reset();
  spinning_ = false;
  send_coast(now);
  if (coast_pending_) return;
  coast_pending_ = true;
  coast_confirmed_ = false;
  coast_order_ = order_;
  coast_attempts_ = 1;
  coast_next_ = now + settings_.reply_timeout;
  coast_ask_at_ = now;
  if (!requests_.busy(kDriveMode) && ask(kDriveMode, now)) coast_ask_at_ = kNever;
}

void Session::receive(std::span<const std::uint8_t> bytes, Instant now) {
  parser_.push(bytes, [&](const Packet& packet, std::size_t behind) {
    take_packet(packet, now - settings_.wire_byte_time * static_cast<std::int64_t>(behind));
  });
  watch_partial(now);
  service(now);
}

void Session::advance(Instant now) {
  while (parser_.partial() && now - partial_since_ >= patience()) {
    ++counters_.resyncs;
    parser_.abandon([&](const Packet& packet, std::size_t) { take_packet(packet, now); });
    partial_since_ = now;
  }
  watch_partial(now);
  requests_.expire(now, [&](const Request& request) { take_timeout(request, now); });
  service(now);
}

void Session::sent(std::size_t n) noexcept {
  counters_.bytes_out += n;
  outbox_.sent(n);
}

Instant Session::deadline() const noexcept {
  Instant earliest = requests_.deadline();
  if (parser_.partial()) earliest = std::min(earliest, partial_since_ + patience());
  if (coast_pending_) {
    earliest = std::min(earliest, coast_next_);
    if (!requests_.busy(kDriveMode)) earliest = std::min(earliest, coast_ask_at_);
  }
  if (state_ == State::ready) {
    earliest = std::min({earliest, next_poll_, last_reply_ + settings_.reply_timeout * kSilentTimeouts});
  }
  return earliest;
}

std::size_t Session::take(std::span<Reading> out) {
  const std::size_t n = std::min(out.size(), readings_.size());
  std::copy_n(readings_.begin(), n, out.begin());
  readings_.erase_begin(n);
  return n;
}

void Session::take_packet(const Packet& packet, Instant end) {
  if (!packet.standard() || packet.access() != Access::reply) {
    ++counters_.unasked;
    return;
  }
  if (packet.module_id() != settings_.module_id) {
    ++counters_.wrong_module;
    return;
  }
  const auto answer = requests_.answer(packet.type, packet.sub());
  if (!answer) {
    ++counters_.unasked;
    return;
  }
  if (answer->late) {
    ++counters_.late_replies;
    return;
  }
  ++counters_.replies;
  last_reply_ = std::max(last_reply_, end);
  take_answer(answer->request, packet, end);
}

void Session::take_answer(const Request& request, const Packet& packet, Instant end) {
  const Entry& asked = *request.entry;
  if (packet.data().size() != size_of(asked.format)) {
    ++counters_.wrong_length;
    if (step_asked_ && &asked == kScript[step_].entry) fail_step("a reply of the wrong length");
    return;
  }
  const double value = number(asked.format, packet.data());
  if (!std::isfinite(value)) ++counters_.bad_values;
  if (state_ == State::connecting && step_asked_ && &asked == kScript[step_].entry) {
    take_step_answer(request, packet);
  }
  if (&asked == &kDriveMode) take_drive_mode(request, value, end);
  if (std::isfinite(value)) take_reading(request, value, packet.length + kFrameOverhead, end);
}

void Session::take_reading(const Request& request, double value, std::size_t reply_bytes, Instant end) {
  const auto quantity = quantity_of(*request.entry);
  if (!quantity) return;
  if (*quantity == Quantity::derate) value /= 65536;
  Instant from = request.started + settings_.wire_byte_time * static_cast<std::int64_t>(request.bytes);
  Instant to = end - settings_.wire_byte_time * static_cast<std::int64_t>(reply_bytes);
  // A link without real wire time (a pseudo-terminal) can answer sooner than bytes would take.
  if (to < from) {
    from = std::min(request.queued, end);
    to = end;
  }
  const Reading reading{*quantity, value, from + (to - from) / 2, (to - from) / 2};
  if (readings_.full()) ++counters_.dropped_readings;
  readings_.push_back(reading);
  newest_reading_ = std::max(newest_reading_, reading.time);
}

void Session::take_drive_mode(const Request& request, double mode, Instant now) {
  last_drive_mode_ = static_cast<int>(mode);
  if (!coast_pending_) return;
  if (request.order > coast_order_ && last_drive_mode_ == static_cast<int>(DriveMode::coast)) {
    coast_pending_ = false;
    coast_confirmed_ = true;
    return;
  }
  // At once if the question was older than the coast; else the module gets a moment.
  coast_ask_at_ = request.order > coast_order_ ? now + settings_.reply_timeout / 10 : now;
}

void Session::take_step_answer(const Request& request, const Packet& packet) {
  const Step& step = kScript[step_];
  if (step.sets()) {
    const double wanted = step.kind == Step::Kind::set_timeout ? settings_.module_timeout_s : 0;
    const Packet expected = make(*request.entry, Access::reply, settings_.module_id, wanted);
    if (!(packet == expected)) {
      step_asked_ = false;
      if (++step_attempts_ >= kRequiredAttempts) {
        step_failure_ = fmt::format(
            "the module did not accept its communication timeout ({} reads {} instead of {}): it would keep spinning "
            "if this host died",
            request.entry->name, number(request.entry->format, packet.data()), wanted);
      }
      return;
    }
  }
  step.store(identity_, number(request.entry->format, packet.data()));
  ++step_;
  step_asked_ = false;
  step_attempts_ = 0;
}

void Session::take_timeout(const Request& request, Instant now) {
  ++counters_.timeouts;
  if (request.entry == &kDriveMode && coast_pending_) coast_ask_at_ = now;
  if (state_ != State::connecting || !step_asked_ || request.entry != kScript[step_].entry) return;
  fail_step("no reply");
}

void Session::fail_step(const char* why) {
  const Step& step = kScript[step_];
  step_asked_ = false;
  if (++step_attempts_ < (step.must_answer() || step.sets() ? kRequiredAttempts : kOptionalAttempts)) return;
  step_attempts_ = 0;
  if (step.must_answer()) {
    step_failure_ = fmt::format("{} to get {}.{}", why, name_of(step.entry->type), step.entry->name);
  } else {
    ++step_;
  }
}

// A USB adapter may hand over the second half of a frame 16 ms after the first.
Duration Session::patience() const noexcept {
  return std::max(settings_.reply_timeout / 4, settings_.wire_byte_time * static_cast<std::int64_t>(kMaxFrame));
}

void Session::watch_partial(Instant now) {
  if (!parser_.partial()) {
    partial_since_ = kNever;
  } else if (partial_since_ == kNever || parser_.partial_offset() != partial_offset_) {
    partial_since_ = now;
  }
  partial_offset_ = parser_.partial_offset();
  count_parser();
}

void Session::count_parser() noexcept {
  const Parser::Counters& parsed = parser_.counters();
  counters_.bytes_in = parsed.bytes;
  counters_.packets = parsed.packets;
  counters_.crc_errors = parsed.crc_errors;
  counters_.refused_lengths = parsed.refused_lengths;
  counters_.discarded_bytes = parsed.discarded_bytes;
}

void Session::service(Instant now) {
  continue_coasting(now);
  continue_connecting(now);
  flush_speed(now);
  poll(now);
  check_silence(now);
}

void Session::continue_coasting(Instant now) {
  if (!coast_pending_) return;
  if (now >= coast_next_) {
    if (coast_attempts_ >= kCoastAttempts) {
      // Silence, so that the module's own timeout can end the motion.
      coast_attempts_ = 0;
      coast_ask_at_ = kNever;
      coast_next_ = now + settings_.longest_silence * 3 / 2 + settings_.reply_timeout;
      ++counters_.unconfirmed_coasts;
      if (state_ != State::failed) fail(why_no_answer(), now);
      return;
    }
    ++coast_attempts_;
    send_coast(now);
    coast_next_ = now + settings_.reply_timeout;
    coast_ask_at_ = now;
  }
  if (now < coast_ask_at_ || requests_.busy(kDriveMode)) return;
  coast_ask_at_ = ask(kDriveMode, now) ? kNever : now + settings_.reply_timeout / 10;
}

void Session::continue_connecting(Instant now) {
  if (state_ != State::connecting || coast_pending_) return;
  if (!step_failure_.empty()) {
    fail(std::exchange(step_failure_, {}), now);
    return;
  }
  if (step_asked_) return;
  while (step_ < std::size(kScript) && kScript[step_].kind == Step::Kind::legacy_coil &&
         identity_.coil_temperature_client != 0) {
    ++step_;
  }
  if (step_ == std::size(kScript)) {
    state_ = State::ready;
    next_poll_ = now;
    last_reply_ = now;
    return;
  }
  const Step& step = kScript[step_];
  if (requests_.busy(*step.entry) || !fits(kSetAndGet)) return;
  if (step.sets()) {
    const double wanted = step.kind == Step::Kind::set_timeout ? settings_.module_timeout_s : 0;
    tell(Outbox::Kind::setting, make(*step.entry, Access::set, settings_.module_id, wanted), now);
  }
  step_asked_ = ask(*step.entry, now);
}

void Session::flush_speed(Instant now) {
  if (!wanted_speed_ || !fits(kVelocityFrame)) return;
  const Packet packet = make(kVelocity, Access::set, settings_.module_id, *wanted_speed_);
  if (tell(Outbox::Kind::motion, packet, now)) wanted_speed_.reset();
}

void Session::poll(Instant now) {
  if (state_ != State::ready || now < next_poll_) return;
  const Duration period = from_seconds(1 / settings_.telemetry_hz);
  next_poll_ = next_poll_ + period > now ? next_poll_ + period : now + period;
  for (const Quantity quantity : {Quantity::speed, kSlow[turn_]}) {
    const Entry* polled = entry_of(quantity);
    if (polled != nullptr && !ask(*polled, now)) ++counters_.skipped_polls;
  }
  turn_ = (turn_ + 1) % static_cast<int>(kSlowCount);
}

void Session::check_silence(Instant now) {
  if (state_ != State::ready || now - last_reply_ < settings_.reply_timeout * kSilentTimeouts) return;
  fail(fmt::format("the module stopped answering: no reply for {:.2f} s", to_seconds(now - last_reply_)), now);
}

void Session::fail(const std::string& why, Instant now) {
  state_ = State::failed;
  failure_ = why;
  if (!coast_pending_) coast(now);
}

std::string Session::why_no_answer() const {
  if (counters_.bytes_in == 0) return "nothing was received";
  if (counters_.packets == 0) return "bytes were received, but no valid packet";
  if (counters_.replies == 0 && counters_.wrong_module > 0) return "only modules with another id answer";
  if (last_drive_mode_ < 0) return "no reply to get brushless_drive.drive_mode";
  return fmt::format("the module does not confirm that it coasts (its drive mode last read {})", last_drive_mode_);
}

bool Session::ask(const Entry& asked, Instant now) noexcept {
  if (requests_.busy(asked) || requests_.full() || !fits(kGetFrame)) return false;
  if (!outbox_.push(Outbox::Kind::request, make(asked, Access::get, settings_.module_id))) return false;
  requests_.add(on_wire(&asked, kGetFrame, now));
  ++counters_.requests;
  return true;
}

bool Session::tell(Outbox::Kind kind, const Packet& packet, Instant now) noexcept {
  if (!outbox_.push(kind, packet)) return false;
  requests_.add(on_wire(nullptr, packet.length + kFrameOverhead, now));
  return true;
}

void Session::send_coast(Instant now) noexcept {
  const Packet packet = make(entry<"propeller_motor_control.ctrl_coast">, Access::set, settings_.module_id);
  outbox_.push_coast(packet);
  on_wire(nullptr, packet.length + kFrameOverhead, now);
  ++counters_.coasts;
}

Request Session::on_wire(const Entry* asked, std::size_t bytes, Instant now) noexcept {
  Request request{asked, bytes, ++order_, now, std::max(now, wire_free_)};
  wire_free_ = request.started + settings_.wire_byte_time * static_cast<std::int64_t>(bytes);
  return request;
}

bool Session::fits(std::size_t bytes) const noexcept {
  return requests_.outstanding_bytes() + bytes <= settings_.credit_bytes;
}

const Entry* Session::entry_of(Quantity quantity) const noexcept {
  switch (quantity) {
    case Quantity::speed:
      return &entry<"brushless_drive.obs_velocity">;
    case Quantity::supply_voltage:
      return &entry<"power_monitor.volts">;
    case Quantity::supply_current:
      return &entry<"power_monitor.amps">;
    case Quantity::motor_current:
      return &entry<"brushless_drive.est_motor_amps">;
    case Quantity::coil_temperature:
      if (identity_.coil_temperature_client == 83) return &entry<"coil_temperature_estimator.t_coil">;
      if (identity_.coil_temperature_client == 77) return &entry<"temperature_estimator.temp">;
      return nullptr;
    case Quantity::derate:
      return &entry<"brushless_drive.derate">;
    case Quantity::drive_mode:
      return &kDriveMode;
  }
  return nullptr;
}

}  // namespace kphi::iq
