// Pieces of work, done by a thread per processor and taken in their order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <thread>
#include <utility>

namespace kphi {

/// A thread costs more than what it saves with fewer bytes of text than this: they wait until somebody asks for them.
inline constexpr std::size_t kWorthAThread = std::size_t{1} << 16;
[[nodiscard]] inline std::launch launch_for(std::size_t bytes) {
  return bytes < kWorthAThread ? std::launch::deferred : std::launch::async;
}

/// `take` is called by the thread that adds, with the results in the order of adding, as many behind as there are
/// processors. What a piece throws, add() or finish() throws.
template <class Result>
class OrderedWork {
 public:
  explicit OrderedWork(std::function<void(Result)> take) : take_(std::move(take)) {}

  template <class Work>
  void add(std::launch policy, Work&& work) {
    if (ahead_.size() >= std::max(1u, std::thread::hardware_concurrency())) take_first();
    ahead_.push_back(std::async(policy, std::forward<Work>(work)));
  }
  /// Takes what is left.
  void finish() {
    while (!ahead_.empty()) take_first();
  }

 private:
  void take_first() {
    std::future<Result> first = std::move(ahead_.front());
    ahead_.pop_front();
    take_(first.get());
  }

  std::function<void(Result)> take_;
  std::deque<std::future<Result>> ahead_;
};

}  // namespace kphi
