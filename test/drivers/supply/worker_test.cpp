#include "drivers/supply/worker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <latch>
#include <optional>
#include <stdexcept>
#include <vector>

#include "base/error.hpp"
#include "drivers/supply/modbus_supply.hpp"
#include "test/drivers/supply/simulated_supply.hpp"
#include "test/held_lock.hpp"

namespace kphi::supply {

struct LockOfWorker : kphi::test::HeldLock {
  explicit LockOfWorker(Worker& worker) : HeldLock(worker.mutex_) {}
};

namespace worker_test {

using namespace std::chrono_literals;
using test::kShort;
using test::lasting;
using test::soon;
using test::what_of;
using testing::AllOf;
using testing::HasSubstr;

const Limits kTwelveVolts{Volts(12), Amperes(2.5), Volts(13), Amperes(3)};

/// What a fake supply was told and what it shall do; outlives it.
struct Script {
  std::atomic<bool> output{true};  ///< somebody has left it on
  std::atomic<int> looks{0}, offs{0};
  std::atomic<bool> read_fails{false}, off_fails{false}, on_fails{false}, throws_oddly{false};
  std::latch* inside = nullptr;   ///< counted down in the first look
  std::latch* release = nullptr;  ///< waited for there
};

class FakeSupply final : public Supply {
 public:
  explicit FakeSupply(Script& script) : script_(script) { identity_.device = "fake supply"; }
  [[nodiscard]] const Identity& identity() const noexcept override { return identity_; }
  Limits apply(const Limits& limits) override { return limits; }
  [[nodiscard]] SupplyReading read(const std::function<void()>& between) override {
    const int look = ++script_.looks;
    if (look == 1 && script_.inside != nullptr) {
      script_.inside->count_down();
      script_.release->wait();
    }
    if (script_.throws_oddly) throw 42;
    between();
    if (script_.read_fails) throw DeviceError("fake supply", "read", "the line is lost", "plug it in");
    SupplyReading reading;
    reading.time_ns = look;
    reading.output = script_.output;
    return reading;
  }
  void switch_off() override {
    ++script_.offs;
    if (script_.off_fails) throw DeviceError("fake supply", "switch off", "no answer");
    script_.output = false;
  }

 private:
  void switch_on() override {
    script_.output = true;
    if (script_.on_fails) throw DeviceError("fake supply", "switch on", "no answer");
  }
  Script& script_;
  Identity identity_;
};

std::unique_ptr<Supply> fake(Script& script) { return std::make_unique<FakeSupply>(script); }

class PoweredOutputOf : public testing::Test {
 protected:
  Script script;
  FakeSupply supply{script};
};

TEST_F(PoweredOutputOf, ASupplyIsOnWhileItLives) {
  script.output = false;
  {
    PoweredOutput on(supply);
    EXPECT_TRUE(script.output);
  }
  EXPECT_FALSE(script.output);
}

TEST_F(PoweredOutputOf, ASupplyEndsWithAnException) {
  EXPECT_THROW(
      {
        PoweredOutput on(supply);
        throw std::runtime_error("anything");
      },
      std::runtime_error);
  EXPECT_FALSE(script.output);
}

TEST_F(PoweredOutputOf, ASupplySwitchesOffWhenSwitchingOnWasNotConfirmed) {
  script.on_fails = true;
  EXPECT_THROW(PoweredOutput on(supply), DeviceError);
  EXPECT_FALSE(script.output);
  EXPECT_EQ(script.offs, 1);
}

TEST_F(PoweredOutputOf, ASupplySwitchesOffOnceAndTellsOfAFailure) {
  script.off_fails = true;
  {
    PoweredOutput on(supply);
    EXPECT_THAT(on.off(), HasSubstr("no answer"));
  }
  EXPECT_EQ(script.offs, 1);
}

/// Takes until there are so many.
std::vector<SupplyReading> taken(Worker& worker, std::size_t wanted) {
  std::vector<SupplyReading> all;
  EXPECT_TRUE(soon([&] {
    std::array<SupplyReading, 8> some;
    const std::size_t count = worker.take(some);
    all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(count));
    return all.size() >= wanted;
  }));
  return all;
}

class SupplyWorker : public testing::Test {
 protected:
  Script script;
  SteadyClock clock, fast{100};
};

TEST_F(SupplyWorker, HandsOutReadingsInOrder) {
  Worker worker(fake(script), fast, 5);
  const std::vector<SupplyReading> all = taken(worker, 20);
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i].time_ns, static_cast<std::int64_t>(i) + 1);
  ASSERT_TRUE(worker.newest());
  EXPECT_GE(worker.newest()->time_ns, all.back().time_ns);
  EXPECT_TRUE(worker.alive());
  EXPECT_EQ(worker.failure(), "");
}

