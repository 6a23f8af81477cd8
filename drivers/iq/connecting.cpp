#include "drivers/iq/connecting.hpp"

#include <fmt/format.h>

namespace kphi::iq {
namespace {

constexpr int kOptionalAttempts = 2;

}  // namespace

Connecting::Connecting(const Settings& settings)
    : module_id_(settings.module_id), module_timeout_s_(settings.module_timeout_s) {}

void Connecting::begin(const std::optional<Identity>& known) {
  known_ = known;
  identity_ = {};
  identity_.system_control_id = module_id_;
  step_ = 0;
  open_.reset();
  asked_ = false;
  failure_.clear();
  another_module_ = false;
}

void Connecting::advance(Exchange& exchange, Instant now) {
  if (asked_ || !failure_.empty()) return;
  while (!done() && kScript[step_].kind == Step::Kind::legacy_coil && identity_.coil_temperature_client != 0) next();
  if (done()) return;
  if (!open_) open_ = inquiry();
  const auto& [wanted, set_to] = open_->inquiry();
  const int id = id_of(*wanted);
  asked_ = set_to ? exchange.tell_and_ask(*wanted, *set_to, id, now) : exchange.ask(*wanted, id, now);
}

void Connecting::take(const Heard& heard) {
  if (!asked_ || done() || &heard.entry() != kScript[step_].entry) return;
  asked_ = false;
  open_->take(heard.kind == Heard::Kind::answer ? std::optional(heard.value()) : std::nullopt);
  if (open_->done()) conclude(heard.kind == Heard::Kind::wrong_length ? "a reply of the wrong length" : "no reply");
}

void Connecting::conclude(const char* why_silent) {
  const Step& step = kScript[step_];
  const Reply reply = open_->reply();
  if (!reply.value) return take_silence(why_silent);
  if (step.sets() && !reply.accepted) {
    failure_ = fmt::format(
        "the module did not accept its communication timeout ({} reads {} instead of {}): it would keep spinning if "
        "this host died",
        step.entry->name, *reply.value, *wanted());
    return;
  }
  step.store(identity_, *reply.value);
  if (step.kind == Step::Kind::own_id) take_own_id(*reply.value);
  if (step.kind == Step::Kind::last_of_uid) compare_uid();
  next();
}

void Connecting::take_silence(const char* why) {
  const Step& step = kScript[step_];
  if (step.must_answer()) {
    failure_ = fmt::format("{} to get {}.{}", why, name_of(step.entry->type), step.entry->name);
  } else if (step.kind == Step::Kind::own_id && identity_.system_control_id != 0) {
    identity_.system_control_id = 0;
    open_.reset();
  } else {
    next();
  }
}

void Connecting::take_own_id(double id) {
  if (id == module_id_) return;
  failure_ = fmt::format("module {} answers on id {}: its other clients have that id; set module_id to {}", id,
                         identity_.system_control_id, id);
}

void Connecting::compare_uid() {
  if (!known_ || known_->same_module(identity_)) return;
  another_module_ = true;
  failure_ = fmt::format("another module answers, uid {} instead of {}", identity_.uid_text(), known_->uid_text());
}

void Connecting::next() noexcept {
  ++step_;
  open_.reset();
}

int Connecting::id_of(const Entry& asked) const noexcept {
  return asked.type == Client::system_control ? identity_.system_control_id : module_id_;
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
