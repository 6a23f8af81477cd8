#include "results/reduction/quality_flags.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kphi::results {
namespace {

constexpr double kSpeedShare = 0.01;   // of the command
constexpr double kSpeedReached = 2.0;  // rad/s
constexpr double kSpeedSteady = 5.0;   // rad/s
constexpr double kFewSamples = 0.1;    // of those expected
// Of the window's: a restart of the box leaves a gap that ft_sequence does not show.
constexpr double kMostSamples = 0.9;
constexpr std::uint64_t kFewSpeeds = 3;

/// The window of the speed ends a lag earlier than the one of the thrust. A change of speed in between is not in the
/// mean speed, but already in the thrust.
bool leaves_at_the_end(const StepEvidence& step, const MotorSeries& motor) {
  const double steady = 3 * std::max(kSpeedShare * std::abs(step.speed.mean), kSpeedSteady);
  const auto late = motor.over(MotorChannel::speed, {step.motor_window.end, step.window.end});
  return std::ranges::any_of(late, [&](const MotorReading& reading) {
    return !(std::abs(std::abs(reading.value) - std::abs(step.speed.mean)) <= steady);
  });
}

std::uint32_t speed_flags(const StepEvidence& step, const MotorSeries& motor) {
  // NaN without a reading counts as not reached, too.
  return flag_if(QualityFlag::speed_not_reached,
                 !(std::abs(step.speed.mean - step.commanded_rad_s) <= speed_tolerance(step.commanded_rad_s))) |
         flag_if(QualityFlag::speed_unsteady,
                 step.speed.deviation > std::max(kSpeedShare * std::abs(step.speed.mean), kSpeedSteady) ||
                     leaves_at_the_end(step, motor)) |
         flag_if(QualityFlag::speed_glitch, motor.glitches(step.motor_window) > 0) |
         flag_if(QualityFlag::frozen, motor.speed_frozen(step.motor_window)) |
         flag_if(QualityFlag::derated, motor.statistics(MotorChannel::derate, step.motor_window).least < 1);
}

std::uint32_t cell_flags(const StepEvidence& step, const LoadCellScale& scale) {
  const CellWindow& cell = step.cell;
  const double n = static_cast<double>(cell.n);
  const double rate_hz = scale.sample_rate_hz;
  const bool saturated = (cell.status & scale.saturation_bits) != 0;
  const std::uint32_t others = cell.status & ~(scale.saturation_bits | kMonitorBit);
  return flag_if(QualityFlag::saturated, saturated || cell.at_limit) |
         flag_if(QualityFlag::lost_samples, cell.lost > 0 || n < kMostSamples * step.window.seconds() * rate_hz) |
         flag_if(QualityFlag::few_samples,
                 n < kFewSamples * std::max(step.planned_s, 0.0) * rate_hz || step.speed.n < kFewSpeeds) |
         flag_if(QualityFlag::frozen, cell.frozen) |
         flag_if(QualityFlag::bad_status, (others & ~kSummaryBit) != 0 || (others != 0 && !saturated));
}

/// Written so that NaN raises the flag.
std::uint32_t module_flags(const RunHeader& header, const MotorSeries& motor, const Window& window) {
  const auto flag_unless = [&](QualityFlag flag, MotorChannel channel, auto&& good) {
    const auto readings = motor.over(channel, window);
    return flag_if(flag, !std::ranges::all_of(readings, good, &MotorReading::value));
  };
  const double volts = header.supply_voltage_v, hottest = header.coil_temperature_max_degc;
  return flag_unless(QualityFlag::drive_saturated, MotorChannel::drive_pwm,
                     [](double pwm) { return std::abs(pwm) < kFullDrive; }) |
         flag_unless(QualityFlag::motor_fault, MotorChannel::fault_now, [](double fault) { return fault == 0; }) |
         flag_unless(QualityFlag::supply_out_of_band, MotorChannel::supply_voltage,
                     [&](double v) {
                       return !(volts > 0) || (v >= (1 - kSupplyBand) * volts && v <= (1 + kSupplyBand) * volts);
                     }) |
         flag_unless(QualityFlag::coil_hot, MotorChannel::coil_temperature,
                     [&](double degc) { return !(hottest > 0) || degc < hottest; });
}

constexpr Nanoseconds kSinceEver = std::numeric_limits<Nanoseconds>::min();
constexpr Nanoseconds kForEver = std::numeric_limits<Nanoseconds>::max();

enum class Concerns : std::uint8_t { instant, until_it_ends, whole_run };

struct Meaning {
  EventKind kind;
  QualityFlag flag;
  Concerns concerns;
  EventKind end{};  ///< of what lasts until it ends
};

constexpr Meaning kMeanings[] = {
    {EventKind::restarted, QualityFlag::stream_restarted, Concerns::instant},
    {EventKind::stalled, QualityFlag::stalled, Concerns::until_it_ends, EventKind::stall_ended},
    {EventKind::silent, QualityFlag::silent, Concerns::until_it_ends, EventKind::resumed},
    {EventKind::box_trouble, QualityFlag::box_trouble, Concerns::instant},
    {EventKind::taken_over, QualityFlag::taken_over, Concerns::until_it_ends, EventKind::resumed},
    // The configuration is read now and then, so the time of the change is unknown.
    {EventKind::unusable, QualityFlag::configuration_changed, Concerns::whole_run},
    {EventKind::configuration_changed, QualityFlag::configuration_changed, Concerns::whole_run},
    {EventKind::motor_reset, QualityFlag::motor_reset, Concerns::instant},
    {EventKind::motor_connected, QualityFlag::motor_lost, Concerns::instant},
    {EventKind::motor_no_answer, QualityFlag::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_silent, QualityFlag::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_coast_denied, QualityFlag::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_lease_expired, QualityFlag::motor_lost, Concerns::instant},
    {EventKind::motor_port_lost, QualityFlag::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_another_module, QualityFlag::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_host_absent, QualityFlag::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_let_go, QualityFlag::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_slow_round_trip, QualityFlag::slow_round_trip, Concerns::until_it_ends,
     EventKind::motor_slow_round_trip},
};

Nanoseconds end_of(const Meaning& meaning, std::span<const StreamEvent> later, Nanoseconds begin) {
  if (meaning.concerns == Concerns::instant) return begin;
  if (meaning.concerns == Concerns::whole_run) return kForEver;
  const auto end = std::ranges::find(later, meaning.end, &StreamEvent::kind);
  return end == later.end() ? kForEver : end->time_ns;
}

}  // namespace

