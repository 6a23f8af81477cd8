// Asks the box over HTTP how it is set now, on a thread of its own, far from the receive path: when its stream has
// fallen silent, and when it has booted.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <mutex>
#include <thread>

#include "base/clock.hpp"
#include "base/wakeup.hpp"
#include "drivers/netbox/configuration/address.hpp"
#include "drivers/netbox/configuration/changes.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/stream/reconnect.hpp"

namespace kphi::netbox {

class Inquiry {
 public:
  struct Answer {
    BoxAnswer box = BoxAnswer::unreachable;
    Changes changes = 0;  ///< against what was known before
    bool booted = false;  ///< it has forgotten its peaks
    Instant at{0};        ///< bench time
  };

  /// `clock` and `bell` must outlive this; `bell` is raised with each answer.
  Inquiry(Address address, const Clock& clock, Configuration known, Wakeup& bell);
  /// Waits for a running request, 2 s at most.
  ~Inquiry();
  Inquiry(const Inquiry&) = delete;
  Inquiry& operator=(const Inquiry&) = delete;
  /// Any thread; returns at once. Asked again while it works, it asks once more.
  void ask() noexcept;
  /// One thread. False: no answer waits.
  [[nodiscard]] bool take(Answer& answer) noexcept { return answers_.pop(answer); }
  /// What the box said last. Any thread.
  [[nodiscard]] Configuration latest() const;

 private:
  enum Order : int { kRest, kAsk, kEnd };
  void run() noexcept;
  [[nodiscard]] Answer find_out() noexcept;

  const Address address_;
  const Clock& clock_;
  Wakeup& bell_;
  mutable std::mutex mutex_;
  Configuration known_;  // under mutex_
  boost::lockfree::spsc_queue<Answer, boost::lockfree::capacity<16>> answers_;
  std::atomic<int> order_{kRest};
  std::thread thread_;
};

}  // namespace kphi::netbox
