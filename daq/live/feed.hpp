// From the runner to the live view, and a few words back. The runner never waits: a tick replaces the one before, a
// message without room is dropped and counted.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "base/published.hpp"
#include "daq/live/messages.hpp"
#include "daq/run/steering.hpp"

namespace kphi::daq::live {

class Feed {
 public:
  explicit Feed(std::size_t room = 4096) : messages_(room) {}

  /// The runner's thread.
  void show(const Tick& tick) noexcept {
    tick_.publish(tick);
    shown_.fetch_add(1, std::memory_order_release);
  }
  /// The runner's thread.
  void tell(const Message& message) {
    if (!messages_.push(message)) dropped_.fetch_add(1);
  }
  /// The server's thread.
  template <class Take>
  void take(Take&& take) {
    messages_.consume_all(take);
  }
  /// Any thread.
  [[nodiscard]] Tick newest() const noexcept { return tick_.read(); }
  /// How often show() was called. Any thread.
  [[nodiscard]] std::uint64_t shown() const noexcept { return shown_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(); }

  /// Any thread. True: the first request.
  bool ask_stop() noexcept { return !stop_.exchange(true); }
  /// Any thread: the runner checks it on every tick.
  [[nodiscard]] bool stop_asked() const noexcept { return stop_.load(); }
  /// The server's thread. Dropped when there are more than anybody can press.
  void press(Key key) noexcept { (void)keys_.push(key); }
  /// The runner's thread: the oldest that was pressed.
  [[nodiscard]] std::optional<Key> take_key() noexcept {
    Key key{};
    return keys_.pop(key) ? std::optional(key) : std::nullopt;
  }

 private:
  Published<Tick> tick_;
  std::atomic<std::uint64_t> shown_{0}, dropped_{0};
  std::atomic<bool> stop_{false};
  boost::lockfree::spsc_queue<Key, boost::lockfree::capacity<64>> keys_;
  boost::lockfree::spsc_queue<Message> messages_;  // sized at run time: see recorder.hpp
};

/// What a page that joins late must know. Bounded; one thread.
class History {
 public:
  static constexpr std::size_t kTraceLength = 2000, kMostSteps = 20000, kMostLines = 500;

  /// Keeps a message that was sent to all pages; of limits only the newest.
  void keep(const Message& message);
  /// Adds a point to the trace, unless it already has one of this time.
  void keep(const Tick& tick);
  /// {"type":"history","trace":[[time_s, thrust_n, commanded_rpm, speed_rpm] …],"messages":[…]}; null if unknown.
  /// Limits first, then steps, then the others, each oldest first.
  [[nodiscard]] std::string message() const;

 private:
  struct Point {
    double time_s, thrust_n, commanded_rpm, speed_rpm;
  };
  std::deque<Point> trace_;
  std::deque<std::string> limits_, steps_, others_;
};

}  // namespace kphi::daq::live
