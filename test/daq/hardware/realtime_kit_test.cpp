#include "daq/hardware/realtime_kit.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <optional>

#include "results/file_layer.hpp"
#include "test/daq/private_bus.hpp"
#include "test/soon.hpp"

namespace kphi::daq {
namespace realtime_kit_test {

using testing::HasSubstr;

constexpr const char* kName = "org.freedesktop.RealtimeKit1";
constexpr const char* kPath = "/org/freedesktop/RealtimeKit1";

class RealtimeKit : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::LogindMock::available()) GTEST_SKIP() << "apt install dbus-daemon python3-dbusmock";
    bus_.emplace();
  }
  /// A kit whose answer is this line of Python.
  void start(const char* answer) {
    kit_ = bus_->start_owner(
        kName, {"/usr/bin/python3", "-m", "dbusmock", "--system", "--logfile", log(), kName, kPath, kName});
    ASSERT_GE(sd_bus_call_method(bus_->connection(), kName, kPath, "org.freedesktop.DBus.Mock", "AddMethod", nullptr,
                                 nullptr, "sssss", kName, "MakeThreadRealtime", "tu", "", answer),
              0);
  }
  [[nodiscard]] std::string log() const { return (folder_ / "kit.log").string(); }

  test::TemporaryFolder folder_;
  std::optional<test::PrivateBus> bus_;
  std::unique_ptr<test::Process> kit_;
};

TEST_F(RealtimeKit, IsAskedForTheThreadAndLetsTheKernelEndWhatComputesForever) {
  start("");
  EXPECT_EQ(ask_realtime_kit(4711, 10), "");
  EXPECT_TRUE(test::soon([&] {
    return results::read_text(log()).find("MakeThreadRealtime 4711 10") != std::string::npos;
  })) << results::read_text(log());
  rlimit computing{};
  ASSERT_EQ(getrlimit(RLIMIT_RTTIME, &computing), 0);
  EXPECT_LE(computing.rlim_max, 200'000u) << "us; it refuses those who have more";
}

TEST_F(RealtimeKit, ThatRefusesIsQuoted) {
  start("raise dbus.exceptions.DBusException('not today', name='org.freedesktop.DBus.Error.AccessDenied')");
  EXPECT_EQ(ask_realtime_kit(4711, 10), "RealtimeKit: not today");
}

TEST_F(RealtimeKit, ThatIsNotThereIsSaid) {
  EXPECT_THAT(ask_realtime_kit(4711, 10),
              HasSubstr("RealtimeKit: The name org.freedesktop.RealtimeKit1 was not provided"));
}

TEST(PriorityWords, NameConsequenceCauseAndNextMove) {
  EXPECT_EQ(priority_words(""), "");
  EXPECT_EQ(
      priority_words("Operation not permitted"),
      "other programs may delay kphi and so stop a run: no real-time priority (Operation not permitted); write "
      "`@dialout - rtprio 20` into /etc/security/limits.d/kphi.conf and log in again, or keep this computer idle");
}

}  // namespace realtime_kit_test
}  // namespace kphi::daq
