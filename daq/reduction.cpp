#include "daq/reduction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "daq/clock_map.hpp"
#include "daq/event_doubts.hpp"
#include "daq/supply_means.hpp"
#include "daq/zero_limits.hpp"
#include "drivers/iq/quality.hpp"
#include "profiles/bench.hpp"
#include "profiles/campaign.hpp"
#include "profiles/configuration_error.hpp"
#include "results/record_error.hpp"

namespace kphi::daq {
namespace {

using results::Doubt;
using results::LoadCellRecord;
using results::MotorChannel;
using results::MotorReading;
using results::Nanoseconds;
using results::Phase;
using results::PhaseMark;
using results::StepMean;

__extension__ using Wide = __int128;

constexpr std::uint32_t kSaturationBit = 1u << 17;  // Net Box Table 17.1
constexpr std::uint32_t kMonitorBit = 1u << 16;     // a condition the user set; raises the summary bit, too
constexpr std::uint32_t kSummaryBit = 1u << 31;
constexpr double kStandstill = 5.0;    // rad/s
constexpr double kSpeedShare = 0.01;   // of the command
constexpr double kSpeedReached = 2.0;  // rad/s
constexpr double kSpeedSteady = 5.0;   // rad/s
constexpr double kFewSamples = 0.1;    // of those expected
constexpr double kMostSamples =
    0.9;  // of the window's: a restart of the box leaves a gap that ft_sequence does not show
constexpr std::uint64_t kFewSpeeds = 3;

/// True speed per reported speed: the gain of the motor module's clock, where the run's bench file knows it.
double clock_factor(const results::RunHeader& header) {
  if (header.bench_text.find("clock_gain") == std::string::npos) return 1;
  try {
    const auto gain = profiles::parse_bench(header.bench_text, "bench.yaml").iq.clock_gain;
    return gain ? gain->factor : 1;
  } catch (const ConfigurationError& error) {
    throw results::RecordError(fmt::format("run {}: the clock gain in its bench file cannot be read: {}; see kphi info",
                                           header.uuid, error.what()));
  }
}

constexpr int kGatesSince = 3;  // format of the run file; steps of older ones keep the doubts that they have
constexpr double kSupplyBand = 0.1;

/// What the campaign in the run's header says that motor and supply may do.
iq::QualityLimits quality_limits(const results::RunHeader& header) {
  iq::QualityLimits limits;
  try {
    const profiles::Campaign campaign = profiles::parse_campaign(header.campaign_text, "campaign.yaml");
    limits.supply_lowest_v = (1 - kSupplyBand) * campaign.supply.value();
    limits.supply_highest_v = (1 + kSupplyBand) * campaign.supply.value();
    limits.coil_temperature_max_degc = campaign.limits.coil_temperature_max.value();
  } catch (const ConfigurationError&) {
    // A run without a readable campaign has no limits.
  }
  return limits;
}

double speed_tolerance(double commanded) { return std::max(kSpeedShare * commanded, kSpeedReached); }

struct Window {
  Nanoseconds begin = 0;
  Nanoseconds end = 0;
  [[nodiscard]] double centre() const { return 0.5 * (static_cast<double>(begin) + static_cast<double>(end)); }
};

/// Sums of one channel about its first sample: whole numbers, so the order of adding does not matter.
class CountSums {
 public:
  void add(std::int32_t count) {
    if (n_ == 0) first_ = count;
    const std::int64_t d = static_cast<std::int64_t>(count) - first_;
    sum_ += d;
    squares_ += static_cast<Wide>(d) * d;
    ++n_;
  }
  [[nodiscard]] std::uint64_t n() const { return n_; }
  [[nodiscard]] double mean() const { return first_ + static_cast<double>(sum_) / static_cast<double>(n_); }
  [[nodiscard]] double deviation() const {
    if (n_ < 2) return 0;
    const Wide spread = squares_ * static_cast<Wide>(n_) - static_cast<Wide>(sum_) * sum_;
    const double n = static_cast<double>(n_);
    return std::sqrt(static_cast<double>(spread) / n / (n - 1));
  }

