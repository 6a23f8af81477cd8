// Reads the coefficient file that `kphi fit` writes (format kphi-coefficients/2). For the ground: allocates and throws.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "compensation/convex_polygon.hpp"
#include "compensation/thrust_curve.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

inline constexpr const char* kCoefficientFormat = "kphi-coefficients/2";

/// A coefficient file that cannot be used. The message is "file:line: what is wrong; the next step".
class CoefficientError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One coefficient file in SI units, whatever its k_unit. What the file leaves out or calls `unknown` is empty.
/// fit/coefficients/README.md lists its keys.
struct Coefficients {
  explicit Coefficients(const ThrustCurve& fitted) : curve(fitted) {}

  struct Propeller {
    std::string id;
    std::string name;
    double diameter_in = 0;  ///< 0 if unknown
    int blades = 0;          ///< 0 if unknown
  };
  /// Of one number by the GUM, in the number's unit.
  struct Uncertainty {
    double u = 0;            ///< standard uncertainty
    double expanded_95 = 0;  ///< half of the 95 % interval
    double freedom = std::numeric_limits<double>::infinity();
  };
  /// One number of the curve, in the unit of its form.
  struct Parameter {
    std::string key;  ///< as the file names it
    double value = 0;
    std::optional<Uncertainty> uncertainty;
  };
  struct Row {
    Radians occlusion;
    ThrustCoefficient k;
    std::optional<Uncertainty> uncertainty;
    std::optional<RadPerSec> at_speed;  ///< the single speed of the file's k_at_speed
  };
  /// Drag torque of one occlusion.
  struct Torque {
    Radians occlusion;
    double k_q = 0;  ///< N m/(rad/s)², magnitude
    std::optional<Uncertainty> uncertainty;
    std::optional<double> per_thrust_m, per_thrust_expanded_95_m;  ///< κ = k_q/k, half of its 95 % interval
  };
  struct Run {
    std::string file;
    std::string sha256;
  };
  /// Law of thrust over throttle of the log behind the file, in the words of one flight stack.
  struct ThrottleLaw {
    struct Number {
      std::string name;  ///< as the stack calls it
      double value = 0;
      double half_95 = 0;  ///< half of the 95 % interval
    };
    std::string name;  ///< "px4", "ardupilot", …
    double rms_n = 0;  ///< of the rows about the law, N
    std::vector<Number> numbers;
    std::vector<std::string> not_told_from;  ///< laws that the rows cannot tell from this one
    /// nullptr if the law has no such number.
    [[nodiscard]] const Number* find(const std::string& number) const;
  };
  /// How the coefficients were fitted, in the words of `kphi fit`; empty in a file that does not say.
  struct Fit {
    std::string k_by, weights, loss, curve_loss;
    std::optional<std::pair<double, double>> speed_range_rpm;          ///< lowest and highest level fitted
    std::vector<std::string> leave_out;                                ///< "PHI:REPETITION:CAUSE"
    bool mounted_once = false;                                         ///< one mounting for all runs of an occlusion
    std::optional<std::vector<std::pair<std::string, double>>> bench;  ///< `u`: uncertainties of the stand, by name
  };
  struct Provenance {
    std::string campaign;
    std::string flight;  ///< one line on it, of a flight log; empty: a bench
    Fit fit;
    std::vector<Run> runs;
  };
  /// Of the thrust that flies, share, 95 %; where it is worst; up to which it is fit to fly, or to fly with care.
  struct ThrustError {
    std::optional<double> share_95, phi_deg, fit_to_fly, with_care;
    std::string where{};  ///< the vehicle for whose φ and speeds; empty: for all of the file's
  };
  /// The same for φ up to a row's and speeds no further than a column's from `reference_rad_s`; without rows: not told.
  struct ThrustErrorWithin {
    struct Row {
      double phi_deg = 0;
      std::vector<double> shares;  ///< one for each column
    };
    double reference_rad_s = 0;
    std::vector<double> off_rad_s;  ///< ascending
    std::vector<Row> rows;          ///< ascending
  };
  std::string path;
  std::string origin;  ///< measured, simulated; empty: not told
  std::string measured_utc;
  std::string tool_version;
  Propeller propeller;
  /// What flies: K_T, k(φ), its overlap measure and the largest valid φ; with its uncertainty if the file has the
  /// covariance.
  ThrustCurve curve;
  std::string form;                               ///< of the curve, as the file names it
  std::optional<Uncertainty> thrust_coefficient;  ///< of K_T
  std::vector<Parameter> parameters;              ///< of the curve
  std::vector<std::vector<double>> covariance;    ///< of K_T, intercept and slope per rad; empty: unknown, or a table
  std::vector<std::string> not_known;             ///< sources that these uncertainties lack
  std::vector<std::string> assumed;               ///< sources in them that nobody measured
  ThrustError thrust_error;
  ThrustErrorWithin thrust_error_within;
  std::string doubts_allow;                ///< the verdict, whatever the number; empty: not told
  std::string verdict;                     ///< of the fit: fit_to_fly, with_care, not_yet; empty: not told
  bool anchored = false;                   ///< k(0) of the curve is K_T
  std::vector<Radians> points;             ///< occlusions behind the curve
  Radians smallest_occlusion;              ///< of the valid range of φ
  std::optional<RadPerSec> slowest_speed;  ///< valid range of speeds
  std::optional<RadPerSec> fastest_speed;
  std::vector<Row> table;
  std::vector<Torque> torque;         ///< ascending φ; empty if it was not measured
  std::vector<ThrottleLaw> throttle;  ///< empty: no log with a throttle is behind the file
  std::optional<double> air_density_kg_m3, air_density_u_kg_m3;
  Provenance provenance;

  /// K_T alone, of a log without occlusions: `curve` is K_T at φ = 0 and knows no other φ.
  [[nodiscard]] bool alone() const { return form == kNoCurve; }
  /// nullptr if the file has no such law.
  [[nodiscard]] const ThrottleLaw* throttle_law(const std::string& name) const;
  static constexpr const char* kNoCurve = "none";
};

/// What is asked of a file: k(φ), for whatever flies, or K_T alone will do.
enum class Need : std::uint8_t { curve, thrust_coefficient };

/// Refuses a file of another format, without k_unit or overlap, with a K_T that is not positive, with numbers that are
/// not finite, with a key given twice, or with a required key missing. Other keys than the known ones are let pass.
/// Throws CoefficientError.
[[nodiscard]] Coefficients load_coefficients(const std::string& path, Need need = Need::curve);
/// As load_coefficients, from text; `path` only names it in messages.
[[nodiscard]] Coefficients parse_coefficients(const std::string& text, const std::string& path,
                                              Need need = Need::curve);

/// k(φ) in N/(rad/s)² for people: "1.59668e-06 - 2.5658e-07 phi/rad", "1.55e-06 at 0, 1.39e-06 at 45 deg".
[[nodiscard]] std::string words_of(const ThrustCurve& curve);

/// A message for coefficients and a vehicle that measure φ differently, naming both files; nullopt if they agree.
/// Compensator::build refuses them too, but knows no files.
[[nodiscard]] std::optional<std::string> overlap_mismatch(OverlapMeasure fitted, const std::string& coefficients,
                                                          OverlapMeasure flown, const std::string& vehicle);

}  // namespace kphi::compensation