TEST_F(SupplyWorker, DropsWhatNobodyTakes) {
  SteadyClock fastest(1000);
  Worker worker(fake(script), fastest, 100);
  EXPECT_TRUE(soon([&] { return script.looks > 4200; }));
  std::vector<SupplyReading> kept(5000);
  ASSERT_GE(worker.take(kept), 4096u);
  EXPECT_EQ(kept[4095].time_ns, 4096);
  EXPECT_GT(worker.newest()->time_ns, 4197) << "the newest is known though it was dropped";
}

TEST_F(SupplyWorker, SwitchesOffWhenItDies) {
  {
    Worker worker(fake(script), clock);
    worker.apply(kTwelveVolts);
    worker.switch_on();
    EXPECT_TRUE(script.output);
  }
  EXPECT_FALSE(script.output);
}

TEST_F(SupplyWorker, SwitchesOffWhatSomebodyElseHadSwitchedOn) {
  { Worker worker(fake(script), clock); }
  EXPECT_FALSE(script.output);
}

TEST_F(SupplyWorker, SwitchesOffWhenItsOwnerThrows) {
  EXPECT_THROW(
      {
        Worker worker(fake(script), clock);
        worker.switch_on();
        throw std::runtime_error("anything");
      },
      std::runtime_error);
  EXPECT_FALSE(script.output);
}

TEST_F(SupplyWorker, SwitchesOffWhenTheSupplyFailsAndWhateverIsThrownOnItsThread) {
  for (const auto& [fails, failure] :
       {std::pair{&Script::read_fails, "fake supply: read: the line is lost; plug it in"},
        std::pair{&Script::throws_oddly, "an unknown failure"}}) {
    Script failing;
    Worker worker(fake(failing), fast);
    worker.switch_on();
    failing.*fails = true;
    EXPECT_TRUE(soon([&] { return !worker.alive(); }));
    EXPECT_FALSE(failing.output);
    EXPECT_EQ(worker.failure(), failure);
  }
}

TEST_F(SupplyWorker, SaysThatItCouldNotSwitchOff) {
  Worker worker(fake(script), fast);
  worker.switch_on();
  script.off_fails = true;
  script.read_fails = true;
  EXPECT_TRUE(soon([&] { return !worker.alive(); }));
  EXPECT_GE(script.offs, 1);
  EXPECT_EQ(
      worker.failure(),
      "fake supply: read: the line is lost; plug it in; fake supply: switch off: no answer; its output may be on: "
      "switch it off by hand");
  EXPECT_FALSE(worker.switch_off_and_confirm(10s)) << "at once, since nobody can";
}

TEST_F(SupplyWorker, FailsWhenTheOrderToSwitchOffFails) {
  Worker worker(fake(script), clock);
  script.off_fails = true;
  EXPECT_FALSE(worker.switch_off_and_confirm(10s));
  EXPECT_FALSE(worker.alive());
  EXPECT_EQ(worker.failure(), "fake supply: switch off: no answer; its output may be on: switch it off by hand");
  EXPECT_GE(script.offs, 2);
}

