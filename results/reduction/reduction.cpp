#include "results/reduction/reduction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/error.hpp"
#include "results/reduction/bin_statistics.hpp"
#include "results/reduction/cell_stream.hpp"
#include "results/reduction/motor_series.hpp"
#include "results/reduction/quality_flags.hpp"

namespace kphi::results {
namespace {

double seconds(Nanoseconds time) { return 1e-9 * static_cast<double>(time); }
Nanoseconds nanoseconds(double time_s) { return std::llround(1e9 * time_s); }

/// One step that was held to its end: its samples in bins from the command on, and the change of speed that it is.
struct HeldStep {
  PhaseMark mark;
  Window whole;
  CellBins bins;
  Transition transition;  ///< thrust in N, zero subtracted
};

const RunRecording& usable(const RunRecording& run) {
  const RunHeader& header = run.header;
  const auto& scale = header.load_cell;
  const bool usable = scale.counts_per_newton > 0 && scale.counts_per_newton_metre > 0 && scale.device_rate_hz > 0 &&
                      header.thrust_axis >= 0 && header.thrust_axis <= 2 && header.clock_gain > 0;
  if (usable) return run;
  throw RecordError(
      fmt::format("run {}: scale, rate, thrust axis or clock gain is invalid; see kphi verify", header.uuid));
}

class Reduction {
 public:
  Reduction(const RunRecording& run, const LoadCellColumns& cell)
      : run_(usable(run)),
        newtons_(run.header.thrust_sign / run.header.load_cell.counts_per_newton),
        newton_metres_(run.header.thrust_sign / run.header.load_cell.counts_per_newton_metre),
        cell_(run, cell),
        motor_(run.motor),
        zeros_(run, cell_, motor_),
        spans_(flag_spans(run.events)) {}

  [[nodiscard]] Reduced reduced() {
    const std::vector<HeldStep> held = held_steps();
    if (zeros_.empty() && !held.empty()) {
      throw RecordError(fmt::format("run {}: no load-cell samples at standstill; repeat the run", run_.header.uuid));
    }
    lag_ = estimate_lag(transitions_of(held));
    Reduced found;
    for (const HeldStep& step : held) found.steps.push_back(mean_of(step));
    if (zeros_.empty()) return found;
    found.zero = check_zeros(found.steps);
    const std::uint32_t flags =
        flag_if(QualityFlag::zero_drifted, found.zero.drifted()) | flag_if(QualityFlag::zero_noisy, found.zero.noisy());
    for (StepMean& step : found.steps) step.quality_flags |= flags;
    return found;
  }

  [[nodiscard]] std::vector<Transition> transitions() const { return transitions_of(held_steps()); }

  [[nodiscard]] std::vector<PlotRow> plot(const Window& whole) const {
    const CellBins bins = cell_.bins(whole);
    const std::vector<double> thrust = thrust_in(bins);
    const auto speeds = motor_.over(MotorChannel::speed, {0, std::numeric_limits<Nanoseconds>::max()});
    std::vector<PlotRow> rows;
    auto next = speeds.begin();
    for (std::size_t i = 0; i < bins.size(); ++i) {
      const double at = bins.window(i, i + 1).centre();
      while (next != speeds.end() && static_cast<double>(next->time_ns) <= at) ++next;
      const bool between = next != speeds.begin() && next != speeds.end();
      rows.push_back(
          {1e-9 * at, thrust[i], between ? run_.header.clock_gain * speed_between(next[-1], *next, at) : kNotMeasured});
    }
    return rows;
  }

 private:
  [[nodiscard]] double speed_between(const MotorReading& a, const MotorReading& b, double at) const {
    const double share = (at - static_cast<double>(a.time_ns)) / static_cast<double>(b.time_ns - a.time_ns);
    return run_.header.spin * std::lerp(a.value, b.value, share);
  }
  [[nodiscard]] Nanoseconds discard() const { return nanoseconds(run_.header.minimum_discard_s); }
  [[nodiscard]] double lag_s() const { return lag_.known() ? lag_.seconds : 0; }

