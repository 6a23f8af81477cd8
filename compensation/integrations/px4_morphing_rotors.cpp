#include "px4_morphing_rotors.hpp"

ActuatorEffectivenessMorphing::ActuatorEffectivenessMorphing(const kphi_compensator& compensator,
                                                             const kphi_masses& masses, int rotors, const int* spins,
                                                             float full_thrust, float drag_per_newton)
    : _compensator(compensator),
      _masses(masses),
      _rotors(rotors),
      _full_thrust(full_thrust),
      _drag_per_newton(drag_per_newton) {
  for (int i = 0; i < _rotors; ++i) _spins[i] = spins[i];
  kphi_scaling_factors(&_compensator, _in_matrix);
}

void ActuatorEffectivenessMorphing::armsMeasured(const float* angles, const float* rates, float age) {
  kphi_set_moving_arms(&_compensator, angles, rates, age);
  _moved = true;
}

bool ActuatorEffectivenessMorphing::getEffectivenessMatrix(Configuration& configuration,
                                                           EffectivenessUpdateReason external_update) {
  if (!_moved && external_update == EffectivenessUpdateReason::NO_EXTERNAL_UPDATE) return false;
  float hubs[KPHI_MAX_ROTORS][2], k[KPHI_MAX_ROTORS];
  kphi_hubs(&_compensator, &_masses, hubs);
  kphi_scaling_factors(&_compensator, k);
  EffectivenessMatrix& effectiveness = configuration.effectiveness_matrices[configuration.selected_matrix];
  const int first = configuration.num_actuators_matrix[configuration.selected_matrix];
  for (int i = 0; i < _rotors; ++i) {
    const float thrust = _full_thrust * k[i];  // the thrust axis is (0, 0, -1) in PX4's frame
    const float x = hubs[i][0], y = -hubs[i][1];
    effectiveness(ROLL, first + i) = -thrust * y;
    effectiveness(PITCH, first + i) = thrust * x;
    effectiveness(YAW, first + i) = -static_cast<float>(_spins[i]) * thrust * (_drag_per_newton / k[i]);
    effectiveness(THRUST_X, first + i) = 0.f;
    effectiveness(THRUST_Y, first + i) = 0.f;
    effectiveness(THRUST_Z, first + i) = -thrust;
    _in_matrix[i] = k[i];
  }
  configuration.actuatorsAdded(ActuatorType::MOTORS, _rotors);
  _moved = false;
  return true;
}

void ActuatorEffectivenessMorphing::updateSetpoint(const matrix::Vector<float, NUM_AXES>&, int,
                                                   ActuatorVector& actuator_sp, const ActuatorVector&,
                                                   const ActuatorVector& actuator_max) {
  float k[KPHI_MAX_ROTORS], thrusts[KPHI_MAX_ROTORS], speeds[KPHI_MAX_ROTORS];
  unsigned short flags[KPHI_MAX_ROTORS];
  kphi_scaling_factors(&_compensator, k);
  for (int i = 0; i < _rotors; ++i) {
    thrusts[i] = actuator_sp(i) * _full_thrust * _in_matrix[i];
    const float wanted = actuator_sp(i) * (_in_matrix[i] / k[i]);
    actuator_sp(i) = wanted < actuator_max(i) ? wanted : actuator_max(i);
  }
  kphi_speeds_for(&_compensator, thrusts, speeds, flags);  // for its flags
  _flags = 0;
  for (int i = 0; i < _rotors; ++i) _flags |= flags[i];
}
