#include "drivers/iq/session/polling.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace polling_test {

using namespace std::chrono_literals;
using fake::Bytes;
using fake::Connected;
using fake::is_reply;
using fake::State;
using fake::Wire;

TEST(Telemetry, ReadsSpeedEveryCycleAndTheOthersInTurn) {
  Connected wire;
  wire.spin(1000);
  wire.run_for(200ms);
  wire.readings();
  wire.run_for(3s);
  std::map<MotorChannel, int> count;
  std::map<MotorChannel, double> value;
  for (const MotorReading& reading : wire.readings()) {
    ++count[reading.channel];
    value[reading.channel] = reading.value;
  }
  EXPECT_NEAR(count[MotorChannel::speed], 150, 1);
  constexpr std::size_t kChannels = kMotorChannels.size();
  for (std::size_t i = 1; i < kChannels; ++i)
    EXPECT_NEAR(count[static_cast<MotorChannel>(i)], 150.0 / (kChannels - 1), 1) << i;
  EXPECT_EQ(value[MotorChannel::speed], 1000);
  EXPECT_EQ(value[MotorChannel::supply_voltage], 12.5);
  EXPECT_EQ(value[MotorChannel::supply_current], 3.25);
  EXPECT_EQ(value[MotorChannel::motor_current], 10);
  EXPECT_EQ(value[MotorChannel::coil_temperature], 55.25);
  EXPECT_EQ(value[MotorChannel::derate], 1.0);
  EXPECT_EQ(value[MotorChannel::drive_mode], 3);
}

TEST(Telemetry, AsksBothOfACycleInOneBatch) {
  Connected wire(100ms);
  wire.batches.clear();
  wire.run_for(1s);
  const auto both = [](const auto& batch) { return batch.second.size() >= 14; };
  EXPECT_EQ(std::count_if(wire.batches.begin(), wire.batches.end(), both), 50 + 2)
      << "twice it looks for a restart alone";
  EXPECT_EQ(wire.batches.size(), 50u + 2u);
}

TEST(Telemetry, IsNotDoubledWhenTheModuleIsSlow) {
  Connected wire;
  wire.latency = 55ms;
  wire.run_for(100ms);
  wire.module.heard.clear();
  wire.run_for(1s);
  const auto speeds = wire.module.count([](const auto& m) { return m.type == 50 && m.sub == 13; });
  EXPECT_LE(speeds, 1000u / 55 + 1);
  EXPECT_GE(speeds, 15u);
  EXPECT_GT(wire.session.counters().skipped_polls, 0u);
}

TEST(Telemetry, StaysInsideTheCreditWindow) {
  for (const std::size_t credit : {18u, 21u, 63u}) {
    Settings settings;
    settings.credit_bytes = credit;
    settings.telemetry_hz = 1000;
    settings.slow_hz = 1000;
    Wire wire(settings);
    wire.latency = 9ms;
    std::size_t most = 0;
    wire.spoil = [&](Bytes&, Duration&) { most = std::max(most, 7 * (wire.replies_on_their_way() + 1)); };
    wire.session.connect(wire.now);
    for (int i = 0; i < 3000; ++i) {
      wire.run_for(100us);
      if (wire.session.state() == State::ready && i % 50 == 0) wire.spin(100 + i);
    }
    EXPECT_LE(most, credit);
    EXPECT_GE(most, std::min<std::size_t>(credit, 42) / 7 * 7) << "pipelined";
  }
}

TEST(Telemetry, StampsTheMiddleLessTheTimeOnTheWire) {
  Settings settings;
  settings.wire_byte_time = 100us;
  Wire wire(settings);
  wire.latency = 7 * 100us + 11 * 100us + 2ms;
  wire.connect();
  wire.run_for(1s);
  wire.readings();
  wire.batches.clear();
  wire.run_for(20ms);
  ASSERT_EQ(wire.batches.size(), 1u);
  wire.run_for(10ms);
  const auto readings = wire.readings();
  EXPECT_TRUE(std::any_of(readings.begin(), readings.end(), [&](const MotorReading& reading) {
    return reading.channel == MotorChannel::speed && Instant(reading.time_ns) == wire.batches[0].first + 700us + 1ms &&
           Duration(reading.uncertainty_ns) == 1ms;
  }));
}

TEST(Telemetry, UncertaintyCoversTheMomentOfMeasurement) {
  Connected wire(30ms);
  std::mt19937 random(5);
  wire.spoil = [&](Bytes& reply, Duration& delay) {
    delay = std::chrono::microseconds(20 + random() % 9000);
    const Duration until_measured = delay * (random() % 11) / 10;
    if (is_reply(reply, 50, 13)) {
      reply = fake::message(50, 13, 3, 0, fake::f32(to_seconds(wire.now + until_measured)));
    }
  };
  wire.run_for(30ms);
  wire.readings();
  wire.run_for(2s);
  int checked = 0;
  for (const MotorReading& reading : wire.readings()) {
    if (reading.channel != MotorChannel::speed) continue;
    EXPECT_LE(std::abs(reading.value - 1e-9 * reading.time_ns), 1e-9 * reading.uncertainty_ns + 1e-6);
    ++checked;
  }
  EXPECT_GT(checked, 90);
}

TEST(Telemetry, KeepsABoundedNumberOfReadings) {
  Settings settings;
  settings.telemetry_hz = 10000;
  Wire wire(settings);
  wire.latency = 10us;
  wire.connect();
  wire.run_for(1s);
  EXPECT_EQ(wire.readings().size(), 4096u);
  EXPECT_GT(wire.session.counters().dropped_readings, 0u);
}

TEST(Telemetry, AsksForAllThatIsWantedInEveryCycle) {
  Settings settings;
  settings.telemetry_hz = 100;
  settings.slow_hz = 10;
  settings.every_cycle = {MotorChannel::speed, MotorChannel::motor_current, MotorChannel::supply_voltage,
                          MotorChannel::supply_current};
  Connected wire(100ms, settings);
  wire.run_for(1s);
  std::map<MotorChannel, int> count;
  for (const MotorReading& reading : wire.readings()) ++count[reading.channel];
  for (const MotorChannel quantity : settings.every_cycle) EXPECT_NEAR(count[quantity], 100, 1) << name_of(quantity);
  EXPECT_NEAR(count[MotorChannel::coil_temperature] + count[MotorChannel::derate] + count[MotorChannel::drive_mode] +
                  count[MotorChannel::drive_pwm] + count[MotorChannel::fault_now],
              10, 1);
}

}  // namespace polling_test
}  // namespace kphi::iq
