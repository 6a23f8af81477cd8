#include "daq/hardware/sleep_inhibitor.hpp"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <system_error>

#include "base/descriptor.hpp"
#include "test/daq/private_bus.hpp"

namespace kphi::daq {
namespace sleep_inhibitor_test {

using namespace std::chrono_literals;
using test::Inhibitor;
using test::LogindMock;
using test::PrivateBus;
using test::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

constexpr auto kAll = "sleep:idle:handle-lid-switch";

Inhibitor kphi_holds(const std::string& what) {
  return {what, "kphi", "the motor of the test stand may turn", "block"};
}

auto line_that_names(const std::string& cause) {
  return AllOf(StartsWith("this computer may go to sleep during the run: "), HasSubstr(cause),
               EndsWith("`systemctl mask sleep.target`"), Not(HasSubstr("\n")));
}

void expect_none(const SleepInhibitor& inhibitor, const std::string& cause) {
  EXPECT_THAT(inhibitor.why_not(), line_that_names(cause));
}

/// A system bus that is only a socket: connections are accepted by the kernel and never served.
class DeafSocket {
 public:
  explicit DeafSocket(bool listens) {
    const std::string path = (folder_ / "bus").string();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    if (bind(socket_.number(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
        (listens && listen(socket_.number(), 0) != 0))
      throw std::system_error(errno, std::generic_category(), path);
    setenv("DBUS_SYSTEM_BUS_ADDRESS", ("unix:path=" + path).c_str(), 1);
  }
  ~DeafSocket() { unsetenv("DBUS_SYSTEM_BUS_ADDRESS"); }

 private:
  TemporaryFolder folder_;
  Descriptor socket_{socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
};

/// How long it took to be done without a lock; sd-bus by itself would wait 25 s or 90 s.
void expect_soon(std::chrono::steady_clock::time_point begin) {
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
}

TEST(SleepInhibitorWithoutABus, SaysThatThereIsNone) {
  const TemporaryFolder folder;
  setenv("DBUS_SYSTEM_BUS_ADDRESS", ("unix:path=" + (folder / "none").string()).c_str(), 1);
  expect_none(SleepInhibitor(), "no connection to the system bus (No such file or directory)");
  unsetenv("DBUS_SYSTEM_BUS_ADDRESS");
}

TEST(SleepInhibitorWithoutABus, SaysThatItRefusesConnections) {
  const DeafSocket bus(false);
  expect_none(SleepInhibitor(), "no connection to the system bus (Connection refused)");
}

TEST(SleepInhibitorWithoutABus, GivesUpOnOneThatNeverGreetsBack) {
  const DeafSocket bus(true);
  const auto begin = std::chrono::steady_clock::now();
  expect_none(SleepInhibitor(), "no connection to the system bus (Connection timed out)");
  expect_none(SleepInhibitor(), "no connection to the system bus (");  // the first one still fills the kernel's queue
  expect_soon(begin);
}

class SleepInhibitorOnABus : public testing::Test {
 protected:
  void SetUp() override {
    if (!LogindMock::available()) GTEST_SKIP() << "apt install dbus-daemon python3-dbusmock";
    bus_.emplace();
  }

  std::optional<PrivateBus> bus_;
};

TEST_F(SleepInhibitorOnABus, HoldsWhileItLives) {
  const LogindMock logind(*bus_);
  {
    const SleepInhibitor inhibitor;
    EXPECT_EQ(inhibitor.why_not(), "");
    EXPECT_THAT(logind.inhibitors(), ElementsAre(kphi_holds(kAll)));
  }
  EXPECT_THAT(logind.inhibitors_once_they_are(0), IsEmpty());
}

TEST_F(SleepInhibitorOnABus, LeavesNothingToAChildOfTheProgram) {
  const LogindMock logind(*bus_);
  std::optional<SleepInhibitor> inhibitor(std::in_place);
  test::Process child({"/usr/bin/python3", "-c", "import signal; print('up', flush=True); signal.pause()"});
  child.wait_for("up");
  EXPECT_THAT(logind.inhibitors(), SizeIs(1));
  inhibitor.reset();
  EXPECT_THAT(logind.inhibitors_once_they_are(0), IsEmpty());
}

TEST_F(SleepInhibitorOnABus, IsTakenForEachRunAnew) {
  const LogindMock logind(*bus_);
  std::vector<double> took_ms;
  for (int run = 0; run < 21; ++run) {
    const auto begin = std::chrono::steady_clock::now();
    const SleepInhibitor inhibitor;
    took_ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    ASSERT_EQ(inhibitor.why_not(), "");
  }
  std::nth_element(took_ms.begin(), took_ms.begin() + 10, took_ms.end());
  RecordProperty("median_ms", std::to_string(took_ms[10]));
  EXPECT_THAT(logind.inhibitors_once_they_are(0), IsEmpty());
}

TEST_F(SleepInhibitorOnABus, DoesWithoutTheLidOrTakesSleepAloneWhereTheOthersAreRefused) {
  const LogindMock logind(*bus_);
  for (const auto& [refused, held] : {std::pair("lid", "sleep:idle"), std::pair(":", "sleep")}) {
    logind.refuse(refused);
    const SleepInhibitor inhibitor;
    EXPECT_EQ(inhibitor.why_not(), "");
    EXPECT_THAT(logind.inhibitors_once_they_are(1), ElementsAre(kphi_holds(held)));
  }
}

TEST_F(SleepInhibitorOnABus, SaysThatLogindRefused) {
  const LogindMock logind(*bus_);
  logind.refuse("");
  expect_none(SleepInhibitor(), "logind refused (Permission denied); log in at this computer itself, or ");
  EXPECT_THAT(logind.inhibitors(), IsEmpty());
}

TEST_F(SleepInhibitorOnABus, SaysThatThereIsNoLogind) {
  expect_none(SleepInhibitor(), "no logind on the system bus (The name org.freedesktop.login1 was not provided");
}

TEST_F(SleepInhibitorOnABus, GivesUpOnALogindThatNeverAnswers) {
  ASSERT_GE(sd_bus_request_name(bus_->connection(), "org.freedesktop.login1", 0), 0);
  const auto begin = std::chrono::steady_clock::now();
  expect_none(SleepInhibitor(), "no lock from logind (Connection timed out)");
  expect_soon(begin);
}

}  // namespace sleep_inhibitor_test
}  // namespace kphi::daq
