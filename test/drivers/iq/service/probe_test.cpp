#include "drivers/iq/service/probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"

namespace kphi::iq {
namespace {

using fake::Module;
using fake::ModuleOnALine;
using testing::HasSubstr;

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

TEST(Search, TriesTheRatesInTheirOrder) {
  EXPECT_EQ(bauds_to_try(),
            (std::vector<unsigned>{115200, 921600, 1000000, 2000000, 460800, 230400, 57600, 38400, 19200, 9600}));
}

TEST(Search, FindsAModuleAtAnyRateAndLeavesItCoasting) {
  for (const unsigned baud : {115200u, 921600u, 57600u, 9600u}) {
    ModuleOnALine line;
    line.with([&](Module& m) { m.baud = baud; });
    EXPECT_EQ(find_baud(line.device(), 0), baud);
    EXPECT_TRUE(line.left_coasting());
    EXPECT_TRUE(only_coasted(line));
  }
}

TEST(Search, FindsTheIdsOfALine) {
  ModuleOnALine line;
  line.with([](Module& m) { give_id(m, 5); });
  line.with_others([](std::vector<Module>& others) {
    others.resize(2);
    give_id(others[1], 62);
  });
  EXPECT_EQ(find_ids(line.device(), 115200), (std::vector<int>{0, 5, 62}));
  EXPECT_TRUE(line.left_coasting());
  EXPECT_TRUE(only_coasted(line));
}

TEST(Search, FindsNothingOnADeadLine) {
  ModuleOnALine line;
  line.with([](Module& m) { m.mute = true; });
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

TEST(Probe, SaysUnderWhichIdTheModuleAnswers) {
  ModuleOnALine line;
  line.with([](Module& m) { give_id(m, 7); });
  const auto lines = findings_of({line.device(), 115200, 0});
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[1], "fault: id 7 answers at 115200 baud, not id 0; write module_id: 7 under iq: in the bench file");
  EXPECT_TRUE(only_coasted(line));
}

TEST(Probe, SaysWhereItSearchedInVain) {
  ModuleOnALine line;
  line.with([](Module& m) { m.mute = true; });
  const auto lines = findings_of({line.device(), 115200, 0});
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_THAT(lines[1], HasSubstr("note: searched for it at 115200, 921600, 1000000"));
}

TEST(Probe, SearchesOnlyWhenAskedAndOnlyForASilentModule) {
  ModuleOnALine silent, stubborn;
  silent.with([](Module& m) { m.mute = true; });
  ProbeSettings no_search;
  no_search.search = false;
  EXPECT_EQ(findings_of({silent.device(), 115200, 0}, no_search).size(), 1u);
  stubborn.with([](Module& m) {
    m.ignore_sets = true;
    m.values[{50, 0}] = fake::u8(3);
  });
  EXPECT_EQ(findings_of({stubborn.device(), 115200, 0}).size(), 1u) << "it answers, and does not coast";
  EXPECT_TRUE(stubborn.left_coasting());
  EXPECT_EQ(findings_of({"/dev/no_such_tty", 115200, 0}).size(), 1u);
}

}  // namespace
}  // namespace kphi::iq
