#include "drivers/iq/requests.hpp"

#include <algorithm>

namespace kphi::iq {

bool Requests::busy(const Entry& entry) const noexcept {
  return std::any_of(requests_.begin(), requests_.begin() + count_,
                     [&](const Request& request) { return request.entry == &entry; });
}

std::size_t Requests::outstanding_bytes() const noexcept {
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < count_; ++i) bytes += requests_[i].expired ? 0 : requests_[i].bytes;
  return bytes;
}

void Requests::add(const Request& request) noexcept {
  if (count_ < kRequests) requests_[count_++] = request;
}

std::optional<Requests::Answer> Requests::answer(std::uint8_t type, std::uint8_t sub) noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    const Request request = requests_[i];
    if (request.entry == nullptr || static_cast<std::uint8_t>(request.entry->type) != type || request.entry->sub != sub)
      continue;
    erase(i);
    if (!request.expired) release_before(request.order);
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
  if (!request.expired) return request.started + reply_timeout_;
  return request.expired_at + reply_timeout_ * (request.overtaken ? 1 : 3);
}

void Requests::erase(std::size_t at) noexcept {
  std::move(requests_.begin() + at + 1, requests_.begin() + count_, requests_.begin() + at);
  --count_;
}

// The module answers in order: whoever answers a later frame has read the sets before it.
void Requests::release_before(std::uint64_t order) noexcept {
  for (std::size_t i = 0; i < count_;) {
    if (requests_[i].order < order && requests_[i].entry == nullptr) {
      erase(i);
      continue;
    }
    requests_[i].overtaken |= requests_[i].order < order;
    ++i;
  }
}

}  // namespace kphi::iq
