#include "drivers/iq/scan.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "test/drivers/iq/module_on_a_line.hpp"

namespace kphi::iq {
namespace {

using namespace std::chrono_literals;
using fake::Module;
using fake::ModuleOnALine;

std::vector<int> ids_of(const std::vector<Found>& found) {
  std::vector<int> ids;
  for (const Found& module : found) ids.push_back(module.module_id);
  return ids;
}

void give_id(Module& module, int id) {
  module.id = id;
  module.values[{5, 14}] = fake::u8(id);
}

TEST(Scan, FindsTheModulesOfALineWithinTwoSeconds) {
  ModuleOnALine line;
  line.with([](Module& m) { give_id(m, 5); });
  line.with_others([](std::vector<Module>& others) {
    others.resize(2);
    give_id(others[0], 0);
    give_id(others[1], 62);
  });
  const auto start = std::chrono::steady_clock::now();
  const auto found = scan(line.device(), 115200);
  EXPECT_LT(std::chrono::steady_clock::now() - start, 2s);
  EXPECT_EQ(ids_of(found), (std::vector<int>{0, 5, 62}));
  for (const Found& module : found) EXPECT_FALSE(module.legacy);
  EXPECT_TRUE(line.left_coasting());
}

TEST(Scan, KnowsOldFirmwareByTheIdThatSystemControlTells) {
  ModuleOnALine line;
  line.with([](Module& m) {
    give_id(m, 9);
    m.old_system_control = true;
  });
  const auto found = scan(line.device(), 115200);
  ASSERT_EQ(ids_of(found), (std::vector<int>{9}));
  EXPECT_TRUE(found[0].legacy);
}

TEST(Scan, FindsNobodyOnADeadLine) {
  ModuleOnALine line;
  line.with([](Module& m) { m.mute = true; });
  EXPECT_TRUE(scan(line.device(), 115200).empty());
}

}  // namespace
}  // namespace kphi::iq
