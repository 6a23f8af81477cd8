// A stand-in of PX4's control allocator, written from what its sources do (src/modules/control_allocator, src/lib/
// control_allocation, 2026), for one matrix of motors:
// - The matrix is asked for when the module starts (CONFIGURATION_UPDATE), before any sensor was read, and at each
//   update of the parameters; before each allocation again (NO_EXTERNAL_UPDATE), but not within 100 ms of the last one
//   that was given.
// - The mix is the pseudo-inverse, made in float by Courrieu's formula (arXiv 0804.4809), whose errors grow with the
//   fourth power of the matrix's condition: rows of unlike size cost a shape without symmetry half of its thrust. Each
//   axis is divided by a scale, entries below 1e-3 are made 0. The scale is made when PX4 allocates next after a
//   configuration update, of the matrix that it has by then; a matrix that came in between with another reason takes
//   the update of the scale away. Until a first one it is 1.
// - The scale of roll and pitch is the root of their mean square over half as many motors as they move, that of yaw its
//   largest entry, that of the thrust its mean; roll, pitch and yaw are scaled only where getNormalizeRPY asks for it.
// - Sequential desaturation without airmode: thrust may fall to unsaturate roll and pitch, then these fall; then yaw
//   comes on top, may go 0.15 above the range, falls, and thrust makes room for it. Airmode 1: thrust may rise, too,
//   and roll and pitch stay. Airmode 2: yaw is in the sum from the beginning, thrust rises or falls for all, yaw falls
//   last. (From 2026-11 on MC_AIRMODE_LIM bounds by how much it may rise; 0 and 1 are airmode 0 and 1.)
// - After allocation updateSetpoint, then the slew rate (CA_Rn_SLEW, seconds from 0 to 1, of the time since the last
//   allocation, 0.2 to 20 ms), to which NaN is 0 until it is reached; then the outputs are cut to their range; of what
//   is not finite NaN is published, which stops the motor.
// Beside PX4's own classes, which were compiled for this comparison alone, with one mix for both: the same bits of
// 20,000 demands in airmode 0 and 1, within 1.3e-4 in airmode 2 (another order of the sum), within 3e-8 with a slew
// rate. With a mix of its own 305 of 20,000 outputs differ by more than 0.01, all in 9 of 200 random shapes, of a
// condition from 19 to 3,000: the float mix of either is as far from the exact one there as from the other.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "ActuatorEffectiveness.hpp"

namespace px4 {

using Outputs = Eigen::VectorXf;
using Demand = Eigen::Matrix<float, 6, 1>;  ///< torque x, y, z, thrust x, y, z; z down

struct Parameters {
  int airmode = 0;  ///< MC_AIRMODE: 0, 1 roll and pitch, 2 yaw, too
  float slew = 0;   ///< CA_Rn_SLEW [s]; 0: without
};

class ControlAllocator {
 public:
  static constexpr double kPause = 0.1;  // s

  explicit ControlAllocator(ActuatorEffectiveness& effectiveness, const Parameters& parameters = {})
      : effectiveness_(effectiveness), parameters_(parameters) {
    parameters_updated(0);
  }

  void parameters_updated(double now) {
    AllocationMethod methods[ActuatorEffectiveness::MAX_NUM_MATRICES];
    bool normalize[ActuatorEffectiveness::MAX_NUM_MATRICES];
    effectiveness_.getDesiredAllocationMethod(methods);
    effectiveness_.getNormalizeRPY(normalize);
    sequential_ = methods[0] == AllocationMethod::SEQUENTIAL_DESATURATION;
    normalize_ = normalize[0];
    ask(EffectivenessUpdateReason::CONFIGURATION_UPDATE, now);
  }
  void motor_failed(double now) { ask(EffectivenessUpdateReason::MOTOR_ACTIVATION_UPDATE, now); }

  /// A torque set-point comes in; what is published as actuator_motors.
  Outputs run(const Demand& demand, double now) {
    if (now - asked_at_ >= kPause) ask(EffectivenessUpdateReason::NO_EXTERNAL_UPDATE, now);
    if (mix_is_old_) make_mix();
    Outputs outputs = sequential_ ? desaturated(demand) : Outputs(mix_ * demand);
    hand_through(demand, outputs);
    slew(outputs, static_cast<float>(std::clamp(now - run_at_, 0.0002, 0.02)));
    run_at_ = now;
    for (float& output : outputs) {
      if (output < 0) output = 0;
      if (output > 1) output = 1;
      if (!std::isfinite(output)) output = std::numeric_limits<float>::quiet_NaN();
    }
    return before_ = outputs;
  }
  [[nodiscard]] const Demand& scale() const { return scale_; }

