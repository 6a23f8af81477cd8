#include <gtest/gtest.h>

#include "drivers/sim/netbox/device.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::sim::tcp_test {

using namespace test;

std::string text(std::string_view spelt) {
  const auto data = bytes(spelt);
  return {data.begin(), data.end()};
}
std::string spelt(const std::string& data) {
  return hex(std::span(reinterpret_cast<const std::uint8_t*>(data.data()), data.size()));
}

constexpr std::string_view kReadCalibration = "01 00000000000000 00000000000000 00 0000 0000";

NetBoxDevice si_40_2() {
  NetBoxSettings settings;
  settings.range = {40, 40, 120, 2, 2, 2};
  return NetBoxDevice(settings);
}

struct NetBoxTcp : ::testing::Test {
  std::string ask(std::string_view command) {
    std::string received = text(command);
    const std::string answer = box.tcp(received);
    EXPECT_TRUE(received.empty());
    return spelt(answer);
  }
  NetBoxDevice box = si_40_2();
};

TEST_F(NetBoxTcp, CalibrationIsTheManualsExample) {
  EXPECT_EQ(ask(kReadCalibration), hex("12 34 02 03 00 0f 42 40 00 0f 42 40 04 c5 04 c5 0e 4e 00 3d 00 3d 00 3d"));
}

TEST_F(NetBoxTcp, CommandsMayComeInPieces) {
  const std::string whole = text(kReadCalibration) + text(kReadCalibration);
  std::string received, answers;
  for (const char byte : whole) {
    received += byte;
    answers += box.tcp(received);
  }
  EXPECT_EQ(answers.size(), 24u + 24u);
}

TEST_F(NetBoxTcp, UnknownCommandsAreIgnored) {
  EXPECT_EQ(ask("00 00000000000000 00000000000000 00 0000 0000"), "");  // READFT
  EXPECT_EQ(ask("02 00000000000000 00000000000000 00 0000 0000"), "");  // WRITETRANSFORM
}

}  // namespace kphi::sim::tcp_test