TEST_F(SupplyWorker, SwitchesOffWhenAskedAndGoesOn) {
  Worker worker(fake(script), fast);
  worker.switch_on();
  EXPECT_TRUE(worker.switch_off_and_confirm(10s));
  EXPECT_FALSE(script.output);
  EXPECT_TRUE(worker.alive());
  worker.switch_on();
  EXPECT_TRUE(script.output);
}

TEST_F(SupplyWorker, SwitchesOffWhileAnotherThreadStandsStillInItsLock) {
  Worker worker(fake(script), fast);
  worker.switch_on();
  const LockOfWorker held(worker);
  worker.switch_off();
  EXPECT_TRUE(soon([&] { return !script.output; }));
  EXPECT_TRUE(worker.alive()) << "and the guard waits for nobody";
}

TEST_F(SupplyWorker, HandsFailuresToWhoHasAsked) {
  script.on_fails = true;
  Worker worker(fake(script), clock);
  EXPECT_THAT(what_of([&] { worker.switch_on(); }), HasSubstr("switch on: no answer"));
  EXPECT_TRUE(worker.alive());
  EXPECT_FALSE(script.output);
}

TEST_F(SupplyWorker, RefusesOrdersWhenItHasFailed) {
  script.read_fails = true;
  Worker worker(fake(script), clock);
  EXPECT_TRUE(soon([&] { return !worker.alive(); }));
  EXPECT_THAT(what_of([&] { worker.switch_on(); }), HasSubstr("the line is lost"));
  EXPECT_THAT(what_of([&] { worker.apply(kTwelveVolts); }), HasSubstr("the line is lost"));
}

/// The supply is in the midst of a look and stays there: everybody else gets through. Who waited for it would wait for
/// ever.
TEST_F(SupplyWorker, LetsNobodyWaitForASlowSupply) {
  std::latch inside(1), release(1);
  script.inside = &inside;
  script.release = &release;
  Worker worker(fake(script), clock);
  inside.wait();
  std::array<SupplyReading, 4> some;
  EXPECT_EQ(worker.take(some), 0u);
  EXPECT_FALSE(worker.newest());
  EXPECT_TRUE(worker.alive());
  EXPECT_EQ(worker.failure(), "");
  worker.switch_off();
  EXPECT_FALSE(worker.switch_off_and_confirm(1ms));
  EXPECT_TRUE(script.output);
  release.count_down();
  EXPECT_TRUE(soon([&] { return !script.output; }));
}

TEST_F(SupplyWorker, LeavesALongReadingForAnOrderToSwitchOff) {
  std::latch inside(1), release(1);
  script.inside = &inside;
  script.release = &release;
  Worker worker(fake(script), clock, 0.01);  // no further reading of its own
  inside.wait();
  worker.switch_off();
  release.count_down();
  EXPECT_TRUE(soon([&] { return !script.output; }));
  EXPECT_FALSE(worker.newest()) << "half a reading is none";
  EXPECT_TRUE(worker.alive());
}

/// While a look goes on, on and off are asked for, in this order: it never goes on.
TEST_F(SupplyWorker, LetsOffOverruleAnEarlierOn) {
  std::latch inside(1), release(1);
  script.inside = &inside;
  script.release = &release;
  script.output = false;
  Worker worker(fake(script), clock);
  inside.wait();
  std::string answer;
  std::latch asking(1);
  std::thread asks([&] {
    asking.count_down();
    answer = what_of([&] { worker.switch_on(); });
  });
  asking.wait();
  worker.switch_off();  // before or after the other thread's call: off either way, or on by a later wish
  release.count_down();
  asks.join();
  if (answer == "nothing was thrown") {
    EXPECT_TRUE(script.output) << "asked after the off";
  } else {
    EXPECT_THAT(answer, HasSubstr("it was switched off meanwhile"));
    EXPECT_FALSE(script.output);
  }
}

