// One row of steps.csv: what one step of one run (or the average of its repetitions) measured.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "base/device_data.hpp"

namespace kphi::results {

/// Why a step is not to be trusted without a look. A set of bits; the names stand in steps.csv, joined by '+'.
enum class QualityFlag : std::uint32_t {
  none = 0,
  speed_not_reached = 1u << 0,       ///< mean speed further than 1 % (and 2 rad/s) from the command
  speed_unsteady = 1u << 1,          ///< speed spread over the window above 1 % of its mean (and 5 rad/s)
  saturated = 1u << 2,               ///< a status word with the saturation bit, or a count at its limit
  lost_samples = 1u << 3,            ///< fewer records in the window than ft_sequence says, or than 90 % by rate
  derated = 1u << 4,                 ///< the module derated
  few_samples = 1u << 5,             ///< under a tenth of the expected load-cell samples, or too few for an uncertainty
  bad_status = 1u << 6,              ///< another error bit of the box
  stream_restarted = 1u << 7,        ///< the stream began anew within the step
  rebooted = 1u << 8,                ///< the box started anew since the zero: its bias is another
  stalled = 1u << 9,                 ///< the box repeated its measurement within the step
  silent = 1u << 10,                 ///< no record for long within the step
  box_trouble = 1u << 11,            ///< the box saw its own communication fail within the step
  taken_over = 1u << 12,             ///< another client took the stream within the step
  configuration_changed = 1u << 13,  ///< the box was set otherwise at some time of the run
  zero_drifted = 1u << 14,  ///< the zeros before and after the run differ by more than is tolerated, or one is missing
  zero_noisy = 1u << 15,    ///< the samples of a zero of the run scatter by more than is tolerated
  drive_saturated = 1u << 16,     ///< the module drove with 98 % of the supply voltage or more: none was left
  motor_fault = 1u << 17,         ///< the module reported a fault within the step
  supply_out_of_band = 1u << 18,  ///< the supply voltage was not within 10 % of the campaign's
  coil_hot = 1u << 19,            ///< the coil was at the campaign's limit of its temperature, or above
  motor_reset = 1u << 20,         ///< the module restarted by itself within the step
  motor_lost = 1u << 21,          ///< the module was lost, or did not do as it was told, within the step
  slow_round_trip = 1u << 22,     ///< the module's readings are blurred in time since then in this run
  supply_limited = 1u << 23,      ///< the bench supply limited the current within the step
  supply_off = 1u << 24,          ///< its output was off within the step, or its protection had switched it off
  supply_sag = 1u << 25,          ///< more than 5 % of its set voltage was missing at its terminals
  supply_rise = 1u << 26,         ///< its terminals were more than 3 % above the set voltage: the motor fed back
  unsettled = 1u << 27,     ///< the thrust still changed at the end of the step, or its speed came too late to tell
  drifted = 1u << 28,       ///< thrust over speed² went on changing all through the step
  lag_unknown = 1u << 29,   ///< the steps do not tell how much later than the speed the thrust shows
  frozen = 1u << 30,        ///< load cell or motor speed repeated one value for 0.1 s or longer
  speed_glitch = 1u << 31,  ///< speeds that no rotor can have were left out
};

/// Flags that leave thrust over speed² as good as it is; all others keep a step out of averages and fits.
inline constexpr std::uint32_t kHarmlessFlags = [] {
  std::uint32_t bits = 0;
  for (const QualityFlag flag :
       {QualityFlag::lost_samples, QualityFlag::stream_restarted, QualityFlag::box_trouble,
        QualityFlag::supply_out_of_band, QualityFlag::coil_hot, QualityFlag::slow_round_trip, QualityFlag::supply_sag,
        QualityFlag::supply_rise, QualityFlag::lag_unknown, QualityFlag::speed_glitch})
    bits |= static_cast<std::uint32_t>(flag);
  return bits;
}();

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

struct StepMean {
  std::string propeller;
  int blades = 0;
  double diameter_in = 0;
  double occlusion_deg = 0;
  int repetition = 0;  ///< 1-based; 0 in an average over repetitions; -1, -2 … in the reference runs of a session
  int step = 0;        ///< 0-based
  double commanded_speed_rad_s = 0;
  double speed_rad_s = 0;  ///< mean, unsigned
  double speed_sd_rad_s = 0;
  std::uint64_t speed_n = 0;
  double thrust_n = 0;  ///< mean, zero subtracted, N
  double thrust_sd_n = 0;
  std::uint64_t thrust_samples = 0;
  double torque_nm = 0;  ///< mean about the thrust axis, zero subtracted
  double torque_sd_nm = 0;
  double zero_n = 0;  ///< zero that was subtracted from the thrust at this step
  double supply_voltage_v = 0;
  double supply_current_a = 0;
  double motor_current_a = 0;
  double coil_temperature_degc = 0;
  double window_begin_s = 0;  ///< since the run's epoch
  double window_end_s = 0;
  std::uint32_t quality_flags = 0;  ///< bits of QualityFlag
  // Beyond the flags: columns of their own groups, which a file has when one of its steps has them.
  double supply_v = kNotMeasured;  ///< at the terminals of the bench supply
  double supply_a = kNotMeasured;  ///< out of it
  double supply_w = kNotMeasured;  ///< mean of the products
  double air_density_kg_m3 = kNotMeasured;
  double air_density_u_kg_m3 = kNotMeasured;   ///< standard uncertainty
  double discarded_s = kNotMeasured;           ///< from the command to the window's begin
  double thrust_n_eff = kNotMeasured;          ///< independent samples that would give the same uncertainty of the mean
  double thrust_u_n = kNotMeasured;            ///< standard uncertainty of thrust_n, with the zero's
  double thrust_freedom = kNotMeasured;        ///< degrees of freedom of thrust_u_n
  double speed_u_rad_s = kNotMeasured;         ///< standard uncertainty of the mean, without that of the clock gain
  double zero_u_n = kNotMeasured;              ///< standard uncertainty of the zero; all steps of a run share it
  double zero_moved_n = kNotMeasured;          ///< from before the run to after it
  double lag_s = kNotMeasured;                 ///< the thrust shows so much later than the speed
  double lag_u_s = kNotMeasured;               ///< standard uncertainty
  std::uint64_t speed_glitches = 0;            ///< speeds left out
  double repetitions_averaged = kNotMeasured;  ///< this and the next three: of an average over repetitions alone
  double repetitions_left_out = kNotMeasured;
  double k_scatter_share = kNotMeasured;   ///< standard deviation of k from repetition to repetition of the occlusion
  double thrust_scatter_n = kNotMeasured;  ///< that of the thrust at this step about the k of each repetition
  double simulated = kNotMeasured;         ///< 1: by a simulator; 0: by devices
};

/// Simulated if one step is, measured if all are.
[[nodiscard]] inline Origin origin_of(std::span<const StepMean> steps) {
  const auto one = [](const StepMean& step) {
    return std::isnan(step.simulated) ? Origin::unknown : step.simulated != 0 ? Origin::simulated : Origin::measured;
  };
  Origin origin = steps.empty() ? Origin::unknown : one(steps.front());
  for (const StepMean& step : steps) origin = together(origin, one(step));
  return origin;
}

}  // namespace kphi::results
