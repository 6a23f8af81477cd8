// The whole physics of the simulated bench: motor, propeller, occlusion, load cell. Seeded; one thread; no clock.
#pragma once

#include <cstdint>
#include <utility>

#include "base/random.hpp"
#include "drivers/sim/physics/load_cell.hpp"
#include "drivers/sim/physics/motor.hpp"
#include "drivers/sim/physics/truth.hpp"

namespace kphi::sim {

struct PlantParameters {
  MotorParameters motor;
  LoadCellParameters load_cell;
  double air_density_kg_m3 = 1.225;  ///< thrust and drag are those of truth.hpp at 1.225 and proportional to it
};

class Plant {
 public:
  Plant(const PlantParameters& parameters, std::uint64_t seed) noexcept;

  /// nullptr: the bare motor. Occlusion in degrees, [0, 360).
  void mount(const PropellerTruth* propeller, double occlusion_deg) noexcept;
  /// Advances by 1/7000 s.
  void step(const PowerStage& stage) noexcept;
  /// See Motor::power.
  void power(BusSource source) { motor_.power(std::move(source)); }
  void upset(const MotorUpset& upset) noexcept { motor_.upset(upset); }

  [[nodiscard]] const MotorState& motor() const noexcept { return motor_.state(); }
  [[nodiscard]] const MotorEnergy& energy() const noexcept { return motor_.energy(); }
  [[nodiscard]] const MotorParameters& motor_parameters() const noexcept { return motor_.parameters(); }
  [[nodiscard]] const Wrench& reading() const noexcept { return load_cell_.reading(); }
  [[nodiscard]] double thrust() const noexcept { return load_cell_.thrust(); }      ///< N, without noise and zero
  [[nodiscard]] const Wrench& zero() const noexcept { return load_cell_.zero(); }   ///< of the load cell, now
  [[nodiscard]] double thrust_coefficient() const noexcept { return air_.thrust; }  ///< N/(rad/s)², as mounted
  [[nodiscard]] double torque_coefficient() const noexcept { return shaft_.drag; }  ///< N m/(rad/s)², as mounted

 private:
  double density_share_;  ///< of 1.225 kg/m³
  Random random_;
  Motor motor_;
  LoadCell load_cell_;
  AirLoad air_;
  ShaftLoad shaft_;
};

}  // namespace kphi::sim
