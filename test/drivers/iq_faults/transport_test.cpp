// The driver on a pseudo-terminal against the simulated bench: what only a real port can do. Wall time; waits have
// deadlines.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <optional>
#include <thread>

#include "base/error.hpp"
#include "drivers/iq/link/motor.hpp"
#include "drivers/iq/service/probe.hpp"
#include "drivers/sim/bench_server.hpp"
#include "test/soon.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::iq::test {
namespace transport_test {

using namespace std::chrono_literals;
using kphi::test::soon;

class OverAPort : public testing::Test {
 protected:
  ~OverAPort() override { stop(); }
  void serve(std::vector<sim::FaultEntry> entries, unsigned baud = 115200) {
    sim::ServerSettings settings;
    settings.device = (folder.path() / "motor").string();
    settings.control = (folder.path() / "control").string();
    settings.bench.module.baud = baud;
    settings.bench.motor_line_paced = true;
    settings.bench.motor_keep = sim::IqLine::Keep::replies;
    for (const auto& entry : entries) settings.bench.faults.push_back(sim::fault_of(entry));
    server.emplace(settings);
    device = server->addresses().device;
    thread = std::thread([this] { server->run(); });
  }
  static bool dies_spinning(Motor& motor) {
    motor.spin_at(RadPerSec(300));
    return soon([&] {
      motor.renew();
      return !motor.alive();
    });
  }
  void stop() {
    if (!thread.joinable()) return;
    server->request_stop();
    thread.join();
  }

  kphi::test::TemporaryFolder folder;
  std::string device;
  std::optional<sim::Server> server;
  std::thread thread;
  SteadyClock clock;
};

TEST_F(OverAPort, EveryReadingWasSent) {
  serve({});
  std::vector<MotorReading> readings(4096);
  {
    Motor motor(device, 115200, {}, clock);
    motor.spin_at(RadPerSec(300));
    ASSERT_TRUE(soon([&] {
      motor.renew();
      return motor.counters().replies > 100;
    }));
    readings.resize(motor.take(readings));
    EXPECT_EQ(motor.counters().crc_errors, 0u);
  }
  stop();
  EXPECT_GT(readings.size(), 50u);
  for (const MotorReading& reading : readings) {
    if (reading.channel != MotorChannel::speed) continue;
    const auto& log = server->motor_truth().log;
    EXPECT_TRUE(std::any_of(log.begin(), log.end(), [&](const sim::SentIqReply& sent) {
      float said = 0;
      if (sent.type == 50 && sent.sub == 13) std::memcpy(&said, sent.bytes.data(), 4);
      return sent.arrivals == 1 && static_cast<double>(said) == reading.value;
    })) << reading.value;
  }
}

TEST_F(OverAPort, AtAnotherRateTheDriverSaysThatNothingSensibleComes) {
  serve({}, 921600);
  EXPECT_THROW(Motor(device, 115200, {}, clock), DeviceError);
}

TEST_F(OverAPort, UnpluggedItIsDeadSoonAndCanBeOpenedAgainByItsName) {
  serve({{{"kind", "motor_unplug"}, {"at_s", "1"}, {"for_s", "0.3"}, {"other", "true"}}});
  {
    Motor motor(device, 115200, {}, clock);
    ASSERT_TRUE(dies_spinning(motor));
    EXPECT_NE(motor.failure(), "");
    EXPECT_THROW(motor.spin_at(RadPerSec(300)), DeviceError);
  }
  ASSERT_TRUE(soon([&] { return std::filesystem::exists(device); }));
  Motor again(device, 115200, {}, clock);
  EXPECT_TRUE(again.identity().uid().starts_with("00410018")) << "another module hangs there now";
}

TEST_F(OverAPort, WhenTheModuleFallsBackToItsFirstRateTheDriverGivesUpAndTheModuleCoasts) {
  serve({{{"kind", "motor_baud"}, {"at_s", "1"}}}, 921600);
  {
    Motor motor(device, 921600, {}, clock);
    ASSERT_TRUE(dies_spinning(motor));
  }
  stop();
  EXPECT_GT(server->motor_truth().done.at(sim::FaultKind::motor_baud), 0u);
}

TEST_F(OverAPort, AModuleAtAnotherRateIsFoundAndNothingIsChanged) {
  serve({}, 921600);
  for (int i = 0; i < 2; ++i) {
    const Probe found = probe({device, 115200, 0}, clock);
    ASSERT_EQ(found.findings.size(), 2u);
    EXPECT_EQ(found.findings[1].line(),
              "fault: module 0 answers at 921600 baud, not at 115200; write baud: 921600 under iq: in the bench file");
  }
  EXPECT_TRUE(probe({device, 921600, 0}, clock).answers()) << "it still speaks at its own rate";
}

}  // namespace transport_test
}  // namespace kphi::iq::test
