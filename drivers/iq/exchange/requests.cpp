#include "drivers/iq/exchange/requests.hpp"

#include <cmath>

namespace kphi::iq {
namespace {

constexpr int kOvertaken = 2;

}  // namespace

void AdaptiveTimeout::measured(Duration round_trip) noexcept {
  if (smoothed_ == Duration{0}) {
    smoothed_ = round_trip;
    deviation_ = round_trip / 2;
  } else {
    deviation_ += (Duration(std::abs((smoothed_ - round_trip).count())) - deviation_) / 4;
    smoothed_ += (round_trip - smoothed_) / 8;
  }
  timeout_ = std::clamp(smoothed_ + 4 * deviation_, shortest_, longest_);
}

void AdaptiveTimeout::timed_out(Instant sent, Instant now) noexcept {
  if (sent < doubled_at_) return;
  doubled_at_ = now;
  timeout_ = std::min(2 * timeout_, longest_);
}

bool Requests::busy(const Entry& entry, int module_id) const noexcept {
  return std::ranges::any_of(requests_,
                             [&](const Request& one) { return one.entry == &entry && one.module_id == module_id; });
}

bool Requests::none_open() const noexcept {
  return std::ranges::none_of(requests_, [](const Request& one) { return one.entry != nullptr && !one.expired; });
}

bool Requests::has_expired() const noexcept { return std::ranges::any_of(requests_, &Request::expired); }

std::size_t Requests::outstanding_bytes() const noexcept {
  std::size_t bytes = 0;
  for (const Request& request : requests_) bytes += request.expired ? 0 : request.bytes;
  return bytes;
}

std::optional<Request> Requests::answer(std::uint8_t type, std::uint8_t sub, int module_id, Instant begun) noexcept {
  const auto at = std::ranges::find_if(requests_, [&](const Request& one) {
    return one.entry != nullptr && one.module_id == module_id && one.entry->sub == sub &&
           static_cast<std::uint8_t>(one.entry->type) == type && begun >= one.earliest;
  });
  if (at == requests_.end()) return std::nullopt;
  const Request request = *at;
  if (!request.expired) requests_.erase(at);
  overtake(request.order);
  return request;
}

Instant Requests::deadline() const noexcept {
  Instant earliest = kNever;
  for (const Request& request : requests_) earliest = std::min(earliest, due(request));
  return earliest;
}

Instant Requests::due(const Request& request) const noexcept {
  if (!request.expired) return request.started + request.patience;
  return std::max(request.started + 10 * quarantine_, request.expired_at + quarantine_);
}

// The module answers in order: a reply to a later frame proves that it has read the sets before it.
void Requests::overtake(std::uint64_t order) noexcept {
  for (Request& request : requests_) request.overtaken += request.order < order ? 1 : 0;
  erase_if([](const Request& one) {
    return one.entry == nullptr ? one.overtaken > 0 : one.expired && one.overtaken >= kOvertaken;
  });
}

}  // namespace kphi::iq
