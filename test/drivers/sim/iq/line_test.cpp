#include "drivers/sim/iq/line.hpp"

#include <gtest/gtest.h>

#include <optional>

#include "drivers/sim/truth_log.hpp"
#include "test/drivers/sim/fault_words.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::sim::line_test {

using namespace std::chrono_literals;
using namespace test;

constexpr std::string_view kGetSpeed = "55 02 32 0D 00 31 B4";
constexpr std::string_view kGetFault = "55 02 54 00 00 A6 EB";
const std::string kSpeed = hex("55 06 32 0D 03 00 00 C8 42 71 DF");  // 100 rad/s
const std::string kFault = hex("55 03 54 00 03 00 47 15");

class Line : public ::testing::Test {
 protected:
  Line() {
    state.speed = 100;
    module.oscillator_gain = 0;
    module.sensors.perfect = true;
  }
  void make(const std::vector<std::string>& faults = {}) {
    device.emplace(module, state);
    line.emplace(*device, settings, test::fault_script(faults), 7, IqLine::Keep::replies);
  }
  /// What has come until `now`, as hex; `times` gets each chunk's.
  std::string hear(Instant now) {
    times.clear();
    std::string out;
    line->advance(now);
    IqChunk chunk;
    while (line->next_chunk(chunk, now)) {
      out += hex(chunk.bytes);
      times.push_back(chunk.at);
    }
    return out;
  }
  std::string ask(std::string_view spelt, Instant at = 1s, Duration patience = 500ms) {
    line->advance(at);
    line->send(bytes(spelt), at);
    return hear(at + patience);
  }
  /// The answer to a question of the speed while this is wrong.
  std::string with(const std::string& fault) {
    make({fault + " at_s=0"});
    return ask(kGetSpeed);
  }

  MotorState state;
  IqSettings module;
  IqLineSettings settings;
  std::optional<IqDevice> device;
  std::optional<IqLine> line;
  std::vector<Instant> times;
};

TEST_F(Line, CarriesBothWaysAtOnce) {
  make();
  EXPECT_EQ(ask(kGetSpeed), kSpeed);
  EXPECT_EQ(times, std::vector<Instant>{1s});
  ASSERT_EQ(line->truth().log.size(), 1u);
  const SentIqReply& sent = line->truth().log[0];
  EXPECT_EQ(sent.truth, 100);
  EXPECT_EQ(sent.asked, 1s);
  EXPECT_EQ(sent.arrivals, 1u);
  EXPECT_EQ(hex(sent.data()), hex("00 00 c8 42"));
}

TEST_F(Line, BytesTakeTheTimeOfTheirRate) {
  settings.paced = true;
  make();
  EXPECT_EQ(ask(kGetSpeed), kSpeed);
  const double byte = 10.0 / 115200;
  ASSERT_EQ(times.size(), 11u);
  EXPECT_NEAR(to_seconds(times.front() - 1s), 8 * byte, 1e-7) << "seven of the question, one of the answer";
  EXPECT_NEAR(to_seconds(times.back() - 1s), 18 * byte, 1e-7);
}

TEST_F(Line, PacedThroughputIsWhatTheBaudGives) {
  settings.paced = true;
  make();
  for (int i = 0; i < 1000; ++i) line->send(bytes(kGetSpeed), 0s);
  hear(10s);
  EXPECT_NEAR(to_seconds(line->truth().log.back().arrived), (1000 * 11 + 7) * 10.0 / 115200, 1e-3);
  EXPECT_EQ(line->truth().frames_arrived, 1000u);
}

TEST_F(Line, ScalesWithTheClockOfTheBench) {
  settings.paced = true;
  settings.time_scale = module.time_scale = 20;
  module.reply_latency = 100us;
  make();
  ask(kGetSpeed);
  EXPECT_NEAR(to_seconds(times.back() - 1s), 20 * (18 * 10.0 / 115200 + 1e-4), 1e-6);
}

