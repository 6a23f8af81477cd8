#include "fit/flights/flight_model.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kphi::fit {
namespace {

using compensation::Rotors;

/// The mean of the rotors is in K_T: what their own numbers have in common is held at 0 this tightly.
constexpr double kMeanOfRotors = 1e-5;

}  // namespace

FlightModel::FlightModel(const FlownBins& flown, std::vector<FreeNumber> free, std::vector<double> knots_rad,
                         double mass_kg, double fastest)
    : given(kKnots + knots_rad.size() + flown.rotors, 0),
      shock(flown.bins.size(), 0),
      flown_(&flown),
      free_(std::move(free)),
      column_(given.size(), -1),
      knots_(std::move(knots_rad)),
      mass_(mass_kg),
      fastest_(fastest) {
  given[kLevel] = given[kRollGain] = given[kPitchGain] = 1;
  for (std::size_t i = 0; i < free_.size(); ++i) column_[free_[i].which] = static_cast<int>(i);
  set_num_residuals(static_cast<int>(3 * bins() + free_.size() + 1));
  mutable_parameter_block_sizes()->push_back(static_cast<int>(free_.size()));
}

std::vector<double> FlightModel::start() const {
  std::vector<double> values;
  for (const FreeNumber& one : free_) values.push_back(one.before);
  return values;
}

std::pair<std::size_t, double> FlightModel::place_of(double phi) const {
  std::size_t j = 0;
  while (j + 1 < knots_.size() && phi > knots_[j]) ++j;
  const double before = j > 0 ? knots_[j - 1] : 0;
  return {j, (phi - before) / (knots_[j] - before)};
}

std::vector<Rotors<double>> FlightModel::squares(const Driving& driving) const {
  const auto [timing, law, sag, late] = driving;
  const RotorDrive& drive = flown_->drive;
  const std::size_t count = drive.values.size(), rotors = flown_->rotors;
  std::vector<Rotors<double>> speeds(count, Rotors<double>(rotors));
  // What was logged at t was so at t − late: speeds by kTiming, commands by kStamp.
  const double shift = (drive.commands ? late : timing) / drive.step_s, whole = std::floor(shift), part = shift - whole;
  const auto from = static_cast<std::ptrdiff_t>(whole), end = static_cast<std::ptrdiff_t>(count) - 1;
  for (std::ptrdiff_t n = 0; n <= end; ++n) {
    const auto& a = drive.values[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(n + from, 0, end))];
    const auto& b = drive.values[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(n + from + 1, 0, end))];
    for (std::size_t i = 0; i < rotors; ++i) speeds[static_cast<std::size_t>(n)][i] = a[i] + part * (b[i] - a[i]);
  }
  if (drive.commands) {
    const double follow = 1 - std::exp(-drive.step_s / std::max(timing, 1e-4));
    Rotors<double> turning(rotors), last(rotors);
    for (std::size_t n = 0; n < count; ++n) {
      const double volts = drive.volts.empty() ? 1 : 1 + sag * (drive.volts[n] - 1);
      for (std::size_t i = 0; i < rotors; ++i) {
        const double u = speeds[n][i];
        const double aim = fastest_ * volts * std::sqrt(std::max(0.0, law * u * u + (1 - law) * u));
        if (n == 0) turning[i] = last[i] = aim;
        // Commands change all the time: over a step their mean is followed.
        turning[i] += follow * ((last[i] + aim) / 2 - turning[i]);
        last[i] = aim;
        speeds[n][i] = turning[i];
      }
    }
  }
  std::vector<Rotors<double>> means(bins(), Rotors<double>(rotors));
  for (std::size_t b = 0; b < bins(); ++b)
    for (std::size_t n = flown_->first[b]; n < flown_->first[b] + flown_->samples; ++n)
      for (std::size_t i = 0; i < rotors; ++i)
        means[b][i] += speeds[n][i] * speeds[n][i] / static_cast<double>(flown_->samples);
  return means;
}

