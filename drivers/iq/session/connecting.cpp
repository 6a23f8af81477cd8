#include "drivers/iq/session/connecting.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace kphi::iq {

void OpenInquiry::advance(Exchange& exchange, int module_id, Instant now) {
  if (asked_ || done()) return;
  const auto& [wanted, set_to] = inquiry_;
  asked_ = set_to ? exchange.tell_and_ask(*wanted, *set_to, module_id, now) : exchange.ask(*wanted, module_id, now);
}

bool OpenInquiry::take(const QueryResult& result) noexcept {
  if (!asked_ || &result.entry() != inquiry_.entry) return false;
  asked_ = false;
  reply_.time = result.time;
  reply_.uncertainty = result.uncertainty;
  take(result.kind == QueryResult::Kind::answer ? std::optional(result.value()) : std::nullopt);
  return true;
}

void OpenInquiry::take(std::optional<double> answer) noexcept {
  --attempts_;
  if (!answer) return;
  reply_.value = answer;
  reply_.accepted = inquiry_.set_to && is_as_set(*inquiry_.entry, *inquiry_.set_to, *answer);
  if (!inquiry_.set_to || reply_.accepted) attempts_ = 0;
}

void Inquiries::check(const std::vector<Inquiry>& inquiries) {
  for (const Inquiry& inquiry : inquiries) {
    const Entry& wanted = *inquiry.entry;
    if (!wanted.allows(Access::get))
      throw std::invalid_argument(fmt::format("{} cannot be read as a number", wanted.path));
    if (inquiry.set_to && !is_volatile_setting(wanted))
      throw std::invalid_argument(fmt::format("{} must not be set in passing", wanted.path));
  }
}

void Inquiries::advance(Exchange& exchange, int system_control_id, Instant now) {
  for (OpenInquiry& one : open_) {
    const bool of_system = one.inquiry().entry->type == Client::system_control;
    one.advance(exchange, of_system ? system_control_id : module_id_, now);
  }
}

void Inquiries::take(const QueryResult& result) {
  (void)std::ranges::any_of(open_, [&](OpenInquiry& one) { return one.take(result); });
}

bool Inquiries::done() const noexcept { return std::ranges::all_of(open_, &OpenInquiry::done); }

bool Inquiries::sets(const Entry& wanted) const noexcept {
  return std::ranges::any_of(open_, [&](const OpenInquiry& one) {
    return !one.done() && one.inquiry().entry == &wanted && one.inquiry().set_to;
  });
}

void Inquiries::abandon() noexcept {
  for (OpenInquiry& one : open_) one.give_up();
}

std::vector<Reply> Inquiries::replies() const {
  std::vector<Reply> all;
  for (const OpenInquiry& one : open_) all.push_back(one.reply());
  return all;
}

namespace {

constexpr int kOptionalAttempts = 2;

/// What is asked and set at connection, in this order, after the coast is confirmed.
struct Step {
  enum class Kind {
    own_id,       ///< must be the id that is being spoken to; old firmware answers on id 0 only, or not at all
    required,     ///< no answer: the connection fails
    last_of_uid,  ///< as required; afterwards a different module is refused, before anything is set in it
    optional,     ///< no answer: an older firmware; continue
    legacy_coil,  ///< only asked when the newer client did not answer
    set_timeout,  ///< set to Settings::module_timeout_s, then read back; required
    set_zero,     ///< set to 0, then read back; firmware without the entry stays silent and is accepted
  };
  const Entry* entry;
  Kind kind;

