// Threads on which no signal is ever delivered: signals belong to the program's main thread.
#pragma once

#include <pthread.h>
#include <signal.h>

#include <thread>
#include <utility>

#include "base/real_time.hpp"

namespace kphi {

struct ThreadRole {
  const char* name;     ///< as `top -H` shows it, at most 15 letters
  bool urgent = false;  ///< it asks for real-time priority
};

/// Starts `work` on a thread that blocks all signals. They are blocked before it exists, so it never has a moment
/// without. Throws std::system_error when the system has no more threads.
template <class Work>
[[nodiscard]] std::thread start_thread(const ThreadRole& role, Work&& work) {
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
  return std::thread([role, work = std::forward<Work>(work)]() mutable {
    pthread_setname_np(pthread_self(), role.name);
    if (role.urgent) real_time::ask();
    work();
  });
}

}  // namespace kphi
