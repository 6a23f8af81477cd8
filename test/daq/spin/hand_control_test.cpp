#include "daq/spin/hand_control.hpp"

#include <gtest/gtest.h>

#include <deque>

#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace hand_control_test {

using std::chrono::milliseconds;
using std::chrono::seconds;

class Hand : public testing::Test {
 protected:
  [[nodiscard]] HandControl control(std::optional<Duration> lasts = std::nullopt) {
    return HandControl({from_rpm(6000), from_rpm(500), from_rpm(7000), lasts, seconds(30)}, pressed_);
  }
  /// What is wanted once these keys were pressed, RPM; -1: to stop.
  static double rpm(HandControl& control, Duration now, RadPerSec commanded) {
    const auto wanted = control.wanted(now, commanded);
    return wanted ? std::round(to_rpm(*wanted)) : -1;
  }
  std::deque<Key> keys_;

 private:
  test::PressedKeys pressed_{[this]() -> std::optional<Key> {
    if (keys_.empty()) return std::nullopt;
    const Key key = keys_.front();
    keys_.pop_front();
    return key;
  }};
};

TEST_F(Hand, BeginsWithItsSpeedAndGoesUpAndDownByAStepWithinItsBounds) {
  HandControl hand = control();
  EXPECT_EQ(rpm(hand, seconds(0), RadPerSec(0)), 6000);
  keys_ = {Key::up};
  EXPECT_EQ(rpm(hand, seconds(1), from_rpm(6000)), 6500);
  keys_ = {Key::up, Key::up, Key::up};
  EXPECT_EQ(rpm(hand, seconds(2), from_rpm(6600)), 7000) << "the highest";
  keys_ = std::deque<Key>(100, Key::down);
  EXPECT_EQ(rpm(hand, seconds(3), from_rpm(800)), 500) << "never to rest, which is stop";
}

TEST_F(Hand, NeverWantsMoreThanOneStepBeyondWhatIsCommanded) {
  HandControl hand = control();
  EXPECT_EQ(rpm(hand, seconds(0), RadPerSec(0)), 6000);
  keys_ = std::deque<Key>(30, Key::down);
  EXPECT_EQ(rpm(hand, seconds(1), from_rpm(6000)), 5500);
  keys_ = std::deque<Key>(30, Key::up);
  EXPECT_EQ(rpm(hand, seconds(2), from_rpm(5600)), 6100);
  EXPECT_EQ(rpm(hand, seconds(3), from_rpm(5700)), 6100) << "and it does not follow by itself";
}

TEST_F(Hand, IsNotSlowedByTheKeyForMoreWhileItGetsThere) {
  HandControl hand = control();
  keys_ = {Key::up};
  EXPECT_EQ(rpm(hand, seconds(1), from_rpm(100)), 6000);
}

TEST_F(Hand, GoesNoFasterAtTheKeyForLessBelowOneStep) {
  HandControl hand = control();
  (void)hand.wanted(seconds(0), RadPerSec(0));
  keys_ = {Key::hold, Key::down};
  EXPECT_EQ(rpm(hand, seconds(1), from_rpm(321)), 321);
}

TEST_F(Hand, HoldsWhereTheRampIs) {
  HandControl hand = control();
  (void)hand.wanted(seconds(0), RadPerSec(0));
  keys_ = {Key::hold};
  EXPECT_EQ(rpm(hand, seconds(1), from_rpm(3210)), 3210);
  EXPECT_EQ(rpm(hand, seconds(2), from_rpm(3210)), 3210);
}

TEST_F(Hand, HasNothingToHoldBeforeTheMotorTurns) {
  HandControl hand = control();
  keys_ = {Key::hold};
  EXPECT_EQ(rpm(hand, seconds(0), RadPerSec(0)), 6000);
}

TEST_F(Hand, IsCalledOffByAStopBeforeItBegan) {
  HandControl hand = control();
  keys_ = {Key::up, Key::hold};
  EXPECT_FALSE(hand.is_called_off());
  keys_ = {Key::stop, Key::up};
  EXPECT_TRUE(hand.is_called_off());
  EXPECT_EQ(rpm(hand, seconds(0), RadPerSec(0)), -1);
}

TEST_F(Hand, StopsForGoodAtTheKey) {
  HandControl hand = control(seconds(100));
  keys_ = {Key::up, Key::stop, Key::up};
  EXPECT_EQ(rpm(hand, seconds(1), from_rpm(6000)), -1);
  EXPECT_EQ(hand.why(), "a key was pressed");
  keys_ = {Key::up};
  EXPECT_EQ(rpm(hand, seconds(2), from_rpm(6000)), -1);
}

TEST_F(Hand, StopsWithoutAKeyForAWhile) {
  HandControl hand = control();
  EXPECT_EQ(rpm(hand, seconds(5), RadPerSec(0)), 6000);
  EXPECT_EQ(rpm(hand, seconds(34), from_rpm(6000)), 6000);
  keys_ = {Key::hold};
  EXPECT_EQ(rpm(hand, milliseconds(34'900), from_rpm(6000)), 6000);
  EXPECT_EQ(rpm(hand, milliseconds(64'800), from_rpm(6000)), 6000) << "any key counts";
  EXPECT_EQ(rpm(hand, milliseconds(64'900), from_rpm(6000)), -1);
  EXPECT_EQ(hand.why(), "no key for 30 s");
}

TEST_F(Hand, LastsAsLongAsWasAskedForFromTheFirstMomentAtItsSpeed) {
  HandControl hand = control(seconds(5));
  EXPECT_EQ(rpm(hand, seconds(0), RadPerSec(0)), 6000);
  EXPECT_EQ(rpm(hand, seconds(40), from_rpm(5999)), 6000) << "no dead man where a time was set";
  EXPECT_EQ(rpm(hand, seconds(41), from_rpm(6000)), 6000);
  EXPECT_EQ(rpm(hand, seconds(46), from_rpm(6000)), -1);
  EXPECT_EQ(hand.why(), "5 s are over");
}

}  // namespace hand_control_test
}  // namespace kphi::daq
