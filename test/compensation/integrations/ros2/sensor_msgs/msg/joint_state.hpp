#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rclcpp/rclcpp.hpp"

namespace sensor_msgs::msg {

struct JointState {
  using ConstSharedPtr = std::shared_ptr<const JointState>;
  struct Header {
    rclcpp::Time stamp;
  } header;
  std::vector<std::string> name;
  std::vector<double> position, velocity;
};

}  // namespace sensor_msgs::msg
