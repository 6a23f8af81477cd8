// Waiting for what announces itself nowhere.
#pragma once

#include <chrono>
#include <thread>

namespace kphi::test {

/// Polls with a deadline; whether it came true.
template <class What>
[[nodiscard]] bool soon(What&& what, std::chrono::milliseconds limit = std::chrono::seconds(20)) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < end) {
    if (what()) return true;
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  return what();
}

}  // namespace kphi::test
