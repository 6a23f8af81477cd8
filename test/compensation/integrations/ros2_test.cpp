// The ROS 2 node: arms by the names of their joints, thrusts or a wrench in, speeds and flags out. What `kphi export`
// writes for it flies in test/fit/export/flown_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <geometry_msgs/msg/wrench.hpp>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/joint_state.hpp>
#include <std_msgs/msg/float64_multi_array.hpp>

#include "test/compensation/example_vehicle.hpp"

int node_main(int count, char** arguments);

namespace kphi::compensation::ros2_test {

using std_msgs::msg::Float64MultiArray;
using Numbers = std::vector<double>;

void set_parameters() {
  const Airframe airframe = example_airframe();
  const ThrustCurve line = paper_line();
  rclcpp::warnings.clear();
  rclcpp::parameters = {{"kphi.thrust_coefficient_n_s2_per_rad2", line.thrust_coefficient().value()},
                        {"kphi.line_intercept_n_s2_per_rad2", line_of(line).intercept.value()},
                        {"kphi.line_slope_n_s2_per_rad3", line_of(line).slope_per_rad},
                        {"kphi.phi_max_rad", line.largest_fitted().value()},
                        {"kphi.overlap", std::string("rim_arc")},
                        {"vehicle.joints", std::vector<std::string>{"a", "b", "c", "d"}},
                        {"vehicle.hinge_turn_rad", Numbers{0, kPi / 2, kPi, 3 * kPi / 2}},
                        {"vehicle.half_side_m", airframe.half_side.value()},
                        {"vehicle.arm_length_m", airframe.arm_length.value()},
                        {"vehicle.propeller_radius_m", airframe.propeller_radius.value()},
                        {"vehicle.speed_max_rad_s", airframe.fastest_speed.value()},
                        {"vehicle.body_mass_kg", 0.42},
                        {"vehicle.body_at_m", Numbers{0, 0}},
                        {"vehicle.hub_mass_kg", Numbers(4, 0.045)},
                        {"vehicle.rotor_spins", std::vector<std::int64_t>{1, -1, 1, -1}},
                        {"vehicle.drag_per_newton_m", 0.0133}};
}

void tell(const std::vector<std::string>& names, const Numbers& angles, const Numbers& rates = {}, double stamp = 12) {
  sensor_msgs::msg::JointState arms;
  arms.name = names;
  arms.position = angles;
  arms.velocity = rates;
  arms.header.stamp = rclcpp::Time(stamp);
  rclcpp::subscriptions.at("arms")(arms);
}
Numbers published(const char* topic) { return std::any_cast<Float64MultiArray>(rclcpp::published.at(topic)).data; }
void ask(const Numbers& thrusts) { rclcpp::subscriptions.at("rotor_thrusts")(Float64MultiArray{thrusts}); }
Numbers values_of(const Rotors<RadPerSec>& speeds) {
  Numbers values;
  for (const RadPerSec speed : speeds) values.push_back(speed.value());
  return values;
}
Numbers angles_of(const std::array<Radians, 4>& arms) {
  return {arms[0].value(), arms[1].value(), arms[2].value(), arms[3].value()};
}
constexpr double kStale = static_cast<double>(Flag::arm_angle_stale);
constexpr double kUnknown = static_cast<double>(Flag::arm_angle_unknown);

TEST(Ros2Node, TurnsThrustsIntoTheSpeedsOfTheLibrary) {
  set_parameters();
  rclcpp::on_spin = [] {
    rclcpp::clock_s = 12.02;
    tell({"a", "b", "c", "d"}, angles_of(shape_o()), {0, 0, 9, 0});
    ask({1, 1.5, 2, -1});
    EXPECT_EQ(published("rotor_speeds"), values_of(with_arms(shape_o()).speeds_for(thrusts_of(1, 1.5, 2, -1)).speeds));
    EXPECT_EQ(published("rotor_flags"), (Numbers{0, 0, kStale, static_cast<double>(Flag::thrust_negative)}));
  };
  EXPECT_EQ(node_main(0, nullptr), 0);
}

TEST(Ros2Node, TakesJointsByTheirNamesInAnyOrderAndInParts) {
  set_parameters();
  rclcpp::on_spin = [] {
    const Numbers o = angles_of(shape_o());
    rclcpp::clock_s = 12.02;
    tell({"wheel", "d", "b"}, {99, o[3], o[1]});
    ask({1, 1, 1, 1});
    EXPECT_EQ(published("rotor_flags"), (Numbers{kUnknown, 0, kUnknown, 0})) << "a and c were never told";
    tell({"c", "a"}, {o[2], o[0]}, {9, 0}, 12.015);
    ask({1, 1.5, 2, 1});
    EXPECT_EQ(published("rotor_speeds"), values_of(with_arms(shape_o()).speeds_for(thrusts_of(1, 1.5, 2, 1)).speeds));
    EXPECT_EQ(published("rotor_flags"), (Numbers{0, 0, kStale, 0}));
    tell({}, {1, 1, 1, 1});  // whose angles these are nobody says
    ask({1, 1.5, 2, 1});
    EXPECT_EQ(published("rotor_speeds"), values_of(with_arms(shape_o()).speeds_for(thrusts_of(1, 1.5, 2, 1)).speeds));
  };
  EXPECT_EQ(node_main(0, nullptr), 0);
}

TEST(Ros2Node, ToldNothingMoreOfAMovingArmSaysThatItsAngleIsStale) {
  set_parameters();
  rclcpp::on_spin = [] {
    rclcpp::clock_s = 12;
    tell({"a", "b", "c", "d"}, angles_of(shape_o()), {0.5, 0, 0, 0});
    ask({1, 1, 1, 1});
    EXPECT_EQ(published("rotor_flags"), (Numbers{0, 0, 0, 0}));
    rclcpp::clock_s = 12.2;
    ask({1, 1, 1, 1});
    EXPECT_EQ(published("rotor_flags"), (Numbers{kStale, 0, 0, 0}));
  };
  EXPECT_EQ(node_main(0, nullptr), 0);
}

TEST(Ros2Node, MixesAWrench) {
  set_parameters();
  rclcpp::on_spin = [] {
    rclcpp::clock_s = 12;
    tell({"a", "b", "c", "d"}, angles_of(shape_o()));
    rclcpp::subscriptions.at("wrench")(geometry_msgs::msg::Wrench{{0, 0, 6}, {0.02, -0.03, 0.005}});
    const Compensator compensator = with_arms(shape_o());
    const RotorLayout layout = compensator.layout({0.42, {}, Rotors<double>(4, 0.045)}, {1, -1, 1, -1});
    auto mixer = Mixer::build(layout, {Metres(0.0133), 0});
    ASSERT_TRUE(mixer && mixer->set_layout(layout, compensator.drag_scale()));
    const MixedThrusts mixed = mixer->mix({Newtons(6), NewtonMetres(0.02), NewtonMetres(-0.03), NewtonMetres(0.005)},
                                          {{}, compensator.thrust_max()});
    const Numbers speeds = published("rotor_speeds"), wanted = values_of(compensator.speeds_for(mixed.thrusts).speeds);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(speeds[i], wanted[i], 1e-9 * wanted[i]);
    EXPECT_EQ(published("mixer_concessions"), Numbers{0});
  };
  EXPECT_EQ(node_main(0, nullptr), 0);
}

TEST(Ros2Node, WarnsOfCoefficientsThatWereNotMeasuredOrAreNotFitToFly) {
  rclcpp::on_spin = [] {};
  set_parameters();
  rclcpp::parameters["kphi.origin"] = std::string("simulated");
  rclcpp::parameters["kphi.verdict"] = std::string("fit_to_fly");
  EXPECT_EQ(node_main(0, nullptr), 0);
  EXPECT_THAT(rclcpp::warnings, testing::ElementsAre("coefficients: origin simulated, verdict fit_to_fly"));
  rclcpp::parameters["kphi.origin"] = std::string("measured");
  rclcpp::warnings.clear();
  EXPECT_EQ(node_main(0, nullptr), 0);
  EXPECT_TRUE(rclcpp::warnings.empty());
}

TEST(Ros2Node, RefusesParametersThatMakeNoSense) {
  const std::pair<const char*, std::any> wrong[] = {{"kphi.thrust_coefficient_n_s2_per_rad2", 0.0},
                                                    {"kphi.overlap", std::string("rim")},
                                                    {"vehicle.arm_length_m", 0.01},
                                                    {"vehicle.joints", std::vector<std::string>{"a", "b"}},
                                                    {"vehicle.hinge_turn_rad", Numbers{0, 1}},
                                                    {"vehicle.rotor_spins", std::vector<std::int64_t>{1, 1, -1, -1}},
                                                    {"kphi.curve_phi_rad", Numbers{0, 1}},
                                                    {"kphi.torque_phi_rad", Numbers{0.5, 1}},
                                                    {"kphi.speed_trend_s_per_rad", 1.0}};
  for (const auto& [name, value] : wrong) {
    set_parameters();
    rclcpp::parameters[name] = value;
    EXPECT_THROW(node_main(0, nullptr), std::invalid_argument) << name;
  }
}

}  // namespace kphi::compensation::ros2_test
