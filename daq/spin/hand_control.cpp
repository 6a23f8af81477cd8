#include "daq/spin/hand_control.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace kphi::daq {

std::optional<RadPerSec> HandControl::wanted(Instant now, RadPerSec commanded) {
  commanded_ = commanded;
  if (take_keys() || !newest_key_) newest_key_ = now;
  if (!reached_ && commanded == target_) reached_ = now;
  if (settings_.lasts && reached_ && now - *reached_ >= *settings_.lasts)
    why_ = fmt::format("{:g} s are over", to_seconds(*settings_.lasts));
  if (!settings_.lasts && now - *newest_key_ >= settings_.dead_man)
    why_ = fmt::format("no key for {:g} s", to_seconds(settings_.dead_man));
  if (!why_.empty()) return std::nullopt;
  return target_;
}

bool HandControl::is_called_off() {
  if (newest_key_) return false;
  (void)take_keys();
  return !why_.empty();
}

bool HandControl::take_keys() {
  bool any = false;
  for (; const std::optional<Key> key = keys_.next(); any = true) take(*key);
  return any;
}

void HandControl::take(Key key) {
  switch (key) {
    case Key::up:
      // A key that is held down for a second asks for thirty steps: the motor must not run after them.
      target_ = std::max(target_, std::min({target_ + settings_.step, commanded_ + settings_.step, settings_.highest}));
      return;
    case Key::down: {
      const RadPerSec least = std::min(settings_.step, settings_.start);
      target_ = std::min(target_, std::max({target_ - settings_.step, commanded_ - settings_.step, least}));
      return;
    }
    case Key::hold:
      if (commanded_ > RadPerSec(0)) target_ = commanded_;  // before it turns there is nothing to hold
      return;
    case Key::stop:
      why_ = "a key was pressed";
      return;
  }
}

}  // namespace kphi::daq
