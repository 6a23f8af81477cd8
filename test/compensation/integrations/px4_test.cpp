// The child of PX4's ActuatorEffectiveness under a stand-in of PX4's allocator, beside PX4's own multirotor in X.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <random>
#include <string>

#include "compensation/integrations/px4_morphing_rotors.hpp"
#include "control_allocator.hpp"
#include "test/compensation/integrations/shipped_drone.hpp"

namespace px4_test {

using px4::Demand;
using px4::Outputs;

using namespace shipped_drone;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

MorphingVehicle vehicle() {
  auto made = with_shipped_drone<MorphingVehicle>();
  made.full_thrust = kFull;
  made.drag_per_newton = kDrag;
  for (int i = 0; i < 4; ++i) made.reference[i] = kX[i];
  return made;
}

/// In PX4's frame; thrust upwards.
Demand demand_of(float thrust, float roll, float pitch, float yaw) {
  Demand demand = Demand::Zero();
  demand << roll, pitch, yaw, 0, 0, -thrust;
  return demand;
}

/// The child, and what its rotors really do.
class Px4 : public testing::Test {
 protected:
  /// Thrust up, torques about x forward, y left, z up: T_i = output_i K_T k_i ω_max², drag torque κ of the uncovered
  /// thrust. An output is the square of a speed there (THR_MDL_FAC 1).
  Eigen::Vector4f wrench_of(const Outputs& outputs, const float* arms, int first = 0) {
    kphi_compensator truth;
    EXPECT_EQ(kphi_compensator_build(&truth, of.curves, &of.airframe, KPHI_LAW_CLAMPED), 0);
    kphi_set_arms(&truth, arms);
    float hubs[4][2], k[4];
    kphi_hubs(&truth, &of.masses, hubs);
    kphi_scaling_factors(&truth, k);
    Eigen::Vector4f wrench = Eigen::Vector4f::Zero();
    for (int i = 0; i < 4; ++i) {
      const float uncovered = outputs[first + i] * kFull, thrust = uncovered * k[i];
      wrench += Eigen::Vector4f(thrust, thrust * hubs[i][1], -thrust * hubs[i][0],
                                static_cast<float>(of.spins[i]) * kDrag * uncovered);
    }
    return wrench;
  }
  /// What PX4's own multirotor makes of this demand, in X: what its pilot and its gains are used to.
  Outputs own_outputs(const Demand& demand, const px4::Parameters& parameters = {}) {
    px4::ControlAllocator allocator(multirotor, parameters);
    return allocator.run(demand, 0.01);
  }
  Eigen::Vector4f own_wrench(const Demand& demand, const px4::Parameters& parameters = {}) {
    return wrench_of(own_outputs(demand, parameters), kX);
  }

  void arms(const float* angles) { child.armsMeasured(angles, kStill, 0); }
  /// Arms measured and in PX4's matrix.
  void fly(px4::ControlAllocator& allocator, const float* angles) {
    arms(angles);
    for (int i = 0; i < 3; ++i) allocator.run(demand_of(0.4F, 0, 0, 0), now += 0.2);
  }
  static void expect_near(const Eigen::VectorXf& got, const Eigen::VectorXf& wanted, float within = 2e-5F) {
    EXPECT_LT((got - wanted).cwiseAbs().maxCoeff(), within) << got.transpose() << " instead of " << wanted.transpose();
  }

  void SetUp() override { ASSERT_EQ(child.build(of), nullptr); }

