#include "fit/flights/speed_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <optional>
#include <vector>

#include "base/number.hpp"
#include "base/statistics.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

using Complex = std::complex<double>;

constexpr double kPiece = 0.25;                        // s: some 30 turns, in which errors of speeds hardly add up
constexpr double kLongestGap = 0.15;                   // s between two speeds
constexpr double kLeastOrder = 0.4, kMostOrder = 6.6;  // beats per turn
constexpr std::size_t kLeastPieces = 40, kMostPieces = 120, kLeastSamples = 16, kMostSamples = 40'000;
constexpr std::size_t kParts = 5;     // of the pieces, for the error of a line
constexpr std::size_t kPerWidth = 3;  // orders for each width of a line
constexpr double kWhole = 0.015;      // relative: k to 3 %
constexpr double kSkirt = 0.08;       // relative: the lines of rotors about those of the others
constexpr double kAlone = 1.25;       // the line over any that contradicts it

/// Angle of a rotor by its speeds, straight between them.
class Turned {
 public:
  explicit Turned(const FlightChannel& speed) : speed_(&speed), sum_(speed.values.size(), 0) {
    for (std::size_t i = 1; i < sum_.size(); ++i)
      sum_[i] = sum_[i - 1] + (speed.time_s[i] - speed.time_s[i - 1]) * (speed.values[i] + speed.values[i - 1]) / 2;
  }
  /// nullopt outside, and in gaps.
  [[nodiscard]] std::optional<double> at(double time) {
    const auto& [times, values] = *speed_;
    while (next_ < times.size() && times[next_] <= time) ++next_;
    if (next_ == 0 || next_ == times.size() || times[next_] - times[next_ - 1] > kLongestGap) return std::nullopt;
    const double into = time - times[next_ - 1], wide = times[next_] - times[next_ - 1];
    const double slope = (values[next_] - values[next_ - 1]) / wide;
    return sum_[next_ - 1] + into * (values[next_ - 1] + slope * into / 2);
  }

 private:
  const FlightChannel* speed_;
  std::vector<double> sum_;
  std::size_t next_ = 0;
};

/// A piece of flight: what the accelerometer felt, without its line, through a window; the rotors' angles at the same
/// times.
struct Piece {
  std::array<std::vector<double>, 3> felt;
  std::array<double, 3> energy{};
  std::vector<std::vector<double>> angle;  ///< by rotor
};

void take_out_line(std::vector<double>& values) {
  const double n = static_cast<double>(values.size()), middle = (n - 1) / 2, level = mean(values);
  double slope = 0, squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double x = static_cast<double>(i) - middle;
    slope += x * values[i], squares += x * x;
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] -= level + slope / squares * (static_cast<double>(i) - middle);
}

std::vector<Piece> pieces_of(const FlightLog& log, std::size_t rotors, double slowest) {
  const std::vector<double>& times = log.specific_force[2].time_s;
  std::vector<Turned> turned;
  for (std::size_t i = 0; i < rotors; ++i) turned.emplace_back(log.rotor_speed[i]);
  std::vector<Piece> pieces;
  for (std::size_t begin = 0; begin < times.size();) {
    Piece piece;
    piece.angle.resize(rotors);
    std::size_t end = begin;
    bool whole = true;
    for (; end < times.size() && times[end] < times[begin] + kPiece; ++end) {
      for (std::size_t i = 0; i < rotors; ++i) {
        const auto angle = turned[i].at(times[end]);
        whole = whole && angle;
        piece.angle[i].push_back(angle.value_or(0));
      }
    }
    const std::size_t count = end - begin;
    const double lasted = times[end - 1] - times[begin];
    whole = whole && count >= kLeastSamples && lasted > 0.8 * kPiece;
    for (std::size_t i = 0; i < rotors && whole; ++i)
      whole = piece.angle[i].back() - piece.angle[i].front() > slowest * lasted;
    for (std::size_t axis = 0; axis < 3 && whole; ++axis) {
      const auto& values = log.specific_force[axis].values;
      whole = values.size() == times.size();
      if (!whole) break;
      auto& felt = piece.felt[axis];
      felt.assign(values.begin() + static_cast<std::ptrdiff_t>(begin),
                  values.begin() + static_cast<std::ptrdiff_t>(end));
      take_out_line(felt);
      for (std::size_t n = 0; n < count; ++n) {
        felt[n] *= 0.5 - 0.5 * std::cos(2 * kPi * (static_cast<double>(n) + 0.5) / static_cast<double>(count));
        piece.energy[axis] += felt[n] * felt[n];
      }
    }
    if (whole) pieces.push_back(std::move(piece));
    begin = end;
  }
  return pieces;
}

