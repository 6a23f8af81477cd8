// Every source of error with what it does to each k(φ): from these the budget of any linear function of the k follows,
// independent errors by squares, common ones by their sum.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fit/model/repeatability.hpp"
#include "fit/numerics/budget.hpp"
#include "fit/uncertainty/bench_uncertainty.hpp"
#include "fit/uncertainty/speed_dependence.hpp"

namespace kphi::fit {

struct ErrorSource {
  std::string name;
  Evaluation evaluation = Evaluation::type_a;
  std::string unit;
  std::string note;
  bool common = false;              ///< the same error at every φ
  double shared_freedom = 0;        ///< one estimate behind all φ; 0: each its own
  std::vector<double> u;            ///< per φ, in `unit`; NaN: not known
  std::vector<double> sensitivity;  ///< of k per `unit`
  std::vector<double> freedom;
};

class ErrorSources {
 public:
  explicit ErrorSources(std::vector<double> k) : k_(std::move(k)) {}
  void add(ErrorSource source) { sources_.push_back(std::move(source)); }

  /// Of Σ weights · k.
  [[nodiscard]] Budget budget(std::string quantity, std::string unit, double value,
                              std::span<const double> weights) const;
  /// Of two linear functions.
  [[nodiscard]] double covariance(std::span<const double> a, std::span<const double> b) const;
  [[nodiscard]] const std::vector<double>& k() const { return k_; }

 private:
  std::vector<double> k_;
  std::vector<ErrorSource> sources_;
};

/// What is known of a bench and its steps. `speed` gives the model's inadequacy; one per φ, or empty.
[[nodiscard]] ErrorSources error_sources(const Repeatability& repeatability, std::span<const SpeedDependence> speed,
                                         const BenchUncertainty& bench);

/// Of a table of coefficients found elsewhere: its own standard errors.
[[nodiscard]] ErrorSources error_sources(std::vector<double> k, std::vector<double> standard_errors);

}  // namespace kphi::fit
