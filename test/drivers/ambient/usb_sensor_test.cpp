// The true libusb, the driver of the bridge and that of the sensor, against a simulated bridge and sensor that share no
// line with them; each fault alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "base/random.hpp"
#include "drivers/ambient/ambient_worker.hpp"
#include "drivers/ambient/bme280.hpp"
#include "drivers/sim/usb/mcp2221.hpp"
#include "test/drivers/sim_equipment/usb_socket.hpp"
#include "test/drivers/usb/virtual_bus.hpp"

namespace kphi::ambient {
namespace usb_sensor_test {

using namespace std::chrono_literals;
using sim::FaultKind;
using testing::HasSubstr;

constexpr const char* kAddress = "usb:04d8:00dd:0001";

/// The integer formulas drop the lowest bits of the counts (aT >> 3): 0.0025 °C beside the steps of 0.01 °C, and
/// through the temperature 0.2 Pa beside the counts of 0.18 Pa.
void expect_equal(const Air& air, const sim::TrueAir& truth) {
  EXPECT_NEAR(air.temperature_c, truth.temperature_c, 0.0078);
  EXPECT_NEAR(air.pressure_pa, truth.pressure_pa, 0.5);
  EXPECT_NEAR(air.relative_humidity, truth.relative_humidity, 1e-4) << "counts of 0.008 %";
}

class UsbSensorTest : public OnVirtualBus {
 protected:
  std::unique_ptr<Ambient> sensor() { return open(sensor_address(kAddress)); }
  std::unique_ptr<Ambient> plugged_sensor() {
    wire->plug(1, bridge);
    return sensor();
  }
  void expect_true_air(Ambient& from) { expect_equal(from.read(), truth); }
  /// The bridge's manual is kept.
  void TearDown() override {
    const sim::BridgeTruth seen = bridge.truth();
    EXPECT_EQ(seen.hasty, 0u);
    EXPECT_EQ(seen.malformed, 0u);
  }