  MorphingVehicle of = vehicle();
  ActuatorEffectivenessMorphing child;
  px4::Multirotor multirotor{{{0.1277F, -0.1277F, kFull, -kDrag},
                              {-0.1277F, -0.1277F, kFull, kDrag},
                              {-0.1277F, 0.1277F, kFull, -kDrag},
                              {0.1277F, 0.1277F, kFull, kDrag}}};
  double now = 0;
};

const Demand kDemands[] = {demand_of(0.3F, 0, 0, 0), demand_of(0.4F, 0.05F, -0.04F, 0.1F), demand_of(0.2F, 0, 0, 0.15F),
                           demand_of(0.5F, -0.1F, 0.1F, -0.05F)};

TEST_F(Px4, FliesAsTheStacksOwnMultirotorInX) {
  px4::ControlAllocator allocator(child);
  fly(allocator, kX);
  for (const Demand& demand : kDemands) expect_near(allocator.run(demand, now), own_outputs(demand));
}

TEST_F(Px4, BootsBeforeAnArmWasMeasuredWithTheReferenceShape) {
  px4::ControlAllocator allocator(child);
  for (const Demand& demand : kDemands) expect_near(allocator.run(demand, now += 0.004), own_outputs(demand));
  expect_near(allocator.run(demand_of(0, 0, 0, 0), now), Outputs::Zero(4));
}

TEST_F(Px4, StopsTheMotorsOfASetPointThatIsNotANumber) {
  px4::ControlAllocator allocator(child);
  for (const float* shape : {kX, kO}) {
    fly(allocator, shape);
    for (const Demand& demand : {demand_of(kNaN, 0, 0, 0), demand_of(0.3F, kNaN, 0, 0), demand_of(0.3F, 0, 0, kNaN)}) {
      for (const float output : allocator.run(demand, now += 0.004)) EXPECT_TRUE(std::isnan(output)) << output;
      EXPECT_NE(child.flags() & static_cast<unsigned>(KPHI_THRUST_NAN), 0u);
      for (const float output : own_outputs(demand)) EXPECT_TRUE(std::isnan(output)) << "as the stack's own";
    }
    expect_near(wrench_of(allocator.run(kDemands[1], now += 0.004), shape), own_wrench(kDemands[1]));
  }
}

TEST_F(Px4, GivesTheSameWrenchInEveryShape) {
  px4::ControlAllocator allocator(child);
  const float between[4] = {2.8F, 2.9F, 2.7F, 2.6F};
  for (const float* shape : {kO, between, kX, kO}) {
    fly(allocator, shape);
    for (const Demand& demand : kDemands) {
      expect_near(wrench_of(allocator.run(demand, now), shape), own_wrench(demand));
      EXPECT_EQ(child.flags() & ~static_cast<unsigned>(KPHI_AT_CEILING), 0u);
    }
  }
}

TEST_F(Px4, KeepsItsWrenchWhenAParameterChangesInO) {
  px4::ControlAllocator allocator(child);
  const Demand demand = demand_of(0.4F, 0.02F, -0.02F, 0.05F);
  fly(allocator, kO);
  const Demand scale = allocator.scale();
  expect_near(wrench_of(allocator.run(demand, now), kO), own_wrench(demand));
  for (const double until_next : {0.004, 0.25}) {  // the second: PX4 asks for the true matrix before it has allocated
    allocator.parameters_updated(now += 0.3);
    const Eigen::Vector4f meanwhile = wrench_of(allocator.run(demand, now += until_next), kO);
    EXPECT_NEAR(meanwhile[0], own_wrench(demand)[0], 0.01F) << "the matrix is that of X, but every thrust is right";
    allocator.run(demand, now += 0.11);
    expect_near(wrench_of(allocator.run(demand, now += 0.004), kO), own_wrench(demand));
    EXPECT_EQ(allocator.scale(), scale);
  }
  fly(allocator, kX);
  expect_near(allocator.run(demand, now), own_outputs(demand));
}

TEST_F(Px4, KeepsItsThrustsBetweenTwoMatrices) {
  px4::ControlAllocator allocator(child);
  const float nearly_o[4] = {kPi - 0.1F, kPi - 0.1F, kPi - 0.35F, kPi - 0.1F};
  fly(allocator, nearly_o);
  arms(kO);
  EXPECT_NEAR(wrench_of(allocator.run(demand_of(0.25F, 0, 0, 0), now += 0.004), kO)[0],
              own_wrench(demand_of(0.25F, 0, 0, 0))[0], 1e-4);
}

TEST_F(Px4, SaturatesInEachAirmodeAndAtASlewRateAsTheStacksOwnMultirotorInX) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> axis(-1, 1), up(0, 1.2F);
  for (const px4::Parameters& parameters : {px4::Parameters{0, 0}, {1, 0}, {2, 0}, {0, 0.05F}, {1, 0.05F}}) {
    px4::ControlAllocator allocator(child, parameters), beside(multirotor, parameters);
    arms(kX);
    for (int i = 0; i < 3; ++i) {
      allocator.run(kDemands[0], now += 0.2);
      beside.run(kDemands[0], now);
    }
    for (int i = 0; i < 1000; ++i) {
      const Demand demand = demand_of(up(random), axis(random), axis(random), axis(random));
      now += 0.004;
      expect_near(allocator.run(demand, now), beside.run(demand, now), 1e-4F);
    }
  }
}