class SupplyWorkerOnAWire : public testing::Test {
 protected:
  /// At 12 V and on.
  void start(double hz, double answers_per_s = 0, const Timing& timing = kShort) {
    simulated.emplace("RD6006", answers_per_s);
    worker.emplace(std::make_unique<ModbusSupply>(simulated->address(), clock, timing), clock, hz);
    worker->apply(kTwelveVolts);
    worker->switch_on();
  }
  SteadyClock clock;
  std::optional<test::SimulatedSupply> simulated;
  std::optional<Worker> worker;
};

TEST_F(SupplyWorkerOnAWire, TellsUnfitLimitsFromAFailure) {
  start(20);
  EXPECT_THROW(worker->apply({Volts(61), Amperes(1), Volts(13), Amperes(3)}), std::invalid_argument);
  EXPECT_TRUE(worker->alive());
}

TEST_F(SupplyWorkerOnAWire, FeedsFromAStockSupplyOfTenAnswersPerSecond) {
  start(5, 10, {});
  const std::vector<SupplyReading> all = taken(*worker, 6);
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end(),
                             [](const SupplyReading& a, const SupplyReading& b) { return a.time_ns < b.time_ns; }));
  int settled = 0;
  for (const auto& frame : simulated->truth().frames) settled += frame[1] == 3 && frame[3] == 0;
  EXPECT_EQ(settled, 1) << "nothing was asked twice: who it is was asked at the beginning only";
  EXPECT_TRUE(worker->switch_off_and_confirm(10s));
  EXPECT_FALSE(simulated->output());
}

TEST_F(SupplyWorkerOnAWire, NamesTheUnpluggedSupplyAndThatItCouldNotSwitchOff) {
  start(20);
  simulated->spoil(lasting(sim::FaultKind::supply_closed));
  EXPECT_TRUE(soon([&] { return !worker->alive(); }));
  EXPECT_THAT(worker->failure(),
              AllOf(HasSubstr("supply RD6006 on "), HasSubstr("No such file"), HasSubstr("plug"),
                    HasSubstr("switch off"), HasSubstr("its output may be on: switch it off by hand")));
  EXPECT_TRUE(simulated->output()) << "a cable that is out takes no orders";
}

TEST_F(SupplyWorkerOnAWire, SwitchesOffASupplyThatIsNotHeardAnyMore) {
  start(20);
  simulated->spoil(lasting(sim::FaultKind::supply_no_reply));
  EXPECT_TRUE(soon([&] { return !worker->alive(); }));
  EXPECT_THAT(worker->failure(), HasSubstr("its output may be on"));
  worker.reset();
  EXPECT_FALSE(simulated->output()) << "it has heard, though it was not heard";
}

TEST_F(SupplyWorkerOnAWire, ReportsATripAsAReading) {
  start(20);
  simulated->spoil({.kind = sim::FaultKind::supply_trip, .code = 1});
  EXPECT_TRUE(soon([&] {
    const auto newest = worker->newest();
    return newest && newest->protection == SupplyProtection::over_voltage && !newest->output;
  }));
  EXPECT_TRUE(worker->alive());
  worker->switch_on();
  EXPECT_TRUE(simulated->output()) << "a new wish after the trip";
}

/// The motor is braked and feeds back: the supply cannot take it, the voltage rises, and the threshold ends it.
TEST_F(SupplyWorkerOnAWire, SeesTheVoltageRiseWhenTheLoadFeedsBack) {
  start(50);
  simulated->hang({0.5, 0});
  ASSERT_TRUE(soon([&] { return worker->newest() && worker->newest()->voltage_v > 11.9; }));
  simulated->hang({-0.2, 0});
  EXPECT_TRUE(soon([&] { return worker->newest()->protection == SupplyProtection::over_voltage; }));
  EXPECT_TRUE(soon([&] { return worker->newest()->current_a < 0.01; }));
}

}  // namespace worker_test
}  // namespace kphi::supply
