#include "drivers/iq/session/inquiries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace kphi::iq {

void Inquiries::check(const std::vector<Inquiry>& inquiries) {
  for (const Inquiry& inquiry : inquiries) {
    const Entry& wanted = *inquiry.entry;
    if (!wanted.allows(Access::get) || size_of(wanted.format) > 4) {
      throw std::invalid_argument(fmt::format("{}.{} cannot be read as a number", name_of(wanted.type), wanted.name));
    }
    if (inquiry.set_to && !is_volatile_setting(wanted)) {
      throw std::invalid_argument(fmt::format("{}.{} must not be set in passing", name_of(wanted.type), wanted.name));
    }
  }
}

void Inquiries::begin(const std::vector<Inquiry>& inquiries) {
  items_.clear();
  for (const Inquiry& inquiry : inquiries) items_.push_back({OpenInquiry(inquiry)});
}

void Inquiries::advance(Exchange& exchange, int system_control_id, Instant now) {
  for (Item& item : items_) {
    if (item.asked || item.open.done()) continue;
    const auto& [wanted, set_to] = item.open.inquiry();
    const int id = wanted->type == Client::system_control ? system_control_id : module_id_;
    item.asked = set_to ? exchange.tell_and_ask(*wanted, *set_to, id, now) : exchange.ask(*wanted, id, now);
  }
}

void Inquiries::take(const QueryResult& result) {
  for (Item& item : items_) {
    if (!item.asked || item.open.inquiry().entry != &result.entry()) continue;
    item.asked = false;
    return item.open.take(result.kind == QueryResult::Kind::answer ? std::optional(result.value()) : std::nullopt);
  }
}

bool Inquiries::done() const noexcept {
  return std::all_of(items_.begin(), items_.end(), [](const Item& item) { return item.open.done(); });
}

bool Inquiries::sets(const Entry& wanted) const noexcept {
  return std::any_of(items_.begin(), items_.end(), [&](const Item& item) {
    const Inquiry& inquiry = item.open.inquiry();
    return !item.open.done() && inquiry.entry == &wanted && inquiry.set_to;
  });
}

void Inquiries::abandon() noexcept {
  for (Item& item : items_) {
    item.open.give_up();
    item.asked = false;
  }
}

std::vector<Reply> Inquiries::replies() const {
  std::vector<Reply> all;
  for (const Item& item : items_) all.push_back(item.open.reply());
  return all;
}

}  // namespace kphi::iq