 private:
  std::int32_t first_ = 0;
  std::uint64_t n_ = 0;
  std::int64_t sum_ = 0;
  Wide squares_ = 0;
};

struct CellWindow {
  CountSums force;
  CountSums torque;
  std::uint64_t lost = 0;
  std::uint32_t status = 0;  ///< all set bits, without healthy monitor words
  bool at_limit = false;
};

/// The load cell of one run, with its samples placed in bench time.
class CellStream {
 public:
  explicit CellStream(const results::RunRecording& run)
      : header_(run.header),
        records_(run.load_cell),
        clock_(run.load_cell, run.header.load_cell.device_rate_hz, stall_ends(run.events)) {
    for (const ClockEpoch& epoch : clock_.epochs()) {
      if (epoch.rebooted) reboots_.push_back(clock_.time_ns(epoch, epoch.begin));
    }
    const auto& scale = header_.load_cell;
    for (std::size_t i = 0; i < limits_.size(); ++i) {
      const double counts = scale.range[i] * (i < 3 ? scale.counts_per_newton : scale.counts_per_newton_metre);
      const double full = std::numeric_limits<std::int32_t>::max();
      limits_[i] = static_cast<std::int64_t>(counts > 0 && counts < full ? counts : full);
    }
  }

  /// How often the box had started anew before `time`.
  [[nodiscard]] std::size_t boot_at(Nanoseconds time) const {
    return static_cast<std::size_t>(std::count_if(reboots_.begin(), reboots_.end(), [&](auto t) { return t < time; }));
  }
  /// The part of a window after the last restart of the box in it.
  [[nodiscard]] Window since_reboot(Window window) const {
    for (const Nanoseconds time : reboots_) {
      if (time < window.end) window.begin = std::max(window.begin, time);
    }
    return window;
  }

  [[nodiscard]] CellWindow over(const Window& window) const {
    CellWindow found;
    for (const ClockEpoch& epoch : clock_.epochs()) {
      const std::size_t begin = clock_.first_at(epoch, window.begin);
      const std::size_t end = clock_.first_at(epoch, window.end);
      for (std::size_t i = begin; i < end; ++i) add(records_[i], found);
      count_lost(epoch, begin, end, window, found);
    }
    return found;
  }

 private:
  void add(const LoadCellRecord& record, CellWindow& found) const {
    const auto axis = static_cast<std::size_t>(header_.thrust_axis);
    found.force.add(record.counts[axis]);
    found.torque.add(record.counts[axis + 3]);
    if (record.status != (kSummaryBit | kMonitorBit)) found.status |= record.status;
    for (std::size_t i = 0; i < 6; ++i) {
      const std::int64_t count = record.counts[i];
      found.at_limit |= count >= limits_[i] || count <= -limits_[i];
    }
  }

  /// Gaps of ft_sequence inside the window, and those parts of gaps across its ends that lie inside.
  void count_lost(const ClockEpoch& epoch, std::size_t begin, std::size_t end, const Window& window,
                  CellWindow& found) const {
    const std::uint32_t stride = std::max(header_.load_cell.ft_stride, 1u);
    const std::size_t from = std::max(begin, epoch.begin + 1);
    const std::size_t to = std::min(end + 1, epoch.end);
    for (std::size_t i = from; i < to; ++i) {
      const std::uint32_t missing = (records_[i].ft_sequence - records_[i - 1].ft_sequence) / stride - 1;
      if (missing == 0 || missing == std::numeric_limits<std::uint32_t>::max()) continue;
      if (i > begin && i < end) {
        found.lost += missing;
        continue;
      }
      const Nanoseconds before = clock_.time_ns(epoch, i - 1);
      const double period = static_cast<double>(clock_.time_ns(epoch, i) - before) / (missing + 1.0);
      for (std::uint32_t k = 1; k <= missing; ++k) {
        const double t = static_cast<double>(before) + k * period;
        found.lost += t >= static_cast<double>(window.begin) && t < static_cast<double>(window.end);
      }
    }
  }

