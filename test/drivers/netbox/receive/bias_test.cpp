#include "drivers/netbox/receive/bias.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "test/drivers/netbox/fake_box.hpp"

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;
using test::captured_xml;
using test::FakeBox;
using test::FakeWeb;
using test::with;
using testing::HasSubstr;

std::string xml() { return with(with(captured_xml(), "comrdtrate", "7000"), "comrdtbsiz", "40"); }

StampedRecord of(std::int32_t fz, std::int32_t tz, std::uint32_t status = 0) {
  StampedRecord stamped;
  stamped.record.status = status;
  stamped.record.counts = {0, 0, fz, 0, 0, tz};
  return stamped;
}

TEST(ZeroEstimate, IsMeanAndSpreadInNewtonsAndNewtonMetres) {
  Configuration scale;
  scale.counts_per_newton = 1e6;
  scale.counts_per_newton_metre = 1e3;
  ZeroEstimate estimate;
  for (const std::int32_t i : {1, 2, 3, 4}) estimate.add(of(1'000'000 * i, -1000 * i));
  const ZeroMeasurement zero = estimate.result(scale);
  EXPECT_DOUBLE_EQ(zero.mean[2], 2.5);
  EXPECT_DOUBLE_EQ(zero.mean[5], -2.5);
  EXPECT_DOUBLE_EQ(zero.standard_deviation[2], std::sqrt(5.0 / 3.0));
  EXPECT_DOUBLE_EQ(zero.standard_deviation[5], std::sqrt(5.0 / 3.0));
  EXPECT_EQ(zero.mean[0], 0);
  EXPECT_EQ(zero.records, 4u);
}

TEST(ZeroEstimate, LeavesSaturatedAndFaultyRecordsOut) {
  Configuration scale;
  scale.counts_per_newton = scale.counts_per_newton_metre = 1;
  ZeroEstimate estimate;
  estimate.add(of(10, 0));
  estimate.add(of(1'000'000, 0, 0x80020000u));
  estimate.add(of(20, 0, 0x80010000u));  // a latched monitor condition is healthy
  const ZeroMeasurement zero = estimate.result(scale);
  EXPECT_EQ(zero.mean[2], 15);
  EXPECT_EQ(zero.records, 2u);
  EXPECT_EQ(zero.refused, 1u);
}

void take_bias_from(FakeBox::Manner manner, bool expect_restart) {
  manner.load = 3'000'000;
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box(manner);
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  const BiasStep step = take_bias(cell, clock, 1000, {}, 5s);
  EXPECT_EQ(step.before.mean[2], 3.0);
  EXPECT_EQ(step.before.records, 1000u);
  EXPECT_EQ(step.after.mean[2], 0.0);
  EXPECT_EQ(step.after.standard_deviation[2], 0.0) << "no record of the old zero among them";
  EXPECT_GT(step.after.first, step.before.last);
  EXPECT_EQ(step.stream_restarted, expect_restart);
  EXPECT_EQ(box.biases(), 1);
  cell.stop();
  const Counters counters = cell.counters();
  EXPECT_EQ(counters.expected, counters.received + counters.lost_network + counters.lost_host);
}

TEST(Bias, WorksOnABoxThatKeepsStreaming) { take_bias_from({}, false); }
TEST(Bias, WorksOnABoxThatStopsItsStream) { take_bias_from({.bias_stops = true}, true); }

TEST(Bias, ThatDidNotWorkIsAnErrorWithItsNumbers) {
  FakeWeb web(FakeWeb::page(xml()));
  FakeBox box({.load = 3'000'000, .bias_works = false});
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  cell.start();
  try {
    static_cast<void>(take_bias(cell, clock, 200, {}, 5s));
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("Fz is 3 N afterwards, 0.05 N are tolerated"));
  }
}

TEST(Bias, WithoutAStreamIsAnErrorInTime) {
  FakeWeb web(FakeWeb::page(xml()));
  const SteadyClock clock;
  LoadCell cell({"127.0.0.1", 1, web.port()}, clock);
  EXPECT_THROW(static_cast<void>(measure_zero(cell, 10, 20ms)), DeviceError);
}

}  // namespace
}  // namespace kphi::netbox
