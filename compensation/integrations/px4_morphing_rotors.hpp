// PX4: the rotors of a morphing multirotor, whose positions and coefficients follow the arms. C++14, float, no
// exceptions, no RTTI. Build the library with KPHI_COMPENSATION_FLOAT.
#pragma once

#include "ActuatorEffectiveness.hpp"
#include "compensation/kphi_compensation.h"

class ActuatorEffectivenessMorphing : public ActuatorEffectiveness {
 public:
  /// `compensator` was built by kphi_compensator_build for `rotors` rotors (3 to 8). `spins`: +1 where the drag torque
  /// points up. `full_thrust` [N]: of an uncovered rotor at output 1. `drag_per_newton` [N m/N]: KM. They are copied.
  ActuatorEffectivenessMorphing(const kphi_compensator& compensator, const kphi_masses& masses, int rotors,
                                const int* spins, float full_thrust, float drag_per_newton);

  /// At the rate of the servos' feedback: [rad], [rad/s], and how old it is [s].
  void armsMeasured(const float* angles, const float* rates, float age);
  /// Sum of KPHI_… flags of all rotors at the last setpoint; not 0: look before flying on.
  unsigned flags() const { return _flags; }

  bool getEffectivenessMatrix(Configuration& configuration, EffectivenessUpdateReason external_update) override;
  void updateSetpoint(const matrix::Vector<float, NUM_AXES>& control_sp, int matrix_index, ActuatorVector& actuator_sp,
                      const ActuatorVector& actuator_min, const ActuatorVector& actuator_max) override;
  const char* name() const override { return "Morphing multirotor"; }

 private:
  kphi_compensator _compensator;
  kphi_masses _masses;
  int _rotors;
  int _spins[KPHI_MAX_ROTORS];
  float _full_thrust;
  float _drag_per_newton;
  float _in_matrix[KPHI_MAX_ROTORS];  ///< k_i that the matrix was made with
  bool _moved{true};                  ///< since then
  unsigned _flags{0};
};
