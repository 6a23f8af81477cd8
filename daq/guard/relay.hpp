// What passes samples and readings on to another thread, oldest first.
#pragma once

#include <algorithm>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>
#include <span>
#include <vector>

namespace kphi::daq {

/// Consumer. Everything that waits, oldest first.
template <class T>
[[nodiscard]] std::vector<T> take_all(boost::lockfree::spsc_queue<T>& queue) {
  std::vector<T> taken;
  queue.consume_all([&](const T& each) { taken.push_back(each); });
  return taken;
}

template <class T>
class Relay {
 public:
  Relay(std::size_t capacity, std::size_t at_once) : queue_(capacity), batch_(at_once) {}

  /// Producer. Takes all that `link` has; `inspect` sees each before it is pushed. True: something moved.
  template <class Link, class Inspect>
  bool move(Link& link, Inspect&& inspect) {
    for (bool moved = false;; moved = true) {
      const std::span<T> room(batch_.data(), std::min(batch_.size(), queue_.write_available()));
      const std::size_t n = room.empty() ? 0 : link.take(room);
      if (n == 0) return moved;
      for (const T& each : room.first(n)) inspect(each);
      queue_.push(batch_.data(), n);
    }
  }
  /// Consumer.
  std::size_t take(std::span<T> out) { return queue_.pop(out.data(), out.size()); }

 private:
  boost::lockfree::spsc_queue<T> queue_;
  std::vector<T> batch_;
};

}  // namespace kphi::daq
