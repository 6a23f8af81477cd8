#include "drivers/netbox/stream/reconnect.hpp"

#include <gtest/gtest.h>

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;
using Move = Reconnect::Move;

TEST(Reconnect, ASilenceIsAskedAboutAtOnceAndOnce) {
  Reconnect reconnect({});
  EXPECT_EQ(reconnect.next(1s), Move::none);
  reconnect.silent(1s);
  EXPECT_EQ(reconnect.next(1s), Move::ask);
  EXPECT_EQ(reconnect.next(1s), Move::none);
  EXPECT_EQ(reconnect.deadline(), kNever);
}

TEST(Reconnect, AStreamThatAnotherClientHasTakenIsNeverFoughtFor) {
  Reconnect reconnect({});
  reconnect.silent(1s);
  EXPECT_EQ(reconnect.next(1s), Move::ask);
  EXPECT_TRUE(reconnect.answered(BoxAnswer::ready, false, 1s));
  EXPECT_EQ(reconnect.deadline(), kNever);
  for (Instant now = 1s; now < 200s; now += 1s) ASSERT_EQ(reconnect.next(now), Move::none);
}

TEST(Reconnect, ABoxThatWasAwayIsStartedWhenItIsBack) {
  for (const BoxAnswer away : {BoxAnswer::unreachable, BoxAnswer::rdt_disabled, BoxAnswer::unusable}) {
    Reconnect reconnect({});
    reconnect.silent(1s);
    EXPECT_EQ(reconnect.next(1s), Move::ask);
    EXPECT_TRUE(reconnect.answered(away, false, 1s));
    EXPECT_EQ(reconnect.next(1s), Move::none);
    EXPECT_EQ(reconnect.next(reconnect.deadline()), Move::ask);
    EXPECT_TRUE(reconnect.answered(BoxAnswer::ready, false, 3s));
    EXPECT_EQ(reconnect.next(3s), Move::start);
    EXPECT_TRUE(reconnect.starting());
    reconnect.streaming();
    EXPECT_EQ(reconnect.next(4s), Move::none);
  }
}

TEST(Reconnect, ABoxThatHasBootedIsStartedAtOnce) {
  Reconnect reconnect({});
  reconnect.silent(1s);
  EXPECT_EQ(reconnect.next(1s), Move::ask);
  EXPECT_TRUE(reconnect.answered(BoxAnswer::ready, true, 1s));
  EXPECT_EQ(reconnect.next(1s), Move::start);
}

TEST(Reconnect, WhatWasAwayOnceIsNoExcuseForTheNextSilence) {
  Reconnect reconnect({});
  reconnect.silent(1s);
  (void)reconnect.next(1s);
  (void)reconnect.answered(BoxAnswer::ready, true, 1s);
  (void)reconnect.next(1s);
  reconnect.streaming();
  reconnect.silent(5s);
  EXPECT_EQ(reconnect.next(5s), Move::ask);
  (void)reconnect.answered(BoxAnswer::ready, false, 5s);
  EXPECT_EQ(reconnect.next(5s), Move::none);
}

TEST(Reconnect, ThePausesDoubleUpToTheirCapUntilItGivesUp) {
  Reconnect reconnect({});
  reconnect.silent(0s);
  (void)reconnect.next(0s);
  Instant now = 0s;
  for (const Duration pause : {250ms, 500ms, 1000ms, 2000ms, 4000ms, 8000ms, 8000ms, 8000ms}) {
    EXPECT_EQ(reconnect.answered(BoxAnswer::unreachable, false, now), now == 0s) << "told once, not each time";
    EXPECT_EQ(reconnect.deadline(), now + pause);
    now = reconnect.deadline();
    EXPECT_EQ(reconnect.next(now - 1ns), Move::none);
    ASSERT_EQ(reconnect.next(now), Move::ask);
  }
  (void)reconnect.answered(BoxAnswer::unreachable, false, 59s);
  EXPECT_EQ(reconnect.deadline(), 60s);
  EXPECT_EQ(reconnect.next(60s), Move::give_up);
  EXPECT_EQ(reconnect.next(61s), Move::none);
  EXPECT_EQ(reconnect.deadline(), kNever);
}

TEST(Reconnect, AStartWithoutARecordIsTriedAgainLater) {
  Reconnect reconnect({});
  reconnect.silent(0s);
  (void)reconnect.next(0s);
  (void)reconnect.answered(BoxAnswer::ready, true, 0s);
  EXPECT_EQ(reconnect.next(0s), Move::start);
  reconnect.start_failed(2s);
  EXPECT_FALSE(reconnect.starting());
  EXPECT_EQ(reconnect.deadline(), 2s + 250ms);
  EXPECT_EQ(reconnect.next(reconnect.deadline()), Move::ask);
  (void)reconnect.answered(BoxAnswer::ready, false, 3s);
  EXPECT_EQ(reconnect.next(3s), Move::start);
}

TEST(Reconnect, SwitchedOffItOnlyAsks) {
  Reconnect reconnect({.reconnect = false});
  reconnect.silent(1s);
  EXPECT_EQ(reconnect.next(1s), Move::ask);
  EXPECT_TRUE(reconnect.answered(BoxAnswer::unreachable, false, 1s));
  EXPECT_EQ(reconnect.next(100s), Move::none);
  EXPECT_EQ(reconnect.deadline(), kNever);
}

TEST(Reconnect, AnAnswerThatComesAfterTheStreamIsNoNews) {
  Reconnect reconnect({});
  reconnect.silent(1s);
  (void)reconnect.next(1s);
  reconnect.streaming();
  EXPECT_FALSE(reconnect.answered(BoxAnswer::unreachable, false, 2s));
  EXPECT_EQ(reconnect.next(100s), Move::none);
}

}  // namespace
}  // namespace kphi::netbox
