// ROS 2: arm angles, and rotor thrusts or one wrench, in; rotor speeds out. C++17, double. Its parameters are what
// `kphi export --to ros2 --vehicle VEHICLE` writes, SI.
#include <cmath>
#include <cstdint>
#include <geometry_msgs/msg/wrench.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/joint_state.hpp>
#include <std_msgs/msg/float64_multi_array.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"

namespace flying = kphi::compensation;

namespace {

using Numbers = std::vector<double>;
using Float64MultiArray = std_msgs::msg::Float64MultiArray;

flying::Position at(double x, double y) { return {kphi::Metres(x), kphi::Metres(y)}; }

}  // namespace

class CompensatorNode : public rclcpp::Node {
 public:
  CompensatorNode() : Node("kphi_compensator"), compensator_(built()), mixer_(mixer()) {
    const std::string origin = text("kphi.origin"), verdict = text("kphi.verdict");
    if (origin != "measured" || verdict != "fit_to_fly")
      RCLCPP_WARN(get_logger(), "coefficients: origin %s, verdict %s", origin.c_str(), verdict.c_str());
    speeds_ = create_publisher<Float64MultiArray>("rotor_speeds", 10);
    flags_ = create_publisher<Float64MultiArray>("rotor_flags", 10);
    concessions_ = create_publisher<Float64MultiArray>("mixer_concessions", 10);
    arms_subscription_ = create_subscription<sensor_msgs::msg::JointState>(
        "arms", 10, [this](sensor_msgs::msg::JointState::ConstSharedPtr arms) { on_arms(*arms); });
    thrusts_subscription_ = create_subscription<Float64MultiArray>(
        "rotor_thrusts", 10, [this](Float64MultiArray::ConstSharedPtr thrusts) { on_thrusts(*thrusts); });
    wrench_subscription_ = create_subscription<geometry_msgs::msg::Wrench>(
        "wrench", 10, [this](geometry_msgs::msg::Wrench::ConstSharedPtr wrench) { on_wrench(*wrench); });
  }

 private:
  /// Of one joint, when it was last heard of.
  struct Arm {
    double angle = std::numeric_limits<double>::quiet_NaN(), rate = 0;
    rclcpp::Time stamp;
  };

  double number(const char* name, double otherwise = 0) { return declare_parameter<double>(name, otherwise); }
  Numbers numbers(const char* name) { return declare_parameter<Numbers>(name, Numbers()); }
  std::string text(const char* name) { return declare_parameter<std::string>(name, "unknown"); }

  static std::optional<flying::OcclusionTable> table_of(const Numbers& phi, const Numbers& values) {
    if (phi.size() != values.size()) throw std::invalid_argument("kphi: a table needs as many values as angles");
    std::vector<flying::Knot> knots;
    for (std::size_t i = 0; i < phi.size(); ++i) knots.push_back({kphi::Radians(phi[i]), values[i]});
    return flying::OcclusionTable::from(knots.data(), knots.size());
  }

  flying::ThrustCurve curve() {
    const auto overlap = flying::overlap_measure_named(text("kphi.overlap"));
    if (!overlap) throw std::invalid_argument("kphi.overlap must be rim_arc, area_share or load_share");
    const kphi::ThrustCoefficient k_t(number("kphi.thrust_coefficient_n_s2_per_rad2"));
    const kphi::ThrustCoefficient intercept(number("kphi.line_intercept_n_s2_per_rad2"));
    const double slope = number("kphi.line_slope_n_s2_per_rad3");
    const kphi::Radians largest(number("kphi.phi_max_rad"));
    const Numbers phi = numbers("kphi.curve_phi_rad"), k = numbers("kphi.curve_k_n_s2_per_rad2");
    const auto table = table_of(phi, k);
    auto made = table         ? flying::ThrustCurve::from_table(*table, largest, *overlap)
                : phi.empty() ? flying::ThrustCurve::from_line(k_t, intercept, slope, largest, *overlap)
                              : std::nullopt;
    if (!made)
      throw std::invalid_argument(
          "kphi: K_T and intercept, or the k of a table, must be positive, a table must not rise, phi_max_rad must be "
          "in "
          "(0, 2 pi]");
    const Numbers torque_phi = numbers("kphi.torque_phi_rad"), share = numbers("kphi.torque_share");
    const auto torque = table_of(torque_phi, share);
    if (!torque_phi.empty() && !(torque && made->set_torque_share(*torque)))
      throw std::invalid_argument("kphi.torque_share must be in (0, 10) at angles that ascend from 0");
    const flying::SpeedTrend trend{number("kphi.speed_trend_s_per_rad"),
                                   kphi::RadPerSec(number("kphi.speed_trend_reference_rad_s"))};
    if (std::fabs(trend.per_rad_s) > 0 && !made->set_speed_trend(trend))
      throw std::invalid_argument("kphi.speed_trend_s_per_rad: k changes by more than 0.3 from rest to its reference");
    return *made;
  }

