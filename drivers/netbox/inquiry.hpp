// Asks the box over HTTP why its stream is silent: once for each silence, on a thread of its own, far from the
// receive path.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "drivers/clock.hpp"
#include "drivers/netbox/event_queue.hpp"

namespace kphi::netbox {

class Inquiry {
 public:
  /// `clock` and `answers` must outlive this; the thread is the only producer of `answers`.
  Inquiry(std::string host, std::uint16_t http_port, const Clock& clock, EventQueue& answers);
  /// Waits for a running request, 2 s at most.
  ~Inquiry();
  Inquiry(const Inquiry&) = delete;
  Inquiry& operator=(const Inquiry&) = delete;
  /// Any thread; returns at once. Asked again while it works, it asks once more.
  void ask() noexcept;

 private:
  enum Order : int { kRest, kAsk, kEnd };
  void run() noexcept;
  [[nodiscard]] EventKind find_out() const noexcept;

  const std::string host_;
  const std::uint16_t http_port_;
  const Clock& clock_;
  EventQueue& answers_;
  std::atomic<int> order_{kRest};
  std::thread thread_;
};

}  // namespace kphi::netbox
