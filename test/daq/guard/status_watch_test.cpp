#include "daq/guard/status_watch.hpp"

#include <gmock/gmock.h>

namespace kphi::daq {
namespace status_watch_test {

using netbox::Product;
using testing::HasSubstr;
using State = StatusWatch::State;

constexpr std::uint32_t kSerialLink = 0x88000000;  // of an Axia: a gage is out of its range

/// A box of 40 samples per datagram at 7 kHz.
class StatusWatching : public testing::Test {
 protected:
  State take(std::uint32_t status, int n = 1) { return take(watch_, status, n); }
  State take(StatusWatch& watch, std::uint32_t status, int n) {
    State state = State::trusted;
    for (int i = 0; i < n; ++i) {
      LoadCellRecord sample;
      sample.status = status;
      sample.arrival_ns = now_ns_ += 142'857;
      state = watch.take(sample);
      if (auto event = watch.take_event()) events_.push_back(*event);
    }
    return state;
  }
  Nanoseconds now_ns_ = 0;
  StatusWatch watch_{Product::net_box, 40, 7000}, axia_{Product::axia, 40, 7000};
  std::vector<StreamEvent> events_;
};

TEST_F(StatusWatching, HasThePatienceOfOneDatagram) {
  EXPECT_EQ(take(0, 1000), State::trusted);
  EXPECT_EQ(take(kSerialLink, 40), State::trusted);
  EXPECT_EQ(take(kSerialLink), State::untrusted);
  EXPECT_EQ(watch_.reason(),
            "load cell: the Net Box reports \"serial link communication error\" (status 0x88000000) for 5.9 ms, so its "
            "samples cannot be trusted; check the cell's cable and the box's supply, switch the box off and on, then "
            "run: kphi devices");
}

TEST_F(StatusWatching, ForgetsAHiccupAfterAsManySoundSamples) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(take(kSerialLink, 40), State::trusted);
    EXPECT_EQ(take(0, 40), State::trusted);
  }
}

TEST_F(StatusWatching, IsNotDeceivedByAnErrorThatComesAndGoes) {
  for (int i = 0; i < 39; ++i) {
    EXPECT_EQ(take(kSerialLink, 2), State::trusted);
    EXPECT_EQ(take(0, 1), State::trusted);
  }
  EXPECT_EQ(take(kSerialLink, 2), State::untrusted);
}

TEST_F(StatusWatching, NamesAllThatIsSet) {
  (void)take(0xA0000004, 41);
  EXPECT_THAT(watch_.reason(), HasSubstr("\"digital board error, internal temperature error\" (status 0xA0000004)"));
}

TEST_F(StatusWatching, TrustsALatchedMonitorCondition) {
  EXPECT_EQ(take(0x80010000, 10'000), State::trusted);
  EXPECT_EQ(take(axia_, 0x80010000, 10'000), State::trusted);
  EXPECT_TRUE(events_.empty());
}

TEST_F(StatusWatching, ReadsTheBitsOfItsProduct) {
  EXPECT_EQ(take(axia_, kSerialLink, 41), State::trusted) << "an Axia's gage out of range is saturation";
  EXPECT_TRUE(events_.empty()) << "which the ranges tell";
  EXPECT_EQ(take(0xC0000000, 41), State::untrusted) << "a Net Box's CPU or RAM";
  StatusWatch other{Product::axia, 40, 7000};
  EXPECT_EQ(take(other, 0x80020000, 41), State::untrusted) << "an Axia does not have the Net Box's bit for saturation";
  EXPECT_THAT(other.reason(), HasSubstr("the Axia reports \"bit 17\" (status 0x80020000)"));
}

TEST_F(StatusWatching, HasHalfASecondForWhatMayPass) {
  for (const std::uint32_t status : {0x80020000u, 0x80100000u, 0x80120000u}) {
    StatusWatch watch{Product::net_box, 40, 7000};
    EXPECT_EQ(take(watch, status, 3500), State::trusted);
    EXPECT_EQ(take(watch, status, 1), State::lasting);
    EXPECT_EQ(take(watch, 0, 1), State::trusted);
    EXPECT_THAT(watch.reason(), HasSubstr("for 500.3 ms, so its samples cannot be trusted; "));
  }
  EXPECT_TRUE(events_.empty()) << "ranges and stream tell of these";
}

TEST_F(StatusWatching, DoesNotRememberAnErrorThatLastedForLongerThanItsPatience) {
  (void)take(0x80100000, 100'000);
  (void)take(0, 3501);
  EXPECT_EQ(take(0x80100000, 3500), State::trusted);
}

TEST_F(StatusWatching, HasAPatienceOfOneSampleAndOfOneSlowDatagramAtLeast) {
  StatusWatch single{Product::net_box, 1, 7000};
  EXPECT_EQ(take(single, kSerialLink, 1), State::trusted);
  EXPECT_EQ(take(single, kSerialLink, 1), State::untrusted);
  StatusWatch slow{Product::net_box, 40, 10};
  EXPECT_EQ(take(slow, 0x80020000, 40), State::trusted);
  EXPECT_EQ(take(slow, 0x80020000, 1), State::lasting);
}

TEST_F(StatusWatching, TellsTheFirstErrorAndItsEndWithTheirTimes) {
  (void)take(0, 7000);
  (void)take(kSerialLink, 10);
  (void)take(0, 10);
  (void)take(0x80000004, 10);
  (void)take(0, 100);
  ASSERT_EQ(events_.size(), 2u);
  EXPECT_EQ(events_[0].kind, EventKind::box_error);
  EXPECT_EQ(events_[0].time_ns, 7001 * 142'857);
  EXPECT_EQ(events_[0].text, "1.000 s: the Net Box reports \"serial link communication error\" (status 0x88000000)");
  EXPECT_EQ(events_[1].kind, EventKind::box_error_ended);
  EXPECT_EQ(events_[1].time_ns, 7011 * 142'857);
  EXPECT_EQ(events_[1].records, 10u);
  EXPECT_EQ(events_[1].text, "1.002 s: the Net Box no longer reports an error, after 10 bad samples");
}

TEST_F(StatusWatching, TellsOfAFieldBusThatNothingElseTells) {
  (void)take(0x80200000);
  ASSERT_EQ(events_.size(), 1u);
  EXPECT_THAT(events_[0].text, HasSubstr("\"CAN communication error\""));
}

}  // namespace status_watch_test
}  // namespace kphi::daq