  const results::RunHeader& header_;
  const std::vector<LoadCellRecord>& records_;
  ClockMap clock_;
  std::vector<Nanoseconds> reboots_;
  std::array<std::int64_t, 6> limits_{};
};

struct Statistics {
  std::uint64_t n = 0;
  double mean = std::numeric_limits<double>::quiet_NaN();
  double deviation = 0;
  double least = std::numeric_limits<double>::infinity();
};

/// The motor's readings of one run, by channel and time.
class MotorSeries {
 public:
  explicit MotorSeries(const std::vector<MotorReading>& readings) : readings_(readings) {}

  [[nodiscard]] std::pair<const MotorReading*, const MotorReading*> over(MotorChannel channel,
                                                                         const Window& window) const {
    const auto at = [&](Nanoseconds time) {
      return std::partition_point(readings_.data(), readings_.data() + readings_.size(), [&](const MotorReading& r) {
        return r.channel < channel || (r.channel == channel && r.time_ns < time);
      });
    };
    return {at(window.begin), at(window.end)};
  }

  [[nodiscard]] Statistics statistics(MotorChannel channel, const Window& window, double sign = 1) const {
    const auto [begin, end] = over(channel, window);
    Statistics s;
    s.n = static_cast<std::uint64_t>(end - begin);
    if (s.n == 0) return s;
    double sum = 0;
    for (const auto* r = begin; r != end; ++r) {
      sum += sign * r->value;
      s.least = std::min(s.least, sign * r->value);
    }
    s.mean = sum / static_cast<double>(s.n);
    double squares = 0;
    for (const auto* r = begin; r != end; ++r) squares += (sign * r->value - s.mean) * (sign * r->value - s.mean);
    if (s.n > 1) s.deviation = std::sqrt(squares / static_cast<double>(s.n - 1));
    return s;
  }

 private:
  const std::vector<MotorReading>& readings_;
};

struct Zero {
  double time = 0;   ///< ns, centre of its window
  double force = 0;  ///< counts
  double torque = 0;
  double force_deviation = 0;
  std::size_t boot = 0;  ///< a zero holds for one power-up of the box
};

class Zeros {
 public:
  void add(const Zero& zero) { (zeros_[0] ? zeros_[1] : zeros_[0]) = zero; }
  [[nodiscard]] bool empty() const { return !zeros_[0]; }
  [[nodiscard]] bool both() const { return zeros_[1].has_value(); }
  /// Power-up of the first zero: the only one without doubt.
  [[nodiscard]] std::size_t boot() const { return zeros_[0]->boot; }
  [[nodiscard]] Zero at(double time, std::size_t boot) const {
    const Zero& a = *zeros_[0];
    if (!zeros_[1] || zeros_[1]->time == a.time) return a;
    const Zero& b = *zeros_[1];
    if (a.boot != b.boot) return b.boot == boot ? b : a;
    const double share = (time - a.time) / (b.time - a.time);
    return {time, a.force + share * (b.force - a.force), a.torque + share * (b.torque - a.torque), 0, boot};
  }
  /// Counts from before to after; NaN when nobody can tell.
  [[nodiscard]] double movement() const {
    if (!zeros_[1] || zeros_[0]->boot != zeros_[1]->boot) return std::numeric_limits<double>::quiet_NaN();
    return zeros_[1]->force - zeros_[0]->force;
  }
  [[nodiscard]] double largest_deviation() const {
    return std::max(zeros_[0]->force_deviation, zeros_[1] ? zeros_[1]->force_deviation : 0.0);
  }

 private:
  std::array<std::optional<Zero>, 2> zeros_;
};

class Reduction {
 public:
  explicit Reduction(const results::RunRecording& run)
      : run_(run),
        clock_factor_(clock_factor(run.header)),
        limits_(quality_limits(run.header)),
        cell_(run),
        motor_(run.motor),
        spans_(doubt_spans(run.events)) {}

