#pragma once

#include <memory>

namespace geometry_msgs::msg {

struct Vector3 {
  double x = 0, y = 0, z = 0;
};

struct Wrench {
  using ConstSharedPtr = std::shared_ptr<const Wrench>;
  Vector3 force, torque;
};

}  // namespace geometry_msgs::msg
