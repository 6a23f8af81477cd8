// One thread sleeps until another rings.
#include "drivers/netbox/receive/doorbell.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;

TEST(Doorbell, TheSleeperSleepsForAsLongAsNobodyRings) {
  Doorbell bell;
  const auto begun = std::chrono::steady_clock::now();
  bell.listen();
  bell.sleep(20ms);
  EXPECT_GE(std::chrono::steady_clock::now() - begun, 20ms);
  EXPECT_FALSE(bell.listening());
}

TEST(Doorbell, ARingBetweenListeningAndSleepingIsNotLost) {
  Doorbell bell;
  bell.listen();
  bell.ring();
  const auto begun = std::chrono::steady_clock::now();
  bell.sleep(30s);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 10s);
}

TEST(Doorbell, WhoHasLeftIsNotRungFor) {
  Doorbell bell;
  bell.listen();
  EXPECT_TRUE(bell.listening());
  bell.leave();
  bell.ring();
  EXPECT_FALSE(bell.listening());
}

TEST(Doorbell, NothingOfAHundredThousandPiecesIsSleptThrough) {
  constexpr int kPieces = 100'000;
  Doorbell bell, answer;
  std::atomic<int> there{0}, taken{0};
  std::thread sleeper([&] {
    for (int had = 0; had < kPieces;) {
      bell.listen();
      if (there.load(std::memory_order_acquire) == had) bell.sleep(30s);
      bell.leave();
      had = there.load(std::memory_order_acquire);
      taken.store(had, std::memory_order_release);
      answer.ring();
    }
  });
  const auto begun = std::chrono::steady_clock::now();
  for (int i = 1; i <= kPieces; ++i) {
    there.store(i, std::memory_order_release);
    bell.ring();
    // Every so often until it has been taken: so that the sleeper does go to sleep.
    while (i % 16 == 0 && taken.load(std::memory_order_acquire) < i) {
      answer.listen();
      if (taken.load(std::memory_order_acquire) < i) answer.sleep(30s);
      answer.leave();
    }
  }
  sleeper.join();
  EXPECT_EQ(taken, kPieces);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 25s) << "a ring was lost: somebody slept to the end";
}

}  // namespace
}  // namespace kphi::netbox
