// From the runner to whoever looks on, and one word back. The runner never waits: a tick replaces the one before, a
// message that finds no room is dropped and counted.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <string>

#include "daq/live/tick.hpp"
#include "drivers/netbox/published.hpp"

namespace kphi::daq::live {

class Feed {
 public:
  explicit Feed(std::size_t room = 4096) : messages_(room) {}

  /// The runner's thread.
  void show(const Tick& tick) noexcept {
    tick_.publish(tick);
    shown_.fetch_add(1, std::memory_order_release);
  }
  /// The runner's thread. One message as pages read it (messages.hpp).
  void tell(const std::string& message) {
    if (!messages_.push(message)) dropped_.fetch_add(1);
  }
  /// The onlooker's thread; one.
  template <class Take>
  void take(Take&& take) {
    messages_.consume_all(take);
  }
  /// Any thread.
  [[nodiscard]] Tick newest() const noexcept { return tick_.read(); }
  /// How often show() was called. Any thread.
  [[nodiscard]] std::uint64_t shown() const noexcept { return shown_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(); }

  /// Any thread. True: nobody had asked before.
  bool ask_stop() noexcept { return !stop_.exchange(true); }
  /// Any thread: the runner asks on every tick.
  [[nodiscard]] bool stop_asked() const noexcept { return stop_.load(); }

 private:
  netbox::Published<Tick> tick_;
  std::atomic<std::uint64_t> shown_{0}, dropped_{0};
  std::atomic<bool> stop_{false};
  boost::lockfree::spsc_queue<std::string> messages_;  // sized at run time: see recorder.hpp
};

}  // namespace kphi::daq::live