  [[nodiscard]] ZeroCheck check_zeros(const std::vector<StepMean>& steps) const {
    double largest_thrust_n = 0;  // NaN of a step without samples is none
    for (const StepMean& step : steps) largest_thrust_n = std::fmax(largest_thrust_n, std::abs(step.thrust_n));
    ZeroCheck check;
    check.moved_n = newtons_ * zeros_.movement();
    check.tolerated_n = tolerated_drift(largest_thrust_n);
    check.deviation_n = std::abs(newtons_) * zeros_.largest_deviation();
    check.only_one = run_.outcome == Outcome::complete && std::isnan(check.moved_n);
    check.u_n = std::abs(newtons_) * zeros_.largest_u();
    return check;
  }

  /// The step that an abort cut short is followed by whatever made the bench safe, never by another step.
  [[nodiscard]] bool held_to_its_end(std::size_t i) const {
    if (run_.phases[i].phase != Phase::step || i + 1 >= run_.phases.size()) return false;
    const Phase next = run_.phases[i + 1].phase;
    return run_.outcome == Outcome::complete || next == Phase::step || next == Phase::ramp;
  }

  [[nodiscard]] std::vector<HeldStep> held_steps() const {
    std::vector<HeldStep> held;
    for (std::size_t i = 0; i < run_.phases.size(); ++i) {
      if (!held_to_its_end(i)) continue;
      const Window whole{run_.phases[i].time_ns, run_.phases[i + 1].time_ns};
      // In the order of time: the stream holds the samples it has just read.
      Transition transition;
      transition.before = thrust_before(whole);
      CellBins bins = cell_.bins(whole);
      transition.bin_s = bins.bin_s();
      transition.thrust = thrust_in(bins);
      transition.squared = squared_speeds(whole);
      transition.ramped = i > 0 && run_.phases[i - 1].phase == Phase::ramp;
      held.push_back({run_.phases[i], whole, std::move(bins), std::move(transition)});
    }
    return held;
  }

  /// N, zero subtracted; NaN of a bin that holds nothing.
  [[nodiscard]] std::vector<double> thrust_in(const CellBins& bins) const {
    std::vector<double> thrust;
    for (std::size_t i = 0; i < bins.size(); ++i) {
      const Window bin = bins.window(i, i + 1);
      const double zero = zeros_.empty() ? 0 : zeros_.force_at(bin.centre(), cell_.boot_at(bin.end));
      thrust.push_back(newtons_ * (bins.force(i) - zero));
    }
    return thrust;
  }

  [[nodiscard]] std::vector<double> thrust_before(const Window& whole) const {
    const CellBins none = cell_.bins({whole.begin, whole.begin});
    const auto history_bins = static_cast<Nanoseconds>(kThrustHistory / none.bin_s());
    return thrust_in(cell_.bins({whole.begin - history_bins * none.width(), whole.begin}));
  }

  [[nodiscard]] std::vector<SquaredSpeed> squared_speeds(const Window& whole) const {
    std::vector<SquaredSpeed> squared;
    const Window history{whole.begin - nanoseconds(kSpeedHistory), whole.end};
    for (const auto& r : motor_.over(MotorChannel::speed, history)) {
      const double time_s = seconds(r.time_ns - whole.begin);
      if (squared.empty() || squared.back().time_s < time_s) squared.push_back({time_s, r.value * r.value});
    }
    return squared;
  }

  [[nodiscard]] static std::vector<Transition> transitions_of(const std::vector<HeldStep>& held) {
    std::vector<Transition> transitions;
    for (const HeldStep& step : held) transitions.push_back(step.transition);
    return transitions;
  }

  /// When the speed first was where it should be, not before the discard; that itself when it never was.
  [[nodiscard]] Nanoseconds arrival(const HeldStep& step) const {
    const double commanded = step.mark.speed_rad_s;
    const Nanoseconds earliest = std::min(step.whole.begin + discard(), step.whole.end);
    const auto near = [&](const MotorReading& r) {
      return std::abs(run_.header.spin * r.value - commanded) <= speed_tolerance(commanded);
    };
    const auto before = motor_.over(MotorChannel::speed, {step.whole.begin, earliest});
    if (!before.empty() && near(before.back())) return earliest;
    const auto after = motor_.over(MotorChannel::speed, {earliest, step.whole.end});
    const auto arrived = std::ranges::find_if(after, near);
    return arrived == after.end() ? earliest : arrived->time_ns;
  }

