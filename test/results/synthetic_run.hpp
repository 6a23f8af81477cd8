// A run with known truth: a propeller of constant k, a load cell with drift and lag, a motor that takes its time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "results/records.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_writer.hpp"
#include "results/step_mean.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::results::test {

using kphi::test::TemporaryFolder;

inline double k_of(const StepMean& step) { return step.thrust_n / (step.speed_rad_s * step.speed_rad_s); }

inline bool has(const StepMean& step, QualityFlag flag) {
  return (step.quality_flags & static_cast<std::uint32_t>(flag)) != 0;
}

/// Their places.
inline std::vector<int> steps_flagged(const std::vector<StepMean>& steps, QualityFlag flag) {
  std::vector<int> places;
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (has(steps[i], flag)) places.push_back(static_cast<int>(i));
  return places;
}

struct Truth {
  double k = 1.2e-6;           ///< N/(rad/s)²
  double torque_share = 0.01;  ///< N m per N
  std::vector<double> speeds{400, 800, 1200};
  double zero_s = 1.0;
  double dwell_s = 2.0;
  double zero_force_n = 0.35;  ///< at the start
  double drift_n_per_s = 0;
  double motor_tau_s = 0.1;
  double thrust_delay_s = 0;  ///< of the thrust after the speed
  double thrust_tau_s = 0;    ///< and a first-order lag
  double noise_n = 0.02;
  double correlated_n = 0;      ///< deviation of a second noise …
  double correlation_s = 0.01;  ///< … with this correlation time (first-order autoregressive)
  double speed_noise_rad_s = 0;
  double reading_s = 0.02;     ///< between two readings of the motor
  double reading_phase_s = 0;  ///< of the first one
  double rate_hz = 1000;
  std::uint32_t ft_stride = 7;
  double skew_ppm = 30;
  int records_per_datagram = 1;
  double delay_us = 80;   ///< smallest
  double jitter_us = 30;  ///< mean of an exponential
  int sign = -1;
  int spin = -1;
  std::uint32_t ft_begin = 4294960000u;  ///< wraps during the run
  std::uint64_t seed = 1;
  std::function<bool(std::uint64_t)> lose = [](std::uint64_t) { return false; };  ///< by sample number
  std::function<std::uint32_t(double)> status = [](double) { return 0u; };        ///< by bench time, s
};

inline double commanded_at(const Truth& truth, double t) {
  const double step = (t - truth.zero_s) / truth.dwell_s;
  if (step < 0 || step >= static_cast<double>(truth.speeds.size())) return 0;
  return truth.speeds[static_cast<std::size_t>(step)];
}

/// Bench time at which the zero after begins; it ends 3 s plus zero_s later… the motor has 3 s to stop.
inline double spin_down_at(const Truth& truth) {
  return truth.zero_s + truth.dwell_s * static_cast<double>(truth.speeds.size());
}
inline constexpr double kSpinDown = 3.0;

inline RunHeader header_of(const Truth& truth) {
  RunHeader header;
  header.uuid = "11111111-2222-3333-4444-555555555555";
  header.started_utc = "2021-05-30T00:00:00Z";
  header.tool_version = "0.1.0";
  header.campaign_name = "synthetic";
  header.campaign_text = "name: synthetic\n";
  header.bench_text = "name: none\n";
  header.operator_name = "Zoë";
  header.propeller_id = "5x3";
  header.propeller_name = "5 inch, 3 blades";
  header.diameter_in = 5;
  header.blades = 3;
  header.occlusion_deg = 90;
  header.repetition = 2;
  header.thrust_axis = 2;
  header.thrust_sign = truth.sign;
  header.spin = truth.spin;
  header.minimum_discard_s = 1;
  header.load_cell.sample_rate_hz = truth.rate_hz;
  header.load_cell.ft_stride = truth.ft_stride;
  header.load_cell.device_rate_hz = truth.rate_hz * truth.ft_stride;
  header.load_cell.range = {40, 40, 120, 2, 2, 2};
  header.load_cell.serial = "FT12345";
  header.load_cell.configuration_xml = std::string(70000, 'x');
  header.motor_identity = "simulated";
  return header;
}

