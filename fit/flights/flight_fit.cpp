#include "fit/flights/flight_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <utility>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/statistics.hpp"
#include "fit/flights/flight_model.hpp"
#include "fit/numerics/least_squares.hpp"

namespace kphi::fit {
namespace {

using compensation::Rotors;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr double kBlock = 6;  // s: three times the memory of the slowest noise that is expected
constexpr std::size_t kLeastBlocks = 4, kMostBlocks = 60;
constexpr double kShock = 6;    // deviations
constexpr double kWeak = 0.03;  // of a rotor beside the others, to be named

/// Pieces of time that are taken as independent of each other.
struct Blocks {
  std::vector<std::size_t> of;  ///< of each bin
  std::size_t count = 0;
};

Blocks blocks_of(const FlownBins& flown) {
  const double seconds = flown.excitation.seconds;
  const auto wanted = std::clamp(static_cast<std::size_t>(seconds / kBlock), kLeastBlocks, kMostBlocks);
  Blocks blocks{{}, wanted};
  for (std::size_t b = 0; b < flown.bins.size(); ++b) blocks.of.push_back(b * wanted / flown.bins.size());
  return blocks;
}

double spread(std::vector<double> values) {
  if (values.empty()) return 0;
  const double middle = median(values);
  for (double& one : values) one = std::abs(one - middle);
  return 1.4826 * median(std::move(values));
}

/// One row of residuals for each of force, roll and pitch.
struct Equation {
  std::size_t index;
  [[nodiscard]] std::size_t row(std::size_t bin, std::size_t bins) const {
    return index == 0 ? bin : bins + 2 * bin + index - 1;
  }
};

class Fitting {
 public:
  Fitting(const FlownBins& flown, const LoggedVehicle& vehicle, const FlightPriors& priors)
      : flown_(flown), vehicle_(vehicle), priors_(priors), blocks_(blocks_of(flown)) {
    for (const double phi : flown.excitation.knots_deg) fit_.kept.push_back({phi, {}});
  }

  FlightFit fit() {
    if (!(vehicle_.mass_kg > 0)) throw FitError("the mass of the vehicle is not known; --mass KG says it");
    std::vector<double> knots;
    for (const KeptThrust& one : fit_.kept) knots.push_back(from_degrees(one.phi_deg).value());
    FlightModel model(flown_, free_numbers(flown_, priors_), std::move(knots), vehicle_.mass_kg,
                      vehicle_.airframe.fastest_speed.value());
    model.hover = hover_of(model);
    values_ = model.start();
    for (int pass = 0; pass < 3; ++pass) {
      solve(model);
      weigh(model);
    }
    solve(model);
    evaluate(model);
    require_order(model);
    covariance(model);
    report(model, model.hover);
    return std::move(fit_);
  }

 private:
  /// Σ k ω² = m g by the means, with all that is free as it is known before.
  double hover_of(const FlightModel& model) const {
    const auto squares = squares_at(model, model.start());
    double felt = 0, sum = 0;
    for (std::size_t b = 0; b < squares.size(); ++b) {
      felt += flown_.bins[b].force;
      sum += std::accumulate(squares[b].begin(), squares[b].end(), 0.0);
    }
    return vehicle_.mass_kg * felt / sum;
  }

  static std::vector<Rotors<double>> squares_at(const FlightModel& model, const std::vector<double>& values) {
    FlightModel::Driving driving{};
    for (std::size_t i = 0; i < values.size(); ++i)
      for (std::size_t d = 0; d < driving.size(); ++d)
        if (model.free()[i].which == FlightModel::kDriving[d]) driving[d] = values[i];
    return model.squares(driving);
  }

  void solve(FlightModel& model) {
    ceres::Problem::Options options = problem_options();
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(options);
    problem.AddResidualBlock(&model, nullptr, values_.data());
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const auto bound = [&](double least, double most) {
        problem.SetParameterLowerBound(values_.data(), static_cast<int>(i), least);
        problem.SetParameterUpperBound(values_.data(), static_cast<int>(i), most);
      };
      if (model.free()[i].which == kTiming && flown_.drive.commands) bound(0.002, 1);
      if (model.free()[i].which == kLaw) bound(0, 1);
    }
    solve_robustly(problem, "the flight", 1e-10);
  }

  void evaluate(const FlightModel& model) {
    rows_.resize(static_cast<std::size_t>(model.num_residuals()));
    jacobian_.resize(model.num_residuals(), static_cast<Eigen::Index>(values_.size()));
    double const* parameters = values_.data();
    double* jacobians = jacobian_.data();
    model.Evaluate(&parameters, rows_.data(), &jacobians);
  }

