// The physics of the simulated bench: motor, propeller, occlusion, load cell. Seeded; one thread; no clock.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "base/clock.hpp"
#include "base/random.hpp"
#include "drivers/sim/physics/motor.hpp"
#include "drivers/sim/physics/stand.hpp"
#include "drivers/sim/physics/truth.hpp"

namespace kphi::sim {

/// Fx, Fy, Fz in N, Tx, Ty, Tz in N m. A propeller that pulls gives +Fz.
using Wrench = std::array<double, 6>;

/// One internal sample of the Net Box.
struct LoadCellSample {
  Instant at{0};  ///< bench time
  Wrench wrench{};
};

struct LoadCellParameters {
  double thrust_lag = 0.040;                                        ///< s, first order
  Wrench noise{0.015, 0.015, 0.025, 6e-4, 6e-4, 6e-4};              ///< white, deviation per internal sample
  Wrench zero_spread{0.3, 0.3, 0.4, 5e-3, 5e-3, 3e-3};              ///< zero offset of a power-up: uniform within ±
  Wrench drift_per_minute{8e-4, -6e-4, 2e-3, 2e-5, -2e-5, 1e-5};    ///< linear
  Wrench walk_per_root_minute{2e-4, 2e-4, 4e-4, 6e-6, 6e-6, 6e-6};  ///< random walk: deviation after one minute
  double gain = 1;                                                  ///< of all axes: what it reads per true load
  double hysteresis = 0;              ///< share of the largest weight that hung on it, read once it is gone
  double slow_noise = 0;              ///< deviation in Fz, N, of noise with a memory of slow_noise_seconds
  double slow_noise_seconds = 1;      ///< its correlation falls to 1/e in this time
  double once_per_turn = 0.015;       ///< amplitude in Fz, as a share of the unoccluded thrust; Fx, Fy the same
  double blade_pass = 0.03;           ///< amplitude in Fz, as a share of the unoccluded thrust
  double blade_pass_occluded = 0.05;  ///< more of it with half the disk occluded
};

/// The aerodynamic part of one mounting.
struct AirLoad {
  double thrust = 0;             ///< k(φ) at 1000 rad/s, N/(rad/s)²
  double thrust_unoccluded = 0;  ///< K_T, N/(rad/s)²
  int blades = 2;
  double occluded_share = 0;   ///< 0..1 of the disk
  double rise_per_krad_s = 0;  ///< of k with the speed, share
};

/// The load on the cell under the motor: thrust with its lag, drag torque, vibration, noise, zero and drift.
class LoadCell {
 public:
  LoadCell(const LoadCellParameters& parameters, Random& random) noexcept;
  void load(const AirLoad& air) noexcept;
  /// A weight pulls along one axis, 0..2, N, in the place of any before it; 0: none.
  void hang(std::size_t axis, double newtons) noexcept;
  /// One tick: the cell's reading at this speed (rad/s) and reaction torque (N m).
  void step(double speed, double reaction_torque, Random& random) noexcept;
  [[nodiscard]] const Wrench& reading() const noexcept { return reading_; }
  [[nodiscard]] double thrust() const noexcept { return thrust_; }     ///< N, true, after the lag
  [[nodiscard]] const Wrench& zero() const noexcept { return zero_; }  ///< offset and drift up to now

 private:
  void rotate(double speed) noexcept;
  [[nodiscard]] std::array<double, 3> weight() const noexcept;
  void drift(Random& random) noexcept;

  LoadCellParameters parameters_;
  AirLoad air_;
  Wrench zero_{};
  double slow_noise_ = 0;  ///< N, now
  std::size_t weight_axis_ = 2;
  double weight_ = 0, largest_weight_ = 0;  ///< N; the second by its magnitude, with its sign
  Wrench reading_{};
  double thrust_ = 0;
  double cosine_ = 1, sine_ = 0;  ///< of the rotor angle
  double blade_amplitude_ = 0;
  std::uint64_t ticks_ = 0;
};

struct PlantParameters {
  MotorParameters motor;
  LoadCellParameters load_cell;
  StandParameters stand;
  double air_density_kg_m3 = 1.225;  ///< thrust and drag are those of truth.hpp at 1.225 and proportional to it
};

class Plant {
 public:
  Plant(const PlantParameters& parameters, std::uint64_t seed);

  /// nullptr: the bare motor. The occlusion by its name, degrees, [0, 360).
  void mount(const PropellerTruth* propeller, double named_deg);
  /// Advances by 1/7000 s.
  void step(const PowerStage& stage) noexcept;
  /// See Motor::power.
  void power(BusSource source) { motor_.power(std::move(source)); }
  void upset(const MotorUpset& upset) noexcept { motor_.upset(upset); }
  /// See LoadCell::hang.
  void hang(std::size_t axis, double newtons) noexcept { load_cell_.hang(axis, newtons); }

  [[nodiscard]] const MotorState& motor() const noexcept { return motor_.state(); }
  [[nodiscard]] const Wrench& reading() const noexcept { return load_cell_.reading(); }
  [[nodiscard]] double thrust() const noexcept { return load_cell_.thrust(); }      ///< N, without noise and zero
  [[nodiscard]] const Wrench& zero() const noexcept { return load_cell_.zero(); }   ///< of the load cell, now
  [[nodiscard]] double torque_coefficient() const noexcept { return shaft_.drag; }  ///< N m/(rad/s)², as mounted

 private:
  double density_share_;  ///< of 1.225 kg/m³
  StandParameters stand_;
  Random random_;
  Random mountings_;
  Motor motor_;
  LoadCell load_cell_;
  AirLoad air_;
  ShaftLoad shaft_;
};

}  // namespace kphi::sim
