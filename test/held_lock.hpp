// A mutex in the hands of a thread that stands still.
#pragma once

#include <future>
#include <mutex>
#include <thread>

namespace kphi::test {

class HeldLock {
 public:
  /// Returns once that thread has it; the destructor ends the thread.
  explicit HeldLock(std::mutex& mutex)
      : thread_([this, &mutex] {
          const std::lock_guard lock(mutex);
          held_.set_value();
          released_.get_future().wait();
        }) {
    held_.get_future().wait();
  }
  ~HeldLock() {
    released_.set_value();
    thread_.join();
  }
  HeldLock(const HeldLock&) = delete;
  HeldLock& operator=(const HeldLock&) = delete;

 private:
  std::promise<void> held_, released_;
  std::thread thread_;
};

}  // namespace kphi::test