  /// Sigma of each channel by its residuals: their deviation, times the root of how much slow noise makes the bins
  /// fewer. What is beyond six deviations is a shock.
  void weigh(FlightModel& model) {
    evaluate(model);
    const std::size_t bins = flown_.bins.size();
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<double> values;
      std::vector<std::size_t> at;
      for (std::size_t b = 0; b < bins; ++b) {
        if (model.shock[b] || (c > 0 && !flown_.bins[b].turns)) continue;
        values.push_back(rows_[Equation{c}.row(b, bins)] * model.sigma[c]);
        at.push_back(b);
      }
      const double deviation = spread(values);
      if (!(deviation > 0)) continue;
      std::vector<double> sums(blocks_.count), counts(blocks_.count);
      for (std::size_t i = 0; i < values.size(); ++i) {
        if (std::abs(values[i]) > kShock * deviation) {
          if (c == 0) model.shock[at[i]] = 1;
          continue;
        }
        sums[blocks_.of[at[i]]] += values[i];
        counts[blocks_.of[at[i]]] += 1;
      }
      double squares = 0, whole = 0;
      for (std::size_t k = 0; k < blocks_.count; ++k) squares += sums[k] * sums[k], whole += counts[k];
      const double memory = std::clamp(squares / (whole * deviation * deviation), 1.0, 100.0);
      model.sigma[c] = deviation * std::sqrt(memory);
      if (c == 0) fit_.noise = deviation, fit_.memory = memory;
    }
  }

