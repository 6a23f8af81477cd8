#include "compensation/flight/draw.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "compensation/flight/random.hpp"

namespace kphi::flight {
namespace {

using compensation::ThrustCurve;

/// The slope first, then the start: the order of the draws.
ThrustCurve drawn_curve(const ThrustCurve& curve, Random& random) {
  const double steepness = random.normal(1.0, 0.03);
  const auto drawn = curve.perturbed(random.normal(0.0, 0.01) * curve.thrust_coefficient(), steepness);
  if (!drawn) throw std::invalid_argument("k(0) is not positive in a draw; check the coefficient file");
  return *drawn;
}

/// The arms that stop short of the farthest one do so `factor` times as far.
Angles with_margin(const Angles& arms, double factor) {
  const Radians farthest = *std::max_element(arms.begin(), arms.end());
  Angles moved = arms;
  for (Radians& arm : moved) arm = farthest - factor * (farthest - arm);
  return moved;
}

void draw_truth(Truth& truth, Random& random) {
  truth.gamma = random.uniform(1.0, 1.5);
  truth.mass = random.normal(1.0, 0.015);
  for (double& factor : truth.thrust) factor = random.normal(1.0, 0.01);
  for (double& error : truth.arm_error) error = random.normal(0.0, 0.02);
  for (Eigen::Index i = 0; i < 2; ++i) truth.cog_error[i] = random.normal(0.0, 1.5e-3);
  truth.drag *= random.uniform(1.0 / 3, 5.0 / 3);
  for (Eigen::Index i = 0; i < 2; ++i) truth.wind[i] = random.normal(0.0, 0.1);
}

void draw_gains(Gains& gains, Random& random) {
  const double root = std::sqrt(random.uniform(0.8, 2.0));
  gains.attitude.head<2>() *= root;
  gains.rate.head<2>() *= root;
  gains.position.head<2>() *= random.uniform(5.0 / 6, 10.0 / 6);
}

}  // namespace

Scene nominal_scene(const Vehicle& vehicle, const PilotSettings& pilot, const ThrustCurve& curve, std::uint64_t seed) {
  Scene scene{vehicle, curve, {}, {}, pilot, seed};
  scene.truth.drag = vehicle.build.air_drag_per_s;
  return scene;
}

Scene drawn_scene(const Scene& nominal, std::size_t index) {
  Random random(nominal.seed, index);
  Scene scene = nominal;
  scene.seed = random.bits();
  scene.truth.law = static_cast<LossLaw>(index % kLossLaws);
  draw_truth(scene.truth, random);
  draw_gains(scene.pilot.gains, random);
  scene.vehicle.o = with_margin(nominal.vehicle.o, random.uniform(0.4, 2.0));
  scene.curve = drawn_curve(nominal.curve, random);
  return scene;
}

}  // namespace kphi::flight
