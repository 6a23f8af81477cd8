#include "fit/signal/blade_pass.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "base/statistics.hpp"
#include "compensation/units.hpp"
#include "results/reduction/cell_stream.hpp"
#include "results/reduction/motor_series.hpp"

namespace kphi::fit {
namespace {

constexpr double kBoxClock = 30e-6;        // relative standard uncertainty of the box's sample clock, a quartz
constexpr double kSearch = 0.02;           // about the reported speed, relative
constexpr double kLeastSignalToNoise = 8;  // of the line over the noise of one bin

/// Hann's window, after the mean is taken away: the once-per-turn line must not leak into the blades'.
std::vector<double> windowed(std::vector<double> values) {
  const double n = static_cast<double>(values.size()), middle = mean(values);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = (values[i] - middle) * (0.5 - 0.5 * std::cos(2 * kPi * (static_cast<double>(i) + 0.5) / n));
  return values;
}

/// |Σ x e^{−iωt}| at any frequency, cycles per sample; the phasor is turned, not computed anew.
double amplitude_at(const std::vector<double>& values, double cycles) {
  const std::complex<double> turn = std::polar(1.0, -2 * kPi * cycles);
  std::complex<double> sum = 0, phasor = 1;
  for (const double value : values) {
    sum += value * phasor;
    phasor *= turn;
  }
  return std::abs(sum);
}

/// The maximum of a single peak between low and high, by golden section.
double peak_between(const std::vector<double>& values, double low, double high) {
  constexpr double kGolden = 0.6180339887498949;
  double left = high - kGolden * (high - low), right = low + kGolden * (high - low);
  double at_left = amplitude_at(values, left), at_right = amplitude_at(values, right);
  for (int i = 0; i < 24; ++i) {
    if (at_left > at_right) {
      high = right;
      right = left;
      at_right = at_left;
      at_left = amplitude_at(values, left = high - kGolden * (high - low));
    } else {
      low = left;
      left = right;
      at_left = at_right;
      at_right = amplitude_at(values, right = low + kGolden * (high - low));
    }
  }
  return 0.5 * (low + high);
}

struct SpectrumPeak {
  double cycles = 0;  // per sample
  double signal_to_noise = 0;
  double u_cycles = 0;
};

/// The highest line near `expected` (cycles per sample).
SpectrumPeak find_peak(const std::vector<double>& samples, double expected) {
  const std::vector<double> values = windowed(samples);
  const double n = static_cast<double>(values.size());
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  std::vector<std::complex<double>> spectrum;
  fft.fwd(spectrum, values);
  const auto low = static_cast<std::size_t>(std::max(1.0, std::floor(expected * (1 - kSearch) * n)));
  const auto high = std::min(spectrum.size() - 2, static_cast<std::size_t>(std::ceil(expected * (1 + kSearch) * n)));
  if (high <= low + 8) return {};
  std::size_t top = low;
  for (std::size_t i = low; i <= high; ++i)
    if (std::abs(spectrum[i]) > std::abs(spectrum[top])) top = i;
  double noise = 0, count = 0;
  for (std::size_t i = low; i <= high; ++i) {
    if (i + 4 > top && i < top + 4) continue;
    noise += std::norm(spectrum[i]);
    ++count;
  }
  SpectrumPeak peak;
  peak.cycles = peak_between(values, (static_cast<double>(top) - 1) / n, (static_cast<double>(top) + 1) / n);
  if (count == 0 || noise == 0) return peak;
  peak.signal_to_noise = amplitude_at(values, peak.cycles) / std::sqrt(noise / count);
  // Rife and Boorstyn's bound for one tone, √6/(π n) over the ratio of peak to noise bin, and Hann's 1.6 of it.
  peak.u_cycles = 1.6 * std::sqrt(6.0) / (kPi * n * peak.signal_to_noise * std::sqrt(2.0));
  return peak;
}

/// Gain of the clock by the line of one step, with the noise about it and the scatter of the speed.
std::optional<Estimate> line_of(const results::RunRecording& run, std::size_t phase, const results::CellStream& cell,
                                const results::MotorSeries& motor) {
  results::Window window{run.phases[phase].time_ns, run.phases[phase + 1].time_ns};
  window.begin += std::llround(1e9 * std::max(run.header.minimum_discard_s, 0.4 * window.seconds()));
  const results::EvenSamples thrust = cell.samples(window);
  const results::Statistics speed = motor.statistics(MotorChannel::speed, window);
  if (thrust.counts.size() < 256 || speed.n < 3) return std::nullopt;
  const double reported = std::abs(speed.mean);
  const double expected = run.header.blades * reported / (2 * kPi) / thrust.rate_hz;
  if (!(expected > 0) || expected * (1 + kSearch) > 0.5) return std::nullopt;
  const SpectrumPeak peak = find_peak(thrust.counts, expected);
  if (peak.signal_to_noise < kLeastSignalToNoise) return std::nullopt;
  return Estimate{
      peak.cycles / expected,
      std::hypot(peak.u_cycles / expected, speed.deviation / std::sqrt(static_cast<double>(speed.n)) / reported)};
}

/// Weighted mean; enlarged where the lines scatter more than they claim (Birge's ratio).
Estimate mean_gain(const std::vector<Estimate>& lines) {
  double sum = 0, weights = 0, chi_squared = 0;
  for (const Estimate& line : lines) {
    sum += line.value / (line.u * line.u);
    weights += 1 / (line.u * line.u);
  }
  const double gain = sum / weights, n = static_cast<double>(lines.size());
  for (const Estimate& line : lines) chi_squared += std::pow((line.value - gain) / line.u, 2);
  const double enlarge = n > 1 ? std::max(1.0, chi_squared / (n - 1)) : 1.0;
  const double u = std::sqrt(enlarge / weights);
  const double whole = std::hypot(u, gain * kBoxClock);
  return {gain, whole, std::max(1.0, n - 1) * std::pow(whole / u, 4)};
}

}  // namespace

std::optional<BladePassCheck> check_by_blade_pass(std::span<const results::RunRecording> runs) {
  BladePassCheck check;
  for (const results::RunRecording& run : runs) {
    const results::LoadCellColumns columns(run.load_cell, run.header);
    const results::CellStream cell(run, columns);
    const results::MotorSeries motor(run.motor);
    for (std::size_t i = 0; i + 1 < run.phases.size(); ++i) {
      if (run.phases[i].phase != results::Phase::step) continue;
      if (const auto line = line_of(run, i, cell, motor)) check.lines.push_back(*line);
    }
  }
  if (check.lines.empty()) return std::nullopt;
  check.gain = mean_gain(check.lines);
  const double half = coverage_factor(check.gain.freedom) * check.gain.u;
  check.lower = check.gain.value - half;
  check.upper = check.gain.value + half;
  return check;
}

}  // namespace kphi::fit
