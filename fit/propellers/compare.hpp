// Two results side by side: what differs, by how much, and whether chance explains it.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace kphi::fit {

/// One number of a result. Independent of the other result's; a standard error of 0 or NaN is not known.
struct ComparedValue {
  std::string name;  ///< "K_T", "slope", "k(45°)"
  std::string unit;
  double value = 0;
  double standard_error = 0;
  /// Counts for the verdict. K_T and k(φ) do; the line is made of them and is shown only.
  bool judged = true;
  double freedom = std::numeric_limits<double>::infinity();  ///< degrees of freedom behind the standard error
};

struct ComparedResult {
  std::string name;  ///< folder or file
  std::string propeller;
  double diameter_in = 0;  ///< 0: unknown
  double speed_min_rad_s = 0, speed_max_rad_s = 0;
  std::optional<double> air_density_kg_m3;
  std::vector<ComparedValue> estimates;
};

/// Standard uncertainties are those of the file's `uncertainty` block where it has one (scatter from run to run and
/// what the stand adds), else the standard errors of the fit.
/// A coefficients.yaml, a campaign folder with one, or a folder or steps.csv without occlusions (K_T alone). Throws
/// ConfigurationError, compensation::CoefficientError or FitError.
[[nodiscard]] ComparedResult load_result(const std::string& path);

struct Difference {
  std::string name;
  std::string unit;
  double a = 0, b = 0;
  double difference = 0;                 ///< b − a
  std::optional<double> standard_error;  ///< of it; none when one of the two is not known
  std::optional<double> p;               ///< of a difference at least so large by chance (Student, Welch-Satterthwaite)
  double coverage = 0;                   ///< Student's factor for the 95 % interval
  bool judged = true;
  bool significant = false;  ///< after Holm's correction for the number of judged differences, level 5 %
  [[nodiscard]] double share() const { return difference / a; }
};

enum class Agreement { agree, differ, undecided };

struct Comparison {
  ComparedResult a, b;
  std::vector<Difference> differences;  ///< of what both have
  Agreement verdict = Agreement::undecided;
  std::vector<std::string>
      remarks;  ///< what makes the two unlike besides: other propeller, speeds, air; missing angles
  /// The largest |difference| / a that a judged quantity leaves open at 95 %: "they agree" to within this.
  double largest_open_share = 0;
  /// K_T of b over a against (D_b/D_a)⁴, where the diameters differ.
  std::optional<double> diameter_ratio4;
};

/// Undecided when no judged quantity has both errors known.
[[nodiscard]] Comparison compare(ComparedResult a, ComparedResult b);

[[nodiscard]] const char* word(Agreement verdict);
[[nodiscard]] std::string comparison_table(const Comparison& comparison);
[[nodiscard]] std::string comparison_json(const Comparison& comparison);

}  // namespace kphi::fit
