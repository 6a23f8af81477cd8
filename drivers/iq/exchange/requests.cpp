#include "drivers/iq/exchange/requests.hpp"

#include <algorithm>

namespace kphi::iq {

bool Requests::busy(const Entry& entry, int module_id) const noexcept {
  return std::any_of(requests_.begin(), requests_.begin() + count_,
                     [&](const Request& request) { return request.entry == &entry && request.module_id == module_id; });
}

bool Requests::none_open() const noexcept {
  return std::none_of(requests_.begin(), requests_.begin() + count_,
                      [](const Request& request) { return request.entry != nullptr && !request.expired; });
}

bool Requests::has_expired() const noexcept {
  return std::any_of(requests_.begin(), requests_.begin() + count_,
                     [](const Request& request) { return request.expired; });
}

std::size_t Requests::outstanding_bytes() const noexcept {
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < count_; ++i) bytes += requests_[i].expired ? 0 : requests_[i].bytes;
  return bytes;
}

void Requests::add(const Request& request) noexcept {
  if (count_ < kRequests) requests_[count_++] = request;
}

std::optional<Requests::Answer> Requests::answer(std::uint8_t type, std::uint8_t sub, int module_id,
                                                 Instant begun) noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    const Request request = requests_[i];
    if (request.entry == nullptr || request.module_id != module_id || request.entry->sub != sub ||
        static_cast<std::uint8_t>(request.entry->type) != type || begun < request.earliest) {
      continue;
    }
    if (!request.expired) erase(i);
    overtake(request.order);
    return Answer{request, request.expired};
  }
  return std::nullopt;
}

Instant Requests::deadline() const noexcept {
  Instant earliest = kNever;
  for (std::size_t i = 0; i < count_; ++i) earliest = std::min(earliest, due(requests_[i]));
  return earliest;
}

Instant Requests::due(const Request& request) const noexcept {
  if (!request.expired) return request.started + request.patience;
  return std::max(request.started + 10 * quarantine_, request.expired_at + quarantine_);
}

void Requests::erase(std::size_t at) noexcept {
  std::move(requests_.begin() + at + 1, requests_.begin() + count_, requests_.begin() + at);
  --count_;
}

// The module answers in order: a reply to a later frame proves that it has read the sets before it.
void Requests::overtake(std::uint64_t order) noexcept {
  for (std::size_t i = 0; i < count_;) {
    Request& request = requests_[i];
    if (request.order < order) ++request.overtaken;
    const bool gone =
        request.entry == nullptr ? request.overtaken > 0 : request.expired && request.overtaken >= kOvertaken;
    if (gone) {
      erase(i);
    } else {
      ++i;
    }
  }
}

}  // namespace kphi::iq
