#include "drivers/iq/baud.hpp"

#include <gtest/gtest.h>

#include "drivers/device_error.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"

namespace kphi::iq {
namespace {

using fake::Module;
using fake::ModuleOnALine;
using Effect = BaudChange::Effect;

void speak_at(ModuleOnALine& line, unsigned baud) {
  line.with([&](Module& m) { m.baud = baud; });
}
unsigned baud_of(ModuleOnALine& line) {
  return line.with([](Module& m) { return m.baud; });
}
std::size_t saves(ModuleOnALine& line) {
  return line.with([](Module& m) { return m.count([](const auto& h) { return h.access == 2; }); });
}

TEST(BaudSearch, TriesTheRatesInTheirOrder) {
  EXPECT_EQ(bauds_to_try(),
            (std::vector<unsigned>{115200, 921600, 1000000, 2000000, 460800, 230400, 57600, 38400, 19200, 9600}));
}

TEST(BaudSearch, FindsAModuleAtWhateverRateAndLeavesItCoasting) {
  for (const unsigned baud : {115200u, 921600u, 57600u, 9600u}) {
    ModuleOnALine line;
    speak_at(line, baud);
    EXPECT_EQ(find_baud(line.device(), 0), baud);
    EXPECT_TRUE(line.left_coasting());
    EXPECT_EQ(
        line.with([](Module& m) { return m.count([](const auto& h) { return h.is_motion() && !h.is_coast(); }); }), 0u);
  }
}

TEST(BaudSearch, SaysWhenNobodyAnswers) {
  ModuleOnALine line;
  line.with([](Module& m) { m.mute = true; });
  EXPECT_EQ(find_baud(line.device(), 0), std::nullopt);
}

TEST(BaudChange, WorksWithFirmwareThatObeysAtOnceAndBack) {
  ModuleOnALine line;
  speak_at(line, 115200);
  const BaudChange up = change_baud(line.device(), 0, 115200, 921600);
  EXPECT_EQ(up.effect, Effect::at_once);
  EXPECT_EQ(up.to, 921600u);
  EXPECT_EQ(up.answered, 100);
  EXPECT_EQ(baud_of(line), 921600u);
  EXPECT_EQ(change_baud(line.device(), 0, 921600, 115200).effect, Effect::at_once);
  EXPECT_EQ(baud_of(line), 115200u);
  EXPECT_EQ(saves(line), 0u) << "setting the rate keeps it; nothing else is saved";
}

TEST(BaudChange, RebootsFirmwareThatNeedsIt) {
  ModuleOnALine line;
  speak_at(line, 115200);
  line.with([](Module& m) { m.baud_needs_reboot = true; });
  const BaudChange change = change_baud(line.device(), 0, 115200, 921600);
  EXPECT_EQ(change.effect, Effect::after_reboot);
  EXPECT_EQ(baud_of(line), 921600u);
  EXPECT_EQ(line.with([](Module& m) { return m.restarts; }), 1);
  EXPECT_EQ(change_baud(line.device(), 0, 921600, 115200).effect, Effect::after_reboot);
  EXPECT_EQ(baud_of(line), 115200u);
}

TEST(BaudChange, RebootsOldFirmwareByIdZero) {
  ModuleOnALine line;
  speak_at(line, 115200);
  line.with([](Module& m) {
    m.id = 7;
    m.values[{5, 14}] = fake::u8(7);
    m.old_system_control = m.baud_needs_reboot = true;
  });
  EXPECT_EQ(change_baud(line.device(), 7, 115200, 921600).effect, Effect::after_reboot);
}

TEST(BaudChange, RollsBackFromARateThatIsNotReliable) {
  ModuleOnALine line;
  speak_at(line, 115200);
  line.with([](Module& m) { m.baud_of_others_fails = true; });
  const BaudChange change = change_baud(line.device(), 0, 115200, 921600);
  EXPECT_EQ(change.effect, Effect::rolled_back) << change.summary();
  EXPECT_EQ(change.to, 115200u);
  EXPECT_LT(change.answered, 100);
  EXPECT_EQ(baud_of(line), 115200u);
  EXPECT_TRUE(line.left_coasting());
}

TEST(BaudChange, RefusesAModuleThatDoesNotCoast) {
  ModuleOnALine line;
  speak_at(line, 115200);
  line.with([](Module& m) {
    m.ignore_sets = true;
    m.values[{50, 0}] = fake::u8(3);
  });
  EXPECT_THROW((void)change_baud(line.device(), 0, 115200, 921600), DeviceError);
  EXPECT_EQ(line.with([](Module& m) { return m.count([](const auto& h) { return h.type == 16; }); }), 0u);
}

TEST(BaudChange, RefusesARateThatThisSystemDoesNotKnow) {
  EXPECT_THROW((void)change_baud("/dev/no_such_tty", 0, 115200, 250000), DeviceError);
}

}  // namespace
}  // namespace kphi::iq
