#include "drivers/sim/truth_log.hpp"

#include <gmock/gmock.h>

#include <array>

#include "drivers/sim/iq/frame.hpp"

namespace kphi::sim::truth_log_test {

using testing::HasSubstr;
using testing::Not;

class MotionLogTest : public testing::Test {
 protected:
  MotionLogTest() { state_.supply_volts = 12; }
  void tell(std::uint8_t sub, std::span<const std::uint8_t> data) {
    std::vector<std::uint8_t> frame;
    append_iq_frame(frame, 52, sub, 1, data);
    device_.receive(frame, now_);
  }
  void spin() {
    const std::array<std::uint8_t, 4> hundred{0x00, 0x00, 0xc8, 0x42};
    tell(5, hundred);
  }
  void look_after(Duration pause) {
    now_ += pause;
    device_.advance(now_);
    log_.look(device_, state_.speed, now_);
  }
  MotorState state_;
  IqDevice device_{{}, state_};
  MotionLog log_;
  Instant now_{0};
};

TEST_F(MotionLogTest, TellsEachCommandOnceAndEveryTurnOfTheStage) {
  log_.look(device_, 0, now_);
  spin();
  for (int i = 0; i < 3; ++i) look_after(std::chrono::milliseconds(1));
  tell(2, {});
  look_after(std::chrono::milliseconds(1));
  EXPECT_EQ(log_.json_lines(),
            "{\"at_ns\":0,\"stage\":\"coast\",\"speed_rad_s\":0.0}\n"
            "{\"at_ns\":0,\"motion_command\":\"velocity\",\"target_rad_s\":100.0}\n"
            "{\"at_ns\":1000000,\"stage\":\"drive\",\"speed_rad_s\":0.0}\n"
            "{\"at_ns\":3000000,\"motion_command\":\"coast\",\"target\":0.0}\n"
            "{\"at_ns\":4000000,\"stage\":\"coast\",\"speed_rad_s\":0.0}\n");
}

TEST_F(MotionLogTest, SeesAModuleThatCoastsUntold) {
  spin();
  look_after(std::chrono::milliseconds(1));
  look_after(std::chrono::seconds(1));  // its song drives the coils
  look_after(std::chrono::seconds(1));
  EXPECT_THAT(log_.json_lines(), HasSubstr("{\"at_ns\":2001000000,\"stage\":\"coast\""));
  EXPECT_THAT(log_.json_lines(), Not(HasSubstr("\"motion_command\":\"coast\"")));
}

}  // namespace kphi::sim::truth_log_test