  /// Thrust as it would be had the speed held its mean: what is left of a change is the propeller's, or the cell's.
  [[nodiscard]] std::vector<double> at_constant_speed(const HeldStep& step, std::size_t first) const {
    const auto expected = delayed(step.transition, lag_.known() ? lag_ : Lag{});
    const auto& thrust = step.transition.thrust;
    std::vector<double> values(thrust.begin() + static_cast<std::ptrdiff_t>(first), thrust.end());
    double sum = 0;
    for (std::size_t i = first; i < expected.size(); ++i) sum += expected[i];
    const double mean = sum / static_cast<double>(values.size());
    if (!(mean > 0)) return values;
    for (std::size_t i = 0; i < values.size(); ++i) {
      // A motor that stops shows nothing about the coefficient.
      values[i] *= expected[first + i] > 0.25 * mean ? mean / expected[first + i] : kNotMeasured;
    }
    return values;
  }

  [[nodiscard]] StepMean mean_of(const HeldStep& step) const {
    const CellBins& bins = step.bins;
    const Nanoseconds lag = nanoseconds(lag_s());
    const Nanoseconds to_nearest = lag - bins.width() / 2;
    const std::size_t discarded = bins.first_from(step.whole.begin + discard() + to_nearest);
    const std::size_t arrived = std::max(discarded, bins.first_from(arrival(step) + to_nearest));
    const Settling settling = settle(step.transition.thrust, arrived, bins.size() - discarded, bins.bin_s());

    StepEvidence evidence;
    evidence.commanded_rad_s = step.mark.speed_rad_s;
    evidence.planned_s = seconds(step.whole.end - step.whole.begin - discard());
    evidence.window = bins.window(settling.begin, bins.size());
    // A lag that seems to be below 0 would take in the next command.
    evidence.motor_window = {evidence.window.begin - lag, std::min(evidence.window.end - lag, step.whole.end)};
    evidence.cell = bins.over(settling.begin, bins.size());
    evidence.speed = motor_.statistics(MotorChannel::speed, evidence.motor_window, run_.header.spin);

    StepMean mean = named(step);
    take_load_cell(step, settling.begin, evidence, mean);
    take_motor(evidence, mean);
    const auto supply = within(run_.supply, evidence.window);
    take_supply(supply, mean);
    take_air(mean);
    take_origin(mean);
    mean.window_begin_s = seconds(evidence.window.begin);
    mean.window_end_s = seconds(evidence.window.end);
    mean.discarded_s = seconds(evidence.window.begin - step.whole.begin);
    mean.lag_s = lag_.known() ? lag_.seconds : kNotMeasured;
    mean.lag_u_s = lag_.known() ? lag_.u : kNotMeasured;
    mean.quality_flags =
        flags_within(spans_, step.whole.begin, step.whole.end) | step_flags(run_.header, motor_, evidence) |
        supply_flags(within(run_.supply, {step.whole.begin, evidence.window.begin}), false) |
        supply_flags(supply, true) | flag_if(QualityFlag::rebooted, cell_.boot_at(step.whole.end) != zeros_.boot()) |
        flag_if(QualityFlag::unsettled, !settling.settled) | flag_if(QualityFlag::lag_unknown, !lag_.known()) |
        flag_if(QualityFlag::few_samples, std::isnan(mean.thrust_u_n) || std::isnan(mean.speed_u_rad_s)) |
        flag_if(QualityFlag::drifted, drifts(at_constant_speed(step, discarded)));
    return mean;
  }

  [[nodiscard]] StepMean named(const HeldStep& step) const {
    const RunHeader& header = run_.header;
    return {.propeller = header.propeller_id,
            .blades = header.blades,
            .diameter_in = header.diameter_in,
            .occlusion_deg = header.occlusion_deg,
            .repetition = header.repetition,
            .step = step.mark.step,
            .commanded_speed_rad_s = step.mark.speed_rad_s};
  }

