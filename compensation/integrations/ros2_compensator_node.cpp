// ROS 2: rotor thrusts and arm angles in, rotor speeds out. C++17, double. Parameters: the square body and the line,
// SI.
#include <memory>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/joint_state.hpp>
#include <std_msgs/msg/float64_multi_array.hpp>
#include <stdexcept>

#include "compensation/compensator.hpp"

namespace flying = kphi::compensation;

class CompensatorNode : public rclcpp::Node {
 public:
  CompensatorNode() : Node("kphi_compensator"), compensator_(built()) {
    speeds_ = create_publisher<std_msgs::msg::Float64MultiArray>("rotor_speeds", 10);
    flags_ = create_publisher<std_msgs::msg::Float64MultiArray>("rotor_flags", 10);
    arms_subscription_ = create_subscription<sensor_msgs::msg::JointState>(
        "arms", 10, [this](sensor_msgs::msg::JointState::ConstSharedPtr arms) { on_arms(*arms); });
    thrusts_subscription_ = create_subscription<std_msgs::msg::Float64MultiArray>(
        "rotor_thrusts", 10,
        [this](std_msgs::msg::Float64MultiArray::ConstSharedPtr thrusts) { on_thrusts(*thrusts); });
  }

 private:
  flying::Compensator built() {
    const auto number = [this](const char* name) { return declare_parameter<double>(name, 0.0); };
    const auto curve = flying::ThrustCurve::from_line(
        kphi::ThrustCoefficient(number("k_t")), kphi::ThrustCoefficient(number("intercept")), number("slope_per_rad"),
        kphi::Radians(number("largest_fitted_rad")));
    if (!curve) throw std::invalid_argument("k_t and intercept must be positive, largest_fitted_rad in (0, 2 pi]");
    const flying::Airframe airframe{kphi::Metres(number("half_side")), kphi::Metres(number("arm_length")),
                                    kphi::Metres(number("propeller_radius")), kphi::RadPerSec(number("slowest_speed")),
                                    kphi::RadPerSec(number("fastest_speed"))};
    const auto outcome = flying::Compensator::build({*curve, *curve, *curve, *curve}, airframe);
    if (!outcome.compensator) throw std::invalid_argument(flying::describe(outcome.refusal));
    return *outcome.compensator;
  }

  void on_arms(const sensor_msgs::msg::JointState& arms) {
    flying::Rotors<kphi::Radians> angles(arms.position.size());
    for (std::size_t i = 0; i < angles.size(); ++i) angles[i] = kphi::Radians(arms.position[i]);
    flying::ArmFeedback motion;
    motion.age = kphi::Seconds((now() - arms.header.stamp).seconds());
    motion.rates = flying::Rotors<kphi::RadPerSec>(arms.velocity.size());
    for (std::size_t i = 0; i < motion.rates.size(); ++i) motion.rates[i] = kphi::RadPerSec(arms.velocity[i]);
    compensator_.set_arms(angles, motion);
  }

  void on_thrusts(const std_msgs::msg::Float64MultiArray& thrusts) {
    flying::Rotors<kphi::Newtons> wanted(thrusts.data.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = kphi::Newtons(thrusts.data[i]);
    const flying::SpeedCommand command = compensator_.speeds_for(wanted);
    std_msgs::msg::Float64MultiArray speeds, flags;
    for (const kphi::RadPerSec speed : command.speeds) speeds.data.push_back(speed.value());
    for (const flying::Flags flag : command.flags) flags.data.push_back(flag.bits());
    speeds_->publish(speeds);
    flags_->publish(flags);
  }

  flying::Compensator compensator_;
  rclcpp::Publisher<std_msgs::msg::Float64MultiArray>::SharedPtr speeds_, flags_;
  rclcpp::Subscription<sensor_msgs::msg::JointState>::SharedPtr arms_subscription_;
  rclcpp::Subscription<std_msgs::msg::Float64MultiArray>::SharedPtr thrusts_subscription_;
};

int main(int count, char** arguments) {
  rclcpp::init(count, arguments);
  rclcpp::spin(std::make_shared<CompensatorNode>());
  rclcpp::shutdown();
  return 0;
}
