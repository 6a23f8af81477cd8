// Progress for the person at the stand: one live line on a terminal, one plain line per step elsewhere.
#pragma once

#include <array>
#include <chrono>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daq/guard/observation.hpp"
#include "daq/run/console.hpp"

namespace kphi::daq {

/// What a person reads during a phase, in the order of results::Phase.
inline constexpr std::array<const char*, results::kPhaseNames.size()> kPhaseWords{
    "zero", "", "spin down", "zero", "", "bias", "bias", "bias", "ramp"};

/// How far the campaign is. Members fill multiples of eight bytes: the live page publishes it as a whole.
struct Position {
  std::array<char, 64> propeller{};  ///< cut off, zero-terminated
  double occlusion_deg = 0;
  int repetition = 0;  ///< 1-based; negative: a reference run
  int repetitions = 0;
  int step = -1;  ///< 0-based; -1 outside steps
  int steps = 0;
  std::string_view phase;            ///< of kPhaseWords; empty in a step
  RadPerSec commanded;               ///< unsigned
  double remaining_s = 0;            ///< of the campaign, wall clock
  double done = 0;                   ///< share of the campaign, 0 to 1: its runs count alike, this one by its time
  std::uint64_t samples_before = 0;  ///< in the runs of the campaign before this one
  int run = 0;                       ///< 1-based; 0: not of a campaign
  int runs = 0;

  void name(std::string_view id) noexcept { id.copy(propeller.data(), propeller.size() - 1); }
};

/// The rotor is at rest meanwhile.
struct StandQuestion {
  std::string text;          ///< one line; empty: no question
  double occlusion_deg = 0;  ///< of the run that follows, as are these
  int repetition = 0;        ///< 1-based; negative: a reference run
  int run = 0;               ///< 1-based
  bool has_power = true;     ///< false: kphi has switched the motor's supply off
  std::string drawing{};     ///< SVG of what is to be mounted; may be empty
};

/// Called from the runner's thread only. By itself it shows nothing.
class Progress {
 public:
  virtual ~Progress() = default;
  /// A run begins, under these limits of its guard.
  virtual void guarded(const std::vector<GuardLimit>&) {}
  /// Called on every tick; must return at once.
  virtual void tick(const Position&, const Observation&) {}
  /// A step or phase has ended.
  virtual void step_done(const Position&, const Observation&) {}
  /// A line to keep.
  virtual void say(const std::string&) {}
  /// What the campaign knows so far, one line.
  virtual void reached(const std::string& words) { say(words); }
  /// A person is asked this at the stand, where they see it; without text: answered.
  virtual void asks(const StandQuestion&) {}
};

inline constexpr std::size_t kAnyWidth = 200;  ///< columns of a line that need not fit

/// " 7/15 44 %  5x3  φ  90°  rep 2/3  step 17/40  speed  7894 of  7895 RPM  thrust  1.162 N  left 06:12"; stale
/// values are shown as '?' with their age, thrust before its zero as '–': "…  thrust      ? N  left 06:12  no thrust
/// for 0.8 s". Where that is wider than `columns`: " 7/15 44 % φ  90° 17/40  7894/7895 RPM 1.162 N 06:12", at most 60
/// of them.
[[nodiscard]] std::string describe(const Position& position, const Observation& seen, std::size_t columns = kAnyWidth);
/// " 6001 of  6000 RPM  thrust  0.612 N  torque   -8.9 mN m   48 W  shakes 0.05 N  blades 0.021 N at 300 Hz".
[[nodiscard]] std::string describe_by_hand(const Position& position, const Observation& seen,
                                           std::size_t columns = kAnyWidth);

/// On a terminal one line rewritten in place, at most ten times a second; elsewhere one line per step.
class PrintedProgress final : public Progress {
 public:
  using Describe = std::string(const Position& position, const Observation& seen, std::size_t columns);
  PrintedProgress(std::FILE* stream, bool on_terminal, Describe* words = &describe)
      : stream_(stream), on_terminal_(on_terminal), words_(words) {}
  ~PrintedProgress() override;
  void tick(const Position& position, const Observation& seen) override;
  void step_done(const Position& position, const Observation& seen) override;
  void say(const std::string& line) override;

 private:
  /// The text that clears the live line; empty if none is drawn.
  [[nodiscard]] std::string clearing() { return std::exchange(drawn_, false) ? "\r\x1b[K" : ""; }
  std::FILE* stream_;
  const bool on_terminal_;
  Describe* const words_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace kphi::daq
