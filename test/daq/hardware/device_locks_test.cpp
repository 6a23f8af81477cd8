#include "daq/hardware/device_locks.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <future>
#include <optional>

#include "test/daq/bench_fixture.hpp"
#include "test/refusal.hpp"

namespace kphi::daq {
namespace device_locks_test {

using testing::ElementsAre;
using testing::HasSubstr;

profiles::BenchConfig config(const std::string& host, int port, const std::string& device,
                             const std::string& supply = {}) {
  profiles::BenchConfig config;
  config.netbox.host = host;
  config.netbox.rdt_port = static_cast<std::uint16_t>(port);
  config.iq.device = device;
  if (!supply.empty()) config.supply.emplace().uri = supply;
  return config;
}

TEST(LockNames, AreOfTheDeviceAndNotOfHowABenchFileNamesIt) {
  const test::TemporaryFolder folder;
  const auto port = folder.path() / "ttyUSB0";
  std::ofstream(port) << "";
  std::filesystem::create_symlink(port, folder.path() / "by-id");
  const auto direct = lock_names(config("127.0.0.1", 49152, port.string()));
  EXPECT_EQ(lock_names(config("localhost", 49152, (folder.path() / "by-id").string())), direct);
  EXPECT_THAT(direct, ElementsAre("Net Box 127.0.0.1:49152", "port " + std::filesystem::canonical(port).string()));
}

TEST(LockNames, OfASupplyAreItsPortOrItsAddress) {
  const auto name = [](const std::string& uri) { return lock_names(config("127.0.0.1", 1, "/dev/a", uri)).at(2); };
  EXPECT_EQ(name("modbus-rtu:/dev/null?model=RD6018"), "port /dev/null");
  EXPECT_EQ(name("modbus-tcp:127.0.0.1:502"), "supply 127.0.0.1:502");
  EXPECT_EQ(name("scpi-tcp:127.0.0.1:502"), "supply 127.0.0.1:502");
  EXPECT_EQ(name("scpi-usb:1ab1:0e11"), "supply 1ab1:0e11");
}

TEST(LockNames, OfABenchInsideTheProcessAreNone) { EXPECT_TRUE(lock_names(test::deterministic_config(1)).empty()); }

/// Names that no other test and no other user has.
std::string own_name(const char* what) { return fmt::format("test {} {}", ::getpid(), what); }

TEST(DeviceLocks, RefuseTheSecondAndSayWhoHasIt) {
  const auto first = lock_devices({own_name("a"), own_name("b")});
  EXPECT_THAT(
      refusal([] {
        return lock_devices({own_name("c"), own_name("b")});
      }),
      AllOf(HasSubstr(own_name("b")), HasSubstr(fmt::format("process {} (", ::getpid())), HasSubstr("kill -INT")));
  EXPECT_NO_THROW((void)lock_devices({own_name("c")})) << "what the refused one had taken is free again";
}

TEST(DeviceLocks, WaitForTheSentinelOfAProgramThatIsDead) {
  const pid_t dead = ::fork();
  if (dead == 0) ::_exit(0);
  ASSERT_EQ(::waitpid(dead, nullptr, 0), dead);
  const std::filesystem::path file = lock_file(own_name("d"));
  std::ofstream(file) << fmt::format(R"({{"pid": {}, "command": "kphi run", "since": "2021-05-30T08:00:00Z"}})", dead);
  std::optional<Descriptor> sentinel(std::in_place, ::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  ASSERT_EQ(::flock(sentinel->number(), LOCK_EX | LOCK_NB), 0);
  auto next = std::async(std::launch::async, [] { return lock_devices({own_name("d")}).size(); });
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(60)), std::future_status::timeout) << "it waits";
  sentinel.reset();
  EXPECT_EQ(next.get(), 1u);
}

TEST(FolderLock, RefusesTheSecondWriter) {
  const test::TemporaryFolder folder;
  const auto results = results::CampaignFolder::create(folder.path(), "u", "c");
  {
    const auto first = lock_folder(results);
    EXPECT_THROW((void)lock_folder(results), InUse);
  }
  EXPECT_NO_THROW((void)lock_folder(results));
}

}  // namespace device_locks_test
}  // namespace kphi::daq
