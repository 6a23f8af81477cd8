#include "daq/spin.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <type_traits>

namespace kphi::daq {
namespace {

class ToldMotor final : public MotorLink {
 public:
  void spin_at(RadPerSec speed) override {
    if (refuse) throw std::runtime_error("refused");
    told.push_back(fmt(speed.value()));
  }
  void renew() noexcept override { told.push_back("renew"); }
  void coast() noexcept override { told.push_back("coast"); }
  std::size_t take(std::span<results::MotorReading>) override { return 0; }
  [[nodiscard]] std::string failure() const override { return {}; }
  [[nodiscard]] std::string identity() const override { return {}; }

  std::vector<std::string> told;
  bool refuse = false;

 private:
  static std::string fmt(double v) { return "spin " + std::to_string(static_cast<int>(v)); }
};

TEST(Spin, CoastsWhenItGoes) {
  ToldMotor motor;
  { Spin(motor, +1).at(RadPerSec(100)); }
  EXPECT_EQ(motor.told, (std::vector<std::string>{"spin 100", "coast"}));
}

TEST(Spin, CoastsEvenWhenItNeverSpun) {
  ToldMotor motor;
  { const Spin spin(motor, +1); }
  EXPECT_EQ(motor.told, (std::vector<std::string>{"coast"}));
}

TEST(Spin, CoastsWhenAnExceptionPasses) {
  ToldMotor motor;
  const auto fail = [&] {
    Spin spin(motor, +1);
    spin.at(RadPerSec(2000));
    throw std::runtime_error("anything");
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_EQ(motor.told.back(), "coast");
}

TEST(Spin, CoastsWhenTheCommandItselfFails) {
  ToldMotor motor;
  motor.refuse = true;
  EXPECT_THROW(Spin(motor, +1).at(RadPerSec(2000)), std::runtime_error);
  EXPECT_EQ(motor.told.back(), "coast");
}

TEST(Spin, TurnsTheOtherWayForAClockwisePropeller) {
  ToldMotor motor;
  { Spin(motor, -1).at(RadPerSec(100)); }
  EXPECT_EQ(motor.told.front(), "spin -100");
}

TEST(Spin, CannotBeCopiedAwayFromItsGuard) {
  EXPECT_FALSE(std::is_copy_constructible_v<Spin>);
  EXPECT_FALSE(std::is_move_constructible_v<Spin>);
}

}  // namespace
}  // namespace kphi::daq
