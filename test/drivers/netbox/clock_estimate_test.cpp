#include "drivers/netbox/clock_estimate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;

constexpr double kRate = 7000;

/// A box with a skewed clock behind a host with delays; the truth is known.
class Channel {
 public:
  struct Manner {
    double skew_ppm = 60;
    double wander_ppm = 0.5;  ///< sine of 600 s
    unsigned stride = 7;
    double usual_delay_s = 200e-6;  ///< mean of an exponential
    double rare_share = 0.02;
    double rare_delay_s = 20e-3;  ///< uniform up to
  };
  static constexpr double kLeastDelay = 80e-6;

  Channel(Manner manner, unsigned seed, std::uint32_t first_ft = 1000)
      : manner_(manner), random_(seed), ft_(first_ft) {}

  struct Sample {
    std::uint32_t ft;
    double true_s;
    Instant arrival;
  };
  Sample next() {
    device_s_ += manner_.stride / kRate;
    ft_ += manner_.stride;
    const double turn = 2 * std::numbers::pi / 600;
    const double true_s =
        device_s_ * (1 + 1e-6 * manner_.skew_ppm) + 1e-6 * manner_.wander_ppm / turn * (1 - std::cos(turn * device_s_));
    double delay = kLeastDelay + std::exponential_distribution(1 / manner_.usual_delay_s)(random_);
    if (uniform(random_) < manner_.rare_share) delay += manner_.rare_delay_s * uniform(random_);
    arrival_s_ = std::max(arrival_s_, true_s + delay);
    return {ft_, true_s, 100s + from_seconds(arrival_s_)};
  }

 private:
  std::uniform_real_distribution<double> uniform{0, 1};
  Manner manner_;
  std::mt19937 random_;
  std::uint32_t ft_;
  double device_s_ = 0, arrival_s_ = 0;
};

struct Quality {
  double rms_us = 0, mean_us = 0, largest_us = 0;
};

/// Error against the true sample time plus the least delay, from 30 s to `seconds`.
Quality quality_of(Channel& channel, ClockEstimate& estimate, double seconds) {
  double squares = 0, sum = 0, largest = 0;
  int n = 0;
  for (Channel::Sample sample = channel.next(); sample.true_s < seconds; sample = channel.next()) {
    estimate.add(sample.ft, sample.arrival);
    if (sample.true_s < 30) continue;
    const double told = to_seconds(estimate.host_time(sample.ft) - 100s);
    const double error_us = 1e6 * (told - sample.true_s - Channel::kLeastDelay);
    squares += error_us * error_us;
    sum += error_us;
    largest = std::max(largest, std::abs(error_us));
    ++n;
  }
  return {std::sqrt(squares / n), sum / n, largest};
}

TEST(ClockEstimate, StaysWithinFiveMicrosecondsOnALoadedHost) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Channel channel({}, seed);
    ClockEstimate estimate(kRate);
    const Quality quality = quality_of(channel, estimate, 240);
    EXPECT_LT(quality.rms_us, 5) << "seed " << seed;
    EXPECT_NEAR(estimate.skew_ppm(), 60, 2) << seed;
    EXPECT_TRUE(estimate.believable());
    EXPECT_LT(to_seconds(estimate.uncertainty()), 10e-6) << seed;
  }
}

TEST(ClockEstimate, StaysWithinFiveMicrosecondsInBufferedMode) {
  Channel channel({.stride = 40, .usual_delay_s = 30e-6, .rare_share = 0.001, .rare_delay_s = 5e-3}, 1);
  ClockEstimate estimate(kRate);
  EXPECT_LT(quality_of(channel, estimate, 240).rms_us, 5);
}

TEST(ClockEstimate, FindsANegativeSkewToo) {
  Channel channel({.skew_ppm = -60}, 2);
  ClockEstimate estimate(kRate);
  EXPECT_LT(quality_of(channel, estimate, 120).rms_us, 5);
  EXPECT_NEAR(estimate.skew_ppm(), -60, 3);
}

TEST(ClockEstimate, DoesNotNoticeTheWrap) {
  Channel channel({}, 3, 0xffffffffu - 40 * 7000);
  ClockEstimate estimate(kRate);
  EXPECT_LT(quality_of(channel, estimate, 120).rms_us, 5);
}

TEST(ClockEstimate, IsNotReadyBeforeFourBinsAndSaysHowLittleItKnows) {
  Channel channel({}, 4);
  ClockEstimate estimate(kRate);
  EXPECT_EQ(estimate.host_time(5), Instant{0});
  Channel::Sample sample = channel.next();
  for (; sample.true_s < 1.9; sample = channel.next()) estimate.add(sample.ft, sample.arrival);
  EXPECT_FALSE(estimate.ready());
  EXPECT_EQ(estimate.skew_ppm(), 0);
  EXPECT_GT(to_seconds(estimate.uncertainty()), 1e-3);
  EXPECT_NEAR(to_seconds(estimate.host_time(sample.ft) - 100s), sample.true_s, 1e-3);
  for (; sample.true_s < 2.1; sample = channel.next()) estimate.add(sample.ft, sample.arrival);
  EXPECT_TRUE(estimate.ready());
}

TEST(ClockEstimate, ForgetsEverythingWhenTheBoxBootsAnew) {
  ClockEstimate estimate(kRate);
  Channel before({}, 5);
  static_cast<void>(quality_of(before, estimate, 60));
  estimate.restart();
  EXPECT_FALSE(estimate.ready());
  Channel after({.skew_ppm = 40}, 6, 17);
  EXPECT_LT(quality_of(after, estimate, 120).rms_us, 5);
  EXPECT_NEAR(estimate.skew_ppm(), 40, 3);
  EXPECT_EQ(estimate.epochs(), 2u);
}

TEST(ClockEstimate, DoubtsARateThatIsAnotherThanConfigured) {
  ClockEstimate estimate(kRate);
  Channel channel({.skew_ppm = 3000}, 7);
  static_cast<void>(quality_of(channel, estimate, 31));
  EXPECT_FALSE(estimate.believable());
}

TEST(ClockEstimate, TellsTheTimeOfOlderRecordsOfTheSameDatagram) {
  Channel channel({.skew_ppm = 0, .wander_ppm = 0, .stride = 40, .usual_delay_s = 1e-9, .rare_share = 0}, 8);
  ClockEstimate estimate(kRate);
  static_cast<void>(quality_of(channel, estimate, 31));
  const Channel::Sample sample = channel.next();
  estimate.add(sample.ft, sample.arrival);
  EXPECT_NEAR(to_seconds(estimate.host_time(sample.ft) - estimate.host_time(sample.ft - 39)), 39 / kRate, 1e-8);
}

}  // namespace
}  // namespace kphi::netbox
