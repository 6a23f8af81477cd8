#include "base/real_time.hpp"

#include <gmock/gmock.h>
#include <linux/capability.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "base/thread.hpp"

namespace kphi::real_time_test {

using testing::HasSubstr;

/// The calling thread loses what lets it set priorities; the kernel keeps this for each thread by itself.
void become_ordinary() {
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_RTPRIO, &none);
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct none_effective[2]{};
  ::syscall(SYS_capset, &header, none_effective);
}

int policy() { return sched_getscheduler(0) & ~SCHED_RESET_ON_FORK; }

struct Asked {
  pid_t thread = 0;
  int priority = 0;
  std::string answer;
} asked;

std::string note(pid_t thread, int priority) {
  asked.thread = thread;
  asked.priority = priority;
  return asked.answer;
}

class RealTime : public testing::Test {
 protected:
  RealTime() { real_time::ask_through(&note); }
  ~RealTime() override { real_time::ask_through(nullptr); }
  /// Where nothing but the grantor can give it.
  template <class Act>
  static void as_ordinary(Act act) {
    start_thread({"ordinary"}, [&] {
      become_ordinary();
      act();
    }).join();
  }
};

TEST_F(RealTime, IsGrantedByTheKernelOrRefusedInWords) {
  start_thread({"a test"}, [] {
    if (real_time::ask()) {
      EXPECT_EQ(policy(), SCHED_RR);
      EXPECT_FALSE(real_time::ask()) << "it has it already";
      real_time::yield();
    } else {
      EXPECT_NE(real_time::refusal(), "");
    }
    EXPECT_EQ(policy(), SCHED_OTHER);
  }).join();
}

TEST_F(RealTime, IsAskedOfTheGrantorWhereTheKernelRefuses) {
  as_ordinary([] {
    asked.answer = "";
    EXPECT_TRUE(real_time::ask());
    EXPECT_EQ(asked.thread, gettid());
    EXPECT_EQ(asked.priority, real_time::kPriority);
  });
}

TEST_F(RealTime, TellsWhatBothSaidWhenBothRefuse) {
  as_ordinary([] {
    asked.answer = "RealtimeKit: no";
    EXPECT_FALSE(real_time::ask());
    EXPECT_THAT(real_time::refusal(), testing::AllOf(HasSubstr("not permitted"), HasSubstr("RealtimeKit: no")));
  });
}

TEST_F(RealTime, LastsAsLongAsItsScope) {
  start_thread({"a test"}, [] {
    { const real_time::Scope scope; }
    EXPECT_EQ(policy(), SCHED_OTHER);
  }).join();
}

TEST_F(RealTime, GoesToTheThreadsThatAreUrgent) {
  int urgent = -1, ordinary = -1;
  start_thread({"urgent", true}, [&] { urgent = policy(); }).join();
  start_thread({"ordinary"}, [&] { ordinary = policy(); }).join();
  EXPECT_EQ(ordinary, SCHED_OTHER);
  if (real_time::refusal().empty()) {
    EXPECT_EQ(urgent, SCHED_RR);
  }
}

TEST(Asleep, IsSeenByOthersOnceItIsOverdue) {
  EXPECT_EQ(real_time::overdue().count(), 0);
  {
    const real_time::Asleep long_since(-std::chrono::seconds(2)), not_yet(std::chrono::hours(1));
    EXPECT_GE(real_time::overdue(), std::chrono::seconds(2));
    EXPECT_LT(real_time::overdue(), std::chrono::seconds(60));
  }
  EXPECT_EQ(real_time::overdue().count(), 0);
}

TEST(Asleep, BeyondWhatCanBeSeenIsBorne) {
  std::vector<std::unique_ptr<real_time::Asleep>> many;
  for (int i = 0; i < 200; ++i) many.push_back(std::make_unique<real_time::Asleep>(std::chrono::hours(1)));
  EXPECT_EQ(real_time::overdue().count(), 0);
}

TEST(StartThread, GivesItsName) {
  std::string name(16, '\0');
  start_thread({"load cell"}, [&] { pthread_getname_np(pthread_self(), name.data(), name.size()); }).join();
  EXPECT_STREQ(name.c_str(), "load cell");
}

}  // namespace kphi::real_time_test
