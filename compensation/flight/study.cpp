#include "compensation/flight/study.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <future>

namespace kphi::flight {
namespace {

double horizontal(const LegResult& leg) noexcept { return leg.mean_error.head<2>().norm(); }

void count_lost(Merits& merits, const Experiment& experiment, const FlightResult& flight) noexcept {
  if (!flight.lost) return;
  const Leg& leg = experiment.legs[flight.lost_leg];
  const bool plain = leg.shape == Shape::o && !leg.compensated;
  (plain ? merits.lost_plain : merits.lost_compensated) = true;
}

}  // namespace

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
  const auto distance = [&](ExperimentIndex flight, std::size_t index) { return leg(flight, index).mean_distance; };
  Merits merits;
  merits.hover_z_plain = leg(kHoverPlain, 1).mean_error.z();
  merits.hover_z_compensated = leg(kHoverCompensated, 1).mean_error.z();
  merits.hover_xy_plain = horizontal(leg(kHoverPlain, 1));
  merits.hover_xy_compensated = horizontal(leg(kHoverCompensated, 1));
  merits.forward_x = (distance(kLevelPlain, 0) + distance(kLevelCompensated, 0) + distance(kRisingPlain, 0) +
                      distance(kRisingCompensated, 0)) /
                     4;
  merits.forward_plain = (distance(kLevelPlain, 1) + distance(kLevelSwitched, 0) + distance(kRisingPlain, 1) +
                          distance(kRisingSwitched, 0)) /
                         4;
  merits.forward_compensated = (distance(kLevelCompensated, 1) + distance(kLevelSwitched, 1) +
                                distance(kRisingCompensated, 1) + distance(kRisingSwitched, 1)) /
                               4;
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
  std::array<std::vector<double>, kLossLaws> hover_by_law, forward_by_law;
  Findings found;
  found.draws = draws.size();
  double hover_better = 0, forward_better = 0;
  for (const Draw& draw : draws) {
    const Merits merits = merits_of(draw.flights);
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
  for (std::size_t law = 0; law < found.by_law.size(); ++law) {
    found.by_law[law] = {hover_by_law[law].size(), percentiles(hover_by_law[law]).p50,
                         percentiles(forward_by_law[law]).p50};
  }
  if (found.draws > 0) {
    found.hover_z_better = hover_better / static_cast<double>(found.draws);
    found.forward_better = forward_better / static_cast<double>(found.draws);
  }
  const auto over = [&](auto of) {
    std::vector<double> values;
    for (const Merits& merits : kept) values.push_back(std::invoke(of, merits));
    return percentiles(std::move(values));
  };
  found.hover_z_plain = over(&Merits::hover_z_plain);
  found.hover_z_compensated = over(&Merits::hover_z_compensated);
  found.hover_z_ratio = over(&Merits::hover_z_ratio);
  found.hover_xy_plain = over(&Merits::hover_xy_plain);
  found.hover_xy_compensated = over(&Merits::hover_xy_compensated);
  found.hover_xy_ratio = over(&Merits::hover_xy_ratio);
  found.forward_x = over(&Merits::forward_x);
  found.forward_plain = over(&Merits::forward_plain);
  found.forward_compensated = over(&Merits::forward_compensated);
  found.forward_ratio = over(&Merits::forward_ratio);
  found.square_speed_ratio = over(&Merits::square_speed_ratio);
  return found;
}

}  // namespace kphi::flight
