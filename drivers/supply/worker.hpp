// A supply with a thread of its own, which reads it a few times per second. Only callers of apply() and switch_on()
// wait for the wire.
//
// Safety. The output is switched off: when asked, from any thread; when the supply fails; when the thread ends for
// whatever reason; and when the object is destroyed. If that could not be confirmed, failure() says so.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "base/descriptor.hpp"
#include "base/error.hpp"
#include "base/published.hpp"
#include "drivers/supply/supply.hpp"

namespace kphi::supply {

class Worker {
 public:
  /// Readings per second of bench time, fewer where the supply answers slowly; real supplies tolerate 2 to 5.
  static constexpr double kUsualRate = 4;

  /// `clock` outlives the worker.
  Worker(std::unique_ptr<Supply> supply, const Clock& clock, double looks_per_second = kUsualRate);
  /// Switches off and closes; takes as long as the supply, a few seconds when it does not answer.
  ~Worker();

  /// Any thread; wait for the device. Throw what Supply throws, and DeviceError when the worker is not alive.
  void apply(const Limits& limits) {
    ask([&] { supply_->apply(limits); });
  }
  /// Returns with the output on. A switch_off() after this call overrules it, with DeviceError.
  void switch_on();
  /// Any thread; takes no lock: an atomic word and an eventfd. Returns the number of this request.
  std::uint64_t switch_off() noexcept;
  /// Any thread: as switch_off, then waits for the device to report it. False after `wall` or when the supply has
  /// failed: the output may be on.
  [[nodiscard]] bool switch_off_and_confirm(Duration wall) noexcept;

  /// Oldest readings first; one consumer thread. Holds 4096, 17 minutes at 4 Hz; further ones are dropped.
  std::size_t take(std::span<SupplyReading> out);
  /// Any thread.
  [[nodiscard]] std::optional<SupplyReading> newest() const {
    const SupplyReading reading = newest_.read();
    return reading.time_ns == 0 ? std::nullopt : std::optional(reading);
  }
  /// Bench time that the longest reading so far took; 0 before the first. Any thread.
  [[nodiscard]] Duration longest_look() const noexcept { return Duration(longest_look_ns_); }
  /// Read at construction.
  [[nodiscard]] const Identity& identity() const noexcept { return identity_; }
  /// False once the supply has failed; stays false.
  [[nodiscard]] bool alive() const noexcept { return !ended_; }
  /// Why it is not alive, and whether the output may still be on.
  [[nodiscard]] std::string failure() const { return copy_of(failure_); }

 private:
  friend struct LockOfWorker;  // of a test that stands still in it
  /// Text instead of an exception, which cannot leave its thread.
  struct Answer {
    std::string failure;  ///< empty: done
    bool unfit = false;   ///< by an invalid argument
  };
  /// Leaves a reading.
  struct Ordered {};
  struct Order {
    std::function<void()> act;
    std::promise<Answer> answer;
  };

  template <class T>
  [[nodiscard]] T copy_of(const T& shared) const {
    const std::lock_guard lock(mutex_);
    return shared;
  }
  void ask(std::function<void()> act);
  [[nodiscard]] DeviceError gone() const;

  // The thread.
  void run() noexcept;
  [[nodiscard]] static Answer answer_to(const std::function<void()>& act);
  [[nodiscard]] bool serve();
  void await_order() noexcept;
  [[nodiscard]] std::string turn_off() noexcept;
  void look();
  void finish(std::string why) noexcept;

  const std::unique_ptr<Supply> supply_;
  const Clock& clock_;
  const Duration period_;  ///< bench time
  const Identity identity_;

  // Only the thread uses these.
  std::optional<PoweredOutput> output_;
  Instant next_look_{0};

  // Shared by callers and the thread; locked only while copying, never during traffic.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Order> orders_;
  std::string failure_;

  // Without the lock: nothing that switches off waits for a caller.
  Wakeup ordered_;
  std::atomic<std::uint64_t> offs_asked_{0}, offs_done_{0};
  std::atomic<bool> stop_asked_{false}, ended_{false};
  std::atomic<std::int64_t> longest_look_ns_{0};
  Published<SupplyReading> newest_;

  boost::lockfree::spsc_queue<SupplyReading, boost::lockfree::capacity<4096>> queue_;
  std::thread thread_;
};

}  // namespace kphi::supply
