// PX4: the rotors of a morphing multirotor, whose positions and coefficients follow the arms. C++14, float, no
// exceptions, no RTTI. Build the library with KPHI_COMPENSATION_FLOAT. px4.md says where each part goes.
#pragma once

#include "ActuatorEffectiveness.hpp"
#include "compensation/kphi_compensation.h"

/// PX4's parameters as the child wants them. Some 3 kB: not for the stack of a work queue.
struct MorphingVehicle {
  kphi_airframe airframe;
  kphi_masses masses;
  kphi_curve curves[KPHI_MAX_ROTORS];
  int spins[KPHI_MAX_ROTORS];        ///< +1 where the drag torque points up: a rotor that turns clockwise
  float full_thrust;                 ///< N, of an uncovered rotor at output 1: CA_ROTORn_CT
  float drag_per_newton;             ///< m: the magnitude of CA_ROTORn_KM
  float reference[KPHI_MAX_ROTORS];  ///< rad: arm angles of the shape that PX4's normalisation and gains are for
};

/// Reads a parameter of PX4; NaN: PX4 has none of that name.
using ParameterReader = float (*)(const char* name);
/// From CA_ROTOR_COUNT, CA_ROTORn_CT, CA_ROTORn_KM and the KPHI_… of px4_parameters.yaml. nullptr, or the name of the
/// parameter that is missing or makes no sense.
const char* read_morphing_vehicle(ParameterReader parameter, MorphingVehicle& vehicle);

class ActuatorEffectivenessMorphing : public ActuatorEffectiveness {
 public:
  /// Returns nullptr, or the reason why this vehicle cannot fly: PX4 then gets no matrix and drives no motor.
  /// Until arms are measured, they count as those of the reference shape.
  const char* build(const MorphingVehicle& vehicle);

  /// In the allocator's work queue, at the rate of the servos' feedback: [rad], [rad/s], and how old it is [s].
  void armsMeasured(const float* angles, const float* rates, float age);
  /// Sum of KPHI_… flags of all rotors at the last setpoint; not 0: look before flying on.
  unsigned flags() const { return _flags; }

  /// A configuration update gets the matrix of the reference shape, whatever the arms do: from it PX4 takes the scale
  /// of the axes, and keeps it. The matrix of the arms as they are follows once PX4 has taken it.
  bool getEffectivenessMatrix(Configuration& configuration, EffectivenessUpdateReason external_update) override;
  /// What k_i and the trend with the speed make of the outputs since the matrix was made. NaN, a stopped motor for
  /// PX4, stays NaN.
  void updateSetpoint(const matrix::Vector<float, NUM_AXES>& control_sp, int matrix_index, ActuatorVector& actuator_sp,
                      const ActuatorVector& actuator_min, const ActuatorVector& actuator_max) override;
  /// As PX4's own multirotor asks for it; without, gains of another vehicle would not do.
  void getDesiredAllocationMethod(AllocationMethod allocation_method_out[MAX_NUM_MATRICES]) const override;
  void getNormalizeRPY(bool normalize[MAX_NUM_MATRICES]) const override;
  const char* name() const override { return "Morphing multirotor"; }

 private:
  struct Shape {
    float hubs[KPHI_MAX_ROTORS][2];
    float k[KPHI_MAX_ROTORS];
    float drag_scale[KPHI_MAX_ROTORS];
  };
  Shape shapeOfArms() const;

  kphi_compensator _compensator;
  kphi_masses _masses;
  int _rotors{0};  ///< 0: not built
  int _spins[KPHI_MAX_ROTORS];
  float _full_thrust;
  float _lever;  ///< m
  float _fastest;
  Shape _reference;
  float _in_matrix[KPHI_MAX_ROTORS];  ///< k_i that the matrix was made with
  int _matrix{-1};                    ///< which of PX4's matrices, and the first motor's column in it
  int _first{0};
  bool _moved{false};       ///< the arms are not those of the matrix
  bool _scale_taken{true};  ///< PX4 has allocated with the matrix of the last configuration update
  unsigned _flags{0};
};
