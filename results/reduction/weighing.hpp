// A check of the load cell by a known mass, hung on it and taken off again several times: what was read, what it says
// of the cell, and the file that keeps it (kphi-weighing/1).
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace kphi::results {

inline constexpr double kStandardGravity = 9.80665;  ///< m/s²
/// Standard uncertainty of the gravity of an unknown place: anywhere from 9.780 at the equator to 9.832 at a pole.
inline constexpr double kGravityAnywhereU = 0.026 / 1.7320508;

struct Weighing {
  std::string bench;        ///< name in the bench file
  std::string weighed_utc;  ///< ISO 8601, Z
  std::string cell_serial;  ///< of the calibration
  std::string tool_version;
  std::string origin;                 ///< name of an Origin; empty in the files of older versions
  double mass_kg = 0, mass_u_kg = 0;  ///< conventional mass: that of a weight of 8000 kg/m³ in air of 1.2 kg/m³
  double gravity_m_s2 = kStandardGravity, gravity_u_m_s2 = kGravityAnywhereU;
  int axis = 2;  ///< 0..2: x, y or z of the cell, along which it pulls
  /// The mean load of one stretch, the mass off or on.
  struct Level {
    bool loaded = false;
    double time_s = 0;             ///< bench time at its middle
    double seconds = 0;            ///< of samples
    std::array<double, 6> mean{};  ///< Fx Fy Fz in N, Tx Ty Tz in N m
    std::array<double, 6> u{};     ///< standard uncertainty of each, by the scatter
  };
  std::vector<Level> levels;  ///< off, on, off, … , off: one more than twice the number of loads

  /// True force of the mass in air, N.
  [[nodiscard]] double force_n() const;
};

/// A number, its standard uncertainty and the degrees of freedom behind that.
struct Weighed {
  double value = 0, u = 0, freedom = 0;
  [[nodiscard]] double expanded() const;  ///< half of the 95 % interval
};

/// What a weighing says of its cell.
struct CellCheck {
  Weighed gain;                      ///< read per true force, along the axis; 1 is right; the hysteresis is in its u
  int sign = +1;                     ///< of the axis while the mass pulls
  std::array<Weighed, 6> crosstalk;  ///< of the other axes: read per force read along the axis, 1 or m; 0 of its own
  Weighed hysteresis;                ///< the largest change from before a load to after it, share of the load
  double tilt_rad = 0;  ///< by the side forces: of the pull against the axis, and cross-talk; not told apart

  /// Relative standard uncertainty of a force that is read, not corrected by the gain: the deviation of the gain counts
  /// as its own uncertainty does (GUM F.2.4.5).
  [[nodiscard]] double u_calibration() const;
};

/// The drift of the zero, linear from one stretch without load to the next, is taken out. Throws std::invalid_argument
/// without a load between two stretches without.
[[nodiscard]] CellCheck check_of(const Weighing& weighing);

/// "reads 1.02 ± 0.05 % too much along z", "reads right within 0.05 % along z".
[[nodiscard]] std::string gain_words(const Weighing& weighing, const CellCheck& check);

/// The whole file, JSON.
[[nodiscard]] std::string format_weighing(const Weighing& weighing);
/// Throws ConfigurationError "name: …".
[[nodiscard]] Weighing parse_weighing(const std::string& text, const std::string& name);

/// "20260704T093000Z_weigh.json".
inline constexpr const char* kWeighingEnds = "_weigh.json";
/// The newest weighing in `folder` that `counts` and was made by then (ISO 8601, Z), else the first one after it;
/// nullopt: none. Throws as parse_weighing.
[[nodiscard]] std::optional<Weighing> nearest_weighing(const std::filesystem::path& folder,
                                                       const std::function<bool(const Weighing&)>& counts,
                                                       const std::string& utc);

}  // namespace kphi::results
