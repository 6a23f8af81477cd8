#include "drivers/iq/session/session.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace session_test {

using namespace std::chrono_literals;
using fake::Bytes;
using fake::Connected;
using fake::State;
using fake::Wire;

TEST(Spinning, IsRefusedUnlessReady) {
  Wire wire;
  EXPECT_THROW(wire.spin(100), std::logic_error);
  wire.session.connect(wire.now);
  EXPECT_THROW(wire.spin(100), std::logic_error);
  EXPECT_EQ(wire.module.count([](const auto& m) { return m.is_speed(); }), 0u);
}

TEST(Spinning, IsRefusedBeyondTheRangeAndForNonsense) {
  Connected wire;
  for (const double speed : {3450.1, -3451.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(wire.spin(speed), std::invalid_argument);
  }
  EXPECT_FALSE(wire.session.spinning());
}

TEST(Spinning, SendsTheSpeedWithItsSign) {
  Connected wire;
  wire.batches.clear();
  wire.spin(-12.5);
  ASSERT_EQ(wire.batches.size(), 1u);
  EXPECT_EQ(fake::hex(wire.batches[0].second), "55 06 34 05 01 00 00 48 C1 E6 8D");
  EXPECT_TRUE(wire.session.spinning());
  EXPECT_FALSE(wire.session.coasting());
}

TEST(Spinning, AtZeroIsACoast) {
  Connected wire;
  wire.spin(500);
  wire.spin(0);
  EXPECT_FALSE(wire.session.spinning());
  EXPECT_TRUE(wire.module.last_motion()->is_coast());
}

TEST(Rearming, IsRefusedUnlessReady) {
  Wire wire;
  EXPECT_THROW(wire.session.rearm(), std::logic_error);
  wire.connect();
  EXPECT_TRUE(wire.session.armed()) << "the first connection arms";
  wire.session.fail(EventKind::motor_port_lost, "unplugged", wire.now);
  EXPECT_THROW(wire.session.rearm(), std::logic_error);
  EXPECT_FALSE(wire.session.armed());
}

TEST(Soak, ARuinedLineNeverBringsAFalseValueAndNeverMotionAfterACoast) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    const auto chance = [&](int in) { return static_cast<int>(random() % static_cast<unsigned>(in)) == 0; };
    Connected wire;
    wire.spoil = [&](Bytes& reply, Duration& delay) {
      if (chance(20)) reply[random() % reply.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
      if (chance(30)) reply.resize(random() % reply.size());
      if (chance(30)) reply.insert(reply.begin(), {0x55, static_cast<std::uint8_t>(random() % 64), 0x32});
      if (chance(40)) delay += std::chrono::milliseconds(random() % 90);
      if (chance(60)) reply.clear();
    };
    wire.module.values[{50, 13}] = fake::f32(0);
    for (int i = 0; i < 60; ++i) {
      if (wire.session.state() == State::ready && chance(3)) wire.spin(100);
      if (chance(4)) wire.coast();
      wire.run_for(std::chrono::milliseconds(random() % 40));
      if (!wire.session.spinning() && wire.module.last_motion() != nullptr) {
        ASSERT_TRUE(wire.module.last_motion()->is_coast()) << "seed " << seed;
      }
    }
    wire.coast();
    wire.spoil = nullptr;
    wire.run_for(4s);
    EXPECT_TRUE(wire.module.last_motion()->is_coast()) << "seed " << seed;
    EXPECT_TRUE(wire.session.coasting()) << "seed " << seed;
    for (const MotorReading& reading : wire.readings()) {
      ASSERT_TRUE(reading.channel != MotorChannel::speed || reading.value == 0 || reading.value == 100)
          << "seed " << seed << ": " << reading.value;
      ASSERT_TRUE(reading.channel != MotorChannel::supply_voltage || reading.value == 12.5) << "seed " << seed;
    }
  }
}

}  // namespace session_test
}  // namespace kphi::iq
