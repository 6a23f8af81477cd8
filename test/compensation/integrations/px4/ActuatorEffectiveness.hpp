// Of PX4 (src/modules/control_allocator) what a child of ActuatorEffectiveness uses: the same names and signatures.
#pragma once

#include <cstdint>

#include "matrix/matrix/math.hpp"

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

  virtual bool getEffectivenessMatrix(Configuration&, EffectivenessUpdateReason) { return false; }
  virtual void updateSetpoint(const matrix::Vector<float, NUM_AXES>&, int, ActuatorVector&, const ActuatorVector&,
                              const ActuatorVector&) {}
  virtual const char* name() const = 0;
};
