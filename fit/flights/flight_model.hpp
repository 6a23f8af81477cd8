// The model of a flight as residuals for Ceres: specific force along z and, while no rotor is over the body, roll and
// pitch acceleration, against what the rotors give (docs/science.md, eq. 35 to 37).
#pragma once

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fit/flights/flown_bins.hpp"

namespace kphi::fit {

/// Numbers of the model. k(φ)/K_T at each knot of φ follows, then the rotors, one number each.
enum FlightNumber : std::size_t {
  kLevel,     ///< K_T over that of steady hover
  kScale,     ///< of the accelerometer, beside 1
  kBias,      ///< m/s²
  kDrag,      ///< 1/s
  kForward,   ///< 1/(m/s²)
  kTiming,    ///< s: delay of the speeds, or lag behind the commands
  kLaw,       ///< share of u²
  kSag,       ///< relative speed per relative voltage
  kStamp,     ///< s: by how much the stamps of the commands are late
  kRollGain,  ///< inertia of the file over the true one
  kPitchGain,
  kCentreY,  ///< m: centre of gravity beside that of the file
  kCentreX,
  kKnots,
};

/// A free number: what is known of it before; deviation 0: nothing.
struct FreeNumber {
  std::size_t which = 0;
  double before = 0, before_u = 0;
  std::string name{}, unit{};
};

class FlightModel : public ceres::CostFunction {
 public:
  /// Keeps a reference to `flown`. k(φ)/K_T is straight from 1 at φ = 0 through the knots, ascending, and on beyond;
  /// without any it is 1. `fastest` is the speed at full command, rad/s.
  FlightModel(const FlownBins& flown, std::vector<FreeNumber> free, std::vector<double> knots_rad, double mass_kg,
              double fastest);

  /// What turns the rotors: kTiming, kLaw, kSag, kStamp.
  static constexpr std::array kDriving{kTiming, kLaw, kSag, kStamp};
  using Driving = std::array<double, kDriving.size()>;
  /// Squared speeds of all rotors, mean over each bin, (rad/s)².
  [[nodiscard]] std::vector<compensation::Rotors<double>> squares(const Driving& driving) const;

  [[nodiscard]] const std::vector<FreeNumber>& free() const { return free_; }
  [[nodiscard]] std::vector<double> start() const;

  std::vector<double> given;  ///< all numbers, of which those that are not free count
  double hover = 1;           ///< K_T where kLevel is 1, N/(rad/s)²
  /// Standard deviations of a residual of force [m/s²], roll and pitch [rad/s²] by which they are weighted.
  std::array<double, 3> sigma{0.5, 10, 10};
  std::vector<char> shock;  ///< one for each bin: its force does not count

  /// Residuals over sigma: force of each bin, roll and pitch of each bin, then the priors, then the rotors' mean.
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;
  [[nodiscard]] std::size_t bins() const { return flown_->bins.size(); }

 private:
  /// Of a rotor at φ: its knot at or beyond φ, the last one at most, and the share of the way there from the one
  /// before.
  [[nodiscard]] std::pair<std::size_t, double> place_of(double phi) const;
  const FlownBins* flown_;
  std::vector<FreeNumber> free_;
  std::vector<int> column_;  // of each number, −1: not free
  std::vector<double> knots_;
  double mass_, fastest_;
};

}  // namespace kphi::fit
