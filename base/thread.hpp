// Threads on which no signal is ever delivered: signals belong to the program's main thread.
#pragma once

#include <pthread.h>
#include <signal.h>

#include <thread>
#include <utility>

namespace kphi {

/// Starts `work` on a thread that blocks all signals. They are blocked before it exists, so it never has a moment
/// without. Throws std::system_error when the system has no more threads.
template <class Work>
[[nodiscard]] std::thread start_thread(Work&& work) {
  struct Blocked {
    Blocked() noexcept {
      sigset_t all;
      sigfillset(&all);
      pthread_sigmask(SIG_SETMASK, &all, &before);
    }
    ~Blocked() { pthread_sigmask(SIG_SETMASK, &before, nullptr); }
    sigset_t before;
  };
  const Blocked while_starting;
  return std::thread(std::forward<Work>(work));
}

}  // namespace kphi
