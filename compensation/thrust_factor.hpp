// In flight: by which factor the thrust differs from what the flown k tell, with its uncertainty. Watches and says;
// changes nothing (science.md, eq. 41 and 42).
//
// Real-time: no call allocates, throws, locks or loops. Not synchronised: call from one thread, or copy it (trivially
// copyable).
#pragma once

#include <cstdint>
#include <optional>
#include <type_traits>

#include "compensation/units.hpp"

namespace kphi::compensation {

class ThrustFactor {
 public:
  struct Settings {
    Real mass = 0;                  ///< of the vehicle [kg], > 0
    Seconds period{0};              ///< from update to update; > 0
    Seconds memory{10};             ///< a sample this old counts 1/e of a new one; at least 100 periods
    Real flown_error = Real(0.03);  ///< half of the 95 % interval of the flown k, relative, with those of mass and
                                    ///< accelerometer scale; in [0, 1)
  };
  /// nullopt for settings outside their ranges.
  [[nodiscard]] static std::optional<ThrustFactor> build(const Settings& settings) noexcept;

  /// At any fixed rate, in free flight only: neither on the ground nor within a rotor radius of it. `specific_force`:
  /// of the accelerometer along the body's z [m/s²], +9.81 at rest; `told`: Σ k_i ω_i² of the same moment, by speeds
  /// that were measured. A sample is left out and counted where either is not finite, not positive or above 1000 m/s²
  /// times the mass, or where less than a quarter of the weight is told; time goes by all the same.
  void update(Real specific_force, Newtons told) noexcept;

  struct Estimate {
    Real factor = 1;     ///< thrust flown over thrust told
    Real u = 0;          ///< its standard uncertainty by the noise of the flight; +∞ unless known
    bool known = false;  ///< of the noise there are enough samples that are independent
    bool wrong = false;  ///< known, and |factor − 1| exceeds flown_error by more than kSure u
  };
  /// Older samples count less and less, by the memory. After a long time without samples the factor is unknown again.
  [[nodiscard]] Estimate estimate() const noexcept;
  [[nodiscard]] std::uint32_t used() const noexcept { return used_; }  ///< samples; stays at its largest
  [[nodiscard]] std::uint32_t left_out() const noexcept { return left_out_; }

  /// By this many u a k of exactly flown_error is passed less than once in twenty flights of a hundred memories.
  static constexpr Real kSure = 4;

 private:
  ThrustFactor() noexcept = default;

  Real mass_ = 1, keep_ = 0, flown_error_ = 0;
  Real factor_ = 1;
  Real weight_ = 0;                       // Σ w, w = keep^age
  Real squares_ = 0, squares_twice_ = 0;  // Σ w x², Σ w² x² of the told acceleration x
  Real residual_ = 0;                     // of the sample before
  Real residuals_ = 0, neighbours_ = 0;   // Σ w e², Σ w e e_before
  std::uint32_t used_ = 0, left_out_ = 0;
};

static_assert(std::is_trivially_copyable<ThrustFactor>::value, "a ThrustFactor is copied between threads as bytes");

}  // namespace kphi::compensation
