// What the compensation costs against the map it replaces: four plain sqrt(T/K_T).
#include <benchmark/benchmark.h>

#include <cmath>

#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace {

/// Not inlined: the peer is a call across a library boundary, as speeds_for is.
[[gnu::noinline]] std::array<RadPerSec, 4> plain_speeds(const std::array<Newtons, 4>& thrusts, ThrustCoefficient k) {
  std::array<RadPerSec, 4> speeds;
  for (std::size_t i = 0; i < 4; ++i) speeds[i] = RadPerSec(std::sqrt(thrusts[i].value() / k.value()));
  return speeds;
}

void plain_map(benchmark::State& state) {
  auto thrusts = thrusts_of(1.4, 1.5, 1.6, 1.7);
  for (auto _ : state) {
    benchmark::DoNotOptimize(thrusts);
    auto speeds = plain_speeds(thrusts, kExampleCoefficient);
    benchmark::DoNotOptimize(speeds);
  }
}
BENCHMARK(plain_map);

void speeds_for_in_o(benchmark::State& state) {
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
  auto thrusts = thrusts_of(1.4, 1.5, 1.6, 1.7);
  for (auto _ : state) {
    benchmark::DoNotOptimize(thrusts);
    SpeedCommand command = compensator.speeds_for(thrusts);
    benchmark::DoNotOptimize(command);
  }
}
BENCHMARK(speeds_for_in_o);

/// Alternates between two sets of angles, so that every arm has moved at every call.
void set_arms(benchmark::State& state, std::array<Radians, 4> arms, double move_deg) {
  Compensator compensator = example_compensator();
  auto moved = arms;
  for (Radians& angle : moved) angle = angle - from_degrees(move_deg);
  bool turn = false;
  for (auto _ : state) {
    compensator.set_arms((turn = !turn) ? moved : arms);
    benchmark::DoNotOptimize(compensator);
  }
}
BENCHMARK_CAPTURE(set_arms, unchanged_o, shape_o(), 0.0);
BENCHMARK_CAPTURE(set_arms, moving_x, shape_x(), 0.1);
BENCHMARK_CAPTURE(set_arms, moving_o, shape_o(), 0.1);

}  // namespace
}  // namespace kphi::compensation
