// A load cell that lies politely: its stream is healthy, and it repeats one value, or shows no thrust, or thrust of the
// wrong sign. No limit sees that.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "compensation/units.hpp"

namespace kphi::daq {

/// Counts how long each axis repeats one value, and tells when its noise cannot do that. The noise is learnt from the
/// zero: a record equals the one before with at most the probability p, so that n in a row happen with p^n. One thread.
///
/// p is the larger of the share that was seen and that of Gaussian noise in the middle between two counts, where a
/// quiet cell changes least; so a cell whose noise is below half a count is never called frozen.
class FrozenWatch {
 public:
  static constexpr double kLeastSeconds = 0.05;  ///< of one value; 350 samples at 7 kHz
  static constexpr int kLeastRecords = 5;        ///< of a slow cell

  explicit FrozenWatch(double rate_hz);
  /// The zero begins, or is over.
  void learn(bool zero);
  /// The axis that has just been found frozen, 0..5.
  [[nodiscard]] std::optional<std::size_t> take(const std::array<std::int32_t, 6>& counts) {
    std::optional<std::size_t> frozen;
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      Axis& axis = axes_[i];
      const std::int32_t count = counts[i];
      if (learning_) axis.learn(count);
      axis.run = count == axis.last ? axis.run + 1 : 0;
      axis.last = count;
      if (axis.run == axis.limit) frozen = i;
    }
    return frozen;
  }
  /// Records in a row that the axis' noise cannot give; nullopt: it has none, or it is not known yet.
  [[nodiscard]] std::optional<std::uint32_t> limit(std::size_t axis) const;

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  struct Axis {
    void learn(std::int32_t count);
    [[nodiscard]] std::uint32_t limit_of(double least) const;
    std::int32_t last = 0;
    std::uint32_t run = 0, limit = kNone;
    std::uint32_t pairs = 0, equal = 0, longest = 0;  ///< in the zero
    double squares = 0;                               ///< of the differences
    bool begun = false;
  };
  const double least_;
  bool learning_ = false;
  std::array<Axis, 6> axes_{};
};

/// What a turning propeller must do to the load cell.
struct ThrustExpectation {
  double floor_n = 0;  ///< N, zero and noise: less says nothing; 0: nothing is expected
  double least_k = 0;  ///< N/(rad/s)²: half of what the weakest such propeller gives; 0: unknown
};

/// Judges each step's thrust once, when its speed has settled and 0.1 s were seen. One thread.
class ThrustWatch {
 public:
  explicit ThrustWatch(double rate_hz);
  /// A step at this speed begins; 0: something else.
  void begin(RadPerSec speed) noexcept;
  /// Thrust N and torque N m of a sample at a settled speed, zeros subtracted. True: enough were seen, just now.
  [[nodiscard]] bool add(double thrust_n, double torque_nm) noexcept {
    if (speed_ <= RadPerSec(0) || taken_ == samples_) return false;
    thrust_ += thrust_n;
    torque_ += torque_nm;
    return ++taken_ == samples_;
  }
  /// Why those cannot be.
  [[nodiscard]] std::optional<std::string> doubt(int spin, const ThrustExpectation& expected) const;

 private:
  const std::uint32_t samples_;
  RadPerSec speed_{0};
  std::uint32_t taken_ = 0;
  double thrust_ = 0, torque_ = 0;  ///< sums
};

/// What thrust and torque of a turning propeller say against the bench file: a mirrored axis, a propeller that pushes,
/// a rotor that turns the other way. Thrust N along the thrust axis, torque N m about it, `spin` +1 counter-clockwise
/// from above. The cell feels the reaction: it opposes the turning.
[[nodiscard]] std::optional<std::string> doubt_about_signs(double thrust_n, double torque_nm, int spin);

}  // namespace kphi::daq
