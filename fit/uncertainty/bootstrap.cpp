#include "fit/uncertainty/bootstrap.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/random.hpp"

namespace kphi::fit {
namespace {

double pooled(std::span<const RunSums> runs) {
  double xt = 0, xx = 0;
  for (const RunSums& run : runs) {
    xt += run.xt;
    xx += run.xx;
  }
  return xt / xx;
}

/// One resample per entry of `into`. Two 32-bit draws come out of each 64-bit number; the bias of n/2³² does not matter
/// here.
void resample(std::span<const RunSums> runs, std::span<double> into, SplitMix64& random) {
  const std::uint64_t n = runs.size();
  for (double& k : into) {
    double xt = 0, xx = 0;
    std::uint64_t bits = 0;
    for (std::uint64_t i = 0; i < n; ++i) {
      bits = i % 2 == 0 ? random() : bits >> 32;
      const RunSums& run = runs[((bits & 0xffffffffu) * n) >> 32];
      xt += run.xt;
      xx += run.xx;
    }
    k = xt / xx;
  }
}

/// The samples whose ranks among n are nearest to 2.5 % and 97.5 % of n − 1. Of a normal sample only 11 % lie
/// beyond 1.2 deviations on each side: as a rule only these are put in order.
std::pair<double, double> ends_of(const std::vector<double>& samples, double centre, double deviation) {
  const auto rank = [&](double share) {
    return static_cast<std::ptrdiff_t>(share * static_cast<double>(samples.size() - 1) + 0.5);
  };
  std::vector<double> tails(samples.size());
  auto low = tails.begin(), high = tails.end();  // each sample is written at both, without a branch
  for (const double sample : samples) {
    *low = *(high - 1) = sample;
    low += sample < centre - 1.2 * deviation;
    high -= sample > centre + 1.2 * deviation;
  }
  const auto lower = tails.begin() + rank(0.025), upper = tails.begin() + rank(0.975);
  if (lower >= low || upper < high) {
    tails = samples;
    low = tails.end();
    high = tails.begin();
  }
  std::nth_element(tails.begin(), lower, low);
  std::nth_element(high, upper, tails.end());
  return {*lower, *upper};
}

BootstrapInterval summary(std::string quantity, double value, const std::vector<double>& samples) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  const Eigen::Map<const Eigen::ArrayXd> all(samples.data(), n);
  const double centre = all.mean(), deviation = std::sqrt((all - centre).square().sum() / static_cast<double>(n - 1));
  if (!std::isfinite(deviation)) return {std::move(quantity), value, deviation, deviation, deviation};
  const auto [lower, upper] = ends_of(samples, centre, deviation);
  return {std::move(quantity), value, deviation, lower, upper};
}

}  // namespace

std::vector<BootstrapInterval> bootstrap(std::span<const AngleScatter> angles, const LineWeights& line,
                                         const BootstrapOptions& options) {
  std::vector<BootstrapInterval> result;
  if (angles.empty() || options.resamples < 2) return result;
  SplitMix64 random(options.seed);
  std::vector<double> k(options.resamples), intercept(options.resamples), slope(options.resamples);
  double intercept_value = 0, slope_value = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const std::vector<RunSums>& runs = angles[i].runs;
    if (runs.empty()) continue;
    resample(runs, k, random);
    for (std::size_t j = 0; j < k.size(); ++j) {
      intercept[j] += line.intercept[i] * k[j];
      slope[j] += line.slope[i] * k[j];
    }
    const double value = pooled(runs);
    intercept_value += line.intercept[i] * value;
    slope_value += line.slope[i] * value;
    const double phi = runs.front().phi_deg;
    result.push_back(summary(phi == 0 ? "K_T" : fmt::format("k({} deg)", phi), value, k));
  }
  result.push_back(summary("intercept", intercept_value, intercept));
  result.push_back(summary("slope", slope_value, slope));
  return result;
}

}  // namespace kphi::fit
