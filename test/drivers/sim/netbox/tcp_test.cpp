#include <gtest/gtest.h>

#include "drivers/sim/netbox/device.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::sim {
namespace {

using test::bytes;
using test::hex;

std::string text(std::string_view spelt) {
  const auto data = bytes(spelt);
  return {data.begin(), data.end()};
}
std::string spelt(const std::string& data) {
  return hex(std::span(reinterpret_cast<const std::uint8_t*>(data.data()), data.size()));
}

constexpr std::string_view kReadForces = "00 00000000000000 00000000000000 00 0000 0000";
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

TEST_F(NetBoxTcp, ForcesAreSixteenBitsEach) {
  box.set_status(0x80010000u);
  box.sample({Instant{0}, {0, 0, 3.662, 0, 0, 0}});
  EXPECT_EQ(ask(kReadForces), hex("12 34 80 01 00 00 00 00 03 e8 00 00 00 00 00 00"));
}

TEST_F(NetBoxTcp, BiasComesWithTheReading) {
  box.sample({Instant{0}, {0, 0, 3.662, 0, 0, 0}});
  ask("00 00000000000000 00000000000000 00 0000 0001");
  box.sample({Instant{1}, {0, 0, 3.662, 0, 0, 0}});
  EXPECT_EQ(ask(kReadForces), hex("12 34 00 00 00 00 00 00 00 00 00 00 00 00 00 00"));
}

TEST_F(NetBoxTcp, ReadingOverwritesTheConditions) {
  (void)box.http("GET /moncon.cgi?setmce=1&mce0=1&mcx0=2&mcv0=0 HTTP/1.0");
  EXPECT_TRUE(box.settings().conditions[0].enabled);
  ask(kReadForces);
  EXPECT_FALSE(box.settings().conditions[0].enabled);
}

TEST_F(NetBoxTcp, CommandsMayComeInPieces) {
  const std::string whole = text(kReadCalibration) + text(kReadForces);
  std::string received, answers;
  for (const char byte : whole) {
    received += byte;
    answers += box.tcp(received);
  }
  EXPECT_EQ(answers.size(), 24u + 16u);
}

TEST_F(NetBoxTcp, UnknownCommandsAreIgnored) {
  EXPECT_EQ(ask("02 00000000000000 00000000000000 00 0000 0000"), "");  // WRITETRANSFORM
}

}  // namespace
}  // namespace kphi::sim