/// Some of them, evenly over the flight, so that time is bounded.
void thin(std::vector<Piece>& pieces) {
  if (pieces.empty()) return;
  const std::size_t samples = pieces.front().felt[0].size();
  const std::size_t most = std::clamp(kMostSamples / samples, kLeastPieces, kMostPieces);
  if (pieces.size() <= most) return;
  std::vector<Piece> some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(std::move(pieces[i * pieces.size() / most]));
  pieces = std::move(some);
}

/// Share of the energy that follows the rotors at orders kLeastOrder + i step, by parts of the pieces; noise gives 1.
using Scores = std::array<std::vector<double>, kParts>;

Scores scores_of(const std::vector<Piece>& pieces, double step, std::size_t count) {
  Scores scores;
  scores.fill(std::vector<double>(count, 0));
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const Piece& piece = pieces[p];
    const double per = 1 / static_cast<double>(3 * piece.angle.size() * pieces.size());
    for (const auto& angle : piece.angle) {
      std::vector<Complex> at, turn;
      for (const double one : angle) {
        at.push_back(std::polar(1.0, -kLeastOrder * (one - angle.front())));
        turn.push_back(std::polar(1.0, -step * (one - angle.front())));
      }
      for (std::size_t k = 0; k < count; ++k) {
        std::array<double, 3> real{}, imaginary{};
        for (std::size_t n = 0; n < at.size(); ++n) {
          const double c = at[n].real(), s = at[n].imag();
          for (std::size_t axis = 0; axis < 3; ++axis)
            real[axis] += piece.felt[axis][n] * c, imaginary[axis] += piece.felt[axis][n] * s;
          at[n] = {c * turn[n].real() - s * turn[n].imag(), c * turn[n].imag() + s * turn[n].real()};
        }
        for (std::size_t axis = 0; axis < 3; ++axis)
          if (piece.energy[axis] > 0)
            scores[p % kParts][k] += per * (square(real[axis]) + square(imaginary[axis])) / piece.energy[axis];
      }
    }
  }
  return scores;
}

/// What stands out of its surroundings.
std::vector<double> lines_of(const std::vector<double>& score, double noise) {
  constexpr std::ptrdiff_t kNear = 3 * kPerWidth, kFar = 12 * kPerWidth;
  const auto size = static_cast<std::ptrdiff_t>(score.size());
  std::vector<double> lines(score.size(), 0), around;
  for (std::ptrdiff_t k = 0; k < size; ++k) {
    around.clear();
    for (std::ptrdiff_t off = kNear; off <= kFar; ++off)
      for (const std::ptrdiff_t at : {k - off, k + off})
        if (at >= 0 && at < size) around.push_back(score[static_cast<std::size_t>(at)]);
    const double usual = median(around), more = score[static_cast<std::size_t>(k)] - usual;
    if (more > noise * usual) lines[static_cast<std::size_t>(k)] = more;
  }
  return lines;
}

/// Of the parabola through three.
double top_of(const std::vector<double>& score, std::size_t k) {
  const auto at = static_cast<double>(k);
  if (k == 0 || k + 1 >= score.size()) return at;
  const double bend = score[k - 1] - 2 * score[k] + score[k + 1];
  return bend < 0 ? at + std::clamp((score[k - 1] - score[k + 1]) / (2 * bend), -1.0, 1.0) : at;
}

}  // namespace

