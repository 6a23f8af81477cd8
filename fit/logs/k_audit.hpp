// What the k of a table is worth: rows that cannot be right beside the others, a speed that comes in steps, one k for
// what is not one thing.
#pragma once

#include <string>
#include <vector>

#include "fit/logs/log_audit.hpp"
#include "fit/logs/log_zero.hpp"
#include "fit/logs/throttle_law.hpp"
#include "fit/model/thrust_fit.hpp"

namespace kphi::fit {

/// Speeds that are whole multiples of a step apart, and whose thrust scatters as such steps make it: a counter of few
/// pulses. 0: none seen. RPM.
[[nodiscard]] double speed_step_rpm(const ImportedTable& table);

/// Flags and leaves out rows whose speed is counted double or half, and, among few rows, those far from all others.
[[nodiscard]] std::vector<LogFinding> audit_rows(ImportedTable& table);

/// Leaves out what audit_rows() would, for judging the zero, if thrust over ω² is then twice as straight: without a
/// zero, rows only seem to be counted wrong.
void leave_out_obvious(ImportedTable& table);

/// k of the rows of one occlusion.
struct OcclusionFit {
  double occlusion_deg = 0;
  ThrustFit fit;
  double u_k = 0;  ///< standard uncertainty: scatter, zero and steps of the speed
};

/// What a table gives, and why that may be nothing.
struct JudgedFit {
  std::vector<OcclusionFit> fits;  ///< by occlusion
  std::vector<LogFinding> findings;
  std::vector<ThrottleLaw> throttle;  ///< throttle_laws()
  double u_speed = 0;  ///< relative standard uncertainty of all speeds together, of their steps; 0: they have none
};
/// Throws FitError as fit_thrust does.
[[nodiscard]] JudgedFit judged_fit(const ImportedTable& table);

}  // namespace kphi::fit
