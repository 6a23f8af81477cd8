// Single-producer queue whose producer inspects each element before pushing it. Elements without room stay at their
// source.
#pragma once

#include <algorithm>
#include <boost/lockfree/spsc_queue.hpp>
#include <span>
#include <vector>

namespace kphi::daq {

template <class T>
class Relay {
 public:
  Relay(std::size_t capacity, std::size_t at_once) : queue_(capacity), batch_(at_once) {}

  /// Producer. `take(span)` fills it and returns how many; `inspect(span)` sees them before they are pushed. True:
  /// something moved.
  template <class Take, class Inspect>
  bool move(Take&& take, Inspect&& inspect) {
    for (bool moved = false;; moved = true) {
      const std::span<T> room(batch_.data(), std::min(batch_.size(), queue_.write_available()));
      const std::size_t n = room.empty() ? 0 : take(room);
      if (n == 0) return moved;
      inspect(std::span<const T>(room.first(n)));
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
