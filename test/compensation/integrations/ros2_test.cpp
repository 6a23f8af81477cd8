// The ROS 2 node: arms and thrusts in, speeds and flags out.
#include <gtest/gtest.h>

#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/joint_state.hpp>
#include <std_msgs/msg/float64_multi_array.hpp>

#include "test/compensation/example_vehicle.hpp"

int node_main(int count, char** arguments);

namespace kphi::compensation::ros2_test {

using std_msgs::msg::Float64MultiArray;

void set_parameters() {
  const Airframe airframe = example_airframe();
  const ThrustCurve line = paper_line();
  rclcpp::parameters = {{"k_t", line.thrust_coefficient().value()},
                        {"intercept", line_of(line).intercept.value()},
                        {"slope_per_rad", line_of(line).slope_per_rad},
                        {"largest_fitted_rad", line.largest_fitted().value()},
                        {"half_side", airframe.half_side.value()},
                        {"arm_length", airframe.arm_length.value()},
                        {"propeller_radius", airframe.propeller_radius.value()},
                        {"fastest_speed", airframe.fastest_speed.value()}};
}

TEST(Ros2Node, TurnsThrustsIntoTheSpeedsOfTheLibrary) {
  set_parameters();
  rclcpp::on_spin = [] {
    sensor_msgs::msg::JointState arms;
    for (const Radians arm : shape_o()) arms.position.push_back(arm.value());
    arms.velocity = {0, 0, 9, 0};
    rclcpp::clock_s = 12.02;
    arms.header.stamp = rclcpp::Time(12.0);
    rclcpp::subscriptions.at("arms")(arms);
    rclcpp::subscriptions.at("rotor_thrusts")(Float64MultiArray{{1, 1.5, 2, -1}});
    const auto speeds = std::any_cast<Float64MultiArray>(rclcpp::published.at("rotor_speeds")).data;
    const auto flags = std::any_cast<Float64MultiArray>(rclcpp::published.at("rotor_flags")).data;
    const auto wanted = with_arms(shape_o()).speeds_for(thrusts_of(1, 1.5, 2, -1)).speeds;
    ASSERT_EQ(speeds.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(speeds[i], wanted[i].value());
    EXPECT_EQ(flags, (std::vector<double>{0, 0, static_cast<double>(Flag::arm_angle_stale),
                                          static_cast<double>(Flag::thrust_negative)}));
  };
  EXPECT_EQ(node_main(0, nullptr), 0);
}

TEST(Ros2Node, RefusesParametersThatMakeNoSense) {
  set_parameters();
  rclcpp::parameters["k_t"] = 0;
  EXPECT_THROW(node_main(0, nullptr), std::invalid_argument);
  set_parameters();
  rclcpp::parameters["arm_length"] = 0.01;
  EXPECT_THROW(node_main(0, nullptr), std::invalid_argument);
}

}  // namespace kphi::compensation::ros2_test
