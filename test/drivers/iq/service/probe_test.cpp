#include "drivers/iq/service/probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "test/drivers/iq/fake_dialogue.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"

namespace kphi::iq {
namespace probe_test {

using fake::FakeDialogue;
using fake::Module;
using fake::ModuleOnALine;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const SteadyClock kClock;

void give_id(Module& module, int id) {
  module.id = id;
  module.values[{5, 14}] = fake::u8(id);
}

/// Nothing was set but coasts, and nothing saved.
bool only_coasted(ModuleOnALine& line) {
  return line.with(
      [](Module& m) { return m.count([](const auto& h) { return h.access != 0 && !h.is_coast(); }) == 0; });
}

TEST(Search, FindsAModuleAtAnyRateAndLeavesItCoasting) {
  for (const unsigned baud : {115200u, 921600u, 57600u, 9600u}) {
    ModuleOnALine line([&](Module& m) { m.baud = baud; });
    EXPECT_EQ(find_baud(line.device(), 0), baud);
    EXPECT_TRUE(line.left_coasting());
    EXPECT_TRUE(only_coasted(line));
  }
}

TEST(Search, FindsTheIdsOfALine) {
  ModuleOnALine line([](Module& m) { give_id(m, 5); });
  line.with_others([](std::vector<Module>& others) {
    others.resize(2);
    give_id(others[1], 62);
  });
  EXPECT_EQ(find_ids(line.device(), 115200), (std::vector<int>{0, 5, 62}));
  EXPECT_TRUE(line.left_coasting());
  EXPECT_TRUE(only_coasted(line));
}

TEST(Search, FindsNothingOnADeadLine) {
  ModuleOnALine line([](Module& m) { m.mute = true; });
  EXPECT_EQ(find_baud(line.device(), 0), std::nullopt);
  EXPECT_TRUE(find_ids(line.device(), 115200).empty());
}

TEST(Search, NeedsAPort) {
  EXPECT_THROW((void)find_baud("/dev/no_such_tty", 0), DeviceError);
  EXPECT_THROW((void)find_ids("/dev/no_such_tty", 115200), DeviceError);
}

std::vector<std::string> findings_of(const SerialLine& line, const ProbeSettings& settings = {}) {
  const Probe found = probe(line, kClock, settings);
  EXPECT_FALSE(found.answers());
  std::vector<std::string> lines;
  for (const Finding& finding : found.findings) lines.push_back(finding.line());
  return lines;
}

TEST(ModuleProbe, SaysUnderWhichIdTheModuleAnswers) {
  ModuleOnALine line([](Module& m) { give_id(m, 7); });
  const auto lines = findings_of({line.device(), 115200, 0});
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[1], "fault: id 7 answers at 115200 baud, not id 0; write module_id: 7 under iq: in the bench file");
  EXPECT_TRUE(only_coasted(line));
}

TEST(ModuleProbe, SaysWhereItSearchedInVain) {
  ModuleOnALine line([](Module& m) { m.mute = true; });
  const auto lines = findings_of({line.device(), 115200, 0});
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_THAT(lines[1], HasSubstr("note: searched for it at 115200, 921600, 1000000"));
}

TEST(ModuleProbe, SearchesOnlyWhenAskedAndOnlyForASilentModuleAndSaysWhyNobodyAnswers) {
  ModuleOnALine silent([](Module& m) { m.mute = true; });
  ModuleOnALine stubborn([](Module& m) {
    m.ignore_sets = true;
    m.values[{50, 0}] = fake::u8(3);
  });
  ProbeSettings no_search;
  no_search.search = false;
  EXPECT_THAT(findings_of({silent.device(), 115200, 0}, no_search), ElementsAre(HasSubstr("nothing was received")));
  EXPECT_THAT(findings_of({stubborn.device(), 115200, 0}),
              ElementsAre(HasSubstr("coast not confirmed: the drive mode last read 3")))
      << "it answers, and does not coast";
  EXPECT_TRUE(stubborn.left_coasting()) << "the last thing it heard is a coast";
  EXPECT_EQ(findings_of({"/dev/no_such_tty", 115200, 0}).size(), 1u);
}

TEST(ModuleProbe, CoastsBeforeItAsksAnythingElseAndLeavesTheMotorCoasting) {
  ModuleOnALine line([](Module& m) { m.values[{50, 0}] = fake::u8(3); });  // left spinning by a program that died
  EXPECT_TRUE(probe({line.device(), 115200, 0}, kClock).answers());
  line.with([](Module& m) {
    ASSERT_GE(m.heard.size(), 2u);
    EXPECT_TRUE(m.heard[0].is_coast());
    EXPECT_EQ(m.values[(fake::Key{50, 0})], fake::u8(5));
  });
  EXPECT_TRUE(line.left_coasting());
}

TEST(ModuleProbe, ReadsAWholeAudit) {
  ModuleOnALine line;
  line.with([](Module& m) {
    for (const Entry& entry : kEntries) {
      if (entry.audited)
        m.values.insert({{static_cast<int>(entry.type), entry.sub}, fake::Bytes(size_of(entry.format))});
    }
  });
  const Probe found = probe({line.device(), 115200, 0}, kClock);
  ASSERT_TRUE(found.answers());
  for (const Entry& entry : kEntries) {
    const bool older = entry.type == Client::temperature_estimator;  // is asked where the newer one does not answer
    if (entry.audited && !older) EXPECT_TRUE(found.record->values.count(&entry)) << entry.path;
  }
  EXPECT_EQ(found.record->uid(), "111111112222222233333333");
  EXPECT_EQ(found.record->firmware()->text(), "speed 0.0.32");
  EXPECT_EQ(found.record->coil_temperature_client(), 83);
}

constexpr const Entry& kTimeout = entry<"propeller_motor_control.timeout">;

TEST(SettingReadBack, FindsNothingWhenAllArrived) {
  FakeDialogue module;
  module.values[&kTimeout] = 10;
  EXPECT_THAT(set_timeout(module.ask()), IsEmpty());
  EXPECT_EQ(module.values[&kTimeout], 0.5);
}

TEST(SettingReadBack, FindsWhatDidNotArrive) {
  FakeDialogue module;
  module.values[&kTimeout] = 10;
  module.ignores_sets = true;
  const auto findings = set_timeout(module.ask());
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::fault);
  EXPECT_THAT(findings[0].what, HasSubstr("timeout was set to 0.5 s and reads back 10"));
}

TEST(SettingReadBack, AcceptsOldFirmwareWhereTheEntryIsNotRequired) {
  FakeDialogue module;
  module.values.erase(&entry<"propeller_motor_control.timeout_behavior">);
  EXPECT_THAT(set_timeout(module.ask()), IsEmpty());
  module.values.erase(&kTimeout);
  EXPECT_EQ(set_timeout(module.ask()).size(), 1u);
}

}  // namespace probe_test
}  // namespace kphi::iq