  [[nodiscard]] constexpr bool sets() const noexcept { return kind == Kind::set_timeout || kind == Kind::set_zero; }
  [[nodiscard]] constexpr bool must_answer() const noexcept {
    return kind == Kind::required || kind == Kind::last_of_uid || kind == Kind::set_timeout;
  }
};

constexpr Step kScript[] = {
    {&entry<"system_control.module_id">, Step::Kind::own_id},
    {&entry<"system_control.uid1">, Step::Kind::required},
    {&entry<"system_control.uid2">, Step::Kind::required},
    {&entry<"system_control.uid3">, Step::Kind::last_of_uid},
    // Before anything is set: a restart from here on is noticed by the first poll.
    {&entry<"system_control.time">, Step::Kind::optional},
    {&entry<"propeller_motor_control.timeout">, Step::Kind::set_timeout},
    {&entry<"propeller_motor_control.timeout_behavior">, Step::Kind::set_zero},
    {&entry<"propeller_motor_control.timeout_song_option">, Step::Kind::set_zero},
    {&entry<"system_control.firmware_version">, Step::Kind::required},
    {&entry<"system_control.hardware_version">, Step::Kind::required},
    {&entry<"system_control.electronics_version">, Step::Kind::required},
    {&entry<"brushless_drive.motor_pole_pairs">, Step::Kind::optional},
    {&entry<"brushless_drive.motor_Kv">, Step::Kind::optional},
    {&entry<"power_safety.fault_now">, Step::Kind::optional},
    {&entry<"power_safety.fault_ever">, Step::Kind::optional},
    {&entry<"coil_temperature_estimator.t_coil">, Step::Kind::optional},
    {&entry<"temperature_estimator.temp">, Step::Kind::legacy_coil},
};

}  // namespace

Connecting::Connecting(const Settings& settings)
    : module_id_(settings.module_id),
      module_timeout_s_(settings.module_timeout_s),
      system_control_id_(settings.module_id) {}

void Connecting::begin(const std::optional<AuditRecord>& known) {
  known_ = known;
  identity_ = {};
  system_control_id_ = module_id_;
  step_ = 0;
  open_.reset();
  failure_.clear();
  another_module_ = false;
}

void Connecting::skip() noexcept { step_ = std::size(kScript); }

bool Connecting::done() const noexcept { return step_ == std::size(kScript); }

void Connecting::advance(Exchange& exchange, Instant now) {
  if (!failure_.empty()) return;
  while (!done() && kScript[step_].kind == Step::Kind::legacy_coil && identity_.coil_temperature_client() != 0) next();
  if (done()) return;
  if (!open_) open_ = inquiry();
  const bool of_system = kScript[step_].entry->type == Client::system_control;
  open_->advance(exchange, of_system ? system_control_id_ : module_id_, now);
}

void Connecting::take(const QueryResult& result) {
  if (!open_ || !open_->take(result) || !open_->done()) return;
  conclude(result.kind == QueryResult::Kind::wrong_length ? "a reply of the wrong length" : "no reply");
}

void Connecting::conclude(const char* why_silent) {
  const Step& step = kScript[step_];
  const Reply reply = open_->reply();
  if (!reply.value) return take_silence(why_silent);
  if (step.sets() && !reply.accepted) {
    failure_ = fmt::format(
        "the module did not accept its communication timeout ({} reads {} instead of {}): the motor would keep "
        "turning if this computer stopped",
        step.entry->name(), *reply.value, *wanted());
    return;
  }
  identity_.values[step.entry] = *reply.value;
  if (step.kind == Step::Kind::own_id) take_own_id(*reply.value);
  if (step.kind == Step::Kind::last_of_uid) compare_uid();
  next();
}

void Connecting::take_silence(const char* why) {
  const Step& step = kScript[step_];
  if (step.must_answer()) {
    failure_ = fmt::format("{} to get {}", why, step.entry->path);
  } else if (step.kind == Step::Kind::own_id && system_control_id_ != 0) {
    system_control_id_ = 0;
    open_.reset();
  } else {
    next();
  }
}

void Connecting::take_own_id(double id) {
  if (id == module_id_) return;
  failure_ = fmt::format("module {} answers on id {}: its other clients have that id; set module_id to {}", id,
                         system_control_id_, id);
}

void Connecting::compare_uid() {
  if (!known_ || known_->uid() == identity_.uid()) return;
  another_module_ = true;
  failure_ = fmt::format("another module answers, uid {} instead of {}", identity_.uid(), known_->uid());
}

void Connecting::next() noexcept {
  ++step_;
  open_.reset();
}

std::optional<double> Connecting::wanted() const noexcept {
  const Step& step = kScript[step_];
  if (!step.sets()) return std::nullopt;
  return step.kind == Step::Kind::set_timeout ? module_timeout_s_ : 0;
}

OpenInquiry Connecting::inquiry() const noexcept {
  const Step& step = kScript[step_];
  const bool vital = step.must_answer() || step.sets();
  return OpenInquiry({step.entry, wanted()}, vital ? OpenInquiry::kAttempts : kOptionalAttempts);
}

}  // namespace kphi::iq
