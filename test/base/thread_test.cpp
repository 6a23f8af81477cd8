#include "base/thread.hpp"

#include <gtest/gtest.h>
#include <poll.h>

#include "base/descriptor.hpp"

namespace kphi::thread_test {

bool blocks(int signal) {
  sigset_t now;
  pthread_sigmask(SIG_SETMASK, nullptr, &now);
  return sigismember(&now, signal) == 1;
}

TEST(StartThread, BlocksEverySignalThereAndNoneHere) {
  bool interrupt = false, terminate = false, hangup = false;
  start_thread({"a test"}, [&] {
    interrupt = blocks(SIGINT);
    terminate = blocks(SIGTERM);
    hangup = blocks(SIGHUP);
  }).join();
  EXPECT_TRUE(interrupt && terminate && hangup);
  EXPECT_FALSE(blocks(SIGINT) || blocks(SIGTERM) || blocks(SIGHUP));
}

bool readable(const Wakeup& event) {
  pollfd waited{event.descriptor(), POLLIN, 0};
  return ::poll(&waited, 1, 0) == 1;
}

TEST(Wakeup, IsReadableFromRaiseToClear) {
  Wakeup event;
  EXPECT_FALSE(readable(event));
  EXPECT_FALSE(event.clear());
  event.raise();
  event.raise();
  EXPECT_TRUE(readable(event));
  EXPECT_TRUE(event.clear());
  EXPECT_FALSE(readable(event));
}

TEST(Descriptor, ClosesOnceWhoeverHoldsIt) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const Descriptor reader(ends[0]);
  {
    Descriptor writer(ends[1]);
    Descriptor moved(std::move(writer));
    EXPECT_EQ(moved.number(), ends[1]);
    char byte = 0;
    EXPECT_EQ(::write(moved.number(), &byte, 1), 1);
  }
  char bytes[2];
  EXPECT_EQ(::read(reader.number(), bytes, 2), 1);
  EXPECT_EQ(::read(reader.number(), bytes, 2), 0) << "the writing end is closed";
}

}  // namespace kphi::thread_test
