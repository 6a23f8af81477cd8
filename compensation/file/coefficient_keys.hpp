// Every key of a coefficient file, format kphi-coefficients/1: fit/coefficients/ writes them, this folder reads them,
// and fit/coefficients/README.md specifies them. Tests hold all three to this list.
#pragma once

namespace kphi::compensation {

inline constexpr const char* kCoefficientFormat = "kphi-coefficients/1";

/// `path`: dots lead into a map, [] into each entry of a list. `unit` in words, "" for text; k_unit stands for the unit
/// that the key `k_unit` names.
struct CoefficientKey {
  const char* path;
  const char* unit;
  const char* meaning;
};

inline constexpr CoefficientKey kCoefficientKeys[] = {
    {"format", "", "kphi-coefficients/1; required"},
    {"measured_utc", "", "when the last run ended, ISO 8601"},
    {"tool_version", "", "the kphi that wrote the file"},
    {"propeller.id", "", "short name; required"},
    {"propeller.name", "", "name in words"},
    {"propeller.diameter_in", "inch", "diameter"},
    {"propeller.blades", "count", "number of blades"},
    {"k_unit", "", "N/(rad/s)^2 or N/RPM^2, for every k; required"},
    {"overlap", "", "how φ is measured in flight: rim_arc, area_share, load_share; required"},
    {"K_T.value", "k_unit", "thrust coefficient without occlusion, positive; required"},
    {"K_T.standard_error", "k_unit", "its standard error"},
    {"K_T.phi_deg", "deg", "0"},
    {"line.anchored", "truth", "true: the line starts at K_T; required"},
    {"line.intercept", "k_unit", "of the line at φ = 0, positive; required"},
    {"line.slope_per_deg", "k_unit/deg", "of the line; required"},
    {"line.covariance", "k_unit²", "2×2, of intercept and slope_per_deg"},
    {"line.points_deg", "deg", "occlusions that the line goes through"},
    {"valid.phi_deg", "deg", "[smallest, largest] φ; required"},
    {"valid.speed_rpm", "RPM", "[lowest, highest] speed measured at every φ"},
    {"table[].phi_deg", "deg", "occlusion"},
    {"table[].k", "k_unit", "angle-dependent coefficient there"},
    {"table[].standard_error", "k_unit", "its standard error"},
    {"table[].k_at_speed", "k_unit", "mean T/ω² at at_speed_rpm"},
    {"table[].at_speed_rpm", "RPM", "the reference speed"},
    {"table[].k_standard", "k_unit", "k in standard air"},
    {"table[].k_standard_error", "k_unit", "its standard error, with the density's"},
    {"table[].steps", "count", "distinct speeds fitted"},
    {"table[].repetitions", "count", "runs fitted"},
    {"air_density_kg_m3", "kg/m³", "mean of the steps fitted"},
    {"air_density_u_kg_m3", "kg/m³", "its standard uncertainty"},
    {"k_standard.value", "k_unit", "K_T in standard air"},
    {"k_standard.standard_error", "k_unit", "its standard error, with the density's"},
    {"k_standard.air_density_kg_m3", "kg/m³", "1.225"},
    {"supply_v", "V", "nominal supply voltage"},
    {"provenance.campaign", "", "name of the campaign"},
    {"provenance.fit.model", "", "the model"},
    {"provenance.fit.estimator", "", "the estimator in words"},
    {"provenance.fit.k_by", "", "origin, offset, polynomial, speed"},
    {"provenance.fit.weights", "", "equal, thrust, effective-variance"},
    {"provenance.fit.loss", "", "none, huber, cauchy, tukey"},
    {"provenance.fit.speed_range_rpm", "RPM", "[lowest, highest] speed fitted at any φ"},
    {"provenance.fit.leave_out", "", "PHI:REPETITION:CAUSE of every run left out by hand"},
    {"provenance.fit.u", "as --u", "standard uncertainties of the stand, NAME: VALUE"},
    {"provenance.motor_clock.gain", "1", "module's clock against this computer's; or the word unchecked"},
    {"provenance.motor_clock.u", "1", "its standard uncertainty"},
    {"provenance.runs[].file", "", "run file, from the campaign folder"},
    {"provenance.runs[].sha256", "", "64 hex digits"},
    {"uncertainty.K_T.u", "k_unit", "combined standard uncertainty"},
    {"uncertainty.K_T.freedom", "1", "effective degrees of freedom"},
    {"uncertainty.K_T.expanded_95", "k_unit", "half of the 95 % interval"},
    {"uncertainty.intercept.u", "k_unit", "as of K_T"},
    {"uncertainty.intercept.freedom", "1", "as of K_T"},
    {"uncertainty.intercept.expanded_95", "k_unit", "as of K_T"},
    {"uncertainty.slope_per_deg.u", "k_unit/deg", "as of K_T"},
    {"uncertainty.slope_per_deg.freedom", "1", "as of K_T"},
    {"uncertainty.slope_per_deg.expanded_95", "k_unit/deg", "as of K_T"},
    {"uncertainty.covariance", "k_unit²", "3×3, of K_T, intercept, slope_per_deg"},
    {"uncertainty.not_known", "", "sources that the sums lack"},
    {"uncertainty.table[].quantity", "", "K_T, k(45 deg), …"},
    {"uncertainty.table[].u", "k_unit", "combined standard uncertainty"},
    {"uncertainty.table[].expanded_95", "k_unit", "half of the 95 % interval"},
    {"uncertainty.line.clipping_deg", "deg", "φ below which the line is above K_T, or none"},
    {"uncertainty.line.zero_deg", "deg", "φ where the line reaches 0, or none"},
    {"uncertainty.line.intercept_minus_K_T", "k_unit", "by how much the line misses K_T"},
    {"uncertainty.line.u", "k_unit", "its standard uncertainty"},
    {"uncertainty.line_lack_of_fit_p", "1", "p of \"k(φ) is a line\""},
    {"uncertainty.line_quadratic_p", "1", "p of \"k(φ) needs no φ² term\""},
    {"uncertainty.speed[].phi_deg", "deg", "occlusion"},
    {"uncertainty.speed[].change_share", "1", "change of k over the speeds, as a share of k"},
    {"uncertainty.speed[].u", "1", "its standard uncertainty"},
    {"uncertainty.speed[].lack_of_fit_p", "1", "p of \"k does not depend on the speed\""},
    {"uncertainty.rejected_points", "count", "points that the robust loss rejected"},
    {"uncertainty.outlying_runs", "count", "runs that stand out; they are kept"},
    {"torque[].phi_deg", "deg", "occlusion"},
    {"torque[].k_q", "N m/(rad/s)^2", "torque coefficient"},
    {"torque[].u", "N m/(rad/s)^2", "its standard uncertainty"},
    {"torque[].drag_per_thrust_m", "m", "torque per thrust"},
};

}  // namespace kphi::compensation