double speed_tolerance(double commanded_rad_s) { return std::max(kSpeedShare * commanded_rad_s, kSpeedReached); }

std::uint32_t step_flags(const RunHeader& header, const MotorSeries& motor, const StepEvidence& step) {
  return speed_flags(step, motor) | cell_flags(step, header.load_cell) | module_flags(header, motor, step.motor_window);
}

std::span<const SupplyReading> within(std::span<const SupplyReading> readings, const Window& window) {
  const auto first = std::ranges::lower_bound(readings, window.begin, {}, &SupplyReading::time_ns);
  return {first, std::max(first, std::ranges::lower_bound(readings, window.end, {}, &SupplyReading::time_ns))};
}

std::uint32_t supply_flags(std::span<const SupplyReading> readings, bool settled) {
  std::uint32_t flags = 0;
  for (const SupplyReading& seen : readings) {
    flags |= flag_if(QualityFlag::supply_off, seen.output == 0 || seen.protection != SupplyProtection::none);
    if (!settled) continue;
    flags |= flag_if(QualityFlag::supply_limited, seen.regulation == SupplyRegulation::constant_current) |
             flag_if(QualityFlag::supply_sag, !(seen.voltage_v >= (1 - kSupplySag) * seen.set_voltage_v)) |
             flag_if(QualityFlag::supply_rise, seen.voltage_v > (1 + kSupplyRise) * seen.set_voltage_v);
  }
  return flags;
}

std::vector<FlagSpan> flag_spans(std::span<const StreamEvent> events) {
  std::vector<FlagSpan> spans;
  for (std::size_t i = 0; i < events.size(); ++i) {
    for (const Meaning& meaning : kMeanings) {
      if (meaning.kind != events[i].kind) continue;
      const Nanoseconds begin = events[i].time_ns;
      spans.push_back({meaning.concerns == Concerns::whole_run ? kSinceEver : begin,
                       end_of(meaning, events.subspan(i + 1), begin), meaning.flag});
    }
  }
  return spans;
}

std::uint32_t flags_within(std::span<const FlagSpan> spans, Nanoseconds begin, Nanoseconds end) {
  std::uint32_t flags = 0;
  for (const FlagSpan& span : spans) flags |= flag_if(span.flag, span.begin < end && span.end >= begin);
  return flags;
}

}  // namespace kphi::results
