// How many datagrams the receive thread lets come together before it looks.
#include "drivers/netbox/stream/batching.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;

constexpr Duration kSingle{142'857}, kBlock = 40 * kSingle;
constexpr bool kWaits = true, kTakes = false;

/// After `datagrams` that came every `period`; the time of the last.
Instant feed(Batching& gathering, int datagrams, Duration period, Instant from = Instant{0}) {
  Instant at = from;
  for (int i = 0; i < datagrams; ++i) gathering.note(at += period);
  return at;
}

Duration nap_of(HandOver policy, Duration period, bool awaited, double speed = 1) {
  Batching gathering(policy, period, speed);
  const Instant newest = feed(gathering, 100, period);
  return gathering.sleep_time(newest, awaited);
}

/// Datagrams that come in a sleep_time that begins with one.
double shared(HandOver policy, Duration period, bool awaited, double speed = 1) {
  return std::floor(to_seconds(nap_of(policy, period, awaited, speed)) / to_seconds(period));
}

TEST(HandOver, AtOnceNeverSleeps) {
  EXPECT_EQ(nap_of(HandOver::at_once, kSingle, kWaits), 0ns);
  EXPECT_EQ(nap_of(HandOver::at_once, kSingle, kTakes), 0ns);
}

TEST(HandOver, PromptSharesAWakeUpBetweenTwoSingleRecordsAtSevenKilohertz) {
  EXPECT_EQ(shared(HandOver::prompt, kSingle, kWaits), 2);
  EXPECT_EQ(shared(HandOver::prompt, kSingle, kTakes), 2);
  EXPECT_EQ(nap_of(HandOver::prompt, 2 * kSingle, kWaits), 0ns) << "the first would wait for longer than 150 us";
}

TEST(HandOver, GatheredSharesAWakeUpAmongThoseOfTwoMilliseconds) {
  EXPECT_EQ(shared(HandOver::gathered, kSingle, kWaits), 15);
  EXPECT_EQ(shared(HandOver::gathered, 1ms, kWaits), 3);
}

TEST(HandOver, AsAskedIsPromptForWhoWaitsAndGathersForWhoOnlyTakes) {
  EXPECT_EQ(nap_of(HandOver::as_asked, kSingle, kWaits), nap_of(HandOver::prompt, kSingle, kWaits));
  EXPECT_EQ(nap_of(HandOver::as_asked, kSingle, kTakes), nap_of(HandOver::gathered, kSingle, kTakes));
}

TEST(HandOver, ABlockOfFortyIsNeverKeptWaiting) {
  for (const HandOver policy : {HandOver::at_once, HandOver::prompt, HandOver::gathered, HandOver::as_asked})
    EXPECT_EQ(nap_of(policy, kBlock, kTakes), 0ns);
}

TEST(HandOver, TheNapEndsByTheStreamsTimeHoweverLateTheThreadIs) {
  Batching gathering(HandOver::prompt, kSingle, 1);
  const Instant newest = feed(gathering, 100, kSingle);
  const Duration whole = gathering.sleep_time(newest, kWaits);
  EXPECT_EQ(gathering.sleep_time(newest + 40us, kWaits), whole - 40us);
  EXPECT_EQ(gathering.sleep_time(newest + 10ms, kWaits), 0ns) << "behind: no sleep";
  EXPECT_EQ(gathering.sleep_time(newest - 1h, kWaits), whole) << "a clock that was set back";
}

TEST(HandOver, APromptNapWaitsForAnEvenStream) {
  Batching gathering(HandOver::prompt, kSingle, 1);
  Instant newest = feed(gathering, 10, kSingle);
  EXPECT_EQ(gathering.sleep_time(newest, kWaits), 0ns) << "too few to know";
  newest = feed(gathering, 100, kSingle, newest);
  EXPECT_GT(gathering.sleep_time(newest, kWaits), 0ns);
  newest = feed(gathering, 1, 3us, newest);
  EXPECT_EQ(gathering.sleep_time(newest, kWaits), 0ns) << "two in a bunch: who sleeps does not know what he misses";
  newest = feed(gathering, 100, 60us, newest);
  EXPECT_EQ(gathering.sleep_time(newest, kWaits), 0ns);
}

TEST(HandOver, LimitsAreOfAPersonsTimeOnABenchInHaste) {
  constexpr double kSpeed = 200'000.0 / 7000;
  EXPECT_NEAR(shared(HandOver::gathered, kSingle, kTakes, kSpeed), 0.002 * 200'000, 5);
  EXPECT_NEAR(shared(HandOver::gathered, kBlock, kTakes, kSpeed), 0.002 * 5000, 2);
}

}  // namespace
}  // namespace kphi::netbox
