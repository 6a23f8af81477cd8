#include "results/reduction/zeros.hpp"

#include <fmt/format.h>

#include <cmath>

namespace kphi::results {
namespace {

constexpr double kStandstill = 5.0;  // rad/s

/// The time after the last reading of a turning motor.
Nanoseconds standstill_in(const MotorSeries& motor, const Window& window) {
  Nanoseconds time = window.begin;
  for (const auto& reading : motor.over(MotorChannel::speed, window))
    if (std::abs(reading.value) > kStandstill) time = reading.time_ns + 1;
  return time;
}

std::optional<Zero> zero_in(const Window& window, const CellStream& cell) {
  const CellBins bins = cell.bins(window);
  const CellWindow all = bins.over(0, bins.size());
  if (all.n == 0) return std::nullopt;
  std::vector<double> forces;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (const double force = bins.force(i); !std::isnan(force)) forces.push_back(force);
  }
  Zero zero{bins.window(0, bins.size()).centre(), mean_error(without_trend(forces), 2), all.torque.mean,
            all.force.deviation, cell.boot_at(window.end)};
  zero.force.mean = all.force.mean;
  return zero;
}

double larger(double a, double b) { return std::isnan(a) || std::isnan(b) ? a + b : std::max(a, b); }

}  // namespace

Zeros::Zeros(const RunRecording& run, const CellStream& cell, const MotorSeries& motor) {
  const Nanoseconds discard = std::llround(1e9 * run.header.minimum_discard_s);
  for (std::size_t i = 0; i + 1 < run.phases.size(); ++i) {
    const Phase phase = run.phases[i].phase;
    if (phase != Phase::zero_before && phase != Phase::zero_after) continue;
    const Window whole{run.phases[i].time_ns, run.phases[i + 1].time_ns};
    Window window = whole;
    if (phase == Phase::zero_after) {
      const Nanoseconds planned = whole.end - whole.begin;
      window.begin = std::max(whole.begin + std::min(discard, planned / 2), standstill_in(motor, whole));
      if (window.end - window.begin < planned / 10) continue;
    }
    if (const auto zero = zero_in(cell.since_reboot(window), cell)) add(*zero);
  }
}

const Zero* Zeros::only(std::size_t boot) const {
  const Zero& a = *zeros_[0];
  if (!zeros_[1] || zeros_[1]->time == a.time) return &a;
  const Zero& b = *zeros_[1];
  if (a.boot != b.boot) return b.boot == boot ? &b : &a;
  return nullptr;
}

ZeroThen Zeros::at(double time, std::size_t boot) const {
  if (const Zero* alone = only(boot)) {
    return {alone->force.mean, alone->torque, alone->force.u, alone->force.freedom};
  }
  const Zero &a = *zeros_[0], &b = *zeros_[1];
  const double of_a = std::abs(1 - share(time)) * a.force.u;
  const double of_b = std::abs(share(time)) * b.force.u;
  return {force_at(time, boot), a.torque + share(time) * (b.torque - a.torque), std::hypot(of_a, of_b),
          joint_freedom(of_a, a.force.freedom, of_b, b.force.freedom)};
}

double Zeros::force_at(double time, std::size_t boot) const {
  if (const Zero* alone = only(boot)) return alone->force.mean;
  return zeros_[0]->force.mean + share(time) * (zeros_[1]->force.mean - zeros_[0]->force.mean);
}

double Zeros::movement() const {
  if (!zeros_[1] || zeros_[0]->boot != zeros_[1]->boot) return std::numeric_limits<double>::quiet_NaN();
  return zeros_[1]->force.mean - zeros_[0]->force.mean;
}

double Zeros::largest_deviation() const {
  return std::max(zeros_[0]->force_deviation, zeros_[1] ? zeros_[1]->force_deviation : 0.0);
}

double Zeros::largest_u() const { return larger(zeros_[0]->force.u, zeros_[1] ? zeros_[1]->force.u : 0.0); }

bool ZeroCheck::drifted() const { return only_one || std::abs(moved_n) > tolerated_n; }

bool ZeroCheck::noisy() const { return deviation_n > kNoisyZero || u_n > 0.5 * tolerated_n; }

std::vector<std::string> ZeroCheck::reasons() const {
  std::vector<std::string> reasons;
  if (only_one) {
    reasons.push_back("only one of the two zeros of this run was measured: all its steps are flagged");
  } else if (drifted()) {
    reasons.push_back(
        fmt::format("zero moved by {:.3g} N during this run, limit {:.2g} N: all its steps are flagged; "
                    "let the cell warm up, keep draughts off it, see that nothing touches it",
                    moved_n, tolerated_n));
  }
  if (deviation_n > kNoisyZero) {
    reasons.push_back(
        fmt::format("samples at a zero of this run scatter by {:.3g} N, limit {:g} N: all its steps are "
                    "flagged; {}",
                    deviation_n, kNoisyZero, kZeroNextMove));
  } else if (noisy()) {
    reasons.push_back(
        fmt::format("a zero of this run is known to {:.2g} N only, limit {:.2g} N: all its steps are flagged; "
                    "take longer zeros, or {}",
                    u_n, 0.5 * tolerated_n, kZeroNextMove));
  }
  return reasons;
}

}  // namespace kphi::results
