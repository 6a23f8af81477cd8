// Uncertainty budget by the GUM (JCGM 100:2008): what the stand's errors are, what each does to every k(φ), and the
// budget of any linear function of the k: independent errors add by squares, common ones by their sum.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fit/model/repeatability.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/uncertainty/speed_dependence.hpp"

namespace kphi::fit {

inline constexpr const char* kUnitOfK = "N/(rad/s)^2";

enum class Evaluation : std::uint8_t {
  type_a,  ///< from the scatter of what was measured here
  type_b,  ///< from anything else: data sheet, check weight, judgement
};

struct BudgetRow {
  std::string source;  ///< "repetitions", "motor clock", …
  Evaluation evaluation = Evaluation::type_a;
  double u = 0;            ///< standard uncertainty of the input, in `unit`; NaN: unknown, missing in the sum
  std::string unit;        ///< "N", "1" (relative), …
  double sensitivity = 0;  ///< change of the result per `unit`
  double freedom = std::numeric_limits<double>::infinity();
  bool common = false;   ///< the same error in every coefficient of the campaign: it cancels in ratios
  bool assumed = false;  ///< nobody measured it: what stands usually have is in its place
  std::string note{};    ///< where the number comes from; may be empty
  std::string remedy{};  ///< what makes it smaller: "weigh the load cell (kphi weigh)"; may be empty

  [[nodiscard]] bool known() const { return u == u; }
  [[nodiscard]] double contribution() const;  ///< |sensitivity| u, unit of the result; 0 if unknown
};

struct Budget {
  std::string quantity;  ///< "K_T", "k(45 deg)", "slope", "k_i(90 deg)", …
  std::string unit;      ///< of the value
  double value = 0;
  std::vector<BudgetRow> rows;

  /// Standard uncertainty (science.md, eq. 18; rows are independent) of the sources that are known; NaN if none is.
  [[nodiscard]] double combined() const;
  [[nodiscard]] double freedom() const;                      ///< Welch-Satterthwaite (G.2b)
  [[nodiscard]] double coverage(double level = 0.95) const;  ///< Student's factor for freedom()
  [[nodiscard]] double expanded(double level = 0.95) const;  ///< half the interval
  [[nodiscard]] double share(const BudgetRow& row) const;    ///< of the variance, 0..1
  [[nodiscard]] std::vector<std::string> not_known() const;  ///< sources that are missing in the sum
  [[nodiscard]] std::vector<std::string> assumed() const;    ///< sources in the sum that nobody measured
  [[nodiscard]] Estimate estimate() const { return {value, combined(), freedom()}; }
};

/// Standard uncertainties of the stand, which its steps do not show; from its calibration. nullopt: nobody measured it.
/// What every stand has is then assumed (README.md, "Assumed"); the density is listed without a value.
struct BenchUncertainty {
  std::optional<double> cell_calibration;  ///< relative, of the load cell's sensitivity
  std::string calibration_note{};          ///< where that comes from, for the budget; may be empty
  std::optional<double> cross_axis;        ///< relative to the thrust, what other loads make the cell read
  std::optional<double> alignment_rad;     ///< between thrust and the cell's axis
  std::optional<double> motor_clock;       ///< relative, of the clock behind the speed of the motor module
  std::optional<double> air_density;       ///< relative; enters k in standard air only
  /// Relative, of k from mounting to mounting; repetitions that are remounted tell it better. Given to
  /// IdentificationOptions, too.
  std::optional<double> mounting;

  /// Known to be without any of them.
  [[nodiscard]] static BenchUncertainty none() { return {0.0, "", 0.0, 0.0, 0.0, 0.0, 0.0}; }
};

/// "NAME=VALUE" with NAME one of calibration, cross-axis, alignment-deg, clock, density, mounting. Throws
/// ConfigurationError.
void set_uncertainty(BenchUncertainty& bench, const std::string& text);

/// NAME and VALUE of those that are known, as set_uncertainty reads them.
[[nodiscard]] std::vector<std::pair<std::string, double>> known_uncertainties(const BenchUncertainty& bench);

struct ErrorSource {
  std::string name;
  Evaluation evaluation = Evaluation::type_a;
  std::string unit;
  std::string note{};
  bool common = false;        ///< the same error at every φ
  bool assumed = false;       ///< see BudgetRow
  double shared_freedom = 0;  ///< one estimate behind all φ; 0: each its own
  std::string remedy{};       ///< see BudgetRow
  struct Effect {
    double u = 0;            ///< in `unit`; NaN: unknown
    double sensitivity = 0;  ///< of k per `unit`
    double freedom = std::numeric_limits<double>::infinity();
  };
  std::vector<Effect> effects{};  ///< one per φ
};

struct ErrorSources {
  std::vector<double> k;  ///< per φ
  std::vector<ErrorSource> sources;

  /// Of Σ weights · k.
  [[nodiscard]] Budget budget(std::string quantity, std::string unit, double value,
                              std::span<const double> weights) const;
  /// Of two linear functions.
  [[nodiscard]] double covariance(std::span<const double> a, std::span<const double> b) const;
};

/// Of a bench and its steps. `speed` gives the model's inadequacy; one per φ, or empty.
[[nodiscard]] ErrorSources error_sources(const Repeatability& repeatability, std::span<const SpeedDependence> speed,
                                         const BenchUncertainty& bench);

/// Of a table of coefficients found elsewhere: its own standard errors.
[[nodiscard]] ErrorSources error_sources(std::vector<double> k, const std::vector<double>& standard_errors);

}  // namespace kphi::fit
