#include "drivers/iq/session/reset_watch.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace {

using namespace std::chrono_literals;
using fake::State;
using fake::Wire;

struct Restart {
  const char* name;
  void (*happen)(fake::Module&);
};

class EveryRestart : public testing::TestWithParam<Restart> {};

TEST_P(EveryRestart, IsNoticedNamedAndNeverFollowedByMotion) {
  Wire wire;
  wire.connect();
  wire.spin(1000);
  wire.run_for(600ms);
  EXPECT_EQ(wire.session.state(), State::ready);
  (void)wire.session.take_events();
  const auto speeds = [&] { return wire.module.count([](const auto& m) { return m.is_speed(); }); };
  const auto before = speeds();
  GetParam().happen(wire.module);
  ASSERT_TRUE(wire.run_to_state(State::failed, 300ms));
  const auto events = wire.session.take_events();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::module_reset);
  EXPECT_TRUE(spoils_a_run(events[0].kind));
  EXPECT_EQ(wire.session.counters().module_resets, 1u);
  EXPECT_NE(wire.session.failure().find("restarted by itself"), std::string::npos);
  wire.run_for(100ms);
  EXPECT_TRUE(wire.session.coasting());
  wire.connect();
  wire.run_for(1s);
  EXPECT_EQ(speeds(), before);
  EXPECT_THROW(wire.spin(1000), std::logic_error) << "the owner has not seen it yet";
  EXPECT_EQ(fake::to_f32(wire.module.values.at({52, 15})), 0.5f) << "its settings are there again";
  wire.session.rearm();
  wire.spin(900);
  EXPECT_EQ(speeds(), before + 1);
}

INSTANTIATE_TEST_SUITE_P(Session, EveryRestart,
                         testing::Values(Restart{"UptimeGoesBackwards", [](fake::Module& m) { m.restart(); }},
                                         Restart{"UnderVoltageBit",
                                                 [](fake::Module& m) {
                                                   m.values[{84, 1}] = fake::u8(1);
                                                 }}),
                         [](const auto& restart) { return std::string(restart.param.name); });

TEST(Restarts, AreNotSeenInOtherFaultsNorInBitsOfBefore) {
  Wire wire;
  wire.module.values[{84, 1}] = fake::u8(0x01);
  wire.connect();
  wire.module.values[{84, 1}] = fake::u8(0x41);
  wire.run_for(2s);
  EXPECT_EQ(wire.session.state(), State::ready);
}

TEST(Restarts, AreNotSeenWhenTheTimeIsSet) {
  Wire wire;
  wire.connect();
  wire.run_for(1s);
  wire.session.inquire({{find("system_control.time"), 0.0}}, wire.now);
  wire.flush();
  wire.run_for(2s);
  EXPECT_EQ(wire.session.state(), State::ready) << wire.session.failure();
  EXPECT_TRUE(wire.session.inquiries().replies().at(0).accepted);
}

}  // namespace
}  // namespace kphi::iq
