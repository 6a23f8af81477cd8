// The plug is pulled and put in again, the module restarts or falls silent: what is found afterwards coasts, and does
// not spin again.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <optional>

#include "base/error.hpp"
#include "drivers/iq/link/motor.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"
#include "test/soon.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::iq {
namespace reconnect_test {

using namespace std::chrono_literals;
using fake::Module;
using fake::ModuleOnALine;
using std::chrono::steady_clock;
using test::soon;
using test::TemporaryFolder;

/// A module behind a name that stays while the terminal behind it changes.
struct Bench {
  TemporaryFolder folder;
  std::filesystem::path name = folder.path() / "motor";
  std::unique_ptr<ModuleOnALine> line;
  SteadyClock clock;
  std::unique_ptr<Motor> motor;

  Bench() {
    plug_in();
    motor = std::make_unique<Motor>(name.string(), 115200, Settings{}, clock);
  }
  ~Bench() { motor.reset(); }
  void plug_in(const std::function<void(Module&)>& prepare = [](Module&) {}) {
    line = std::make_unique<ModuleOnALine>(prepare);
    std::filesystem::create_symlink(line->device(), name);
  }
  void pull() {
    std::filesystem::remove(name);
    line->unplug();
  }
  void spin(double speed) {
    motor->spin_at(RadPerSec(speed));
    ASSERT_TRUE(line->heard_a_speed(speed));
  }
  bool dead() const {
    return soon([&] {
      motor->renew();
      return !motor->alive();
    });
  }
  /// The module has been found again and set up.
  bool reconnected(std::uint64_t times = 1) const {
    return soon([&] { return motor->counters().reconnections == times; });
  }
  bool noted(EventKind kind) {
    for (const StreamEvent& event : motor->take_events()) seen |= 1u << static_cast<int>(event.kind);
    return (seen & 1u << static_cast<int>(kind)) != 0;
  }
  unsigned seen = 0;
};

TEST(Unplugging, IsNoticedWithinATenthOfASecond) {
  Bench bench;
  bench.spin(1000);
  bench.pull();
  EXPECT_TRUE(soon([&] { return !bench.motor->alive(); }, 100ms));
  EXPECT_TRUE(soon([&] { return bench.noted(EventKind::motor_port_lost); }));
  EXPECT_NE(bench.motor->failure().find("unplugged"), std::string::npos) << bench.motor->failure();
  EXPECT_THROW(bench.motor->spin_at(RadPerSec(100)), DeviceError);
}

TEST(Replugging, FindsTheModuleAgainByTheSameNameAndCoastsIt) {
  Bench bench;
  bench.spin(1000);
  bench.pull();
  ASSERT_TRUE(soon([&] { return !bench.motor->alive(); }));
  bench.plug_in([](Module& m) { m.values[{50, 0}] = fake::u8(3); });
  ASSERT_TRUE(bench.reconnected()) << bench.motor->failure();
  EXPECT_TRUE(bench.line->with([](Module& m) { return m.heard.at(0).is_coast(); })) << "before anything else";
  EXPECT_FALSE(bench.motor->alive());
  EXPECT_NE(bench.motor->failure().find("unplugged"), std::string::npos);
  EXPECT_THROW(bench.motor->spin_at(RadPerSec(100)), DeviceError);
  bench.motor->renew();
  EXPECT_EQ(bench.line->motions(), 0u) << "it does not spin by itself";
}

TEST(Replugging, RefusesAnotherModuleUntilTheRightOneIsBack) {
  Bench bench;
  bench.pull();
  ASSERT_TRUE(soon([&] { return !bench.motor->alive(); }));
  bench.plug_in([](Module& m) { m.values[{5, 4}] = fake::u32(0xDEADBEEF); });
  ASSERT_TRUE(soon([&] { return bench.noted(EventKind::motor_another_module); }));
  EXPECT_THROW(bench.motor->spin_at(RadPerSec(100)), DeviceError);
  EXPECT_EQ(bench.line->motions(), 0u);
  EXPECT_NE(bench.motor->failure().find("another module"), std::string::npos) << bench.motor->failure();
  bench.pull();
  bench.plug_in();
  EXPECT_TRUE(bench.reconnected());
}

TEST(Replugging, OfAnIntermittentPlugEndsCoasting) {
  Bench bench;
  bench.spin(1000);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    bench.pull();
    ASSERT_TRUE(soon([&] { return !bench.motor->alive(); }));
    bench.plug_in();
    ASSERT_TRUE(bench.reconnected(i));
    EXPECT_TRUE(bench.line->left_coasting());
    EXPECT_EQ(bench.line->motions(), 0u);
  }
}

TEST(Unplugging, DoesNotKeepTheDestructorWaiting) {
  Bench bench;
  bench.pull();
  ASSERT_TRUE(soon([&] { return !bench.motor->alive(); }));
  const auto start = steady_clock::now();
  bench.motor.reset();
  EXPECT_LT(steady_clock::now() - start, 500ms);
}

TEST(Unplugging, EndsAStopThatIsWaitedFor) {
  Bench bench;
  bench.spin(3000);
  const auto asked = [](const Module& m) { return m.count([](const auto& h) { return h.type == 50 && h.sub == 13; }); };
  const auto before = bench.line->with(asked);
  ASSERT_TRUE(bench.line->wait_for([&](const Module& m) { return asked(m) > before + 1; })) << "its speed is known";
  auto stop = std::async(std::launch::async, [&] { return bench.motor->stop({.deceleration = 1000}); });
  ASSERT_TRUE(bench.line->wait_for(
      [](const Module& m) { return m.last_motion()->is_speed() && fake::to_f32(m.last_motion()->data) < 2900; }));
  bench.pull();
  EXPECT_EQ(stop.get().outcome, StopReport::Outcome::unconfirmed);
}

TEST(Restarting, OfTheModuleIsNoticedAndItIsSetUpAgain) {
  Bench bench;
  bench.spin(1000);
  bench.line->with([](Module& m) { m.restart(); });
  ASSERT_TRUE(bench.dead());
  EXPECT_TRUE(soon([&] { return bench.noted(EventKind::motor_reset); }));
  ASSERT_TRUE(bench.reconnected());
  EXPECT_EQ(bench.line->with([](Module& m) { return fake::to_f32(m.values.at({52, 15})); }), 0.5f);
  EXPECT_TRUE(bench.line->left_coasting());
}

TEST(Silence, OfTheModuleEndsWhenItIsPoweredAgain) {
  Bench bench;
  bench.spin(1000);
  bench.line->with([](Module& m) { m.mute = true; });
  ASSERT_TRUE(bench.dead());
  EXPECT_TRUE(soon([&] { return bench.noted(EventKind::motor_silent); }));
  bench.line->with([](Module& m) { m.mute = false; });
  ASSERT_TRUE(bench.reconnected());
  EXPECT_TRUE(bench.line->left_coasting());
  EXPECT_FALSE(bench.motor->alive());
}

}  // namespace reconnect_test
}  // namespace kphi::iq
