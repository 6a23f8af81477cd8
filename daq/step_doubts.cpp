#include "daq/step_doubts.hpp"

#include <algorithm>
#include <cmath>

#include "profiles/campaign.hpp"
#include "profiles/configuration_error.hpp"
#include "results/step_mean.hpp"

namespace kphi::daq {
namespace {

using results::Doubt;
using results::MotorChannel;

constexpr std::uint32_t kSaturationBit = 1u << 17;  // Net Box Table 17.1
constexpr std::uint32_t kMonitorBit = 1u << 16;     // a condition the user set; raises the summary bit, too
constexpr std::uint32_t kSummaryBit = 1u << 31;
constexpr double kSpeedShare = 0.01;   // of the command
constexpr double kSpeedReached = 2.0;  // rad/s
constexpr double kSpeedSteady = 5.0;   // rad/s
constexpr double kFewSamples = 0.1;    // of those expected
// Of the window's: a restart of the box leaves a gap that ft_sequence does not show.
constexpr double kMostSamples = 0.9;
constexpr std::uint64_t kFewSpeeds = 3;
constexpr int kGatesSince = 3;  // format of the run file; steps of older ones are not gated
constexpr double kSupplyBand = 0.1;

class Bits {
 public:
  void note(Doubt doubt, bool applies) { bits_ |= applies ? static_cast<std::uint32_t>(doubt) : 0u; }
  [[nodiscard]] std::uint32_t all() const { return bits_; }

 private:
  std::uint32_t bits_ = 0;
};

/// The speed's window ends a lag earlier than the thrust's: what happens to the rotor between the two is in neither
/// mean, but already in the thrust.
bool leaves_at_the_end(const StepEvidence& step, const MotorSeries& motor) {
  const double steady = 3 * std::max(kSpeedShare * std::abs(step.speed.mean), kSpeedSteady);
  const auto late = motor.over(MotorChannel::speed, {step.motor_window.end, step.window.end});
  return std::any_of(late.begin(), late.end(), [&](const results::MotorReading& reading) {
    return !(std::abs(std::abs(reading.value) - std::abs(step.speed.mean)) <= steady);
  });
}

void judge_speed(const StepEvidence& step, const MotorSeries& motor, Bits& bits) {
  // Without a single reading nobody knows: that is "not reached", too.
  bits.note(Doubt::speed_not_reached,
            !(std::abs(step.speed.mean - step.commanded_rad_s) <= speed_tolerance(step.commanded_rad_s)));
  bits.note(Doubt::speed_unsteady,
            step.speed.deviation > std::max(kSpeedShare * std::abs(step.speed.mean), kSpeedSteady) ||
                leaves_at_the_end(step, motor));
  bits.note(Doubt::speed_glitch, motor.glitches(step.motor_window) > 0);
  bits.note(Doubt::frozen, motor.speed_frozen(step.motor_window));
  bits.note(Doubt::derated, motor.statistics(MotorChannel::derate, step.motor_window).least < 1);
}

void judge_cell(const StepEvidence& step, double rate_hz, Bits& bits) {
  const CellWindow& cell = step.cell;
  const double n = static_cast<double>(cell.n);
  bits.note(Doubt::saturated, (cell.status & kSaturationBit) != 0 || cell.at_limit);
  bits.note(Doubt::lost_samples, cell.lost > 0 || n < kMostSamples * step.window.seconds() * rate_hz);
  bits.note(Doubt::few_samples,
            n < kFewSamples * std::max(step.planned_s, 0.0) * rate_hz || cell.n == 0 || step.speed.n < kFewSpeeds);
  bits.note(Doubt::frozen, cell.frozen);
  const std::uint32_t told = kSaturationBit | kMonitorBit;
  const bool only_saturation = (cell.status & ~(told | kSummaryBit)) == 0 && (cell.status & kSaturationBit) != 0;
  bits.note(Doubt::bad_status, (cell.status & ~told) != 0 && !only_saturation);
}

/// Of the gates that nothing else here decides.
iq::StepReadings module_readings(const MotorSeries& motor, const Window& window) {
  iq::StepReadings readings;
  const auto add = [&](MotorChannel channel, const iq::Entry& entry) {
    for (const auto& r : motor.over(channel, window)) readings.add(entry, r.value);
  };
  add(MotorChannel::drive_pwm, iq::entry<"brushless_drive.drive_pwm">);
  add(MotorChannel::fault_now, iq::entry<"power_safety.fault_now">);
  add(MotorChannel::supply_voltage, iq::entry<"power_monitor.volts">);
  add(MotorChannel::coil_temperature, iq::entry<"coil_temperature_estimator.t_coil">);
  return readings;
}

iq::QualityLimits limits_of(const std::string& campaign_text) {
  iq::QualityLimits limits;
  try {
    const profiles::Campaign campaign = profiles::parse_campaign(campaign_text, "campaign.yaml");
    limits.supply_lowest_v = (1 - kSupplyBand) * campaign.supply.value();
    limits.supply_highest_v = (1 + kSupplyBand) * campaign.supply.value();
    limits.coil_temperature_max_degc = campaign.limits.coil_temperature_max.value();
  } catch (const ConfigurationError&) {
    // A run without a readable campaign has no limits.
  }
  return limits;
}

}  // namespace

iq::QualityLimits quality_limits(const results::RunHeader& header) {
  // All runs of a campaign hold the same text, and reading it takes as long as a tenth of a run.
  thread_local std::string last_text;
  thread_local iq::QualityLimits last;
  if (header.campaign_text != last_text) {
    last = limits_of(header.campaign_text);
    last_text = header.campaign_text;
  }
  return last;
}

double speed_tolerance(double commanded_rad_s) { return std::max(kSpeedShare * commanded_rad_s, kSpeedReached); }

std::uint32_t step_doubts(const results::RunHeader& header, const iq::QualityLimits& limits, const MotorSeries& motor,
                          const StepEvidence& step) {
  Bits bits;
  judge_speed(step, motor, bits);
  judge_cell(step, header.load_cell.sample_rate_hz, bits);
  if (header.format < kGatesSince) return bits.all();
  const iq::Verdict verdict = iq::judge(module_readings(motor, step.motor_window), limits);
  bits.note(Doubt::drive_saturated, verdict.is_shut(iq::Gate::saturation));
  bits.note(Doubt::motor_fault, verdict.is_shut(iq::Gate::fault));
  bits.note(Doubt::supply_out_of_band, verdict.is_shut(iq::Gate::supply_voltage));
  bits.note(Doubt::coil_hot, verdict.is_shut(iq::Gate::coil_temperature));
  return bits.all();
}

}  // namespace kphi::daq
