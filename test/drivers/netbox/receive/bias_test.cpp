#include "drivers/netbox/receive/bias.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kphi::netbox {
namespace {

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

}  // namespace
}  // namespace kphi::netbox
