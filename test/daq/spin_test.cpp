#include "daq/spin.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <type_traits>

namespace kphi::daq {
namespace {

class ToldMotor : public MotorLink {
 public:
  void spin_at(RadPerSec speed) override {
    if (refuse) throw std::runtime_error("refused");
    told.push_back(fmt(speed.value()));
  }
  void renew() noexcept override { told.push_back("renew"); }
  void emergency_stop() noexcept override { told.push_back("emergency stop"); }
  void begin_stop(const iq::StopSettings&) override { told.push_back("stop"); }
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override { return report; }
  [[nodiscard]] const iq::AuditRecord& parameters() const override { return record; }
  [[nodiscard]] std::optional<Celsius> coil_temperature() override { return std::nullopt; }
  [[nodiscard]] std::vector<results::StreamEvent> take_events() override { return {}; }
  std::size_t take(std::span<results::MotorReading>) override { return 0; }
  [[nodiscard]] std::string failure() const override { return {}; }
  [[nodiscard]] std::string identity() const override { return {}; }

  std::vector<std::string> told;
  std::optional<iq::StopReport> report;
  iq::AuditRecord record;
  bool refuse = false;

 private:
  static std::string fmt(double v) { return "spin " + std::to_string(static_cast<int>(v)); }
};

const Latch kNoTrip;

TEST(Spin, LetsTheMotorGoWhenItGoes) {
  ToldMotor motor;
  { Spin(motor, +1, kNoTrip).at(RadPerSec(100)); }
  EXPECT_EQ(motor.told, (std::vector<std::string>{"spin 100", "emergency stop"}));
}

TEST(Spin, LeavesAMotorAloneThatHasConfirmedItsStop) {
  ToldMotor motor;
  {
    Spin spin(motor, +1, kNoTrip);
    spin.at(RadPerSec(100));
    EXPECT_FALSE(spin.stopped()) << "nobody has asked for a stop";
    spin.begin_stop();
    EXPECT_FALSE(spin.stopped());
    motor.report = iq::StopReport{iq::StopReport::Outcome::standing, 100, 0, {}, {}};
    EXPECT_TRUE(spin.stopped());
  }
  EXPECT_EQ(motor.told, (std::vector<std::string>{"spin 100", "stop"}));
}

TEST(Spin, DoesNotBelieveAStopThatIsUnderWayUnconfirmedOrOverruled) {
  for (const bool reported : {false, true}) {
    ToldMotor motor;
    {
      Spin spin(motor, +1, kNoTrip);
      spin.begin_stop();
      if (reported) motor.report = iq::StopReport{};
      (void)spin.stopped();
    }
    EXPECT_EQ(motor.told.back(), "emergency stop");
  }
  ToldMotor motor;
  {
    Spin spin(motor, +1, kNoTrip);
    spin.begin_stop();
    motor.report = iq::StopReport{iq::StopReport::Outcome::standing, 100, 0, {}, {}};
    (void)spin.stopped();
    spin.at(RadPerSec(100));
  }
  EXPECT_EQ(motor.told.back(), "emergency stop");
}

TEST(Spin, CoastsEvenWhenItNeverSpun) {
  ToldMotor motor;
  { const Spin spin(motor, +1, kNoTrip); }
  EXPECT_EQ(motor.told, (std::vector<std::string>{"emergency stop"}));
}

TEST(Spin, CoastsWhenAnExceptionPasses) {
  ToldMotor motor;
  const auto fail = [&] {
    Spin spin(motor, +1, kNoTrip);
    spin.at(RadPerSec(2000));
    throw std::runtime_error("anything");
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_EQ(motor.told.back(), "emergency stop");
}

TEST(Spin, CoastsWhenTheCommandItselfFails) {
  ToldMotor motor;
  motor.refuse = true;
  EXPECT_THROW(Spin(motor, +1, kNoTrip).at(RadPerSec(2000)), std::runtime_error);
  EXPECT_EQ(motor.told.back(), "emergency stop");
}

TEST(Spin, TurnsTheOtherWayForAClockwisePropeller) {
  ToldMotor motor;
  { Spin(motor, -1, kNoTrip).at(RadPerSec(100)); }
  EXPECT_EQ(motor.told.front(), "spin -100");
}

TEST(Spin, TurnsNoMoreAfterATrip) {
  ToldMotor motor;
  Latch latch;
  latch.set({"too hot"});
  EXPECT_THROW(Spin(motor, +1, latch).at(RadPerSec(100)), SafetyStop);
  EXPECT_EQ(motor.told, (std::vector<std::string>{"emergency stop"}));
}

TEST(Spin, CoastsWhenATripComesWhileItSpeaks) {
  class TrippingMotor final : public ToldMotor {
   public:
    explicit TrippingMotor(Latch& latch) : latch_(latch) {}
    void spin_at(RadPerSec speed) override {
      latch_.set({"too hot"});
      ToldMotor::emergency_stop();  // as the guard does, an instant before the command goes out
      ToldMotor::spin_at(speed);
    }

   private:
    Latch& latch_;
  };
  Latch latch;
  TrippingMotor motor(latch);
  EXPECT_THROW(Spin(motor, +1, latch).at(RadPerSec(100)), SafetyStop);
  EXPECT_EQ(motor.told, (std::vector<std::string>{"emergency stop", "spin 100", "emergency stop"}));
}

TEST(Spin, CannotBeCopiedAwayFromItsGuard) {
  EXPECT_FALSE(std::is_copy_constructible_v<Spin>);
  EXPECT_FALSE(std::is_move_constructible_v<Spin>);
}

}  // namespace
}  // namespace kphi::daq
