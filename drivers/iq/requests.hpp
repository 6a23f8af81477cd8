// What the modules have been sent and may still be working on. IQUART has no sequence numbers: a reply belongs to the
// oldest open request of its type, sub and module. A request that timed out stays as a ghost which swallows its late
// reply, so that the next request of the same entry is not answered by it; until the ghost is gone no other is sent.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/clock.hpp"
#include "drivers/iq/entries.hpp"

namespace kphi::iq {

struct Request {
  const Entry* entry = nullptr;  ///< null: a set, which has no reply and only fills the module's receive buffer
  int module_id = 0;
  std::size_t bytes = 0;    ///< of the frame
  std::uint64_t order = 0;  ///< position among all frames given to the wire
  Instant queued{0};        ///< when it was handed over
  Instant started{0};       ///< when its first byte left, by the wire time of what was before it
  Duration patience{0};     ///< from then on
  bool alone = false;       ///< nothing else was open when it was sent
  bool expired = false;     ///< a ghost
  Instant expired_at{0};
  bool overtaken = false;  ///< a later request has been answered
};

/// Allocates nothing.
class Requests {
 public:
  struct Answer {
    Request request;
    bool late = false;
  };

  /// `quarantine`: longer than any reply may be late.
  explicit Requests(Duration quarantine) noexcept : quarantine_(quarantine) {}

  /// Is a request of this entry open, or its ghost about?
  [[nodiscard]] bool busy(const Entry& entry, int module_id) const noexcept;
  /// Nothing waits for a reply; ghosts may be about.
  [[nodiscard]] bool none_open() const noexcept;
  /// Bytes that may still lie in the module's receive buffer.
  [[nodiscard]] std::size_t outstanding_bytes() const noexcept;
  [[nodiscard]] bool full() const noexcept { return count_ == kRequests; }
  void add(const Request& request) noexcept;

  /// The request that this reply answers, taken out; nothing if none was asked.
  [[nodiscard]] std::optional<Answer> answer(std::uint8_t type, std::uint8_t sub, int module_id) noexcept;
  /// The line is another one: nothing of before can come.
  void clear() noexcept { count_ = 0; }

  /// Turns what has waited too long into ghosts, and lets ghosts go: two quarantines after they were sent when later
  /// requests have been answered (a serial line keeps the order), else ten. None goes sooner than one quarantine after
  /// its expiry, so that a host that slept finds it still there. Calls `timed_out(const Request&)`.
  template <class TimedOut>
  void expire(Instant now, TimedOut&& timed_out) {
    for (std::size_t i = 0; i < count_;) {
      Request& request = requests_[i];
      if (now < due(request)) {
        ++i;
      } else if (request.entry != nullptr && !request.expired) {
        request.expired = true;
        request.expired_at = now;
        const Request copy = request;
        timed_out(copy);
      } else {
        erase(i);
      }
    }
  }

  /// When the next of them expires or goes.
  [[nodiscard]] Instant deadline() const noexcept;

 private:
  static constexpr std::size_t kRequests = 32;
  [[nodiscard]] Instant due(const Request& request) const noexcept;
  void erase(std::size_t at) noexcept;
  void release_before(std::uint64_t order) noexcept;

  Duration quarantine_;
  std::array<Request, kRequests> requests_;
  std::size_t count_ = 0;
};

}  // namespace kphi::iq