  flying::Airframe airframe() {
    flying::Airframe airframe{kphi::Metres(number("vehicle.half_side_m")), kphi::Metres(number("vehicle.arm_length_m")),
                              kphi::Metres(number("vehicle.propeller_radius_m")),
                              kphi::RadPerSec(number("vehicle.speed_min_rad_s")),
                              kphi::RadPerSec(number("vehicle.speed_max_rad_s"))};
    airframe.arms = {kphi::Radians(number("vehicle.arm_angle_min_rad", airframe.arms.from.value())),
                     kphi::Radians(number("vehicle.arm_angle_max_rad", airframe.arms.to.value())),
                     kphi::Radians(number("vehicle.arm_stale_rad", airframe.arms.stale.value()))};
    const Numbers turns = numbers("vehicle.hinge_turn_rad"), x = numbers("vehicle.hinge_x_m"),
                  y = numbers("vehicle.hinge_y_m"), corner_x = numbers("vehicle.corner_x_m"),
                  corner_y = numbers("vehicle.corner_y_m");
    auto mirrored = declare_parameter<std::vector<bool>>("vehicle.arm_mirrored", std::vector<bool>());
    mirrored.resize(joints_.size());
    if (turns.size() != joints_.size()) throw std::invalid_argument("vehicle.hinge_turn_rad must tell of each joint");
    if (corner_x.empty()) {
      if (joints_.size() != 4)
        throw std::invalid_argument("a square body has four arms; name the corners of another one");
      for (std::size_t i = 0; i < 4; ++i) {
        airframe.hinge_turns[i] = static_cast<int>(std::lround(turns[i] * 2 / kphi::kPi));
        airframe.mirrored[i] = mirrored[i];
      }
      return airframe;
    }
    std::vector<flying::Position> corners;
    for (std::size_t i = 0; i < corner_x.size() && i < corner_y.size(); ++i)
      corners.push_back(at(corner_x[i], corner_y[i]));
    const auto outline = flying::ConvexPolygon::from(corners.data(), corners.size());
    if (!outline || x.size() != joints_.size() || y.size() != joints_.size())
      throw std::invalid_argument(
          "vehicle: corners must go round a convex body, counter-clockwise, with a hinge for each joint");
    airframe.polygon = flying::PolygonBody{*outline, flying::Rotors<flying::Hinge>(joints_.size())};
    for (std::size_t i = 0; i < joints_.size(); ++i)
      airframe.polygon->hinges[i] = {at(x[i], y[i]), kphi::Radians(turns[i]), mirrored[i]};
    return airframe;
  }

  flying::Compensator built() {
    joints_ = declare_parameter<std::vector<std::string>>("vehicle.joints", {"arm_1", "arm_2", "arm_3", "arm_4"});
    if (joints_.size() < flying::kFewestRotors || joints_.size() > flying::kMostRotors)
      throw std::invalid_argument("vehicle.joints must name 3 to 8 arms, in the order of the rotors");
    arms_.resize(joints_.size());
    const flying::ThrustCurve one = curve();
    flying::Airframe frame = airframe();
    frame.overlap = one.overlap();
    const auto outcome = flying::Compensator::build(flying::Rotors<flying::ThrustCurve>(joints_.size(), one), frame);
    if (!outcome.compensator) throw std::invalid_argument(flying::describe(outcome.refusal));
    return *outcome.compensator;
  }