TEST_F(Line, LatencyAndJitterAreTheModules) {
  module.reply_latency = 300us;
  module.reply_jitter = 200us;
  make();
  Instant least = 1s, most{0};
  for (int i = 1; i < 200; ++i) {
    const Instant at = i * 10ms;
    ASSERT_EQ(ask(kGetSpeed, at, 9ms), kSpeed);
    least = std::min(least, times.back() - at);
    most = std::max(most, times.back() - at);
  }
  EXPECT_NEAR(to_seconds(least), 300e-6, 10e-6);
  EXPECT_NEAR(to_seconds(most), 500e-6, 10e-6);
}

TEST_F(Line, TheAdaptersTimerHandsOverAtItsTicks) {
  settings.usb_tick = 16ms;
  make();
  ask(kGetSpeed, 1001ms);
  EXPECT_EQ(times, std::vector<Instant>{1008ms});
  line->send(bytes(kGetSpeed), 2s);
  line->advance(2001ms);
  line->send(bytes(kGetFault), 2001ms);
  EXPECT_EQ(hear(3s), kSpeed + kFault);
  EXPECT_EQ(times.size(), 2u) << "one tick was at 2 s itself";
}

TEST_F(Line, AtAnotherRateEverythingIsGarbage) {
  make();
  line->host_rate(921600);
  EXPECT_EQ(ask(kGetSpeed), "");
  EXPECT_EQ(device->frames(), 0u);
  line->host_rate(115200);
  EXPECT_EQ(ask(kGetSpeed, 2s).size(), kSpeed.size()) << "once the module's receiver has found its feet";
}

TEST_F(Line, ARateHalfAPercentOffIsHeard) {
  module.oscillator_gain = 0.005;
  make();
  line->host_rate(115200);
  EXPECT_NE(ask(kGetSpeed), "");
  module.oscillator_gain = 0.06;
  make();
  line->host_rate(115200);
  EXPECT_EQ(ask(kGetSpeed), "");
}

TEST_F(Line, TheAnswerToANewRateIsAtTheNewRate) {
  make();
  line->host_rate(921600);
  device->set_baud(921600);
  EXPECT_EQ(ask(kGetSpeed, 2s), kSpeed);
}

TEST_F(Line, SpoilsTheBytesOfAReply) {
  EXPECT_NE(with("motor_flip count=1"), kSpeed);
  EXPECT_EQ(line->truth().frames_arrived, 0u);
  EXPECT_EQ(line->truth().spoilt, 1u);
  EXPECT_EQ(with("motor_bad_crc count=1").substr(0, 27), kSpeed.substr(0, 27));
  EXPECT_EQ(line->truth().frames_arrived, 0u);
  EXPECT_EQ(with("motor_truncate count=1 size=5"), kSpeed.substr(0, 15));
  EXPECT_EQ(with("motor_garbage count=1 bytes=55 3B"), hex("55 3b") + kSpeed);
  EXPECT_EQ(line->truth().frames_arrived, 1u);
  EXPECT_EQ(with("motor_garbage count=1 size=20").size(), 60 + kSpeed.size());
}

TEST_F(Line, DropsDuplicatesAndReorders) {
  EXPECT_EQ(with("motor_drop count=1"), "");
  EXPECT_EQ(line->truth().log[0].arrivals, 0u);
  EXPECT_EQ(with("motor_duplicate count=1"), kSpeed + kSpeed);
  EXPECT_EQ(line->truth().log[0].arrivals, 2u);
  EXPECT_EQ(with("motor_reorder count=1"), kSpeed) << "alone it comes late";
  EXPECT_EQ(times.back(), 1010ms);
  make({"motor_reorder at_s=0 count=1"});
  EXPECT_EQ(ask(std::string(kGetSpeed) + std::string(kGetFault)), kFault + kSpeed);
}