bool FlightModel::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  std::vector<double> p = given;
  for (std::size_t i = 0; i < free_.size(); ++i) p[free_[i].which] = parameters[0][i];
  const std::size_t n = bins(), rotors = flown_->rotors, columns = free_.size();
  const bool derive = jacobians != nullptr && jacobians[0] != nullptr;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
  Eigen::Map<Rows> j(derive ? jacobians[0] : nullptr, derive ? num_residuals() : 0,
                     derive ? static_cast<Eigen::Index>(columns) : 0);
  r.setZero();
  if (derive) j.setZero();

  Driving driving{};
  for (std::size_t d = 0; d < driving.size(); ++d) driving[d] = p[kDriving[d]];
  const auto w = squares(driving);
  // How the squares change with these: by differences, as they are filtered.
  constexpr Driving kSteps{1e-3, 1e-3, 1e-2, 1e-3};
  std::array<std::vector<Rotors<double>>, kDriving.size()> dw;
  for (std::size_t d = 0; d < kDriving.size() && derive; ++d) {
    if (column_[kDriving[d]] < 0) continue;
    Driving up = driving, down = driving;
    up[d] += kSteps[d];
    down[d] -= kSteps[d];
    dw[d] = squares(up);
    const auto below = squares(down);
    for (std::size_t b = 0; b < n; ++b)
      for (std::size_t i = 0; i < rotors; ++i) dw[d][b][i] = (dw[d][b][i] - below[b][i]) / (2 * kSteps[d]);
  }

  const auto add = [&](std::size_t row, std::size_t which, double slope) {
    if (derive && column_[which] >= 0) j(static_cast<Eigen::Index>(row), column_[which]) += slope;
  };
  const double k = hover * p[kLevel];
  const std::size_t first_rotor = kKnots + knots_.size();
  for (std::size_t b = 0; b < n; ++b) {
    const FlownBin& bin = flown_->bins[b];
    if (shock[b]) continue;
    // Of each equation: what one rotor's thrust weighs in it, what is told, and 1/sigma.
    const auto equation = [&](std::size_t row, double weight, const auto& lever, double gain, double rest) {
      double sum = 0;
      for (std::size_t i = 0; i < rotors; ++i) {
        const double share = 1 + p[first_rotor + i], of = weight * gain * lever(i) * k;
        double kept = 1;
        if (!knots_.empty()) {
          const auto [at, x] = place_of(bin.phi[i]);
          kept = (1 - x) * (at > 0 ? p[kKnots + at - 1] : 1) + x * p[kKnots + at];
          add(row, kKnots + at, of * share * w[b][i] * x);
          if (at > 0) add(row, kKnots + at - 1, of * share * w[b][i] * (1 - x));
        }
        const double thrust = of * kept * share * w[b][i];
        sum += thrust;
        add(row, kLevel, thrust / p[kLevel]);
        add(row, first_rotor + i, of * kept * w[b][i]);
        for (std::size_t d = 0; d < kDriving.size(); ++d)
          if (!dw[d].empty()) add(row, kDriving[d], of * kept * share * dw[d][b][i]);
      }
      r[static_cast<Eigen::Index>(row)] = sum + weight * rest;
      return sum / weight;
    };
    const double rest = -p[kDrag] * bin.climb + p[kForward] * bin.forward, scale = 1 + p[kScale];
    const double weight = 1 / sigma[0];
    const double felt = equation(
        b, weight, [](std::size_t) { return 1.0; }, scale / mass_, scale * rest + p[kBias] - bin.force);
    add(b, kScale, weight * (felt / scale + rest));
    add(b, kBias, weight);
    add(b, kDrag, -weight * scale * bin.climb);
    add(b, kForward, weight * scale * bin.forward);
    if (!bin.turns || column_[kRollGain] < 0) continue;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const std::size_t row = n + 2 * b + axis, gain = axis == 0 ? kRollGain : kPitchGain;
      const std::size_t centre = axis == 0 ? kCentreY : kCentreX;
      const double sign = axis == 0 ? -1 : 1, by = 1 / sigma[1 + axis], per = p[gain] / bin.inertia[axis];
      const double turned = equation(
          row, by, [&](std::size_t i) { return bin.levers[axis][i] + sign * p[centre]; }, per, -bin.turning[axis]);
      add(row, gain, by * turned / p[gain]);
      double thrust = 0;
      for (std::size_t i = 0; i < rotors; ++i) thrust += k * (1 + p[first_rotor + i]) * w[b][i];
      add(row, centre, by * per * sign * thrust);
    }
  }
  for (std::size_t i = 0; i < columns; ++i) {
    if (!(free_[i].before_u > 0)) continue;
    r[static_cast<Eigen::Index>(3 * n + i)] = (parameters[0][i] - free_[i].before) / free_[i].before_u;
    add(3 * n + i, free_[i].which, 1 / free_[i].before_u);
  }
  for (std::size_t i = 0; i < rotors && column_[first_rotor] >= 0; ++i) {
    r[static_cast<Eigen::Index>(3 * n + columns)] += p[first_rotor + i] / kMeanOfRotors;
    add(3 * n + columns, first_rotor + i, 1 / kMeanOfRotors);
  }
  return true;
}

}  // namespace kphi::fit
