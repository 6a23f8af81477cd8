// Elements on their way from one thread to another: the first looks at each and passes it on, the second takes it. What
// has no room stays where it came from.
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

  /// The first thread. `take(span)` gives how many it has put there; `look(span)` sees them before they go on. True:
  /// something moved.
  template <class Take, class Look>
  bool move(Take&& take, Look&& look) {
    for (bool moved = false;; moved = true) {
      const std::span<T> room(batch_.data(), std::min(batch_.size(), queue_.write_available()));
      const std::size_t n = room.empty() ? 0 : take(room);
      if (n == 0) return moved;
      look(std::span<const T>(room.first(n)));
      queue_.push(batch_.data(), n);
    }
  }
  /// The second thread.
  std::size_t take(std::span<T> out) { return queue_.pop(out.data(), out.size()); }

 private:
  boost::lockfree::spsc_queue<T> queue_;
  std::vector<T> batch_;
};

}  // namespace kphi::daq