  [[nodiscard]] Reduced reduced() {
    find_zeros();
    Reduced found;
    for (std::size_t i = 0; i < run_.phases.size(); ++i) {
      if (run_.phases[i].phase == Phase::step && held_to_its_end(i)) found.steps.push_back(mean_of(i));
    }
    if (zeros_.empty()) return found;
    found.zero = check_zeros(found.steps);
    const std::uint32_t doubts = (found.zero.drifted() ? static_cast<std::uint32_t>(Doubt::zero_drifted) : 0u) |
                                 (found.zero.noisy() ? static_cast<std::uint32_t>(Doubt::zero_noisy) : 0u);
    for (StepMean& step : found.steps) step.doubts |= doubts;
    return found;
  }

 private:
  [[nodiscard]] Window phase_window(std::size_t i) const {
    return {run_.phases[i].time_ns, run_.phases[i + 1].time_ns};
  }
  [[nodiscard]] Nanoseconds discard() const { return std::llround(1e9 * run_.header.minimum_discard_s); }

  [[nodiscard]] ZeroCheck check_zeros(const std::vector<StepMean>& steps) const {
    const results::RunHeader& header = run_.header;
    double largest_thrust_n = 0;  // NaN of a step without samples is none
    for (const StepMean& step : steps) largest_thrust_n = std::fmax(largest_thrust_n, std::abs(step.thrust_n));
    const double newtons = header.thrust_sign / header.load_cell.counts_per_newton;
    return {newtons * zeros_.movement(), tolerated_drift(largest_thrust_n),
            std::abs(newtons) * zeros_.largest_deviation(),
            run_.outcome == results::Outcome::complete && !zeros_.both()};
  }

  /// The step that an abort cut short is followed by whatever made the bench safe, never by another step.
  [[nodiscard]] bool held_to_its_end(std::size_t i) const {
    if (i + 1 >= run_.phases.size()) return false;
    return run_.outcome == results::Outcome::complete || run_.phases[i + 1].phase == Phase::step;
  }

  void find_zeros() {
    for (std::size_t i = 0; i + 1 < run_.phases.size(); ++i) {
      const Phase phase = run_.phases[i].phase;
      if (phase != Phase::zero_before && phase != Phase::zero_after) continue;
      Window window = phase_window(i);
      if (phase == Phase::zero_after) {
        const Nanoseconds planned = window.end - window.begin;
        window.begin += std::min(discard(), planned / 2);
        window.begin = std::max(window.begin, standstill_in(phase_window(i)));
        if (window.end - window.begin < planned / 10) continue;
      }
      window = cell_.since_reboot(window);
      const CellWindow zero = cell_.over(window);
      if (zero.force.n() == 0) continue;
      zeros_.add(
          {window.centre(), zero.force.mean(), zero.torque.mean(), zero.force.deviation(), cell_.boot_at(window.end)});
    }
  }

  /// The time after which no reading says that the motor turns.
  [[nodiscard]] Nanoseconds standstill_in(const Window& window) const {
    const auto [begin, end] = motor_.over(MotorChannel::speed, window);
    Nanoseconds time = window.begin;
    for (const auto* r = begin; r != end; ++r) {
      if (std::abs(r->value) > kStandstill) time = r->time_ns + 1;
    }
    return time;
  }

  /// The step's window; when the speed never arrives, all that the discard leaves.
  [[nodiscard]] Window settled(std::size_t i) const {
    const PhaseMark& mark = run_.phases[i];
    Window window = phase_window(i);
    const auto near = [&](const MotorReading& r) {
      return std::abs(run_.header.spin * r.value - mark.speed_rad_s) <= speed_tolerance(mark.speed_rad_s);
    };
    const auto [first, unused] = motor_.over(MotorChannel::speed, window);
    window.begin = std::min(window.begin + discard(), window.end);
    const auto [begin, end] = motor_.over(MotorChannel::speed, window);
    if (begin != first && near(*(begin - 1))) return window;
    const auto* arrived = std::find_if(begin, end, near);
    if (arrived != end) window.begin = arrived->time_ns;
    return window;
  }

