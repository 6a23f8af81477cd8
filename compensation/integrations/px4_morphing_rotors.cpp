#include "px4_morphing_rotors.hpp"

const char* ActuatorEffectivenessMorphing::build(const MorphingVehicle& vehicle) {
  _rotors = 0;
  const int refusal = kphi_compensator_build(&_compensator, vehicle.curves, &vehicle.airframe, KPHI_LAW_CLAMPED);
  if (refusal != 0) return kphi_refusal_text(refusal);
  _masses = vehicle.masses;
  _full_thrust = vehicle.full_thrust;
  _lever = vehicle.airframe.arm_length;
  _fastest = vehicle.airframe.fastest_speed;
  for (int i = 0; i < KPHI_MAX_ROTORS; ++i) _spins[i] = vehicle.spins[i];
  _rotors = vehicle.airframe.rotors != 0 ? vehicle.airframe.rotors : 4;
  kphi_set_arms(&_compensator, vehicle.reference);
  _reference = shapeOfArms();
  // A mixer is built for what it refuses: rotors that cannot make every torque.
  kphi_mixer trial;
  if (kphi_mixer_build(&trial, _rotors, _reference.hubs, _spins, vehicle.drag_per_newton, 0) == 0) {
    _rotors = 0;
    return "the rotors of the reference shape cannot make every torque; check its angles, the spins and the masses";
  }
  return nullptr;
}

void ActuatorEffectivenessMorphing::getDesiredAllocationMethod(
    AllocationMethod allocation_method_out[MAX_NUM_MATRICES]) const {
  for (int i = 0; i < MAX_NUM_MATRICES; ++i) allocation_method_out[i] = AllocationMethod::SEQUENTIAL_DESATURATION;
}

void ActuatorEffectivenessMorphing::getNormalizeRPY(bool normalize[MAX_NUM_MATRICES]) const {
  for (int i = 0; i < MAX_NUM_MATRICES; ++i) normalize[i] = true;
}

void ActuatorEffectivenessMorphing::armsMeasured(const float* angles, const float* rates, float age) {
  if (_rotors == 0) return;
  kphi_set_moving_arms(&_compensator, angles, rates, age);
  _moved = true;
}

ActuatorEffectivenessMorphing::Shape ActuatorEffectivenessMorphing::shapeOfArms() const {
  Shape shape;
  kphi_hubs(&_compensator, &_masses, shape.hubs);
  kphi_scaling_factors(&_compensator, shape.k);
  kphi_drag_scale(&_compensator, shape.drag_scale);
  return shape;
}

bool ActuatorEffectivenessMorphing::getEffectivenessMatrix(Configuration& configuration,
                                                           EffectivenessUpdateReason external_update) {
  const int matrix_index = configuration.selected_matrix, first = configuration.num_actuators_matrix[matrix_index];
  if (_rotors == 0 || first + _rotors > NUM_ACTUATORS) return false;
  // PX4 forgets to take its scale if another matrix comes before it has allocated with this one.
  if (external_update == EffectivenessUpdateReason::NO_EXTERNAL_UPDATE && (!_moved || !_scale_taken)) return false;
  const bool configured = external_update == EffectivenessUpdateReason::CONFIGURATION_UPDATE;
  const Shape shape = configured ? _reference : shapeOfArms();
  EffectivenessMatrix& effectiveness = configuration.effectiveness_matrices[matrix_index];
  // Each row in a unit of its own, which makes it about 1: the thrust of an uncovered rotor, that thrust at the arm's
  // length, its drag torque. PX4's scale of the axes takes the units out again, but in newtons and newton metres its
  // pseudo-inverse, in float, would lose up to half of the thrust of a shape without symmetry.
  for (int i = 0; i < _rotors; ++i) {
    const float thrust = shape.k[i];  // along (0, 0, -1) in PX4's frame
    const float x = shape.hubs[i][0] / _lever, y = -shape.hubs[i][1] / _lever;
    effectiveness(ROLL, first + i) = -thrust * y;
    effectiveness(PITCH, first + i) = thrust * x;
    effectiveness(YAW, first + i) = -static_cast<float>(_spins[i]) * thrust * shape.drag_scale[i];
    effectiveness(THRUST_X, first + i) = 0.f;
    effectiveness(THRUST_Y, first + i) = 0.f;
    effectiveness(THRUST_Z, first + i) = -thrust;
    _in_matrix[i] = shape.k[i];
  }
  configuration.actuatorsAdded(ActuatorType::MOTORS, _rotors);
  _matrix = matrix_index;
  _first = first;
  _moved = configured;
  _scale_taken = !configured;
  return true;
}

void ActuatorEffectivenessMorphing::updateSetpoint(const matrix::Vector<float, NUM_AXES>&, int matrix_index,
                                                   ActuatorVector& actuator_sp, const ActuatorVector&,
                                                   const ActuatorVector&) {
  if (matrix_index != _matrix) return;
  _scale_taken = true;
  float thrusts[KPHI_MAX_ROTORS], speeds[KPHI_MAX_ROTORS];
  unsigned short flags[KPHI_MAX_ROTORS];
  for (int i = 0; i < _rotors; ++i) thrusts[i] = actuator_sp(_first + i) * _full_thrust * _in_matrix[i];
  kphi_speeds_for(&_compensator, thrusts, speeds, flags);
  _flags = 0;
  for (int i = 0; i < _rotors; ++i) {
    const float share = speeds[i] / _fastest;
    if (thrusts[i] > 0.f) actuator_sp(_first + i) = share * share;  // NaN and less than nothing are PX4's to clip
    _flags |= flags[i];
  }
}
