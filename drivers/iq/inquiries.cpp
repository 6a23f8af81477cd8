#include "drivers/iq/inquiries.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace kphi::iq {
namespace {

constexpr int kAttempts = 3;

}  // namespace

void Inquiries::check(const std::vector<Inquiry>& inquiries) {
  for (const Inquiry& inquiry : inquiries) {
    const Entry& wanted = *inquiry.entry;
    if (!wanted.allows(Access::get) || size_of(wanted.format) > 4) {
      throw std::invalid_argument(fmt::format("{}.{} cannot be read as a number", name_of(wanted.type), wanted.name));
    }
    if (inquiry.set_to && !is_volatile_setting(wanted)) {
      throw std::invalid_argument(
          fmt::format("{}.{} is no setting for passing use", name_of(wanted.type), wanted.name));
    }
  }
}

void Inquiries::begin(std::vector<Inquiry> inquiries) {
  inquiries_ = std::move(inquiries);
  left_ = inquiries_.size();
  states_.assign(left_, State::waiting);
  attempts_.assign(left_, 0);
  replies_.assign(left_, {});
}

void Inquiries::advance(Exchange& exchange, int system_control_id, Instant now) {
  if (done()) return;
  for (std::size_t i = 0; i < inquiries_.size(); ++i) {
    if (states_[i] != State::waiting) continue;
    const auto& [wanted, set_to] = inquiries_[i];
    const int id = wanted->type == Client::system_control ? system_control_id : module_id_;
    const bool sent = set_to ? exchange.tell_and_ask(*wanted, *set_to, id, now) : exchange.ask(*wanted, id, now);
    if (sent) states_[i] = State::asked;
  }
}

void Inquiries::take(const Heard& heard) {
  for (std::size_t i = 0; i < inquiries_.size(); ++i) {
    if (states_[i] != State::asked || inquiries_[i].entry != &heard.entry()) continue;
    const bool last = ++attempts_[i] >= kAttempts;
    states_[i] = State::waiting;
    if (heard.kind != Heard::Kind::answer) {
      if (last) finish(i);
      return;
    }
    const auto& set_to = inquiries_[i].set_to;
    replies_[i].value = heard.value();
    replies_[i].accepted = set_to && is_as_set(heard.entry(), *set_to, heard.value());
    if (!set_to || replies_[i].accepted || last) finish(i);
    return;
  }
}

bool Inquiries::sets(const Entry& wanted) const noexcept {
  for (std::size_t i = 0; i < inquiries_.size(); ++i) {
    if (states_[i] != State::done && inquiries_[i].entry == &wanted && inquiries_[i].set_to) return true;
  }
  return false;
}

void Inquiries::abandon() noexcept {
  for (std::size_t i = 0; i < inquiries_.size(); ++i) {
    if (states_[i] != State::done) finish(i);
  }
}

void Inquiries::finish(std::size_t i) noexcept {
  states_[i] = State::done;
  --left_;
}

}  // namespace kphi::iq
