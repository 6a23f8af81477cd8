#include "drivers/iq/exchange/round_trip.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::iq {
namespace {

constexpr double kPerOctave = 4;

}  // namespace

void RoundTripHistogram::add(Duration duration) noexcept {
  const double microseconds = std::max(1e-3 * static_cast<double>(duration.count()), 1.0);
  const auto bucket = static_cast<std::size_t>(kPerOctave * std::log2(microseconds));
  ++buckets_[std::min(bucket, kBuckets - 1)];
  ++count_;
}

Duration RoundTripHistogram::lower_edge(std::size_t i) noexcept {
  return from_seconds(1e-6 * std::exp2(static_cast<double>(i) / kPerOctave));
}

Duration RoundTripHistogram::quantile(double share) const noexcept {
  if (count_ == 0) return Duration{0};
  const double wanted = std::max(share * static_cast<double>(count_), 1.0);
  std::uint64_t passed = 0;
  std::size_t bucket = 0;
  while (bucket + 1 < kBuckets && static_cast<double>(passed += buckets_[bucket]) < wanted) ++bucket;
  return lower_edge(bucket) + (lower_edge(bucket + 1) - lower_edge(bucket)) / 2;
}

void AdaptiveTimeout::measured(Duration round_trip) noexcept {
  if (smoothed_ == Duration{0}) {
    smoothed_ = round_trip;
    deviation_ = round_trip / 2;
  } else {
    deviation_ += (Duration(std::abs((smoothed_ - round_trip).count())) - deviation_) / 4;
    smoothed_ += (round_trip - smoothed_) / 8;
  }
  timeout_ = std::clamp(smoothed_ + 4 * deviation_, shortest_, longest_);
}

void AdaptiveTimeout::timed_out(Instant sent, Instant now) noexcept {
  if (sent < doubled_at_) return;
  doubled_at_ = now;
  timeout_ = std::min(2 * timeout_, longest_);
}

}  // namespace kphi::iq
