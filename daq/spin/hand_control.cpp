#include "daq/spin/hand_control.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace kphi::daq {

std::optional<RadPerSec> HandControl::wanted(Instant now, RadPerSec commanded) {
  if (!newest_key_) newest_key_ = now;
  while (const std::optional<Key> key = next_key_()) {
    newest_key_ = now;
    take(*key, commanded);
  }
  if (!reached_ && commanded == target_) reached_ = now;
  if (settings_.lasts && reached_ && now - *reached_ >= *settings_.lasts)
    why_ = fmt::format("{:g} s are over", to_seconds(*settings_.lasts));
  if (!settings_.lasts && now - *newest_key_ >= settings_.dead_man)
    why_ = fmt::format("no key for {:g} s", to_seconds(settings_.dead_man));
  if (!why_.empty()) return std::nullopt;
  return target_;
}

void HandControl::take(Key key, RadPerSec commanded) {
  switch (key) {
    case Key::up:
      target_ = std::min(target_ + settings_.step, settings_.highest);
      return;
    case Key::down:
      target_ = std::max(target_ - settings_.step, std::min(settings_.step, settings_.start));
      return;
    case Key::hold:
      if (commanded > RadPerSec(0)) target_ = commanded;  // before it turns there is nothing to hold
      return;
    case Key::stop:
      why_ = "a key was pressed";
      return;
  }
}

}  // namespace kphi::daq