TEST_F(Px4, KeepsRollAndPitchInOWhereAirmodeLetsThrustRise) {
  const Demand demand = demand_of(0.02F, 0.06F, -0.05F, 0);
  for (const int airmode : {0, 1, 2}) {
    px4::ControlAllocator allocator(child, {airmode, 0});
    fly(allocator, kO);
    const Eigen::Vector4f got = wrench_of(allocator.run(demand, now), kO), wanted = own_wrench(demand, {1, 0});
    if (airmode == 0) {
      EXPECT_LT(got[1], 0.9F * wanted[1]) << "without airmode roll is given up";
      continue;
    }
    EXPECT_NEAR(got[1], wanted[1], 2e-4F);
    EXPECT_NEAR(got[2], wanted[2], 2e-4F);
    EXPECT_GT(got[0], own_wrench(demand_of(0.02F, 0, 0, 0))[0]);
  }
}

TEST_F(Px4, ObeysASlewRateWhileItsArmsMoveAndStopsAtTheEndOfIt) {
  const float slew = 0.05F, step = 0.004F;
  px4::ControlAllocator allocator(child, {0, slew});
  fly(allocator, kX);
  Outputs before = allocator.run(kDemands[1], now += step);
  for (int i = 0; i < 200; ++i) {
    const float share = static_cast<float>(i) / 200, moving[4] = {kX[0] + share * (kO[0] - kX[0]), kX[1], kO[2], kO[3]};
    arms(moving);
    const Outputs outputs = allocator.run(i % 20 < 10 ? kDemands[3] : kDemands[1], now += step);
    EXPECT_LE((outputs - before).cwiseAbs().maxCoeff(), step / slew + 1e-6F);
    before = outputs;
  }
  int steps = 0;
  while (!allocator.run(demand_of(kNaN, 0, 0, 0), now += step).array().isNaN().all() && steps < 100) ++steps;
  EXPECT_GT(steps, 2) << "they sink first";
  EXPECT_LT(steps, 13);
  EXPECT_LE(allocator.run(kDemands[1], now += step).maxCoeff(), step / slew + 1e-6F) << "and rise from nothing";
}

TEST_F(Px4, SaturatedInOGivesThrustUpBeforeRollAndPitch) {
  px4::ControlAllocator allocator(child);
  fly(allocator, kO);
  const Demand demand = demand_of(1, 0.02F, 0.02F, 0);
  const Outputs outputs = allocator.run(demand, now);
  EXPECT_LE(outputs.maxCoeff(), 1);
  EXPECT_GE(outputs.minCoeff(), 0);
  const Eigen::Vector4f got = wrench_of(outputs, kO), own = own_wrench(demand);
  EXPECT_LT(got[0], own[0] - 1) << "a covered rotor cannot give what an uncovered one gives";
  EXPECT_NEAR(got[1], own[1], 2e-4F);
  EXPECT_NEAR(got[2], own[2], 2e-4F);
}