  [[nodiscard]] StepMean mean_of(std::size_t i) const {
    const results::RunHeader& header = run_.header;
    const PhaseMark& mark = run_.phases[i];
    const Window window = settled(i);
    const CellWindow cell = cell_.over(window);
    const Statistics speed = motor_.statistics(MotorChannel::speed, window, header.spin);
    if (zeros_.empty()) {
      throw results::RecordError(
          fmt::format("run {}: no load-cell samples while the motor stood; repeat the run", header.uuid));
    }
    const Zero zero = zeros_.at(window.centre(), cell_.boot_at(window.end));
    const double newtons = header.thrust_sign / header.load_cell.counts_per_newton;
    const double newton_metres = header.thrust_sign / header.load_cell.counts_per_newton_metre;
    const double nan = std::numeric_limits<double>::quiet_NaN();

    StepMean mean;
    mean.propeller = header.propeller_id;
    mean.blades = header.blades;
    mean.diameter_in = header.diameter_in;
    mean.occlusion_deg = header.occlusion_deg;
    mean.repetition = header.repetition;
    mean.step = mark.step;
    mean.commanded_speed_rad_s = mark.speed_rad_s;
    mean.speed_rad_s = clock_factor_ * speed.mean;
    mean.speed_sd_rad_s = clock_factor_ * speed.deviation;
    mean.speed_n = speed.n;
    mean.thrust_n = cell.force.n() > 0 ? newtons * (cell.force.mean() - zero.force) : nan;
    mean.thrust_sd_n = std::abs(newtons) * cell.force.deviation();
    mean.thrust_samples = cell.force.n();
    mean.torque_nm = cell.torque.n() > 0 ? newton_metres * (cell.torque.mean() - zero.torque) : nan;
    mean.torque_sd_nm = std::abs(newton_metres) * cell.torque.deviation();
    mean.zero_n = newtons * zero.force;
    mean.supply_voltage_v = motor_.statistics(MotorChannel::supply_voltage, window).mean;
    mean.supply_current_a = motor_.statistics(MotorChannel::supply_current, window).mean;
    mean.motor_current_a = motor_.statistics(MotorChannel::motor_current, window).mean;
    mean.coil_temperature_degc = motor_.statistics(MotorChannel::coil_temperature, window).mean;
    mean.window_begin_s = 1e-9 * static_cast<double>(window.begin);
    mean.window_end_s = 1e-9 * static_cast<double>(window.end);
    mean.doubts = doubts(i, window, cell, speed);
    take_supply(run_.supply, window.begin, window.end, mean);
    if (header.air_density_kg_m3 > 0) {
      mean.air_density_kg_m3 = header.air_density_kg_m3;
      mean.air_density_u_kg_m3 = header.air_density_u_kg_m3;
    }
    return mean;
  }