TEST_F(Line, ChangesWhatIsSaid) {
  EXPECT_EQ(with("motor_value count=1 value=nan").substr(15, 12), "00 00 c0 7f ");
  EXPECT_EQ(hex(line->truth().log[0].data()), hex("00 00 c0 7f")) << "the truth says what was sent";
  EXPECT_EQ(with("motor_value count=1 value=-inf").substr(15, 12), "00 00 80 ff ");
  EXPECT_EQ(with("motor_value count=1 value=denormal").substr(15, 12), "01 00 00 00 ");
  EXPECT_EQ(with("motor_wrong_length count=1 size=2").substr(0, 15), hex("55 04 32 0D 03"));
  EXPECT_EQ(with("motor_wrong_id count=1 id=5"), hex("55 06 32 0D 17 00 00 C8 42 2D 52"));
}

TEST_F(Line, AStuckEntrySaysWhatItSaid) {
  make({"motor_stuck at_s=0 for_s=2.5 type=50"});
  EXPECT_EQ(ask(kGetSpeed), kSpeed);
  state.speed = 200;
  EXPECT_EQ(ask(kGetSpeed, 2s), kSpeed);
  EXPECT_EQ(line->truth().log.back().truth, 200);
  EXPECT_NE(ask(kGetSpeed, 3s), kSpeed);
}

TEST_F(Line, SpoilsTheTimes) {
  EXPECT_EQ(with("motor_split count=1 delay_s=0.001"), kSpeed);
  EXPECT_EQ(times.size(), 11u);
  EXPECT_EQ(times.back() - times.front(), 10ms);
  EXPECT_EQ(with("motor_stall count=1 size=4 delay_s=0.05"), kSpeed);
  EXPECT_EQ(times, (std::vector<Instant>{1s, 1050ms}));
  EXPECT_EQ(with("motor_delay count=1 delay_s=0.2"), kSpeed);
  EXPECT_EQ(times, std::vector<Instant>{1200ms});
  make({"motor_merge at_s=0 for_s=5 delay_s=0.03"});
  line->send(bytes(kGetSpeed), 1s);
  line->advance(1005ms);
  line->send(bytes(kGetFault), 1005ms);
  EXPECT_EQ(hear(2s), kSpeed + kFault);
  EXPECT_EQ(times, std::vector<Instant>{1020ms});
}

TEST_F(Line, OnlyTheEntryThatIsMeant) {
  make({"motor_drop at_s=0 for_s=9 type=50 sub=13"});
  EXPECT_EQ(ask(std::string(kGetSpeed) + std::string(kGetFault)), kFault);
}

TEST_F(Line, ByProbabilityAndCount) {
  make({"motor_drop at_s=0 for_s=1000 p=0.25"});
  for (int i = 1; i <= 1000; ++i) ask(kGetSpeed, i * 1ms, 0s);
  EXPECT_NEAR(static_cast<double>(line->truth().frames_arrived), 750, 50);
  make({"motor_drop at_s=0 count=7"});
  for (int i = 1; i <= 100; ++i) ask(kGetSpeed, i * 1ms, 0s);
  EXPECT_EQ(line->truth().frames_arrived, 93u);
}

TEST_F(Line, BreaksInOneDirection) {
  EXPECT_EQ(with("motor_mute for_s=5"), "");
  EXPECT_EQ(device->frames(), 1u) << "the module heard it";
  EXPECT_EQ(with("motor_deaf for_s=5"), "");
  EXPECT_EQ(device->frames(), 0u);
  EXPECT_EQ(ask(kGetSpeed, 6s), kSpeed) << "it is over";
}

TEST_F(Line, FlipsBitsOfCommands) {
  make({"motor_command_flip at_s=0 count=1"});
  EXPECT_EQ(ask(kGetSpeed), "");
  EXPECT_EQ(line->truth().done.at(FaultKind::motor_command_flip), 1u);
}

TEST_F(Line, UnpluggedNothingPassesAndAnotherModuleMayCome) {
  make({"motor_unplug at_s=2 for_s=1 other=true"});
  const std::string uid = ask("55 02 05 04 00 9C 4E");
  line->advance(2s);
  EXPECT_FALSE(line->plugged());
  EXPECT_EQ(ask(kGetSpeed, 2500ms, 100ms), "");
  line->advance(3s);
  EXPECT_TRUE(line->plugged());
  EXPECT_EQ(ask(kGetSpeed, 3100ms), kSpeed);
  const std::string other = ask("55 02 05 04 00 9C 4E", 4s);
  EXPECT_EQ(other.size(), uid.size());
  EXPECT_NE(other, uid);
}

