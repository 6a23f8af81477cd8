#include "drivers/iq/connecting.hpp"

#include <fmt/format.h>

namespace kphi::iq {
namespace {

constexpr int kRequiredAttempts = 3;
constexpr int kOptionalAttempts = 2;

}  // namespace

Connecting::Connecting(const Settings& settings)
    : module_id_(settings.module_id), module_timeout_s_(settings.module_timeout_s) {}

void Connecting::begin(const std::optional<Identity>& known) {
  known_ = known;
  identity_ = {};
  identity_.system_control_id = module_id_;
  step_ = 0;
  asked_ = false;
  attempts_ = 0;
  failure_.clear();
  another_module_ = false;
}

void Connecting::advance(Exchange& exchange, Instant now) {
  if (asked_ || !failure_.empty()) return;
  while (!done() && kScript[step_].kind == Step::Kind::legacy_coil && identity_.coil_temperature_client != 0) next();
  if (done()) return;
  const Step& step = kScript[step_];
  const int id = id_of(*step.entry);
  asked_ = step.sets() ? exchange.tell_and_ask(*step.entry, wanted(), id, now) : exchange.ask(*step.entry, id, now);
}

void Connecting::take(const Heard& heard) {
  if (!asked_ || done() || &heard.entry() != kScript[step_].entry) return;
  asked_ = false;
  switch (heard.kind) {
    case Heard::Kind::answer:
      return take_answer(heard);
    case Heard::Kind::wrong_length:
      return fail_attempt("a reply of the wrong length");
    case Heard::Kind::timeout:
      return fail_attempt("no reply");
  }
}

void Connecting::take_answer(const Heard& heard) {
  const Step& step = kScript[step_];
  if (step.sets() && !is_as_set(*step.entry, wanted(), heard.value())) {
    if (++attempts_ < kRequiredAttempts) return;
    failure_ = fmt::format(
        "the module did not accept its communication timeout ({} reads {} instead of {}): it would keep spinning if "
        "this host died",
        step.entry->name, heard.value(), wanted());
    return;
  }
  step.store(identity_, heard.value());
  if (step.kind == Step::Kind::own_id) take_own_id(heard.value());
  if (step.kind == Step::Kind::last_of_uid) compare_uid();
  next();
}

void Connecting::fail_attempt(const char* why) {
  const Step& step = kScript[step_];
  if (++attempts_ < (step.must_answer() || step.sets() ? kRequiredAttempts : kOptionalAttempts)) return;
  if (step.must_answer()) {
    failure_ = fmt::format("{} to get {}.{}", why, name_of(step.entry->type), step.entry->name);
  } else if (step.kind == Step::Kind::own_id && identity_.system_control_id != 0) {
    identity_.system_control_id = 0;
    attempts_ = 0;
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
  attempts_ = 0;
}

int Connecting::id_of(const Entry& asked) const noexcept {
  return asked.type == Client::system_control ? identity_.system_control_id : module_id_;
}

double Connecting::wanted() const noexcept {
  return kScript[step_].kind == Step::Kind::set_timeout ? module_timeout_s_ : 0;
}

}  // namespace kphi::iq
