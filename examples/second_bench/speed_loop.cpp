#include "examples/second_bench/speed_loop.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::second_bench {

int SpeedLoop::throttle(double wanted, double measured, double volts, double seconds) noexcept {
  const double needs = volts > 1 ? kMost * wanted / (settings_.kv_rad_s_per_v * volts) : kLeast;
  const double error = wanted - measured;
  const double without = needs + settings_.proportional * error;
  const double next = integral_ + settings_.integral * error * seconds;
  const double sum = without + next;
  if (sum > kLeast && sum < kMost) integral_ = next;  // else it would wind up
  return static_cast<int>(std::lround(std::clamp(without + integral_, kLeast, kMost)));
}

}  // namespace kphi::second_bench
