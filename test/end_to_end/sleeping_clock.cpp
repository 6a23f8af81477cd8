// Preloaded into a program: the clocks of a computer that has slept. As Linux suspends, CLOCK_MONOTONIC stands still
// meanwhile, and CLOCK_BOOTTIME and CLOCK_REALTIME run on. Deadlines on the monotonic clock move with it; a timeout
// that ran out in the kernel meanwhile waits for what is left of it.
//
// The file that KPHI_SLEPT names is 8 bytes: the nanoseconds slept so far. Whoever stops the program writes them before
// it goes on, see sleeping_host.hpp. Without the variable nothing has slept. KPHI_STEPPED likewise: by how much the
// calendar clock has stepped; the kernel's receive stamps have not.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

using Nanoseconds = std::atomic<std::int64_t>;
static_assert(Nanoseconds::is_always_lock_free && sizeof(Nanoseconds) == 8);
const Nanoseconds* slept_so_far = nullptr;
const Nanoseconds* stepped = nullptr;

const Nanoseconds* opened(const char* variable) {
  const char* name = std::getenv(variable);
  if (name == nullptr) return nullptr;
  const int file = open(name, O_RDONLY | O_CLOEXEC);
  void* page = file < 0 ? MAP_FAILED : mmap(nullptr, sizeof(Nanoseconds), PROT_READ, MAP_SHARED, file, 0);
  if (page == MAP_FAILED) std::abort();
  close(file);
  return static_cast<const Nanoseconds*>(page);
}

[[gnu::constructor]] void open_times() {
  slept_so_far = opened("KPHI_SLEPT");
  stepped = opened("KPHI_STEPPED");
}

std::int64_t slept() { return slept_so_far == nullptr ? 0 : slept_so_far->load(); }

bool stands_still(clockid_t clock) {
  return clock == CLOCK_MONOTONIC || clock == CLOCK_MONOTONIC_RAW || clock == CLOCK_MONOTONIC_COARSE;
}

std::int64_t to_ns(const timespec& time) { return time.tv_sec * kSecond + time.tv_nsec; }
timespec to_timespec(std::int64_t ns) { return {ns / kSecond, ns % kSecond}; }

/// Past libc: its function of this name is the one below.
int read_clock(clockid_t clock, timespec* time) {
  const auto result = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  if (result == 0 && stands_still(clock)) *time = to_timespec(to_ns(*time) - slept());
  if (result == 0 && clock == CLOCK_REALTIME && stepped != nullptr) *time = to_timespec(to_ns(*time) + stepped->load());
  return result;
}

std::int64_t now_ns() {
  timespec now{};
  read_clock(CLOCK_MONOTONIC, &now);
  return to_ns(now);
}

/// libc's own of this name, or a sanitizer's.
template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

/// 0, or EINTR.
int sleep_until(std::int64_t deadline) {
  static const auto real = next<int (*)(clockid_t, int, const timespec*, timespec*)>("clock_nanosleep");
  while (now_ns() < deadline) {
    const timespec shifted = to_timespec(deadline + slept());
    if (const int error = real(CLOCK_MONOTONIC, TIMER_ABSTIME, &shifted, nullptr); error != 0) return error;
  }
  return 0;
}

int sleep_for(const timespec& time, timespec* rest) {
  if (time.tv_sec < 0 || time.tv_nsec < 0 || time.tv_nsec >= kSecond) return EINVAL;
  const std::int64_t deadline = now_ns() + to_ns(time);
  const int error = sleep_until(deadline);
  if (error == EINTR && rest != nullptr) *rest = to_timespec(std::max<std::int64_t>(0, deadline - now_ns()));
  return error;
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* time) noexcept { return read_clock(clock, time); }

int clock_nanosleep(clockid_t clock, int flags, const timespec* time, timespec* rest) {
  if (clock == CLOCK_MONOTONIC) return flags == TIMER_ABSTIME ? sleep_until(to_ns(*time)) : sleep_for(*time, rest);
  static const auto real = next<int (*)(clockid_t, int, const timespec*, timespec*)>("clock_nanosleep");
  return real(clock, flags, time, rest);
}

int nanosleep(const timespec* time, timespec* rest) {
  const int error = sleep_for(*time, rest);
  if (error == 0) return 0;
  errno = error;
  return -1;
}

/// A wait that was cut short by the sleep looks like a wake-up without a cause, which every waiter must bear.
int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* deadline) {
  static const auto real =
      next<int (*)(pthread_cond_t*, pthread_mutex_t*, clockid_t, const timespec*)>("pthread_cond_clockwait");
  if (!stands_still(clock)) return real(condition, mutex, clock, deadline);
  const timespec shifted = to_timespec(to_ns(*deadline) + slept());
  const int result = real(condition, mutex, clock, &shifted);
  return result == ETIMEDOUT && now_ns() < to_ns(*deadline) ? 0 : result;
}

int ppoll(pollfd* fds, nfds_t count, const timespec* timeout, const sigset_t* signals) {
  static const auto real = next<int (*)(pollfd*, nfds_t, const timespec*, const sigset_t*)>("ppoll");
  if (timeout == nullptr) return real(fds, count, timeout, signals);
  const std::int64_t deadline = now_ns() + to_ns(*timeout);
  for (timespec left = *timeout;;) {
    const int ready = real(fds, count, &left, signals);
    const std::int64_t rest = deadline - now_ns();
    if (ready != 0 || rest <= 0) return ready;
    left = to_timespec(rest);
  }
}

int poll(pollfd* fds, nfds_t count, int timeout_ms) {
  const timespec timeout = to_timespec(timeout_ms * (kSecond / 1000));
  return ppoll(fds, count, timeout_ms < 0 ? nullptr : &timeout, nullptr);
}

}  // extern "C"
