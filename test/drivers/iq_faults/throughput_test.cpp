// How fast four quantities can be read at 115200 baud: the wire allows 262 times a second when questions are sent ahead
// of answers, 160 when each waits for the last. In virtual time; on a host the benchmark measures it.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "test/drivers/iq_faults/joined.hpp"

namespace kphi::iq {
namespace throughput_test {

using namespace std::chrono_literals;

TEST(Throughput, OfFourQuantitiesIsBeyondWhatOneQuestionAtATimeAllows) {
  test::Manner manner{.telemetry_hz = 255, .slow_hz = 1};
  manner.every_cycle = {MotorChannel::speed, MotorChannel::motor_current, MotorChannel::supply_voltage,
                        MotorChannel::supply_current};
  test::Joined joined(manner, {}, 1);
  joined.run_until(3s);
  std::map<MotorChannel, int> count;
  for (const MotorReading& reading : joined.readings())
    if (reading.time_ns >= Nanoseconds(Duration(1s).count())) ++count[reading.channel];
  int cycles = count[MotorChannel::speed];
  for (const MotorChannel quantity : manner.every_cycle) cycles = std::min(cycles, count[quantity]);
  EXPECT_GT(cycles / 2.0, 200) << "a second, of 262";
  EXPECT_EQ(joined.disagreement(), "");
}

}  // namespace throughput_test
}  // namespace kphi::iq
