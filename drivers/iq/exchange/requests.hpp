// Requests that the module may still be working on: which reply belongs to which, how long to wait, and how long the
// module took.
#pragma once

#include <algorithm>
#include <boost/container/static_vector.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "base/clock.hpp"
#include "drivers/iq/wire/entries.hpp"

namespace kphi::iq {

/// The time-out of a request from the measured round trips: smoothed + 4 mean deviations (RFC 6298, equations 2.2 and
/// 2.3), doubled by each series of time-outs, clamped between two bounds. It starts at the longest.
class AdaptiveTimeout {
 public:
  AdaptiveTimeout(Duration shortest, Duration longest) noexcept
      : shortest_(shortest), longest_(longest), timeout_(longest) {}
  void measured(Duration round_trip) noexcept;
  /// A request that was sent at `sent` timed out. Requests sent before the last doubling do not double it again.
  void timed_out(Instant sent, Instant now) noexcept;
  [[nodiscard]] Duration timeout() const noexcept { return timeout_; }

 private:
  Duration shortest_, longest_;
  Duration timeout_;
  Duration smoothed_{0}, deviation_{0};
  Instant doubled_at_{Instant::min()};
};

struct Request {
  const Entry* entry = nullptr;  ///< null: a set, which has no reply and only fills the module's receive buffer
  int module_id = 0;
  std::size_t bytes = 0;    ///< of the frame
  std::uint64_t order = 0;  ///< position among all frames given to the wire
  Instant queued{0};        ///< when it was handed over
  Instant started{0};       ///< when its first byte left, by the wire time of the frames before it
  Instant earliest{0};      ///< a reply that began to arrive before belongs to another request
  Duration patience{0};     ///< from `started` to the time-out
  bool alone = false;       ///< nothing else was open when it was sent
  bool expired = false;     ///< timed out, and absorbs a late reply
  Instant expired_at{0};
  int overtaken = 0;  ///< replies that came to later requests
};

/// IQUART has no sequence numbers: a reply belongs to the oldest open request of its type, sub and module that was sent
/// before the reply began to arrive. A request that timed out stays as an expired request and absorbs late replies, so
/// that they do not answer the next request of the same entry; while it stays, that entry is not asked again. It is
/// removed by order: a module answers requests in sequence and a serial line keeps the sequence, so a reply that was
/// overtaken cannot come any more. Allocates nothing.
class Requests {
 public:
  /// `quarantine`: longer than any reply may be late.
  explicit Requests(Duration quarantine) noexcept : quarantine_(quarantine) {}

  /// A request of this entry is open or expired.
  [[nodiscard]] bool busy(const Entry& entry, int module_id) const noexcept;
  /// No request waits for a reply; there may be expired ones.
  [[nodiscard]] bool none_open() const noexcept;
  /// There is an expired request.
  [[nodiscard]] bool has_expired() const noexcept;
  /// Bytes that may still lie in the module's receive buffer.
  [[nodiscard]] std::size_t outstanding_bytes() const noexcept;
  [[nodiscard]] bool full() const noexcept { return requests_.size() == kRequests; }
  /// Unless full.
  void add(const Request& request) noexcept {
    if (!full()) requests_.push_back(request);
  }

  /// The request that this reply answers, removed unless it is expired: then the reply is late. nullopt: the module
  /// cannot have received it by `begun`, when the reply's first byte arrived, so this is a second copy of the previous
  /// reply.
  [[nodiscard]] std::optional<Request> answer(std::uint8_t type, std::uint8_t sub, int module_id,
                                              Instant begun) noexcept;
  /// The line is a new one: no reply to an earlier request can come.
  void clear() noexcept { requests_.clear(); }

  /// Expires requests that have waited too long. An expired request is removed when two later requests have been
  /// answered (one more than a line that swaps neighbours needs); otherwise ten quarantines after it was sent, but at
  /// least one after its expiry, so that it is still there when a host that slept continues. Calls `timed_out(const
  /// Request&)`.
  template <class TimedOut>
  void expire(Instant now, TimedOut&& timed_out) {
    for (Request& request : requests_) {
      if (request.entry == nullptr || request.expired || now < due(request)) continue;
      request.expired = true;
      request.expired_at = now;
      timed_out(std::as_const(request));
    }
    erase_if([&](const Request& request) { return now >= due(request); });
  }

  /// When the next one expires or is removed.
  [[nodiscard]] Instant deadline() const noexcept;

 private:
  static constexpr std::size_t kRequests = 32;
  [[nodiscard]] Instant due(const Request& request) const noexcept;
  void overtake(std::uint64_t order) noexcept;
  template <class Gone>
  void erase_if(Gone&& gone) noexcept {
    requests_.erase(std::remove_if(requests_.begin(), requests_.end(), gone), requests_.end());
  }

  Duration quarantine_;
  boost::container::static_vector<Request, kRequests> requests_;
};

}  // namespace kphi::iq