TEST_F(Line, BrownOutForgetsAndIsSilentForAWhile) {
  make({"motor_brown_out at_s=2 down_s=0.5"});
  ask("55 06 34 0F 01 00 00 80 3E E9 8A");  // timeout 0.25 s
  EXPECT_EQ(ask(kGetSpeed, 2100ms, 100ms), "");
  EXPECT_EQ(ask("55 02 34 0F 00 F3 60", 3s).substr(15, 12), "00 00 00 3f ");
}

TEST_F(Line, FallsBackToItsFirstRate) {
  module.baud = 921600;
  make({"motor_baud at_s=2"});
  line->host_rate(921600);
  EXPECT_EQ(ask(kGetSpeed), kSpeed);
  EXPECT_EQ(ask(kGetSpeed, 3s), "");
  line->host_rate(115200);
  ask(kGetSpeed, 4s);
  EXPECT_EQ(ask(kGetSpeed, 5s), kSpeed);
}

TEST_F(Line, IgnoresSetsAndNotGets) {
  make({"motor_ignore_sets at_s=0 for_s=5"});
  ask("55 06 34 05 01 00 00 C8 42 95 37");
  EXPECT_EQ(device->drive().mode, MotorDrive::Mode::coast);
  EXPECT_EQ(ask(kGetSpeed, 2s), kSpeed);
}

TEST_F(Line, HeatsAndLowersTheRedline) {
  make({"motor_hot at_s=0 for_s=5 coil_celsius=120 controller_celsius=75",
        "motor_redline at_s=0 for_s=5 speed_rad_s=99"});
  ask("55 06 34 05 01 00 00 C8 42 95 37");
  for (int i = 0; i < 8; ++i) device->advance(1501ms);
  EXPECT_EQ(ask("55 02 53 00 00 36 6E", 2s).substr(15, 12), "00 00 11 43 ") << "145 degrees";
  EXPECT_NE(ask("55 02 32 29 00 13 7E", 2s), hex("55 06 32 29 03 00 00 01 00 92 28")) << "derated";
}

TEST_F(Line, DisturbsTheSupplyAndTheRotor) {
  make({"motor_sag at_s=1 for_s=1 volts=3", "motor_over_voltage at_s=3 for_s=1 volts=20",
        "motor_locked at_s=5 for_s=1"});
  for (const auto& [at, volts, locked] :
       {std::tuple{0.5, 0.0, false}, {1.5, -3.0, false}, {2.5, 0.0, false}, {3.5, 20.0, false}, {5.5, 0.0, true}}) {
    line->advance(from_seconds(at));
    EXPECT_EQ(line->upset().supply_volts, volts) << at;
    EXPECT_EQ(line->upset().locked, locked) << at;
  }
  EXPECT_EQ(line->truth().events.size(), 5u);
}

TEST_F(Line, TheSameSeedGivesTheSameBytes) {
  std::string first;
  for (int round = 0; round < 2; ++round) {
    make({"motor_flip at_s=0 for_s=9 p=0.5", "motor_garbage at_s=0 for_s=9 p=0.5"});
    std::string all;
    for (int i = 1; i < 100; ++i) all += ask(kGetSpeed, i * 10ms, 5ms);
    if (round == 0) first = all;
    EXPECT_EQ(all, first);
  }
}

TEST_F(Line, ItsTruthCanBeWritten) {
  with("motor_flip count=1");
  const std::string text = json_lines(line->truth());
  EXPECT_NE(text.find(R"("faults":["motor_flip"])"), std::string::npos) << text;
  EXPECT_NE(text.find(R"("motor_totals")"), std::string::npos);
}

}  // namespace kphi::sim::line_test