  void take_load_cell(const HeldStep& step, std::size_t first, const StepEvidence& evidence, StepMean& mean) const {
    const CellWindow& cell = evidence.cell;
    const ZeroThen zero = zeros_.at(evidence.window.centre(), cell_.boot_at(evidence.window.end));
    std::vector<double> thrust;
    for (std::size_t i = first; i < step.transition.thrust.size(); ++i)
      if (!std::isnan(step.transition.thrust[i])) thrust.push_back(step.transition.thrust[i]);
    const MeanError error = mean_error(thrust);
    mean.thrust_n = newtons_ * (cell.force.mean - zero.force);
    mean.thrust_sd_n = std::abs(newtons_) * cell.force.deviation;
    mean.thrust_samples = cell.n;
    mean.torque_nm = newton_metres_ * (cell.torque.mean - zero.torque);
    mean.torque_sd_nm = std::abs(newton_metres_) * cell.torque.deviation;
    mean.zero_n = newtons_ * zero.force;
    mean.zero_u_n = std::abs(newtons_) * zero.u;
    mean.zero_moved_n = newtons_ * zeros_.movement();
    mean.thrust_n_eff = error.u > 0 ? mean.thrust_sd_n * mean.thrust_sd_n / (error.u * error.u) : kNotMeasured;
    mean.thrust_u_n = std::hypot(error.u, mean.zero_u_n);
    mean.thrust_freedom = joint_freedom(error.u, error.freedom, mean.zero_u_n, zero.freedom);
  }

  static void take_supply(std::span<const SupplyReading> readings, StepMean& mean) {
    if (readings.empty()) return;
    const double n = static_cast<double>(readings.size());
    mean.supply_v = mean.supply_a = mean.supply_w = 0;
    for (const SupplyReading& reading : readings) {
      mean.supply_v += reading.voltage_v / n;
      mean.supply_a += reading.current_a / n;
      mean.supply_w += reading.voltage_v * reading.current_a / n;
    }
  }

  void take_origin(StepMean& mean) const {
    const Origin origin = origin_named(run_.header.origin);
    if (origin != Origin::unknown) mean.simulated = origin == Origin::simulated ? 1 : 0;
  }

  void take_air(StepMean& mean) const {
    if (run_.header.air_density_kg_m3 <= 0) return;
    mean.air_density_kg_m3 = run_.header.air_density_kg_m3;
    mean.air_density_u_kg_m3 = run_.header.air_density_u_kg_m3;
  }

  void take_motor(const StepEvidence& evidence, StepMean& mean) const {
    const Window& window = evidence.motor_window;
    mean.speed_rad_s = run_.header.clock_gain * evidence.speed.mean;
    mean.speed_sd_rad_s = run_.header.clock_gain * evidence.speed.deviation;
    mean.speed_u_rad_s = run_.header.clock_gain * evidence.speed.error.u;
    mean.speed_n = evidence.speed.n;
    mean.speed_glitches = motor_.glitches(window);
    mean.supply_voltage_v = motor_.statistics(MotorChannel::supply_voltage, window).mean;
    mean.supply_current_a = motor_.statistics(MotorChannel::supply_current, window).mean;
    mean.motor_current_a = motor_.statistics(MotorChannel::motor_current, window).mean;
    mean.coil_temperature_degc = motor_.statistics(MotorChannel::coil_temperature, window).mean;
  }

  const RunRecording& run_;
  const double newtons_;        ///< of thrust per count
  const double newton_metres_;  ///< of torque about it per count
  CellStream cell_;
  MotorSeries motor_;
  Zeros zeros_;
  std::vector<FlagSpan> spans_;
  Lag lag_;
};

/// What lies beyond the run's phases is a stamp that cannot be.
Window within_run(const RunRecording& run, Window window) {
  constexpr Nanoseconds kAround = 5'000'000'000;
  if (run.phases.empty()) return window;
  return {std::max(window.begin, run.phases.front().time_ns - kAround),
          std::min(window.end, run.phases.back().time_ns + kAround)};
}

}  // namespace

Reduced reduce_with_zeros(const RunRecording& run) { return Reduction(run, {run.load_cell, run.header}).reduced(); }

std::vector<Transition> transitions_of(const RunRecording& run) {
  return Reduction(run, {run.load_cell, run.header}).transitions();
}

RunViews views_of(const RunRecording& run, const LoadCellColumns& cell) {
  RunViews views{sample_times(run, cell), {}};
  if (views.sample_times.empty()) return views;
  try {
    views.plot = Reduction(run, cell).plot(within_run(run, {views.sample_times.front(), views.sample_times.back()}));
  } catch (const RecordError&) {
    // The scale is invalid: kphi verify says so.
  }
  return views;
}

std::vector<StepMean> reduce(const RunRecording& run) { return reduce(run, {run.load_cell, run.header}); }
std::vector<StepMean> reduce(const RunRecording& run, const LoadCellColumns& cell) {
  return Reduction(run, cell).reduced().steps;
}

}  // namespace kphi::results