SpeedCheck check_speeds(const FlightLog& log, std::size_t rotors, int blades) {
  SpeedCheck check{.blades = blades};
  std::vector<double> usual;
  if (log.rotor_speed.size() < rotors) return check;
  for (std::size_t i = 0; i < rotors; ++i) {
    if (log.rotor_speed[i].values.size() < 2) return check;
    usual.push_back(median(log.rotor_speed[i].values));
  }
  const double speed = median(usual);
  if (!(speed > 0)) return check;
  std::vector<Piece> pieces = pieces_of(log, rotors, speed / 2);
  thin(pieces);
  if (pieces.size() < kLeastPieces) return check;

  const double width = 2 * kPi / (speed * kPiece), step = width / static_cast<double>(kPerWidth);
  const auto count = static_cast<std::size_t>((kMostOrder - kLeastOrder) / step);
  const Scores parts = scores_of(pieces, step, count);
  std::vector<double> score(count, 0);
  for (const auto& part : parts)
    for (std::size_t k = 0; k < count; ++k) score[k] += part[k];
  const std::vector<double> lines =
      lines_of(score, std::max(0.4, 8 / std::sqrt(3 * static_cast<double>(pieces.size()))));

  const auto strongest = static_cast<std::size_t>(std::ranges::max_element(lines) - lines.begin());
  if (!(lines[strongest] > 0)) return check;
  std::vector<double> tops;
  for (const auto& part : parts) {  // each its own near the common one
    const std::size_t from = strongest > kPerWidth ? strongest - kPerWidth : 0;
    const std::size_t to = std::min(count, strongest + kPerWidth + 1);
    const auto best = std::max_element(part.begin() + static_cast<std::ptrdiff_t>(from),
                                       part.begin() + static_cast<std::ptrdiff_t>(to)) -
                      part.begin();
    tops.push_back(kLeastOrder + step * top_of(part, static_cast<std::size_t>(best)));
  }
  // The parabola finds the top of a line to a tenth of a step: a rectangle, beside the scatter among the parts.
  const double scatter = variance(tops) / kParts, all = scatter + square(0.1 * step) / 3;
  check.beats = {mean(tops), std::sqrt(all), (kParts - 1.0) * square(all / scatter)};

  const auto is_whole = [](double order, double room) {
    const double whole = std::round(order);
    return whole >= 1 && std::abs(order - whole) <= room;
  };
  const double order = check.beats.value, whole = std::round(order);
  const bool fits = is_whole(order, kWhole * whole);
  double against = 0;  // the strongest line of the other kind
  for (std::size_t k = 0; k < count; ++k) {
    const double at = kLeastOrder + step * static_cast<double>(k);
    const bool own = std::abs(at - order) < kSkirt * order + 2 * width;
    if (!own && is_whole(at, kWhole * at + 2 * width) != fits) against = std::max(against, lines[k]);
  }
  if (lines[strongest] < kAlone * against) return check;
  const int beats = static_cast<int>(whole);
  if (!fits || (blades > 0 && beats != blades && beats != 2 * blades && beats != 1))
    check.verdict = SpeedCheck::Verdict::contradicted;
  else
    check.verdict = beats == blades ? SpeedCheck::Verdict::confirmed : SpeedCheck::Verdict::whole;
  return check;
}

const char* name_of(SpeedCheck::Verdict verdict) {
  constexpr std::array kNames{"not_felt", "whole", "confirmed", "contradicted"};
  return kNames[static_cast<std::size_t>(verdict)];
}

std::string words(const SpeedCheck& check) {
  if (check.verdict == SpeedCheck::Verdict::not_felt)
    return "no vibration of the rotors in the acceleration: nothing confirms the logged speeds";
  const std::string line =
      fmt::format("the body shakes {} times a logged turn", with_error(check.beats.value, expanded(check.beats)));
  switch (check.verdict) {
    case SpeedCheck::Verdict::confirmed:
      return fmt::format("{}, as {} blades do: the pole count is right, and the speeds are {} ± {} % off those logged",
                         line, check.blades, fmt::format("{:+.2f}", 100 * (check.beats.value / check.blades - 1)),
                         two_digits(100 * expanded(check.beats) / check.blades));
    case SpeedCheck::Verdict::whole:
      return line + ", a whole number: the pole count is right, unless by a factor of 2 or 3" +
             (check.blades > 0 ? "" : "; --blades N tells");
    default:
      return fmt::format("{}, and {}: the speeds are wrong, look at the pole count", line,
                         check.blades > 0 ? fmt::format("{} blades make {}", check.blades, check.blades)
                                          : "blades make a whole number");
  }
}

}  // namespace kphi::fit
