// What the modules have been sent and may still be working on. IQUART has no sequence numbers: a reply belongs to the
// oldest open request of its type, sub and module that was put before the reply began to come. A request that timed out
// stays as a ghost which swallows late replies, so that the next request of the same entry is not answered by them;
// until the ghost is gone no other is sent. What lets it go is the order: a module answers one question after the other
// and a serial line keeps it, so a reply that has been overtaken will not come.
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
  Instant earliest{0};      ///< what began to come before answers something else
  Duration patience{0};     ///< from then on
  bool alone = false;       ///< nothing else was open when it was sent
  bool expired = false;     ///< a ghost
  Instant expired_at{0};
  int overtaken = 0;  ///< replies that came to later requests
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
  /// A ghost is about.
  [[nodiscard]] bool haunted() const noexcept;
  /// Bytes that may still lie in the module's receive buffer.
  [[nodiscard]] std::size_t outstanding_bytes() const noexcept;
  [[nodiscard]] bool full() const noexcept { return count_ == kRequests; }
  void add(const Request& request) noexcept;

  /// The request that this reply answers, taken out unless it is a ghost; nothing if the module cannot have heard it by
  /// `begun`, when the reply's first byte came: it is a second copy of the reply before.
  [[nodiscard]] std::optional<Answer> answer(std::uint8_t type, std::uint8_t sub, int module_id,
                                             Instant begun) noexcept;
  /// The line is another one: nothing of before can come.
  void clear() noexcept { count_ = 0; }

  /// Turns what has waited too long into ghosts. A ghost goes when two later requests have been answered, one more than
  /// a line that swaps neighbours needs; else ten quarantines after it was sent, and not sooner than one after its
  /// expiry, so that a host that slept finds it still there. Calls `timed_out(const Request&)`.
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
  static constexpr int kOvertaken = 2;
  [[nodiscard]] Instant due(const Request& request) const noexcept;
  void erase(std::size_t at) noexcept;
  void overtake(std::uint64_t order) noexcept;

  Duration quarantine_;
  std::array<Request, kRequests> requests_;
  std::size_t count_ = 0;
};

}  // namespace kphi::iq