  /// nullopt if no drag torque per thrust is given; the node then ignores wrenches.
  std::optional<flying::Mixer> mixer() {
    const double drag = number("vehicle.drag_per_newton_m");
    const Numbers hubs = numbers("vehicle.hub_mass_kg"), body_at = numbers("vehicle.body_at_m");
    const auto spins = declare_parameter<std::vector<std::int64_t>>("vehicle.rotor_spins", std::vector<std::int64_t>());
    masses_.body = number("vehicle.body_mass_kg");
    if (!(drag > 0)) return std::nullopt;
    if (hubs.size() != joints_.size() || spins.size() != joints_.size() || body_at.size() != 2)
      throw std::invalid_argument("vehicle: hub_mass_kg and rotor_spins must tell of each joint, body_at_m of x and y");
    masses_.body_at = at(body_at[0], body_at[1]);
    masses_.at_hubs = flying::Rotors<double>(joints_.size());
    spins_ = flying::Rotors<int>(joints_.size());
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      masses_.at_hubs[i] = hubs[i];
      spins_[i] = static_cast<int>(spins[i]);
    }
    // Any shape that flies: the arms' own comes with the first wrench.
    flying::Compensator spread = compensator_;
    spread.set_arms(flying::Rotors<kphi::Radians>(joints_.size(), kphi::from_degrees(45)));
    const auto made = flying::Mixer::build(spread.layout(masses_, spins_), {kphi::Metres(drag), 0});
    if (!made)
      throw std::invalid_argument("vehicle: its rotors cannot make every torque; check rotor_spins and masses");
    return made;
  }

  /// The order is the publisher's, other joints may be among them, and a message need not hold all.
  void on_arms(const sensor_msgs::msg::JointState& state) {
    for (std::size_t i = 0; i < state.name.size() && i < state.position.size(); ++i) {
      for (std::size_t arm = 0; arm < joints_.size(); ++arm) {
        if (state.name[i] != joints_[arm]) continue;
        arms_[arm] = {state.position[i], i < state.velocity.size() ? state.velocity[i] : 0, state.header.stamp};
      }
    }
  }

  void take_arms() {
    flying::Rotors<kphi::Radians> angles(arms_.size());
    // Each joint has an age of its own, the library one for all: as rates times ages over that one. A joint that is too
    // old by itself moves faster than any.
    constexpr double kAge_s = 0.25, kTooFast = 1e6;
    const double oldest_s = flying::ArmLimits{}.oldest.value();
    flying::ArmFeedback motion;
    motion.age = kphi::Seconds(kAge_s);
    motion.rates = flying::Rotors<kphi::RadPerSec>(arms_.size());
    for (std::size_t i = 0; i < arms_.size(); ++i) {
      angles[i] = kphi::Radians(arms_[i].angle);
      const double age_s = (now() - arms_[i].stamp).seconds();
      motion.rates[i] = kphi::RadPerSec(
          std::isfinite(arms_[i].angle) && age_s > oldest_s ? kTooFast : arms_[i].rate * age_s / kAge_s);
    }
    compensator_.set_arms(angles, motion);
  }

  void on_thrusts(const Float64MultiArray& thrusts) {
    flying::Rotors<kphi::Newtons> wanted(thrusts.data.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = kphi::Newtons(thrusts.data[i]);
    take_arms();
    publish(wanted);
  }

  /// force.z up [N], torque about x forward, y left, z up [N m].
  void on_wrench(const geometry_msgs::msg::Wrench& wrench) {
    if (!mixer_) return;
    take_arms();
    mixer_->set_layout(compensator_.layout(masses_, spins_), compensator_.drag_scale());
    const flying::Wrench demand{kphi::Newtons(wrench.force.z), kphi::NewtonMetres(wrench.torque.x),
                                kphi::NewtonMetres(wrench.torque.y), kphi::NewtonMetres(wrench.torque.z)};
    const flying::MixedThrusts mixed = mixer_->mix(demand, {{}, compensator_.thrust_max()});
    Float64MultiArray concessions;
    concessions.data.push_back(mixed.concessions.bits());
    concessions_->publish(concessions);
    publish(mixed.thrusts);
  }

  void publish(const flying::Rotors<kphi::Newtons>& thrusts) {
    const flying::SpeedCommand command = compensator_.speeds_for(thrusts);
    Float64MultiArray speeds, flags;
    for (const kphi::RadPerSec speed : command.speeds) speeds.data.push_back(speed.value());
    for (const flying::Flags flag : command.flags) flags.data.push_back(flag.bits());
    speeds_->publish(speeds);
    flags_->publish(flags);
  }

  std::vector<std::string> joints_;  ///< in the order of the rotors
  std::vector<Arm> arms_;
  flying::Masses masses_;
  flying::Rotors<int> spins_;
  flying::Compensator compensator_;
  std::optional<flying::Mixer> mixer_;
  rclcpp::Publisher<Float64MultiArray>::SharedPtr speeds_, flags_, concessions_;
  rclcpp::Subscription<sensor_msgs::msg::JointState>::SharedPtr arms_subscription_;
  rclcpp::Subscription<Float64MultiArray>::SharedPtr thrusts_subscription_;
  rclcpp::Subscription<geometry_msgs::msg::Wrench>::SharedPtr wrench_subscription_;
};

int main(int count, char** arguments) {
  rclcpp::init(count, arguments);
  rclcpp::spin(std::make_shared<CompensatorNode>());
  rclcpp::shutdown();
  return 0;
}
