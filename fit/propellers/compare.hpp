// Two results side by side: their differences, and whether chance explains them (science.md, eq. 18).
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "compensation/file/coefficient_file.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// One number of a result, independent of the other result's; a standard error of 0 or NaN is unknown.
struct ComparedValue {
  std::string name;  ///< "K_T", "slope", "k(45°)"
  std::string unit;
  double value = 0;
  double standard_error = 0;
  /// Counts for the verdict: K_T and k(φ). The curve, which follows from them, and the torque are only
  /// shown.
  bool judged = true;
  double freedom = std::numeric_limits<double>::infinity();  ///< degrees of freedom behind the standard error
};

struct ComparedResult {
  std::string name;  ///< folder or file
  Origin origin = Origin::unknown;
  std::string propeller;
  double diameter_in = 0;  ///< 0: unknown
  double speed_min_rad_s = 0, speed_max_rad_s = 0;
  std::optional<Estimate> air;  ///< density, kg/m³
  std::vector<ComparedValue> estimates;
  std::optional<compensation::Coefficients> file{};  ///< of a coefficients.yaml
};

/// A coefficients.yaml, or a folder with one. Standard uncertainties are those of the file, by the GUM. Throws
/// ConfigurationError or compensation::CoefficientError.
[[nodiscard]] ComparedResult load_result(const std::string& path);

/// Of steps without occlusion: K_T alone, with its budget.
[[nodiscard]] ComparedResult result_of_log(const Fitted& fitted, Origin origin, const std::string& name);

struct Difference {
  std::string name;
  std::string unit;
  double a = 0, b = 0;
  double difference = 0;                   ///< b − a
  std::optional<double> standard_error{};  ///< of it; nullopt if one of the two is unknown
  std::optional<double> p{};               ///< of a difference this large by chance (Student, Welch-Satterthwaite)
  double freedom = 0;                      ///< degrees of freedom behind it
  double coverage = 0;                     ///< Student's factor for the 95 % interval
  bool judged = true;
  bool significant = false;  ///< after Holm's correction for the number of judged differences, level 5 %
  [[nodiscard]] double share() const { return difference / a; }
};

enum class Agreement { agree, differ, undecided };

struct Comparison {
  ComparedResult a, b;
  std::vector<Difference> differences;  ///< of the numbers that both have
  Agreement verdict = Agreement::undecided;
  std::vector<std::string> remarks;  ///< other propeller, speeds, air; missing angles; a factor common to all k
  /// The largest |difference| / a of a judged quantity that is possible at 95 %: they agree to within this.
  double largest_open_share = 0;
  /// K_T of b over a against (D_b/D_a)⁴, where the diameters differ.
  std::optional<double> diameter_ratio4;
};

/// In standard air if both know their density. Of a bench and a flight, whose φ are not the same: K_T, and k(φ)/K_T of
/// both curves at the widest φ of the flight, in which mass, accelerometer and load cell cancel. Undecided unless a
/// judged quantity has both errors.
[[nodiscard]] Comparison compare(ComparedResult a, ComparedResult b);

/// K_T of several logs beside each other.
struct SideBySide {
  std::vector<ComparedResult> results;  ///< K_T alone; in standard air where the density of each is known
  double median = 0;                    ///< of K_T, N/(rad/s)²
  double spread = 0;                    ///< robust standard deviation of K_T, as a share of the median
  std::vector<bool> unlike;             ///< chance does not explain their difference from the median (5 %, Holm)
  std::vector<std::string> remarks;
};
/// `remark` on their speeds; may be empty.
[[nodiscard]] SideBySide side_by_side(std::vector<ComparedResult> results, const std::string& remark);
[[nodiscard]] std::string side_by_side_table(const SideBySide& table);
[[nodiscard]] std::string side_by_side_json(const SideBySide& table);

/// A result beside the truth of the simulated bench.
struct TruthCheck {
  std::string text;    ///< "K_T    found …  true …  +0.007 %", one line per number
  bool close = false;  ///< K_T within 0.5 %, the slope within 2 %, or either within its own ± (95 %) where that is more
};

/// `truth`: file of `kphi sim --truth`. Throws ConfigurationError for a file without the propeller of `found`.
[[nodiscard]] TruthCheck check_against_truth(const ComparedResult& found, const std::string& truth);

[[nodiscard]] const char* word(Agreement verdict);
[[nodiscard]] std::string comparison_table(const Comparison& comparison);
[[nodiscard]] std::string comparison_json(const Comparison& comparison);

}  // namespace kphi::fit
