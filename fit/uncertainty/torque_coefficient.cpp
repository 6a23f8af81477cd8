#include "fit/uncertainty/torque_coefficient.hpp"

#include <fmt/format.h>

#include <cmath>

#include "base/number.hpp"
#include "fit/model/torque_power.hpp"
#include "results/reduction/bin_statistics.hpp"

namespace kphi::fit {
namespace {

/// Of a / b, whose errors are independent.
Estimate ratio(const Estimate& a, const Estimate& b) {
  const double of_a = a.u / std::abs(a.value), of_b = b.u / std::abs(b.value), value = a.value / b.value;
  return {value, std::abs(value) * std::hypot(of_a, of_b), results::joint_freedom(of_a, a.freedom, of_b, b.freedom)};
}

/// Of one φ alone.
Budget budget_of(const ErrorSources& sources, std::size_t i, const std::string& unit) {
  std::vector<double> weights(sources.k.size());
  weights[i] = 1;
  return sources.budget("", unit, sources.k[i], weights);
}

/// The zero of the torque is known by the scatter of the runs alone.
ErrorSources sources_of(const Repeatability& repeatability, const BenchUncertainty& bench) {
  ErrorSources sources = error_sources(repeatability, {}, bench);
  if (repeatability.repeated) return sources;
  for (ErrorSource& source : sources.sources)
    if (source.name == "zero")
      for (ErrorSource::Effect& effect : source.effects) effect.u = std::numeric_limits<double>::quiet_NaN();
  return sources;
}

}  // namespace

std::vector<TorqueCoefficient> torque_coefficients(const Identification& identification,
                                                   const BenchUncertainty& bench) {
  std::vector<TorqueCoefficient> result;
  const auto fitted = fit_torque(identification.selection.used, identification.options);
  if (!fitted || fitted->table.size() != identification.table.size()) return result;
  BenchUncertainty of_torque = bench;
  if (!bench.calibration_note.empty()) of_torque.cell_calibration.reset();
  const ErrorSources sources = sources_of(fitted->repeatability, of_torque);
  // The motor's clock is in both coefficients alike, and cancels in their ratio.
  BenchUncertainty thrust_alone = bench;
  of_torque.motor_clock = thrust_alone.motor_clock = 0;
  const ErrorSources torque_of_ratio = sources_of(fitted->repeatability, of_torque),
                     thrust_of_ratio = error_sources(identification.repeatability, {}, thrust_alone);
  const double first = sources.k.front();
  for (std::size_t i = 0; i < sources.k.size(); ++i) {
    TorqueCoefficient& row = result.emplace_back();
    row.phi_deg = fitted->table[i].phi_deg;
    row.k_q = budget_of(sources, i, "N m/(rad/s)^2");
    row.k_q.quantity = fmt::format("k_Q({} deg)", row.phi_deg);
    std::vector<double> weights(sources.k.size());
    weights[i] = 1 / first;
    weights[0] -= sources.k[i] / (first * first);
    if (i > 0) row.share = sources.budget("", "1", sources.k[i] / first, weights).estimate();
    row.drag_per_thrust_m =
        ratio(budget_of(torque_of_ratio, i, "").estimate(), budget_of(thrust_of_ratio, i, "").estimate());
  }
  return result;
}

std::string torque_line(const std::vector<TorqueCoefficient>& torque) {
  if (torque.empty()) return {};
  const TorqueCoefficient& first = torque.front();
  return fmt::format("{:<10} {} N m/(rad/s)^2, {} m per newton of thrust\n", "k_Q",
                     with_error(first.k_q.value, first.k_q.expanded()),
                     plain_with_error(first.drag_per_thrust_m.value, expanded(first.drag_per_thrust_m)));
}

}  // namespace kphi::fit