TEST_F(Px4, HasNothingNewWhereNoArmMoved) {
  px4::ControlAllocator allocator(child);
  fly(allocator, kO);
  ActuatorEffectiveness::Configuration fresh;
  EXPECT_FALSE(child.getEffectivenessMatrix(fresh, EffectivenessUpdateReason::NO_EXTERNAL_UPDATE));
  arms(kX);
  EXPECT_TRUE(child.getEffectivenessMatrix(fresh, EffectivenessUpdateReason::NO_EXTERNAL_UPDATE));
  EXPECT_EQ(fresh.num_actuators[0], 4);
}

TEST_F(Px4, TellsTheFlagsOfItsArms) {
  px4::ControlAllocator allocator(child);
  const float degrees[4] = {45, 45, 45, 45};
  fly(allocator, kO);
  arms(degrees);
  expect_near(wrench_of(allocator.run(kDemands[0], now), kO), own_wrench(kDemands[0]));
  EXPECT_EQ(child.flags(), static_cast<unsigned>(KPHI_ARM_ANGLE_BEYOND));
}

/// Two motors that push come first, then the child's.
class WithPushers : public ActuatorEffectiveness {
 public:
  explicit WithPushers(ActuatorEffectivenessMorphing& child) : child_(child) {}
  bool getEffectivenessMatrix(Configuration& configuration, EffectivenessUpdateReason reason) override {
    for (int i = 0; i < 2; ++i) configuration.effectiveness_matrices[0](THRUST_X, i) = 1;
    configuration.actuatorsAdded(ActuatorType::MOTORS, 2);
    return child_.getEffectivenessMatrix(configuration, reason);
  }
  void updateSetpoint(const matrix::Vector<float, NUM_AXES>& control, int index, ActuatorVector& set_point,
                      const ActuatorVector& lowest, const ActuatorVector& highest) override {
    child_.updateSetpoint(control, index, set_point, lowest, highest);
  }
  void getDesiredAllocationMethod(AllocationMethod methods[MAX_NUM_MATRICES]) const override {
    child_.getDesiredAllocationMethod(methods);
  }
  void getNormalizeRPY(bool normalize[MAX_NUM_MATRICES]) const override { child_.getNormalizeRPY(normalize); }
  const char* name() const override { return "with pushers"; }

 private:
  ActuatorEffectivenessMorphing& child_;
};

TEST_F(Px4, LeavesTheMotorsBeforeItsOwnAlone) {
  WithPushers pushed(child);
  px4::ControlAllocator allocator(pushed);
  arms(kO);
  for (int i = 0; i < 3; ++i) allocator.run(kDemands[0], now += 0.2);
  Demand demand = kDemands[1];
  demand[3] = 0.7F;
  const Outputs outputs = allocator.run(demand, now);
  ASSERT_EQ(outputs.size(), 6);
  EXPECT_NEAR(outputs[0], 0.7F, 1e-5);
  EXPECT_NEAR(outputs[1], 0.7F, 1e-5);
  expect_near(wrench_of(outputs, kO, 2), own_wrench(kDemands[1]));

  const float less_folded[4] = {kPi - 0.2F, kPi - 0.2F, kPi - 0.4F, kPi - 0.2F};
  arms(less_folded);  // and PX4 does not ask for a matrix yet: each thrust is corrected, and only those
  const Outputs meanwhile = allocator.run(demand, now += 0.004);
  EXPECT_EQ(meanwhile[0], outputs[0]);
  EXPECT_EQ(meanwhile[1], outputs[1]);
  EXPECT_NEAR(wrench_of(meanwhile, less_folded, 2)[0], own_wrench(kDemands[1])[0], 1e-4);
}