  [[nodiscard]] std::uint32_t doubts(std::size_t i, const Window& window, const CellWindow& cell,
                                     const Statistics& speed) const {
    const double commanded = run_.phases[i].speed_rad_s;
    const double planned_s =
        1e-9 * static_cast<double>(run_.phases[i + 1].time_ns - run_.phases[i].time_ns - discard());
    const double expected = std::max(planned_s, 0.0) * run_.header.load_cell.sample_rate_hz;
    const double derate = motor_.statistics(MotorChannel::derate, window).least;
    const Window whole = phase_window(i);
    std::uint32_t bits = doubts_within(spans_, whole.begin, whole.end) |
                         supply_doubts(run_.supply, whole.begin, window.begin, false) |
                         supply_doubts(run_.supply, window.begin, window.end, true);
    const auto note = [&](Doubt doubt, bool applies) { bits |= applies ? static_cast<std::uint32_t>(doubt) : 0u; };
    // Without a single reading nobody knows: that is "not reached", too.
    note(Doubt::speed_not_reached, !(std::abs(speed.mean - commanded) <= speed_tolerance(commanded)));
    note(Doubt::speed_unsteady, speed.deviation > std::max(kSpeedShare * std::abs(speed.mean), kSpeedSteady));
    note(Doubt::saturated, (cell.status & kSaturationBit) != 0 || cell.at_limit);
    const double whole_window =
        1e-9 * static_cast<double>(window.end - window.begin) * run_.header.load_cell.sample_rate_hz;
    note(Doubt::lost_samples, cell.lost > 0 || static_cast<double>(cell.force.n()) < kMostSamples * whole_window);
    note(Doubt::derated, derate < 1);
    note(Doubt::rebooted, cell_.boot_at(whole.end) != zeros_.boot());
    note(Doubt::few_samples,
         static_cast<double>(cell.force.n()) < kFewSamples * expected || cell.force.n() == 0 || speed.n < kFewSpeeds);
    const std::uint32_t told = kSaturationBit | kMonitorBit;
    const bool only_saturation = (cell.status & ~(told | kSummaryBit)) == 0 && (cell.status & kSaturationBit) != 0;
    note(Doubt::bad_status, (cell.status & ~told) != 0 && !only_saturation);
    if (run_.header.format < kGatesSince) return bits;
    const iq::Verdict verdict = iq::judge(module_readings(window), limits_);
    note(Doubt::drive_saturated, verdict.is_shut(iq::Gate::saturation));
    note(Doubt::motor_fault, verdict.is_shut(iq::Gate::fault));
    note(Doubt::supply_out_of_band, verdict.is_shut(iq::Gate::supply_voltage));
    note(Doubt::coil_hot, verdict.is_shut(iq::Gate::coil_temperature));
    return bits;
  }

  /// Of the gates that nothing else here decides.
  [[nodiscard]] iq::StepReadings module_readings(const Window& window) const {
    iq::StepReadings readings;
    const auto add = [&](MotorChannel channel, const iq::Entry& entry) {
      const auto [begin, end] = motor_.over(channel, window);
      for (const auto* r = begin; r != end; ++r) readings.add(entry, r->value);
    };
    add(MotorChannel::drive_pwm, iq::entry<"brushless_drive.drive_pwm">);
    add(MotorChannel::fault_now, iq::entry<"power_safety.fault_now">);
    add(MotorChannel::supply_voltage, iq::entry<"power_monitor.volts">);
    add(MotorChannel::coil_temperature, iq::entry<"coil_temperature_estimator.t_coil">);
    return readings;
  }

  const results::RunRecording& run_;
  const double clock_factor_;
  const iq::QualityLimits limits_;
  CellStream cell_;
  MotorSeries motor_;
  std::vector<DoubtSpan> spans_;
  Zeros zeros_;
};

void require_usable(const results::RunHeader& header) {
  const auto& scale = header.load_cell;
  const bool usable = scale.counts_per_newton > 0 && scale.counts_per_newton_metre > 0 && scale.device_rate_hz > 0 &&
                      header.thrust_axis >= 0 && header.thrust_axis <= 2;
  if (usable) return;
  throw results::RecordError(
      fmt::format("run {}: scale, rate or thrust axis of the load cell cannot be used; see kphi verify", header.uuid));
}

}  // namespace

bool ZeroCheck::drifted() const { return only_one || std::abs(moved_n) > tolerated_n; }

bool ZeroCheck::noisy() const { return deviation_n > kNoisyZero; }

Reduced reduce_with_zeros(const results::RunRecording& run) {
  require_usable(run.header);
  return Reduction(run).reduced();
}

std::vector<StepMean> reduce(const results::RunRecording& run) { return reduce_with_zeros(run).steps; }

}  // namespace kphi::daq
