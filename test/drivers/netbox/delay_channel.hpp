// A box with a skewed clock behind a host with delays; the truth is known. A model, not hardware.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "drivers/netbox/stream/health.hpp"

namespace kphi::netbox::test {

inline constexpr double kRate = 7000;

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
    return {ft_, true_s, std::chrono::seconds(100) + from_seconds(arrival_s_)};
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
  /// What is left when the constant, which nobody can see from one end, is taken away.
  double spread_us() const { return std::sqrt(std::max(0.0, rms_us * rms_us - mean_us * mean_us)); }
};

/// Collects errors in us.
class Errors {
 public:
  void add(double error_us) {
    squares_ += error_us * error_us;
    sum_ += error_us;
    largest_ = std::max(largest_, std::abs(error_us));
    ++n_;
  }
  Quality quality() const { return {std::sqrt(squares_ / n_), sum_ / n_, largest_}; }

 private:
  double squares_ = 0, sum_ = 0, largest_ = 0;
  int n_ = 0;
};

/// Error against the true sample time plus the least delay, from 30 s to `seconds`.
inline Quality quality_of(Channel& channel, ClockEstimate& estimate, double seconds) {
  Errors errors;
  for (Channel::Sample sample = channel.next(); sample.true_s < seconds; sample = channel.next()) {
    const Duration late = estimate.add(sample.ft, sample.arrival);
    if (sample.true_s < 30) continue;
    const double told = to_seconds(sample.arrival - late - std::chrono::seconds(100));
    errors.add(1e6 * (told - sample.true_s - Channel::kLeastDelay));
  }
  return errors.quality();
}

struct ChannelCase {
  const char* name;
  Channel::Manner manner;
};

/// Every host, sign of the wander and mode that the clock must cope with.
inline std::vector<ChannelCase> channel_cases() {
  std::vector<ChannelCase> cases;
  struct Mode {
    const char *quiet, *loaded;
    unsigned stride;
  };
  for (const Mode& mode : {Mode{"quiet 1 kHz single-record", "loaded 1 kHz single-record", 7},
                           Mode{"quiet 7 kHz single-record", "loaded 7 kHz single-record", 1},
                           Mode{"quiet 7 kHz buffered", "loaded 7 kHz buffered", 40}})
    for (const double wander : {0.5, -0.5}) {
      cases.push_back({mode.quiet, {60, wander, mode.stride, 30e-6, 0.001, 5e-3}});
      cases.push_back({mode.loaded, {60, wander, mode.stride, 200e-6, 0.02, 20e-3}});
    }
  return cases;
}

}  // namespace kphi::netbox::test