  /// Roll and pitch must follow the moments of the rotors in the order of the log.
  void require_order(const FlightModel& model) const {
    if (std::ranges::none_of(model.free(), [](const FreeNumber& one) { return one.which == kRollGain; })) return;
    const auto squares = squares_at(model, values_);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      double n = 0, m = 0, t = 0, mm = 0, tt = 0, mt = 0;
      for (std::size_t b = 0; b < flown_.bins.size(); ++b) {
        const FlownBin& bin = flown_.bins[b];
        if (!bin.turns || model.shock[b]) continue;
        double moment = 0;
        for (std::size_t i = 0; i < flown_.rotors; ++i) moment += bin.levers[axis][i] * squares[b][i];
        n += 1, m += moment, t += bin.turning[axis];
        mm += moment * moment, tt += bin.turning[axis] * bin.turning[axis], mt += moment * bin.turning[axis];
      }
      const double along = (mt - m * t / n) / std::sqrt((mm - m * m / n) * (tt - t * t / n));
      // A hovering vehicle is shaken more than it is turned, and its correlation is small but positive.
      if (along > -0.25) continue;
      throw FitError(fmt::format(
          "{} acceleration goes against the moments of the rotors (correlation {:.2f}): their order in the log is not "
          "that of {}, or an axis points the other way; name the channels in its order, from rotor 1",
          axis == 0 ? "roll" : "pitch", along, vehicle_.name));
    }
  }

  /// Errors of all numbers: of the noise by leaving out blocks (eq. 38), of what was known before by its own.
  void covariance(FlightModel& model) {
    const Eigen::Index columns = jacobian_.cols();
    const std::size_t bins = flown_.bins.size();
    const Matrix information = jacobian_.transpose() * jacobian_;
    const Eigen::LDLT<Matrix> solved(information);
    inverse_ = solved.solve(Matrix::Identity(columns, columns));
    if (solved.info() != Eigen::Success || !inverse_.allFinite() || (inverse_.diagonal().array() <= 0).any())
      throw FitError("the flight does not tell the numbers of its model apart; fly height steps, roll and pitch");
    std::vector<Matrix> of(blocks_.count, Matrix::Zero(columns, columns));
    std::vector<Vector> score(blocks_.count, Vector::Zero(columns));
    Matrix weights = Matrix::Zero(columns, static_cast<Eigen::Index>(blocks_.count));
    for (std::size_t b = 0; b < bins; ++b) {
      const std::size_t block = blocks_.of[b];
      for (std::size_t c = 0; c < 3; ++c) {
        const auto row = static_cast<Eigen::Index>(Equation{c}.row(b, bins));
        const Vector derivative = jacobian_.row(row).transpose();
        of[block] += derivative * derivative.transpose();
        score[block] += derivative * rows_[static_cast<std::size_t>(row)];
        weights.col(static_cast<Eigen::Index>(block)).array() += (inverse_ * derivative).array().square();
      }
    }
    noise_ = Matrix::Zero(columns, columns);
    const double blocks = static_cast<double>(blocks_.count);
    for (std::size_t k = 0; k < blocks_.count; ++k) {
      const Vector change = (information - of[k]).ldlt().solve(score[k]);
      noise_ += (blocks - 1) / blocks * change * change.transpose();
    }
    freedom_ = Vector(columns);
    for (Eigen::Index i = 0; i < columns; ++i) {
      const double sum = weights.row(i).sum(), squares = weights.row(i).squaredNorm();
      freedom_[i] = std::max(1.0, sum * sum / squares - 1);
    }
    fit_.blocks = blocks_.count;
    for (std::size_t i = 0; i < model.free().size(); ++i)
      if (const double before = model.free()[i].before_u; before > 0)
        known_.push_back({group_of(model.free()[i].which), inverse_.col(static_cast<Eigen::Index>(i)) / before});
    for (const FreeNumber& one : considered_numbers(flown_, priors_))
      known_.push_back({group_of(one.which), effect_of(model, one)});
    whole_ = noise_;
    for (const Known& one : known_) whole_ += one.effect * one.effect.transpose();
  }

  /// On all free numbers, of one that is not free, wrong by its standard uncertainty.
  Vector effect_of(FlightModel& model, const FreeNumber& number) const {
    const Eigen::Index count = model.num_residuals();
    std::array<Vector, 2> rows{Vector(count), Vector(count)};
    double const* parameters = values_.data();
    for (std::size_t side = 0; side < 2; ++side) {
      model.given[number.which] = number.before + (side == 0 ? -1 : 1) * number.before_u;
      model.Evaluate(&parameters, rows[side].data(), nullptr);
    }
    model.given[number.which] = number.before;
    return inverse_ * (jacobian_.transpose() * (rows[1] - rows[0]) / 2);
  }

  [[nodiscard]] Estimate estimate(std::size_t i) const {
    const auto at = static_cast<Eigen::Index>(i);
    const double noise = noise_(at, at), all = whole_(at, at);
    // Of the noise alone are the degrees of freedom (Welch, Satterthwaite).
    return {values_[i], std::sqrt(all), noise > 0 ? freedom_[at] * square(all / noise) : kEndless};
  }

  /// From level and ratios to K_T and k at the knots.
  [[nodiscard]] Matrix to_k(double hover) const {
    const auto knots = static_cast<Eigen::Index>(fit_.kept.size());
    Matrix to = Matrix::Zero(1 + knots, jacobian_.cols());
    to(0, 0) = hover;
    for (Eigen::Index j = 1; j <= knots; ++j) {
      to(j, 0) = hover * values_[static_cast<std::size_t>(j)];
      to(j, j) = hover * values_[0];
    }
    return to;
  }

  /// A covariance of K_T and the k at the knots, as sources that are independent of each other: each column of its
  /// root is one.
  void add(const std::string& name, Evaluation evaluation, Matrix covariance, std::span<const double> freedom,
           const std::string& note, const std::string& remedy) {
    for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
      const double deviation = std::sqrt(std::max(0.0, covariance(i, i)));
      if (i > 0 && !(deviation > 1e-4 * fit_.k_t)) continue;
      Vector column = Vector::Zero(covariance.rows());
      if (deviation > 0) column = covariance.col(i) / deviation;
      column.head(i).setZero();
      covariance -= column * column.transpose();
      const auto knot = static_cast<std::size_t>(i);
      fit_.sources.push_back({i == 0 ? name : fmt::format("{}, of k({:g}°)/K_T", name, fit_.kept[knot - 1].phi_deg),
                              evaluation,
                              note,
                              remedy,
                              {column.begin(), column.end()},
                              freedom.empty() ? kEndless : freedom[knot]});
    }
  }

  void add_sources(double hover) {
    const Matrix to = to_k(hover);
    add("noise of the flight", Evaluation::type_a, to * noise_ * to.transpose(),
        {freedom_.data(), fit_.kept.size() + 1},
        fmt::format("{} pieces of {:.0f} s, left out in turn", blocks_.count,
                    flown_.excitation.seconds / static_cast<double>(blocks_.count)),
        "fly longer, and fold and unfold more often");
    std::map<std::string, Matrix> groups;
    for (const Known& one : known_) {
      const Vector effect = to * one.effect;
      Matrix& sum = groups.try_emplace(one.group, Matrix::Zero(effect.size(), effect.size())).first->second;
      sum += effect * effect.transpose();
    }
    Vector k = Vector::Constant(to.rows(), fit_.k_t);
    for (std::size_t j = 0; j < fit_.kept.size(); ++j) k[static_cast<Eigen::Index>(j) + 1] *= fit_.kept[j].ratio.value;
    const auto shared = [&](const char* name, double u, const std::string& note, const char* remedy) {
      add(name, Evaluation::type_b, u * u * k * k.transpose(), {}, note, remedy);
    };
    for (const auto& [name, covariance] : groups)
      add(name, Evaluation::type_b, covariance, {}, "what is known of it without the flight",
          name == group_of(kScale) || name == group_of(kBias) ? "lay it on six sides (--u bias=, --u scale=)" : "");
    shared("mass", vehicle_.mass_u, fmt::format("{:g} kg to {:g} %", vehicle_.mass_kg, 100 * vehicle_.mass_u),
           "weigh the vehicle with its battery (--mass, --u mass=)");
    if (flown_.drive.commands)
      shared("speed at full command", 2 * priors_.full_speed_u, "that of the vehicle file, for the mean voltage",
             "log the rotors' speeds");
    else
      shared("speed calibration", 2 * priors_.speed_u, priors_.speed_note,
             "let the vibration tell it: log raw acceleration at 500 Hz, and say --blades");
    double squares = 0, spread = 0;
    for (const FlightErrorSource& one : fit_.sources) {
      squares += square(one.of.front());
      spread += square(square(one.of.front())) / one.freedom;
    }
    fit_.k_t_u = std::sqrt(squares);
    fit_.k_t_freedom = spread > 0 ? squares * squares / spread : kEndless;
  }

  void take_rotors(const FlightModel& model) {
    std::vector<double> p;
    const double n = static_cast<double>(flown_.rotors), beside = n / (n - 1);
    fit_.rotors_told = true;
    for (std::size_t i = 0; i < model.free().size(); ++i) {
      if (model.free()[i].which < kKnots + fit_.kept.size()) continue;
      Estimate one = estimate(i);
      one.value *= beside;
      one.u *= beside;
      fit_.rotors_told = fit_.rotors_told && one.u < 0.02;
      p.push_back(student_test(one, 0).p);
      fit_.rotors.push_back(one);
    }
    const double level = holm_level(p);
    for (std::size_t i = 0; i < p.size(); ++i)
      if (p[i] < level && fit_.rotors[i].value < -kWeak &&
          (!fit_.weak_rotor || fit_.rotors[i].value < fit_.rotors[*fit_.weak_rotor].value))
        fit_.weak_rotor = i;
  }

  void report(const FlightModel& model, double hover) {
    fit_.k_t = hover * values_[0];
    for (std::size_t j = 0; j < fit_.kept.size(); ++j) fit_.kept[j].ratio = estimate(j + 1);
    if (!(fit_.k_t > 0)) throw FitError("thrust does not rise with the speed of the rotors in this flight");
    for (std::size_t i = 0; i < model.free().size(); ++i) {
      const FreeNumber& one = model.free()[i];
      if (!(one.before_u > 0)) continue;
      if (one.which == kTiming && flown_.drive.commands) fit_.lag_s = estimate(i);
      if (one.which == kLaw) fit_.law = estimate(i);
      if (one.which < kKnots) fit_.nuisances.push_back({one.name, one.unit, estimate(i), one.before, one.before_u});
    }
    take_rotors(model);
    add_sources(hover);
    std::vector<double> speeds;
    for (const auto& bin : squares_at(model, values_))
      for (const double one : bin) speeds.push_back(std::sqrt(one));
    std::ranges::sort(speeds);
    fit_.speed_min_rad_s = speeds[speeds.size() / 100];
    fit_.speed_max_rad_s = speeds[speeds.size() - 1 - speeds.size() / 100];
    for (std::size_t b = 0; b < flown_.bins.size(); ++b) {
      fit_.residuals.push_back(model.shock[b] ? std::numeric_limits<double>::quiet_NaN() : rows_[b] * model.sigma[0]);
      fit_.shocks += model.shock[b] ? 1 : 0;
    }
    fit_.remarks = flown_.remarks;
  }

  const FlownBins& flown_;
  const LoggedVehicle& vehicle_;
  const FlightPriors& priors_;
  Blocks blocks_;
  std::vector<double> values_, rows_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian_;
  Matrix inverse_, noise_, whole_;
  Vector freedom_;
  /// What is known before of one number, wrong by its standard uncertainty, moves all free ones by this.
  struct Known {
    std::string group;
    Vector effect;
  };
  std::vector<Known> known_;
  FlightFit fit_;
};

}  // namespace

FlightFit fit_flight(const FlownBins& flown, const LoggedVehicle& vehicle, const FlightPriors& priors) {
  return Fitting(flown, vehicle, priors).fit();
}

}  // namespace kphi::fit
