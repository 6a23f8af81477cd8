#include "compensation/flight/study.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <future>
#include <stdexcept>
#include <utility>

namespace kphi::flight {
namespace {

using compensation::ThrustCurve;

double horizontal(const LegResult& leg) noexcept { return leg.mean_error.head<2>().norm(); }

void count_lost(Merits& merits, const Experiment& experiment, const FlightResult& flight) noexcept {
  if (!flight.lost) return;
  const Leg& leg = experiment.legs[flight.lost_leg];
  const bool plain = leg.shape == Shape::o && !leg.compensated;
  (plain ? merits.lost_plain : merits.lost_compensated) = true;
}

/// The slope first, then the start: the order of the draws. All rotors alike: the bench is off, not a propeller.
void draw_curves(compensation::Rotors<ThrustCurve>& curves, Random& random) {
  const double steepness = random.normal(1.0, 0.03), raised = random.normal(0.0, 0.01);
  for (ThrustCurve& curve : curves) {
    const auto drawn = curve.perturbed(raised * curve.thrust_coefficient(), steepness);
    if (!drawn) throw std::invalid_argument("k(0) is not positive in a draw; check the coefficient file");
    curve = *drawn;
  }
}

/// The arms that stop short of the farthest one do so `factor` times as far.
Angles with_margin(const Angles& arms, double factor) {
  const Radians farthest = *std::max_element(arms.begin(), arms.end());
  Angles moved = arms;
  for (Radians& arm : moved) arm = farthest - factor * (farthest - arm);
  return moved;
}

void draw_truth(Truth& truth, std::size_t rotors, Random& random) {
  truth.gamma = std::max(0.0, truth.gamma + random.uniform(-0.4, 0.1));
  truth.mass *= random.normal(1.0, 0.015);
  for (std::size_t i = 0; i < rotors; ++i) truth.thrust[i] *= random.normal(1.0, 0.01);
  for (std::size_t i = 0; i < rotors; ++i) truth.arm_error[i] += random.normal(0.0, 0.02);
  for (Eigen::Index i = 0; i < 2; ++i) truth.cog_error[i] += random.normal(0.0, 1.5e-3);
  truth.drag *= random.uniform(1.0 / 3, 5.0 / 3);
  for (Eigen::Index i = 0; i < 2; ++i) truth.wind[i] += random.normal(0.0, 0.1);
}

void draw_gains(Gains& gains, Random& random) {
  const double root = std::sqrt(random.uniform(0.8, 2.0));
  gains.attitude.head<2>() *= root;
  gains.rate.head<2>() *= root;
  gains.position.head<2>() *= random.uniform(5.0 / 6, 10.0 / 6);
}

}  // namespace

ThrustCoefficient published_thrust(const PropellerKind& kind) {
  const bool two = kind.blades == 2, six = kind.diameter_in > 5.5;
  const double of_size = six ? (two ? 2.6e-8 : 3.1e-8) : (two ? 1.3e-8 : 1.7e-8);
  return from_newtons_per_rpm2(of_size * std::pow(kind.diameter_in / (six ? 6 : 5), 4));
}

AssumedWorld assumed_world(const Vehicle& vehicle, PropellerKind kind,
                           const compensation::Rotors<compensation::ThrustCurve>& curves) {
  constexpr double kInch = 0.0254;  // m
  if (!(kind.diameter_in > 0)) kind.diameter_in = 2 * vehicle.airframe.propeller_radius.value() / kInch;
  const double k_t = curves[0].thrust_coefficient().value();
  const auto near = [&](int blades) {
    const double published = published_thrust({kind.diameter_in, blades}).value();
    return std::fabs(k_t / published - 1) <= kPublishedScatter;
  };
  AssumedWorld world;
  world.published = published_thrust(kind);
  world.as_in_file = kind.blades > 0 ? near(kind.blades) : near(2) || near(3);
  world.truth.drag = vehicle.build.air_drag_per_s;
  world.truth.thrust_coefficient = world.as_in_file ? curves[0].thrust_coefficient() : world.published;
  for (std::size_t i = 0; world.as_in_file && i < curves.size(); ++i)
    world.truth.thrust[i] *= curves[i].thrust_coefficient().value() / k_t;
  return world;
}

Scene nominal_scene(const Vehicle& vehicle, const PilotSettings& pilot, const compensation::Rotors<ThrustCurve>& curves,
                    const Truth& world, std::uint64_t seed) {
  return {vehicle, curves, world, {}, pilot, seed};
}

Scene drawn_scene(const Scene& nominal, std::size_t index) {
  Random random(nominal.seed, index);
  Scene scene = nominal;
  scene.seed = random.bits();
  scene.truth.law = static_cast<LossLaw>(index % kLossLaws);
  draw_truth(scene.truth, scene.vehicle.rotors(), random);
  draw_gains(scene.pilot.gains, random);
  scene.vehicle.o = with_margin(nominal.vehicle.o, random.uniform(0.4, 2.0));
  draw_curves(scene.curves, random);
  return scene;
}

FlightResult fly_one(std::size_t index, Scene scene, const Shadow& shadow, std::vector<TraceRow>* trace) {
  scene.seed = Random(scene.seed, index).bits();
  return fly(kExperiments[index], scene, shadow, trace);
}

NineFlights fly_all(const Scene& scene, const Shadow& shadow) {
  NineFlights flights;
  for (std::size_t i = 0; i < kExperiments.size(); ++i) flights[i] = fly_one(i, scene, shadow);
  return flights;
}

double Merits::hover_z_ratio() const noexcept { return std::fabs(hover_z_compensated / hover_z_plain); }

Merits merits_of(const NineFlights& flights) noexcept {
  const auto leg = [&](ExperimentIndex flight, std::size_t index) -> const LegResult& {
    return flights[flight].legs[index];
  };
  Merits merits;
  merits.hover_z_x = leg(kHoverPlain, 0).mean_error.z();
  merits.hover_z_plain = leg(kHoverPlain, 1).mean_error.z();
  merits.hover_z_compensated = leg(kHoverCompensated, 1).mean_error.z();
  merits.hover_xy_plain = horizontal(leg(kHoverPlain, 1));
  merits.hover_xy_compensated = horizontal(leg(kHoverCompensated, 1));
  using Place = std::pair<ExperimentIndex, std::size_t>;  // flight and leg
  const auto mean_distance = [&](const std::array<Place, 4>& legs) {
    double sum = 0;
    for (const auto& [flight, index] : legs) sum += leg(flight, index).mean_distance;
    return sum / 4;
  };
  merits.forward_x =
      mean_distance({{{kLevelPlain, 0}, {kLevelCompensated, 0}, {kRisingPlain, 0}, {kRisingCompensated, 0}}});
  merits.forward_plain =
      mean_distance({{{kLevelPlain, 1}, {kLevelSwitched, 0}, {kRisingPlain, 1}, {kRisingSwitched, 0}}});
  merits.forward_compensated =
      mean_distance({{{kLevelCompensated, 1}, {kLevelSwitched, 1}, {kRisingCompensated, 1}, {kRisingSwitched, 1}}});
  merits.square_speed_ratio = (leg(kHoverSwitched, 0).mean_square_speed + leg(kHoverSwitched, 2).mean_square_speed) /
                              (2 * leg(kHoverSwitched, 1).mean_square_speed);
  for (std::size_t i = 0; i < flights.size(); ++i) count_lost(merits, kExperiments[i], flights[i]);
  return merits;
}

std::vector<Draw> fly_draws(const Scene& nominal, const Shadow& shadow, std::size_t count, std::size_t threads) {
  std::vector<Draw> draws(count, Draw{nominal, {}});
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      draws[i].scene = drawn_scene(nominal, i);
      draws[i].flights = fly_all(draws[i].scene, shadow);
    }
  };
  std::vector<std::future<void>> others;
  for (std::size_t i = 1; i < std::min(threads, count); ++i) others.push_back(std::async(std::launch::async, work));
  work();
  for (auto& other : others) other.get();
  return draws;
}

