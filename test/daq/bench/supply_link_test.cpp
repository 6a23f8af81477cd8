#include "daq/bench/supply_link.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace kphi::daq {
namespace {

class FakeSupply final : public SupplyLink {
 public:
  [[nodiscard]] std::string identity() const override { return "fake"; }
  std::size_t take(std::span<results::SupplyReading>) override { return 0; }
  [[nodiscard]] std::string failure() const override { return ""; }
  void cut() noexcept override { on = false; }
  [[nodiscard]] std::string switch_off() noexcept override {
    on = false;
    return "";
  }
  bool on = false;
  bool refuses = false;

 private:
  void switch_on() override {
    on = true;
    if (refuses) throw std::runtime_error("no");
  }
};

TEST(OutputEnable, HoldsThePowerWhileItLives) {
  FakeSupply supply;
  {
    const OutputEnable powered(supply);
    EXPECT_TRUE(supply.on);
  }
  EXPECT_FALSE(supply.on);
}

TEST(OutputEnable, SwitchesOffOnTheWayOutOfAnException) {
  FakeSupply supply;
  try {
    const OutputEnable powered(supply);
    throw std::runtime_error("something else");
  } catch (const std::runtime_error&) {
  }
  EXPECT_FALSE(supply.on);
}

TEST(OutputEnable, SwitchesOffWhenSwitchingOnFailsHalfway) {
  FakeSupply supply;
  supply.refuses = true;
  EXPECT_THROW(OutputEnable{supply}, std::runtime_error);
  EXPECT_FALSE(supply.on);
}

}  // namespace
}  // namespace kphi::daq