  sim::TrueAir truth{21.37, 98'765, 0.43};
  sim::Mcp2221 bridge{faults, "0001", sim::Bme280(truth)};
};

TEST_F(UsbSensorTest, ReadsTheTrueAirWithinItsResolution) {
  const auto air = plugged_sensor();
  EXPECT_THAT(air->identity(), HasSubstr("BME280 at 0x76 behind USB device 04d8:00dd, serial 0001, port 1-1"));
  Random random(1);
  for (int i = 0; i < 8; ++i) {
    truth = {25 + 30 * random.symmetric(), 85'000 + 25'000 * random.symmetric(), 0.5 + 0.4 * random.symmetric()};
    bridge.set_air(truth);
    expect_true_air(*air);
  }
  EXPECT_EQ(bridge.truth().overlapped, 0u) << "one command outstanding";
  EXPECT_EQ(bridge.truth().nacks, 0u);
}

TEST_F(UsbSensorTest, ReadsTheExampleOfTheDataSheet) {
  bridge.set_air({128422 / 5120.0, 25767233 / 256.0, 0.2241});
  const Air air = plugged_sensor()->read();
  EXPECT_DOUBLE_EQ(air.temperature_c, 25.08);
  EXPECT_NEAR(air.pressure_pa, 100653.25, 0.2);
}

TEST_F(UsbSensorTest, MovesAReportThereAndBackByInterruptTransfers) {
  wire->plug(1, bridge);
  const usb::Bus bus;
  const auto device = bus.open(UsbAddress::parse(kAddress));
  device->claim(2);
  const usb::Interface& hid = device->interfaces().at(2);
  ASSERT_EQ(hid.class_code, 3);
  ASSERT_EQ(hid.endpoints.at(1).kind, usb::EndpointKind::interrupt);
  std::array<std::uint8_t, 64> report{0x10, 0, 0, 0x20, 0x75};
  EXPECT_EQ(device->write(hid.endpoints.at(1), report, 1000ms).bytes, 64u);
  report.fill(0);
  EXPECT_EQ(device->read(hid.endpoints.at(0), report, 1000ms).bytes, 64u);
  EXPECT_EQ(report[0], 0x10);
  EXPECT_EQ(report[3], 0x20);
  EXPECT_EQ(report[4], 0x75);
}

TEST_F(UsbSensorTest, IsFoundAtItsOtherAddress) {
  sim::Mcp2221 other(faults, "0001", sim::Bme280(truth, 0x77));
  wire->plug(1, other);
  const auto air = sensor();
  EXPECT_THAT(air->identity(), HasSubstr("0x77"));
  expect_true_air(*air);
  EXPECT_EQ(other.truth().nacks, 1u);
}

TEST_F(UsbSensorTest, SaysWhenNobodyIsBehindTheBridge) {
  break_with(FaultKind::ambient_nack, 1000);
  EXPECT_THAT(refusal([&] { (void)plugged_sensor(); }), HasSubstr("no device answers at this address"));
  EXPECT_THAT(refusal([&] { (void)open(sensor_address("usb:04d8:00dd:0002")); }), HasSubstr("not plugged in"));
}

TEST_F(UsbSensorTest, NamesAFaultThatComesOnceAndGoesOn) {
  const auto air = plugged_sensor();
  for (const auto& [kind, words] : {std::pair{FaultKind::ambient_nack, "no device answers at this address"},
                                    std::pair{FaultKind::ambient_stuck_bus, "held low"},
                                    std::pair{FaultKind::ambient_no_reply, "no answer in time"}}) {
    break_with(kind);
    EXPECT_THAT(refusal([&] { (void)air->read(); }), HasSubstr(words));
    expect_true_air(*air);
  }
}

TEST_F(UsbSensorTest, WaitsForABusyBridge) {
  break_with(FaultKind::ambient_busy, 3);
  const auto air = plugged_sensor();
  expect_true_air(*air);
  break_with(FaultKind::ambient_busy, 10);
  expect_true_air(*air);
}

TEST_F(UsbSensorTest, GivesUpABridgeThatStaysBusy) {
  const auto air = plugged_sensor();
  break_with(FaultKind::ambient_busy, 100'000);
  EXPECT_THAT(refusal([&] { (void)air->read(); }), HasSubstr("stays busy"));
  faults.set({});
  expect_true_air(*air);
}

TEST_F(UsbSensorTest, NeverTakesALateAnswerForThatToTheSameCommand) {
  const auto air = plugged_sensor();
  break_with(FaultKind::ambient_late, 1, 700ms);
  EXPECT_THAT(refusal([&] { (void)air->read(); }), HasSubstr("no answer in time"));
  expect_true_air(*air);
  const std::uint64_t overlapped = bridge.truth().overlapped;
  EXPECT_LE(overlapped, 1u);
  expect_true_air(*air);
  EXPECT_EQ(bridge.truth().overlapped, overlapped) << "in step again";
}

TEST_F(UsbSensorTest, TakesUpABridgeThatAPredecessorLeftInTheMiddle) {
  std::vector<std::uint8_t> report(64, 0);
  report[0] = 0x10;  // its answer was not fetched, and is one to the first command of whoever comes next
  (void)bridge.out(0x03, report);
  expect_true_air(*plugged_sensor());
}

TEST_F(UsbSensorTest, ClearsAHaltedEndpoint) {
  const auto air = plugged_sensor();
  break_with(FaultKind::ambient_stall, 2);
  expect_true_air(*air);
}

TEST_F(UsbSensorTest, RefusesACalibrationOfWhichOneByteWasDamaged) {
  wire->plug(1, bridge);
  using Damage = std::pair<std::uint16_t, std::uint16_t>;
  for (const auto& [at, value] : {Damage{0x89, 0x6A}, Damage{0x8E, 0x00}, Damage{0xE5, 0xFF}}) {
    faults.set({{.kind = FaultKind::ambient_reads_as, .count = 1, .address = at, .value = value}});
    EXPECT_THAT(refusal([&] { (void)sensor(); }), HasSubstr("two readings differ"));
  }
  expect_true_air(*sensor());
}

TEST_F(UsbSensorTest, RefusesAnotherChip) {
  faults.set({{.kind = FaultKind::ambient_reads_as, .address = 0xD0, .value = 0x58}});
  EXPECT_THAT(refusal([&] { (void)plugged_sensor(); }), HasSubstr("chip id 0x58 instead of 0x60"));
}

TEST_F(UsbSensorTest, EndsAtOnceWhenItIsUnpluggedInTheMiddle) {
  auto air = plugged_sensor();
  break_with(FaultKind::ambient_no_reply);
  const std::uint64_t before = bridge.truth().commands;
  auto failure = std::async(std::launch::async, [&] { return refusal([&] { (void)air->read(); }); });
  ASSERT_TRUE(soon([&] { return bridge.truth().commands > before; })) << "it waits for the answer";
  wire->unplug(1);
  EXPECT_THAT(failure.get(), HasSubstr("unplugged"));
  EXPECT_THAT(refusal([&] { (void)air->read(); }), HasSubstr("unplugged"));
  expect_true_air(*plugged_sensor());
}

TEST_F(UsbSensorTest, ComesBackByItselfAfterAReplug) {
  wire->plug(1, bridge);
  const AmbientWorker worker([] { return open(sensor_address(kAddress)); }, clock, {10ms, 20ms, 80ms});
  ASSERT_TRUE(worker.wait_for_first(10s)) << worker.failure();
  wire->unplug(1);
  ASSERT_TRUE(soon([&] { return worker.failure().find("not plugged in") != std::string::npos; }));
  EXPECT_TRUE(worker.newest()) << "what was measured stays, and grows old";
  const Instant last = worker.newest()->at;
  wire->plug(1, bridge);
  ASSERT_TRUE(soon([&] { return worker.newest()->at > last; })) << worker.failure();
  expect_equal(worker.newest()->air, truth);
}

TEST_F(UsbSensorTest, IsPulledOutAndPluggedInAsAScriptSays) {
  faults.set({sim::Fault{FaultKind::ambient_unplug, clock.now() + 100ms, 50ms}});
  const usb::Bus bus;
  const sim::UsbSocket socket(*wire, 1, bridge, faults);
  ASSERT_TRUE(soon([&] { return bus.list().size() == 1; }));
  ASSERT_TRUE(soon([&] { return bus.list().empty(); }));
  ASSERT_TRUE(soon([&] { return bus.list().size() == 1; }));
}

TEST_F(UsbSensorTest, IsOpenedAgainAfterABridgeThatWasSlowToLetGo) {
  auto air = plugged_sensor();
  expect_true_air(*air);
  break_with(FaultKind::ambient_slow_close, 1, 400ms);
  const auto began = std::chrono::steady_clock::now();
  air.reset();
  EXPECT_GE(std::chrono::steady_clock::now() - began, 400ms);
  expect_true_air(*sensor());
}

TEST_F(UsbSensorTest, BearsTransfersThatTakeAlmostHalfASecond) {
  const auto air = plugged_sensor();
  break_with(FaultKind::ambient_late, 3, 440ms);
  expect_true_air(*air);
}

}  // namespace usb_sensor_test
}  // namespace kphi::ambient
