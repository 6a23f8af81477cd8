// Reads the coefficient file that `kphi fit` writes (format kphi-coefficients/1). For the ground: allocates and throws.
#pragma once

#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "compensation/overlap_measure.hpp"
#include "compensation/thrust_line.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// The message reads "file:line: what is wrong; the next move".
class CoefficientError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One coefficient file in SI units, whatever its k_unit. What the file leaves out or calls `unknown` is empty.
struct Coefficients {
  struct Propeller {
    std::string id;
    std::string name;
    double diameter_in = 0;  ///< 0 if unknown
    int blades = 0;          ///< 0 if unknown
  };
  struct Line {
    bool anchored = false;                                           ///< forced through K_T at φ = 0
    ThrustCoefficient intercept;                                     ///< k at φ = 0
    double slope_per_rad = 0;                                        ///< N/(rad/s)² per rad
    std::optional<std::array<std::array<double, 2>, 2>> covariance;  ///< of intercept and slope_per_rad, SI
    std::vector<Radians> points;                                     ///< occlusions behind the line
  };
  struct Row {
    Radians occlusion;
    ThrustCoefficient k;
    std::optional<ThrustCoefficient> standard_error;
    std::optional<ThrustCoefficient> k_at_speed;  ///< T/ω² at the single speed at_speed
    std::optional<RadPerSec> at_speed;
    std::optional<int> steps;
    std::optional<int> repetitions;
  };
  struct Run {
    std::string file;
    std::string sha256;
  };
  struct Provenance {
    std::string campaign;
    std::string model;
    std::string estimator;
    std::vector<Run> runs;
  };

  std::string path;
  std::string measured_utc;
  std::string tool_version;
  Propeller propeller;
  OverlapMeasure overlap = OverlapMeasure::rim_arc;  ///< a line must be flown with the measure it was fitted with
  ThrustCoefficient thrust_coefficient;              ///< K_T, measured at φ = 0
  std::optional<ThrustCoefficient> thrust_coefficient_error;  ///< standard error of K_T
  Line line;
  Radians smallest_occlusion;  ///< valid range of φ
  Radians largest_occlusion;
  std::optional<RadPerSec> slowest_speed;  ///< valid range of speeds
  std::optional<RadPerSec> fastest_speed;
  std::vector<Row> table;
  std::optional<double> air_density_kg_m3;
  std::optional<Volts> supply;
  Provenance provenance;
};

/// Refuses a file of another format, without k_unit or overlap, with a K_T that is not positive, with numbers that are
/// not finite, with a key given twice, or with a required key missing. Other keys than the known ones are let pass.
/// Throws CoefficientError.
[[nodiscard]] Coefficients load_coefficients(const std::string& path);
/// As load_coefficients, from text; `path` only names it in messages.
[[nodiscard]] Coefficients parse_coefficients(const std::string& text, const std::string& path);

/// What flies: the line of the file, with its overlap measure, and with its uncertainty if the file tells both the
/// covariance and the standard error of K_T. Throws CoefficientError if `coefficients` was altered into something
/// invalid.
[[nodiscard]] ThrustLine thrust_line(const Coefficients& coefficients);

}  // namespace kphi::compensation
