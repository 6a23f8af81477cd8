// One thread sleeps until another rings: a futex, which costs the ringer nothing while nobody listens, and the sleeper
// one system call where a descriptor takes two.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace kphi::netbox {

class Doorbell {
 public:
  /// The sleeper: to be followed by a look whether there is something already, then by sleep() or leave().
  void listen() noexcept {
    listening_.store(1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_seq_cst);
  }
  /// The sleeper, after listen(): until ring(), at most `wall`; may end early.
  void sleep(std::chrono::nanoseconds wall) noexcept;
  void leave() noexcept { listening_.store(0, std::memory_order_relaxed); }
  /// The other thread, after it has published what there is.
  void ring() noexcept {
    std::atomic_thread_fence(std::memory_order_seq_cst);
    if (listening() && listening_.exchange(0) != 0) wake();
  }
  [[nodiscard]] bool listening() const noexcept { return listening_.load(std::memory_order_relaxed) != 0; }

 private:
  void wake() noexcept;
  std::atomic<std::uint32_t> listening_{0};
};

}  // namespace kphi::netbox
