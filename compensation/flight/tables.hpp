// What `kphi fly` prints: the paper's three tables with ours beside them, and the percentiles of a study. And what it
// leaves for other programs: traces and draws as CSV, figures as gnuplot scripts with their data inside.
#pragma once

#include <array>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/flight/study.hpp"

namespace kphi::flight {

/// As printf prints it, cut to 399 characters.
template <class... Values>
std::string words(const char* format, Values... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// Table I: absolute position errors in the final configuration [m].
struct HoverRow {
  std::string_view start, final;
  ExperimentIndex flight;
  std::size_t leg;
  std::array<double, 3> paper;
};
inline constexpr std::array<HoverRow, 7> kHoverRows{{
    {"X", "X", kHoverPlain, 0, {0.0336, 0.0185, 0.0142}},
    {"X", "O n.c.", kHoverPlain, 1, {0.22, 0.11, 0.17}},
    {"X", "O c.", kHoverCompensated, 1, {0.030, 0.044, 0.043}},
    {"O n.c.", "X", kHoverPlain, 2, {0.040, 0.049, 0.031}},
    {"O c.", "X", kHoverCompensated, 2, {0.047, 0.042, 0.00855}},
    {"O c.", "O n.c.", kHoverSwitched, 1, {0.0748, 0.0222, 0.1594}},
    {"O n.c.", "O c.", kHoverSwitched, 2, {0.0101, 0.0003, 0.0106}},
}};

/// Table II: ë = kP e + kD ė of the height, e = z_ref − z_est.
struct HeightRow {
  std::string_view start, final;
  ExperimentIndex flight;
  std::size_t leg;
  double acceleration;  ///< ë [m/s²]
  double error;         ///< e [m]
  double error_rate;    ///< ė [m/s]
};
inline constexpr std::array<HeightRow, 2> kHeightRows{{
    {"X", "O n.c.", kHoverPlain, 1, -0.50052, 0.16859, -0.50489},
    {"X", "O c.", kHoverCompensated, 1, -0.03259, -0.0434, 0.10318},
}};

/// Table III: mean and standard deviation of the distance to the reference [m].
struct ForwardCell {
  std::size_t leg;
  double mean, deviation;
};
struct ForwardRow {
  std::string_view title;
  ExperimentIndex flight;
  std::optional<ForwardCell> x, o_plain, o_compensated;
};
inline constexpr std::array<ForwardRow, 6> kForwardRows{{
    {"level  X - O n.c.", kLevelPlain, ForwardCell{0, 0.0772, 0.0414}, ForwardCell{1, 0.2172, 0.0787}, {}},
    {"level  O n.c. - O c.", kLevelSwitched, {}, ForwardCell{0, 0.2339, 0.050}, ForwardCell{1, 0.1210, 0.045}},
    {"level  X - O c.", kLevelCompensated, ForwardCell{0, 0.0898, 0.0452}, {}, ForwardCell{1, 0.1389, 0.0482}},
    {"rising X - O n.c.", kRisingPlain, ForwardCell{0, 0.1211, 0.0426}, ForwardCell{1, 0.2690, 0.0681}, {}},
    {"rising O n.c. - O c.", kRisingSwitched, {}, ForwardCell{0, 0.2134, 0.0452}, ForwardCell{1, 0.1318, 0.0611}},
    {"rising X - O c.", kRisingCompensated, ForwardCell{0, 0.0975, 0.0363}, {}, ForwardCell{1, 0.1038, 0.0439}},
}};

/// Why a number of the paper may not come out of the simulation. Every one of the tables has its reason.
enum class Reason : std::uint8_t { in_x, velocity_term, sign_of_height, sideways, height, circles, scatter };
inline constexpr std::array<std::string_view, 7> kReasons{{
    "the errors in X of Tables I and III: they come from the estimator, latency and trim of the real drone, which are "
    "not modelled and not tuned in",
    "the velocity term of Table II (-0.505 m/s) and the acceleration with it: e = z_ref - z_est makes it a climb at "
    "half "
    "a metre per second, which no hover is; the identity kP e + kD e' holds as arithmetic",
    "the sign of the height in row 2 of Table II: the paper's compensated drone is above its reference, this one "
    "mostly below, because more is lost in flight than on the bench",
    "x and y of Table I in O: they depend on the centre of gravity, the attitude stiffness and kpxy, none of them "
    "published; the draws show how much",
    "the height in O: it is what is lost in flight, by one factor (gamma) and three laws for a propeller of the "
    "paper's; "
    "another propeller, vehicle or gain than the paper's has another",
    "the mean distance on the circles in O: it holds the errors in X, too, which are smaller here",
    "the scatter about that mean: of draughts, jumps of the estimator and trim of the real drone only a noise is "
    "modelled",
}};
/// "a", "b", …: how a table refers to a reason.
[[nodiscard]] inline char letter_of(Reason reason) noexcept {
  return static_cast<char>('a' + static_cast<int>(reason));
}

[[nodiscard]] std::string findings_table(const Findings& findings);

/// ë = kP e + kD ė of the height [m/s²].
[[nodiscard]] inline double height_demand(const Gains& gains, double error, double error_rate) noexcept {
  return gains.position.z() * error + gains.velocity.z() * error_rate;
}

/// One row per 10 ms, units in the column names.
[[nodiscard]] std::string trace_csv(const std::vector<TraceRow>& trace);

/// One row per draw: what was drawn, and how it flew.
[[nodiscard]] std::string draws_csv(const std::vector<Draw>& draws);

/// The same flight with compensation and without, in one picture: height error, arm angles, occlusions (true, and what
/// the controller takes them for) and speeds of rotors 1 and 3.
[[nodiscard]] std::string comparison_figure(const std::string& title, const Experiment& experiment,
                                            const std::vector<TraceRow>& plain,
                                            const std::vector<TraceRow>& compensated);

/// The position error of one flight over time, one axis below the other, as in the paper's figures.
[[nodiscard]] std::string error_figure(const Experiment& experiment, const std::vector<TraceRow>& trace);

/// One dot per draw: hover z and forward distance, compensated over not.
[[nodiscard]] std::string draws_figure(const std::vector<Draw>& draws);

}  // namespace kphi::flight