 private:
  void ask(EffectivenessUpdateReason reason, double now) {
    ActuatorEffectiveness::Configuration configuration{};
    if (!effectiveness_.getEffectivenessMatrix(configuration, reason)) return;
    asked_at_ = now;
    effectiveness_matrix_.resize(6, configuration.num_actuators_matrix[0]);
    for (int axis = 0; axis < 6; ++axis) {
      for (int i = 0; i < effectiveness_matrix_.cols(); ++i)
        effectiveness_matrix_(axis, i) = configuration.effectiveness_matrices[0](axis, i);
    }
    mix_is_old_ = true;
    scale_is_old_ = reason == EffectivenessUpdateReason::CONFIGURATION_UPDATE;
  }

  void make_mix() {
    mix_ = pseudo_inverse(effectiveness_matrix_);
    if (scale_is_old_) make_scale();
    for (int axis = 0; axis < 6; ++axis) {
      if (scale_[axis] > std::numeric_limits<float>::epsilon()) mix_.col(axis) /= scale_[axis];
    }
    mix_ = (mix_.array().abs() < 1e-3F).select(0, mix_);
    mix_is_old_ = scale_is_old_ = false;
  }

  /// G⁺ = Gᵀ L M M Lᵀ, M = (Lᵀ L)⁻¹, where L Lᵀ = G Gᵀ with as many columns as the rank.
  static Eigen::MatrixXf pseudo_inverse(const Eigen::MatrixXf& g) {
    const Eigen::MatrixXf square = g * g.transpose();
    const auto size = square.rows();
    const float tolerance =
        static_cast<float>(size) * std::numeric_limits<float>::epsilon() * square.diagonal().maxCoeff();
    Eigen::MatrixXf l = Eigen::MatrixXf::Zero(size, size);
    Eigen::Index rank = 0;
    for (Eigen::Index k = 0; k < size; ++k) {
      Eigen::VectorXf column = square.col(k).tail(size - k);
      for (Eigen::Index before = 0; before < rank; ++before) column -= l(k, before) * l.col(before).tail(size - k);
      if (!(column[0] > tolerance)) continue;
      l.col(rank).tail(size - k) = column / std::sqrt(column[0]);
      ++rank;
    }
    const Eigen::MatrixXf full = l.leftCols(rank), m = (full.transpose() * full).partialPivLu().inverse();
    return g.transpose() * (full * (m * m * full.transpose()));
  }

  void make_scale() {
    scale_.setOnes();
    for (int axis = 0; normalize_ && axis < 2; ++axis) {
      const auto moved = static_cast<float>((mix_.col(axis).array().abs() > 1e-3F).count());
      if (moved > 0) scale_[axis] = std::sqrt(mix_.col(axis).squaredNorm() / (moved / 2));
    }
    if (normalize_) scale_[2] = mix_.col(2).maxCoeff();
    for (int axis = 5; axis >= 3; --axis) {
      const auto size = mix_.col(axis).array().abs();
      const auto moved = static_cast<float>((size > std::numeric_limits<float>::epsilon()).count());
      scale_[axis] = moved > 0 ? size.sum() / moved : scale_[5];
    }
  }

  Outputs desaturated(const Demand& demand) const {
    Outputs outputs = mix_.leftCols(2) * demand.head(2) + mix_.rightCols(3) * demand.tail(3);
    if (parameters_.airmode == 2) {
      outputs += mix_.col(2) * demand[2];
      unsaturate(outputs, mix_.col(5), 1, false);
      unsaturate(outputs, mix_.col(2), 1, false);
      return outputs;
    }
    unsaturate(outputs, mix_.col(5), 1, parameters_.airmode == 0);
    for (int axis = 0; parameters_.airmode == 0 && axis < 2; ++axis) unsaturate(outputs, mix_.col(axis), 1, false);
    outputs += mix_.col(2) * demand[2];
    unsaturate(outputs, mix_.col(2), 1.15F, false);
    unsaturate(outputs, mix_.col(5), 1, true);
    return outputs;
  }

