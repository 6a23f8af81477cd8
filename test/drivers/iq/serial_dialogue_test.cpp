#include "drivers/iq/serial_dialogue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/device_error.hpp"
#include "drivers/iq/audit.hpp"
#include "drivers/iq/setting.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"

namespace kphi::iq {
namespace {

using fake::Module;
using fake::ModuleOnALine;
using testing::HasSubstr;
using testing::IsEmpty;

const SteadyClock kClock;

std::string refusal(const std::string& device, int module_id = 0) {
  try {
    SerialDialogue dialogue({device, 115200, module_id}, kClock);
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

TEST(SerialDialogue, CoastsBeforeItAsksAnythingElse) {
  ModuleOnALine line;
  line.with([](Module& m) { m.values[{50, 0}] = fake::u8(3); });  // left spinning by a program that died
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  line.with([](Module& m) {
    ASSERT_GE(m.heard.size(), 2u);
    EXPECT_TRUE(m.heard[0].is_coast());
    EXPECT_EQ(m.values[(fake::Key{50, 0})], fake::u8(5));
  });
}

TEST(SerialDialogue, LeavesTheMotorCoasting) {
  ModuleOnALine line;
  {
    SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
    line.with([](Module& m) { m.heard.clear(); });
  }
  EXPECT_TRUE(line.left_coasting()) << "told again at the end";
}

TEST(SerialDialogue, CarriesQuestionsAndSettings) {
  ModuleOnALine line;
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  EXPECT_EQ(dialogue.ask(entry<"power_monitor.volts">)->value, 12.5);
  EXPECT_EQ(dialogue.ask(entry<"brushless_drive.motor_pole_pairs">)->value, 7);
  EXPECT_FALSE(dialogue.ask(entry<"temperature_estimator.temp">)) << "silent in this firmware";
  EXPECT_THAT(set_and_read_back(dialogue, connection_settings(0.5)), IsEmpty());
  EXPECT_EQ(dialogue.counters().timeouts, 2u);
  EXPECT_GT(dialogue.median_round_trip(), Duration(0));
}

TEST(SerialDialogue, StampsAnAnswerBetweenQuestionAndReply) {
  ModuleOnALine line;
  SerialDialogue dialogue({line.device(), 2000000, 0}, kClock);
  const Instant before = kClock.now();
  const auto answer = dialogue.ask(entry<"power_monitor.volts">);
  const Instant after = kClock.now();
  ASSERT_TRUE(answer);
  EXPECT_GE(answer->time - answer->uncertainty, before - Duration(1));
  EXPECT_LE(answer->time + answer->uncertainty, after + Duration(1));
}

TEST(SerialDialogue, ReadsAWholeAudit) {
  ModuleOnALine line;
  line.with([](Module& m) {
    for (const Entry* audited : kAudited)
      m.values.insert({{static_cast<int>(audited->type), audited->sub}, fake::Bytes(size_of(audited->format))});
  });
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  const AuditRecord record = read_audit(dialogue);
  EXPECT_EQ(dialogue.counters().timeouts, 0u);
  EXPECT_EQ(record.uid(), "111111112222222233333333");
  EXPECT_EQ(record.firmware()->text(), "speed 0.0.32");
  EXPECT_EQ(record.coil_temperature_client(), 83);
}

TEST(SerialDialogue, SaysWhyNobodyAnswers) {
  ModuleOnALine mute;
  mute.with([](Module& m) { m.mute = true; });
  EXPECT_THAT(refusal(mute.device()), HasSubstr("nothing was received"));
  ModuleOnALine stubborn;
  stubborn.with([](Module& m) {
    m.values[{50, 0}] = fake::u8(3);
    m.id = 0;
    m.silent.insert({52, 2});
    m.ignore_sets = true;
  });
  EXPECT_THAT(refusal(stubborn.device()), HasSubstr("does not confirm (its drive mode last read 3)"));
  EXPECT_TRUE(stubborn.left_coasting()) << "the last thing it heard is a coast";
}

TEST(SerialDialogue, NoticesThatTheLineIsGone) {
  ModuleOnALine line;
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  line.unplug();
  EXPECT_THROW((void)dialogue.ask(entry<"power_monitor.volts">), DeviceError);
}

TEST(SerialDialogue, IgnoresAReplyThatComesTooLate) {
  ModuleOnALine line;
  SerialDialogue dialogue({line.device(), 115200, 0}, kClock);
  line.with([](Module& m) { m.silent.insert({69, 0}); });
  EXPECT_FALSE(dialogue.ask(entry<"power_monitor.volts">));
  line.with([](Module& m) { m.silent.erase({69, 0}); });
  EXPECT_EQ(dialogue.ask(entry<"power_monitor.amps">)->value, 3.25);
}

}  // namespace
}  // namespace kphi::iq
