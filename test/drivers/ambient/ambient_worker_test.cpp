#include "drivers/ambient/ambient_worker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

#include "base/error.hpp"

namespace kphi::ambient {
namespace ambient_worker_test {

using namespace std::chrono_literals;

/// What a sensor does is up to the test.
struct Script {
  std::mutex mutex;
  std::condition_variable changed;
  bool present = true, held = false;
  int openings = 0, alive = 0, reads = 0;
  double temperature_c = 20;

  template <class Change>
  void set(Change&& change) {
    {
      const std::lock_guard lock(mutex);
      change();
    }
    changed.notify_all();
  }
  template <class Condition>
  [[nodiscard]] bool wait(Condition&& holds) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, 10s, holds);
  }
};

class ScriptedSensor final : public Ambient {
 public:
  explicit ScriptedSensor(Script& script) : script_(script) {
    const std::lock_guard lock(script_.mutex);
    ++script_.openings;
    script_.changed.notify_all();
    if (!script_.present) throw DeviceError("sensor", "open", "not plugged in");
    ++script_.alive;
  }
  ~ScriptedSensor() override {
    script_.set([&] { --script_.alive; });
  }
  Air read() override {
    std::unique_lock lock(script_.mutex);
    ++script_.reads;
    script_.changed.notify_all();
    script_.changed.wait(lock, [&] { return !script_.held; });
    if (!script_.present) throw DeviceError("sensor", "read", "unplugged");
    return {script_.temperature_c, 1e5, 0.5, 0, 0, 0};
  }
  const std::string& identity() const noexcept override { return identity_; }

 private:
  Script& script_;
  const std::string identity_ = "a scripted sensor";
};

class AmbientWorkerTest : public testing::Test {
 protected:
  AmbientWorker::Open open = [this] { return std::make_unique<ScriptedSensor>(script); };
  Script script;
  SteadyClock clock;
  const Rhythm fast{1ms, 1ms, 4ms};
};

TEST_F(AmbientWorkerTest, HandsOutTheNewestReadingWithItsAge) {
  const AmbientWorker worker(open, clock, {1h, 1ms, 4ms});
  ASSERT_TRUE(worker.wait_for_first(10s));
  const auto first = worker.newest(), second = worker.newest();
  EXPECT_EQ(first->air.temperature_c, 20);
  EXPECT_EQ(first->at, second->at);
  EXPECT_GT(second->age, first->age);
  EXPECT_EQ(worker.failure(), "");
}

TEST_F(AmbientWorkerTest, AsksAgainAndAgain) {
  const AmbientWorker worker(open, clock, fast);
  ASSERT_TRUE(script.wait([&] { return script.reads >= 5; }));
  script.set([&] { script.temperature_c = 25; });
  const int seen = script.reads;
  ASSERT_TRUE(script.wait([&] { return script.reads >= seen + 3; }));
  EXPECT_EQ(worker.newest()->air.temperature_c, 25);
  EXPECT_EQ(script.openings, 1);
}

TEST_F(AmbientWorkerTest, HasNothingAndSaysWhyBeforeTheFirstReading) {
  script.present = false;
  const AmbientWorker worker(open, clock, fast);
  EXPECT_FALSE(worker.newest());
  ASSERT_TRUE(script.wait([&] { return script.openings >= 3; }));
  EXPECT_FALSE(worker.wait_for_first(Duration{0}));
  EXPECT_EQ(worker.failure(), "sensor: open: not plugged in");
  script.set([&] { script.present = true; });
  EXPECT_TRUE(worker.wait_for_first(10s));
  EXPECT_EQ(worker.failure(), "");
}

TEST_F(AmbientWorkerTest, ClosesWhatHasFailedAndOpensItAgain) {
  const AmbientWorker worker(open, clock, fast);
  ASSERT_TRUE(worker.wait_for_first(10s));
  script.set([&] { script.present = false; });
  ASSERT_TRUE(script.wait([&] { return script.alive == 0 && script.openings >= 3; }));
  EXPECT_TRUE(worker.newest()) << "stays, and grows old";
  EXPECT_NE(worker.failure(), "");
  script.set([&] {
    script.present = true;
    script.temperature_c = 30;
  });
  ASSERT_TRUE(script.wait([&] { return script.alive == 1 && script.reads >= 3; }));
  const int seen = script.reads;
  ASSERT_TRUE(script.wait([&] { return script.reads >= seen + 2; }));
  EXPECT_EQ(worker.newest()->air.temperature_c, 30);
}

