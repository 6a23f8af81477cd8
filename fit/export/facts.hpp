// What several targets say of a coefficient file and of the vehicle that flies it. Strings are one line each.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compensation/balance.hpp"
#include "fit/export/targets.hpp"

namespace kphi::fit {

/// Throws ConfigurationError for a file of K_T alone; `what`: "the script".
void require_curve(const compensation::Coefficients& file, const std::string& what);

/// K_T k_i(φ), as it flies (ScalingLaw::clamped), N/(rad/s)². Throws ConfigurationError for a φ beyond the file's.
[[nodiscard]] double coefficient_at(const compensation::Coefficients& file, double phi_deg);
/// rad/s at full output: the option, else the vehicle's, else the file's. Throws ConfigurationError without any.
[[nodiscard]] double speed_max_of(const compensation::Coefficients& file, const ExportOptions& options);

/// Torque per thrust, m, with half of its 95 % interval.
struct TorquePerThrust {
  double value = 0;
  std::optional<double> expanded_95;  ///< nullopt: the file does not tell
};
/// Of a rotor at this φ: drag torque between the measured occlusions, over K_T k_i. nullopt: not measured.
[[nodiscard]] std::optional<TorquePerThrust> torque_per_thrust(const compensation::Coefficients& file, double phi_deg);
/// "0.01226 ± 0.00009 m (95 %)", "0.01226 m, ± unknown".
[[nodiscard]] std::string words_of(const TorquePerThrust& torque);
inline constexpr const char* kNoTorque =
    "torque: the coefficient file has none; measure it with the load cell's torque axis";

/// The law and what of it cannot be told, as a line of a comment or of what is left out: "THR_MDL_FAC 0.35 ± 0.02 (95
/// %, by the scatter of the log's rows; holds for its supply and speed controller); these rows cannot tell it from …".
[[nodiscard]] std::string words_of(const compensation::Coefficients::ThrottleLaw& law, const std::string& number);

/// The law of that name. Throws ConfigurationError, with what to do, for a file without it.
[[nodiscard]] const compensation::Coefficients::ThrottleLaw& throttle_law_for(const compensation::Coefficients& file,
                                                                              const std::string& name);
/// Throws ConfigurationError for a law without it.
[[nodiscard]] double number_of(const compensation::Coefficients& file,
                               const compensation::Coefficients::ThrottleLaw& law, const std::string& name);

/// Throws ConfigurationError unless there is one direction for each motor, or none at all.
void require_turns(const ExportOptions& options);

/// The form of k(φ) and what is known beside it, for a target that computes k itself. Shares are of K_T, or of the
/// torque at φ 0.
struct CurveNumbers {
  double k_t = 0;                          ///< N/(rad/s)²
  double line_start = 1, line_slope = 0;   ///< shares, per rad; of a table those of its first piece
  std::vector<compensation::Knot> k;       ///< shares; empty: the line
  std::vector<compensation::Knot> torque;  ///< shares; empty: does not depend on φ
  compensation::SpeedTrend trend;
};
[[nodiscard]] CurveNumbers numbers_of(const compensation::Coefficients& file);

/// options.vehicle as its rotors fly it.
struct FlownVehicle {
  std::string name;
  compensation::Airframe airframe;
  compensation::Masses masses;
  compensation::Rotors<int> spins;
  double drag_per_newton = 0;                  ///< m, without occlusion: measured, else the vehicle file's
  std::string reference_name;                  ///< "X", or the file's first shape
  compensation::Rotors<Radians> reference;     ///< its arm angles
  compensation::RotorLayout reference_layout;  ///< hubs about its centre of gravity
};
/// nullopt without options.vehicle. Throws ConfigurationError if it has no dynamics, measures φ otherwise than the
/// coefficients, or cannot be flown.
[[nodiscard]] std::optional<FlownVehicle> flown_vehicle(const compensation::Coefficients& file,
                                                        const ExportOptions& options);
/// Every corner of the body, also of a square one, and every arm's hinge.
[[nodiscard]] compensation::PolygonBody body_of(const compensation::Airframe& airframe);

/// Control characters become blanks.
[[nodiscard]] std::string one_line(std::string text);
[[nodiscard]] bool is_simulated(const compensation::Coefficients& file);
/// 0 unknown, 1 measured, 2 simulated; 0 unknown, 1 fit to fly, 2 with care, 3 not yet.
[[nodiscard]] int origin_code(const compensation::Coefficients& file);
[[nodiscard]] int verdict_code(const compensation::Coefficients& file);
/// "5x3, Cyclone T5040C; 1.23e-06 N/(rad/s)^2 at phi = 0 deg; measured …, fitted by kphi …; 15 runs", one line each.
[[nodiscard]] std::vector<std::string> provenance_lines(const compensation::Coefficients& file);
/// Those lines, each behind `mark`.
[[nodiscard]] std::string comment(const compensation::Coefficients& file, const std::string& mark);
/// A double-quoted scalar that YAML, JSON, C and Lua read alike.
[[nodiscard]] std::string json_text(const std::string& text);
/// "kphi_5x3": letters, digits and underscores.
[[nodiscard]] std::string identifier(const std::string& id);

/// integrations/ardupilot_morphing.lua
[[nodiscard]] const char* ardupilot_script();

/// Why a target with one constant loses k(φ).
[[nodiscard]] std::string no_phi(const compensation::Coefficients& file, const char* target, double phi_deg);
/// Says so where k changes with the speed and the target cannot hold that.
void say_trend(const compensation::Coefficients& file, Export& result);

}  // namespace kphi::fit