TEST_F(Px4, RefusesAVehicleThatCannotFlyAndGivesNoMatrix) {
  of.airframe.arm_length = 0.05F;
  EXPECT_NE(std::string(child.build(of)).find("arm"), std::string::npos);
  of = vehicle();
  of.spins[1] = 1;
  of.spins[2] = -1;
  EXPECT_NE(std::string(child.build(of)).find("spins"), std::string::npos);
  ActuatorEffectiveness::Configuration fresh;
  EXPECT_FALSE(child.getEffectivenessMatrix(fresh, EffectivenessUpdateReason::CONFIGURATION_UPDATE));
}

/// As PX4 holds them after `kphi export --to px4 --vehicle` (test/fit/export/flown_test.cpp flies that).
std::map<std::string, float> parameters;

void set_parameters() {
  parameters = {{"CA_ROTOR_COUNT", 4},    {"KPHI_HALF_SIDE", 0.045F}, {"KPHI_ARM", 0.117F},
                {"KPHI_PROP_R", 0.0635F}, {"KPHI_ARM_MIN", -90},      {"KPHI_ARM_MAX", 180},
                {"KPHI_ARM_STALE", 2},    {"KPHI_M_BODY", 0.42F},     {"KPHI_M_X", 0},
                {"KPHI_M_Y", 0},          {"KPHI_M_HUB", 0.045F},     {"KPHI_C_N", 0},
                {"KPHI_W_MAX", kFastest}, {"KPHI_PHI_MAX", 270},      {"KPHI_OVERLAP", 0},
                {"KPHI_LINE_K", 1.03F},   {"KPHI_LINE_S", -0.0029F},  {"KPHI_K_N", 0},
                {"KPHI_TQ_N", 0},         {"KPHI_TREND", 0},          {"KPHI_TREND_W", 0}};
  for (int i = 0; i < 4; ++i) {
    const std::string number = std::to_string(i);
    parameters["CA_ROTOR" + number + "_CT"] = kFull;
    parameters["CA_ROTOR" + number + "_KM"] = i % 2 == 0 ? -kDrag : kDrag;
    parameters["KPHI_REF" + number] = 45;
    parameters["KPHI_H" + number + "_TURN"] = 90.0F * static_cast<float>(i);
    parameters["KPHI_H" + number + "_MIRR"] = 0;
  }
}
float parameter(const char* name) {
  const auto found = parameters.find(name);
  return found == parameters.end() ? kNaN : found->second;
}
std::string refusal() {
  static MorphingVehicle made;
  const char* refused = read_morphing_vehicle(parameter, made);
  if (refused != nullptr) return refused;
  ActuatorEffectivenessMorphing child;
  const char* why = child.build(made);
  return why != nullptr ? why : "";
}

TEST(Px4Parameters, AreNamedWhereOneIsMissingOrMakesNoSense) {
  set_parameters();
  EXPECT_EQ(refusal(), "");
  const auto all = parameters;
  for (const auto& [name, value] : all) {
    parameters.erase(name);
    EXPECT_EQ(refusal(), name) << "missing";
    parameters = all;
  }
  for (const auto& [name, value] : {std::pair<const char*, float>{"KPHI_C_N", 13},
                                    {"KPHI_K_N", -1},
                                    {"KPHI_OVERLAP", 3},
                                    {"CA_ROTOR_COUNT", 9},
                                    {"CA_ROTOR2_KM", 0},
                                    {"CA_ROTOR1_CT", 2 * kFull},
                                    {"KPHI_ARM", 0},
                                    {"KPHI_M_BODY", kNaN}}) {
    parameters = all;
    parameters[name] = value;
    EXPECT_EQ(refusal(), name) << value;
  }
  parameters = all;
  parameters["KPHI_PROP_R"] = 0.2F;
  EXPECT_NE(refusal().find("arm"), std::string::npos);
  parameters = all;
  parameters["KPHI_LINE_K"] = -1;
  EXPECT_NE(refusal(), "");
}

}  // namespace px4_test