TEST_F(AmbientWorkerTest, WaitsLongerAndLongerBetweenAttempts) {
  script.present = false;
  std::vector<Instant> attempts;
  AmbientWorker::Open counted = [&] {
    script.set([&] { attempts.push_back(clock.now()); });
    return open();
  };
  const AmbientWorker worker(counted, clock, {1ms, 10ms, 40ms});
  ASSERT_TRUE(script.wait([&] { return attempts.size() >= 5; }));
  const std::lock_guard lock(script.mutex);
  // A host may be late, never early.
  EXPECT_GE(attempts[1] - attempts[0], 10ms);
  EXPECT_GE(attempts[2] - attempts[1], 20ms);
  EXPECT_GE(attempts[3] - attempts[2], 40ms);
  EXPECT_GE(attempts[4] - attempts[3], 40ms);
}

TEST_F(AmbientWorkerTest, KeepsNobodyWaitingForASlowSensor) {
  const AmbientWorker worker(open, clock, fast);
  ASSERT_TRUE(worker.wait_for_first(10s));
  int seen = 0;
  script.set([&] {
    script.held = true;
    seen = script.reads;
  });
  EXPECT_TRUE(script.wait([&] { return script.reads > seen; }));
  EXPECT_TRUE(worker.newest()) << "while the sensor holds its thread";
  EXPECT_EQ(worker.failure(), "");
  script.set([&] { script.held = false; });
}

TEST_F(AmbientWorkerTest, SurvivesAnythingThatIsThrown) {
  std::atomic<int> attempts{0};
  AmbientWorker::Open odd = [&]() -> std::unique_ptr<Ambient> {
    switch (attempts++) {
      case 0:
        throw 3;
      case 1:
        throw std::invalid_argument("odd");
      case 2:
        return nullptr;
      default:
        return open();
    }
  };
  const AmbientWorker worker(odd, clock, fast);
  EXPECT_TRUE(worker.wait_for_first(10s));
  EXPECT_EQ(attempts, 4);
}

TEST_F(AmbientWorkerTest, EndsAtOnceBetweenTwoReadings) {
  { const AmbientWorker worker(open, clock, {1h, 1h, 1h}); }
  EXPECT_EQ(script.alive, 0);
}

TEST(AmbientWorker, DoesNotWaitForASensorThatIsSlowToClose) {
  struct Slow final : Ambient {
    explicit Slow(std::shared_ptr<Script> of) : script(std::move(of)) {}
    ~Slow() override {
      std::unique_lock lock(script->mutex);
      script->changed.wait(lock, [&] { return !script->held; });
      --script->alive;
      script->changed.notify_all();
    }
    Air read() override { return {20, 1e5, 0.5, 0, 0, 0}; }
    const std::string& identity() const noexcept override { return name; }
    std::string name = "slow";
    std::shared_ptr<Script> script;
  };
  const auto script = std::make_shared<Script>();
  script->alive = 1;
  script->held = true;
  const auto began = std::chrono::steady_clock::now();
  {
    const SteadyClock clock;
    const AmbientWorker worker([script] { return std::make_unique<Slow>(script); }, clock);
    EXPECT_TRUE(worker.wait_for_first(10s));
  }
  const auto took = std::chrono::steady_clock::now() - began;
  EXPECT_GE(took, AmbientWorker::kPatience);
  EXPECT_LT(took, AmbientWorker::kPatience + 5s);
  script->set([&] { script->held = false; });
  EXPECT_TRUE(script->wait([&] { return script->alive == 0; })) << "it is closed all the same";
}

}  // namespace ambient_worker_test
}  // namespace kphi::ambient
