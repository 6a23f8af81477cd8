// How many instructions a call takes, counted one by one: with its trap flag set the processor raises SIGTRAP after
// each. The same number every time, whatever else the machine does. Some 10 µs per instruction: for few calls.
#pragma once

#include <csignal>

namespace kphi::test {

#if defined(__x86_64__) && defined(__linux__) && !defined(KPHI_SANITIZED)
inline constexpr bool kInstructionsCanBeCounted = true;
// Below the stack's red zone, which the caller may be using.
#define KPHI_TRAP_FLAG(change)                                                                              \
  asm volatile("leaq -128(%%rsp), %%rsp\n pushfq\n " change ", (%%rsp)\n popfq\n leaq 128(%%rsp), %%rsp" :: \
                   : "memory", "cc")
#else
inline constexpr bool kInstructionsCanBeCounted = false;
#define KPHI_TRAP_FLAG(change) static_cast<void>(0)
#endif

inline volatile long traps = 0;
inline void on_trap(int) { traps = traps + 1; }

template <class Call>
[[gnu::noinline]] long traps_of(const Call& call) {
  const long before = traps;
  KPHI_TRAP_FLAG("orq $0x100");
  call();
  KPHI_TRAP_FLAG("andq $~0x100");
  return traps - before;
}

/// Of `call`, without those of calling nothing. Call it once before: the first call of a library function is resolved.
template <class Call>
[[nodiscard]] long instructions_of(const Call& call) {
  struct sigaction counting {
  }, usual{};
  counting.sa_handler = on_trap;
  sigaction(SIGTRAP, &counting, &usual);
  const long found = traps_of(call) - traps_of([] {});
  sigaction(SIGTRAP, &usual, nullptr);
  return found;
}

#undef KPHI_TRAP_FLAG

}  // namespace kphi::test
