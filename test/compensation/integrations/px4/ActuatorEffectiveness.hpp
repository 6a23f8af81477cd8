// Of PX4 (src/lib/control_allocation, src/modules/control_allocator) what a child of ActuatorEffectiveness meets: the
// same names and signatures.
#pragma once

#include <cstdint>

#include "matrix/matrix/math.hpp"

enum class AllocationMethod { NONE = -1, PSEUDO_INVERSE = 0, SEQUENTIAL_DESATURATION = 1, AUTO = 2 };
enum class ActuatorType { MOTORS = 0, SERVOS, COUNT };
enum class EffectivenessUpdateReason { NO_EXTERNAL_UPDATE = 0, CONFIGURATION_UPDATE = 1, MOTOR_ACTIVATION_UPDATE = 2 };

class ActuatorEffectiveness {
 public:
  virtual ~ActuatorEffectiveness() = default;

  static constexpr int NUM_ACTUATORS = 16;
  static constexpr int NUM_AXES = 6;
  static constexpr int MAX_NUM_MATRICES = 2;
  enum ControlAxis { ROLL = 0, PITCH, YAW, THRUST_X, THRUST_Y, THRUST_Z };

  using EffectivenessMatrix = matrix::Matrix<float, NUM_AXES, NUM_ACTUATORS>;
  using ActuatorVector = matrix::Vector<float, NUM_ACTUATORS>;

  struct Configuration {
    void actuatorsAdded(ActuatorType type, int count) {
      num_actuators_matrix[selected_matrix] += count;
      num_actuators[static_cast<int>(type)] += count;
    }
    EffectivenessMatrix effectiveness_matrices[MAX_NUM_MATRICES];
    int num_actuators_matrix[MAX_NUM_MATRICES]{};
    int selected_matrix{0};
    int num_actuators[static_cast<int>(ActuatorType::COUNT)]{};
  };

  virtual void getDesiredAllocationMethod(AllocationMethod allocation_method_out[MAX_NUM_MATRICES]) const {
    for (int i = 0; i < MAX_NUM_MATRICES; ++i) allocation_method_out[i] = AllocationMethod::PSEUDO_INVERSE;
  }
  virtual void getNormalizeRPY(bool normalize[MAX_NUM_MATRICES]) const {
    for (int i = 0; i < MAX_NUM_MATRICES; ++i) normalize[i] = false;
  }
  virtual bool getEffectivenessMatrix(Configuration&, EffectivenessUpdateReason) { return false; }
  virtual void updateSetpoint(const matrix::Vector<float, NUM_AXES>&, int, ActuatorVector&, const ActuatorVector&,
                              const ActuatorVector&) {}
  virtual const char* name() const = 0;
};