  /// How far along `way` the worst of both sides come into the range, together.
  static float way_back(const Outputs& outputs, const Outputs& way, float highest) {
    float least = 0, most = 0;
    for (int i = 0; i < outputs.size(); ++i) {
      if (std::fabs(way[i]) < 0.2F) continue;
      for (const float limit : {0.0F, highest}) {
        if (!(limit > 0 ? outputs[i] > limit : outputs[i] < limit)) continue;
        const float share = (limit - outputs[i]) / way[i];
        least = std::min(least, share);
        most = std::max(most, share);
      }
    }
    return least + most;
  }
  static void unsaturate(Outputs& outputs, const Outputs& way, float highest, bool forwards_only) {
    const float share = way_back(outputs, way, highest);
    if (forwards_only && share < 0) return;
    outputs += share * way;
    outputs += way_back(outputs, way, highest) / 2 * way;
  }

  void slew(Outputs& outputs, float dt) const {
    if (!(parameters_.slew > 0)) return;
    for (int i = 0; i < outputs.size(); ++i) {
      const bool stop = std::isnan(outputs[i]);
      const float before = i < before_.size() && !std::isnan(before_[i]) ? before_[i] : 0, most = dt / parameters_.slew;
      outputs[i] = before + std::clamp((stop ? 0 : outputs[i]) - before, -most, most);
      if (stop && std::fabs(outputs[i]) < std::numeric_limits<float>::epsilon())
        outputs[i] = std::numeric_limits<float>::quiet_NaN();
    }
  }

  void hand_through(const Demand& demand, Outputs& outputs) {
    matrix::Vector<float, 6> control;
    for (int axis = 0; axis < 6; ++axis) control(axis) = demand[axis];
    ActuatorEffectiveness::ActuatorVector set_point, lowest, highest;
    for (int i = 0; i < outputs.size(); ++i) {
      set_point(i) = outputs[i];
      highest(i) = 1;
    }
    effectiveness_.updateSetpoint(control, 0, set_point, lowest, highest);
    for (int i = 0; i < outputs.size(); ++i) outputs[i] = set_point(i);
  }

  ActuatorEffectiveness& effectiveness_;
  Parameters parameters_;
  Outputs before_;
  double run_at_ = 0;
  Eigen::MatrixXf effectiveness_matrix_, mix_;
  Demand scale_ = Demand::Ones();
  bool sequential_ = false, normalize_ = false, mix_is_old_ = false, scale_is_old_ = false;
  double asked_at_ = -kPause;
};

/// PX4's own multirotor: rotors that stay where they are.
class Multirotor : public ActuatorEffectiveness {
 public:
  struct Rotor {
    float x, y, ct, km;  ///< m, to the right; N; m, positive where it turns counter-clockwise
  };
  explicit Multirotor(std::vector<Rotor> rotors) : rotors_(std::move(rotors)) {}

  bool getEffectivenessMatrix(Configuration& configuration, EffectivenessUpdateReason reason) override {
    if (reason == EffectivenessUpdateReason::NO_EXTERNAL_UPDATE) return false;
    EffectivenessMatrix& matrix = configuration.effectiveness_matrices[configuration.selected_matrix];
    int at = configuration.num_actuators_matrix[configuration.selected_matrix];
    for (const Rotor& rotor : rotors_) {
      matrix(ROLL, at) = -rotor.ct * rotor.y;
      matrix(PITCH, at) = rotor.ct * rotor.x;
      matrix(YAW, at) = rotor.ct * rotor.km;
      matrix(THRUST_Z, at++) = -rotor.ct;
    }
    configuration.actuatorsAdded(ActuatorType::MOTORS, static_cast<int>(rotors_.size()));
    return true;
  }
  void getDesiredAllocationMethod(AllocationMethod methods[MAX_NUM_MATRICES]) const override {
    methods[0] = AllocationMethod::SEQUENTIAL_DESATURATION;
  }
  void getNormalizeRPY(bool normalize[MAX_NUM_MATRICES]) const override { normalize[0] = true; }
  const char* name() const override { return "Multirotor"; }

 private:
  std::vector<Rotor> rotors_;
};

}  // namespace px4
