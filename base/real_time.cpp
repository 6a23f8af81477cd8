#include "base/real_time.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>

namespace kphi::real_time {
namespace {

std::atomic<Grantor> grantor{nullptr};
std::mutex mutex;
std::string refused;  // under the mutex

bool has_it() noexcept {
  const int policy = sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  return policy == SCHED_FIFO || policy == SCHED_RR;
}

/// 0, or an errno.
int set(int policy, int priority) noexcept {
  sched_param parameter{};
  parameter.sched_priority = priority;
  return sched_setscheduler(0, policy, &parameter) == 0 ? 0 : errno;
}

std::array<std::atomic<std::int64_t>, 64> sleepers{};  // when each wants to be awake, steady ns; 0: free

std::int64_t steady_ns() noexcept { return std::chrono::steady_clock::now().time_since_epoch().count(); }

}  // namespace

Asleep::Asleep(std::chrono::nanoseconds wall) noexcept {
  const std::int64_t due = steady_ns() + wall.count();
  for (auto& slot : sleepers) {
    std::int64_t free = 0;
    if (!slot.compare_exchange_strong(free, due)) continue;
    due_ns_ = &slot;
    return;
  }
}

Asleep::~Asleep() {
  if (due_ns_ != nullptr) *due_ns_ = 0;
}

std::chrono::nanoseconds overdue() noexcept {
  const std::int64_t now = steady_ns();
  std::int64_t most = 0;
  for (const auto& slot : sleepers)
    if (const std::int64_t due = slot; due != 0) most = std::max(most, now - due);
  return std::chrono::nanoseconds(most);
}

void ask_through(Grantor somebody) noexcept { grantor = somebody; }

bool ask() noexcept {
  if (has_it()) return false;  // not this call's to give up
  const int error = set(SCHED_RR | SCHED_RESET_ON_FORK, kPriority);
  if (error == 0) return true;
  try {
    std::string why = std::strerror(error);
    if (const Grantor somebody = grantor) {
      const std::string theirs = somebody(gettid(), kPriority);
      if (theirs.empty()) return true;
      why += "; " + theirs;
    }
    const std::lock_guard lock(mutex);
    refused = why;
  } catch (...) {
    // No memory for words: the thread goes on without.
  }
  return false;
}

void yield() noexcept { (void)set(SCHED_OTHER, 0); }

std::string refusal() {
  const std::lock_guard lock(mutex);
  return refused;
}

bool may_lock_memory() noexcept {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) != 0) return false;
  return limit.rlim_cur == RLIM_INFINITY || geteuid() == 0;
}

bool lock_memory() noexcept { return may_lock_memory() && mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0; }

}  // namespace kphi::real_time