Percentiles percentiles(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const std::size_t below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
  };
  return {at(0.1), at(0.5), at(0.9)};
}

Findings findings_of(const std::vector<Draw>& draws) {
  std::vector<Merits> kept;
  std::vector<double> in_x;
  std::array<std::vector<double>, kLossLaws> hover_by_law, forward_by_law;
  Findings found;
  found.draws = draws.size();
  double hover_better = 0, forward_better = 0;
  for (const Draw& draw : draws) {
    const Merits merits = merits_of(draw.flights);
    const FlightResult& hover = draw.flights[kHoverPlain];
    if (hover.leg_count > 0 && !(hover.lost && hover.lost_leg == 0)) in_x.push_back(merits.hover_z_x);
    const bool saved = merits.lost_plain && !merits.lost_compensated;
    found.lost_plain += merits.lost_plain;
    found.lost_compensated += merits.lost_compensated;
    hover_better += merits.lost() ? saved : merits.hover_z_ratio() < 1;
    forward_better += merits.lost() ? saved : merits.forward_ratio() < 1;
    if (merits.lost()) continue;
    kept.push_back(merits);
    const auto law = static_cast<std::size_t>(draw.scene.truth.law);
    hover_by_law[law].push_back(merits.hover_z_ratio());
    forward_by_law[law].push_back(merits.forward_ratio());
  }
  found.kept = kept.size();
  if (!in_x.empty()) found.hover_z_x = percentiles(in_x).p50;
  for (std::size_t law = 0; law < found.by_law.size(); ++law) {
    found.by_law[law] = {hover_by_law[law].size(), percentiles(hover_by_law[law]).p50,
                         percentiles(forward_by_law[law]).p50};
  }
  if (found.draws > 0) {
    found.hover_z_better = hover_better / static_cast<double>(found.draws);
    found.forward_better = forward_better / static_cast<double>(found.draws);
  }
  for (std::size_t i = 0; i < kMerits.size(); ++i) {
    std::vector<double> values;
    for (const Merits& merits : kept) values.push_back(kMerits[i].of(merits));
    found.merits[i] = percentiles(std::move(values));
  }
  return found;
}

}  // namespace kphi::flight