inline RunRecording make_run(const Truth& truth) {
  RunRecording run;
  run.header = header_of(truth);
  run.outcome = Outcome::complete;
  std::mt19937_64 random(truth.seed);
  std::normal_distribution<double> noise(0, truth.noise_n);
  std::exponential_distribution<double> jitter(1e6 / std::max(truth.jitter_us, 1e-3));
  const double end = spin_down_at(truth) + kSpinDown + truth.zero_s;
  const auto ns = [](double s) { return static_cast<Nanoseconds>(std::llround(1e9 * s)); };

  run.phases.push_back({Phase::zero_before, -1, 0, 0});
  for (std::size_t i = 0; i < truth.speeds.size(); ++i) {
    run.phases.push_back(
        {Phase::step, static_cast<int>(i), ns(truth.zero_s + truth.dwell_s * static_cast<double>(i)), truth.speeds[i]});
  }
  run.phases.push_back({Phase::spin_down, -1, ns(spin_down_at(truth)), 0});
  run.phases.push_back({Phase::zero_after, -1, ns(spin_down_at(truth) + kSpinDown), 0});
  run.phases.push_back({Phase::end, -1, ns(end), 0});

  double speed = 0;
  double felt = 0;  // speed² as the thrust shows it
  double wander = 0;
  double last_t = 0;
  double next_reading = truth.reading_phase_s;
  std::normal_distribution<double> unit(0, 1);
  std::mt19937_64 random_speed(truth.seed + 1);
  const auto held_back = static_cast<std::size_t>(std::llround(truth.thrust_delay_s * truth.rate_hz));
  std::vector<double> squares(held_back + 1, 0.0);  // a ring of the last speeds²
  std::uint32_t rdt = 1;
  const double period = (1 + 1e-6 * truth.skew_ppm) / truth.rate_hz;
  for (std::uint64_t n = 0; static_cast<double>(n) * period < end; ++n) {
    const double t = static_cast<double>(n) * period;
    speed += (commanded_at(truth, t) - speed) * (1 - std::exp(-(t - last_t) / truth.motor_tau_s));
    const double since = t - last_t;
    last_t = t;
    if (t >= next_reading) {
      next_reading += truth.reading_s;
      const double noise_of_speed = truth.speed_noise_rad_s > 0 ? truth.speed_noise_rad_s * unit(random_speed) : 0;
      run.motor.push_back({MotorChannel::speed, ns(t), 300000, truth.spin * speed + noise_of_speed});
      run.motor.push_back({MotorChannel::supply_voltage, ns(t), 300000, 16.0});
      run.motor.push_back({MotorChannel::derate, ns(t), 300000, 1.0});
    }
    squares[n % squares.size()] = speed * speed;
    const double delayed = squares[(n + 1) % squares.size()];
    felt = truth.thrust_tau_s > 0 ? delayed + (felt - delayed) * std::exp(-since / truth.thrust_tau_s) : delayed;
    if (truth.correlated_n > 0) {
      const double kept = std::exp(-since / truth.correlation_s);
      wander = n == 0 ? truth.correlated_n * unit(random)
                      : kept * wander + truth.correlated_n * std::sqrt(1 - kept * kept) * unit(random);
    }
    const double thrust = truth.k * felt;
    const double force = truth.zero_force_n + truth.drift_n_per_s * t + truth.sign * thrust + noise(random) + wander;
    LoadCellRecord record;
    record.counts = {0, 0, static_cast<std::int32_t>(std::lround(1e6 * force)),
                     0, 0, static_cast<std::int32_t>(std::lround(1e6 * truth.sign * truth.torque_share * thrust))};
    record.rdt_sequence = rdt++;
    record.ft_sequence = truth.ft_begin + static_cast<std::uint32_t>(n) * truth.ft_stride;
    record.status = truth.status(t);
    record.arrival_ns = ns(t);
    run.load_cell.push_back(record);
  }
  // A datagram carries the stamp of its last record; stamps come in order.
  Nanoseconds latest = 0;
  const auto k = static_cast<std::size_t>(truth.records_per_datagram);
  for (std::size_t at = 0; at < run.load_cell.size(); at += k) {
    const std::size_t last = std::min(at + k, run.load_cell.size()) - 1;
    latest = std::max(latest + 1000, run.load_cell[last].arrival_ns + ns(1e-6 * truth.delay_us + jitter(random)));
    for (std::size_t i = at; i <= last; ++i) run.load_cell[i].arrival_ns = latest;
  }
  std::uint64_t number = 0;
  const std::uint64_t all = run.load_cell.size();
  std::erase_if(run.load_cell, [&](const LoadCellRecord&) { return truth.lose(number++); });
  run.account.received = run.load_cell.size();
  run.account.lost_network = all - run.load_cell.size();
  run.account.expected = all;
  std::stable_sort(run.motor.begin(), run.motor.end(),
                   [](const MotorReading& a, const MotorReading& b) { return a.channel < b.channel; });
  return run;
}

/// Writes as a runner does: in small pieces, with a sync every `samples_per_sync`.
inline void write_pieces(RunWriter& writer, const RunRecording& run, std::size_t samples_per_sync = 3500) {
  for (const PhaseMark& mark : run.phases) writer.mark(mark);
  for (const StreamEvent& event : run.events) writer.note(event);
  writer.append(std::span<const MotorReading>(run.motor));
  for (std::size_t at = 0; at < run.load_cell.size(); at += samples_per_sync) {
    const std::size_t n = std::min(samples_per_sync, run.load_cell.size() - at);
    writer.append(std::span<const LoadCellRecord>(run.load_cell).subspan(at, n));
    writer.sync();
  }
}

inline RunDigests write_run(const std::filesystem::path& path, const RunRecording& run, FileLayer& files = disk()) {
  RunWriter writer(path, run.header, files);
  write_pieces(writer, run);
  return writer.finish(run, views_of);
}

}  // namespace kphi::results::test
