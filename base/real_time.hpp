// Real-time priority for the threads that stop a run when a loaded computer keeps them waiting, and memory that is
// never paged out. Both are asked for and done without. Linux: sched(7), mlockall(2).
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

namespace kphi::real_time {

/// Of SCHED_RR, 1 to 99: above every ordinary thread, below the kernel's own at 50.
inline constexpr int kPriority = 10;

/// Somebody who may give a thread of this process a priority that the kernel refuses it: empty, or why not.
using Grantor = std::string (*)(pid_t thread, int priority);
/// Whom to ask. Before the threads start; nullptr: nobody.
void ask_through(Grantor grantor) noexcept;

/// Asks for the calling thread. Without effect if it has such a priority already. True: granted.
bool ask() noexcept;
/// Gives up what ask() got for the calling thread.
void yield() noexcept;
/// Why the last ask() of any thread was refused; empty: none was.
[[nodiscard]] std::string refusal();

/// The calling thread has it while this lives, unless it is refused.
class Scope {
 public:
  Scope() noexcept : granted_(ask()) {}
  ~Scope() {
    if (granted_) yield();
  }
  Scope(const Scope&) = delete;
  Scope& operator=(const Scope&) = delete;

 private:
  bool granted_;
};

/// The calling thread sleeps for at most `wall` while this lives, for others to see: a thread that is still asleep long
/// afterwards was not run by the computer. Any thread.
class Asleep {
 public:
  explicit Asleep(std::chrono::nanoseconds wall) noexcept;
  ~Asleep();
  Asleep(const Asleep&) = delete;
  Asleep& operator=(const Asleep&) = delete;

 private:
  std::atomic<std::int64_t>* due_ns_ = nullptr;  ///< null: as many as can be seen sleep already
};
/// By how much the most overdue sleeper of this process should have been awake; 0: none is late. Any thread.
[[nodiscard]] std::chrono::nanoseconds overdue() noexcept;

/// Whether lock_memory() would be granted.
[[nodiscard]] bool may_lock_memory() noexcept;
/// Keeps every page that this process touches in memory, if it may lock as much as it likes; a smaller permission
/// (RLIMIT_MEMLOCK) would make later allocations fail. True: done.
bool lock_memory() noexcept;

}  // namespace kphi::real_time
