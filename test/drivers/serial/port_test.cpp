#include "drivers/serial/port.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <memory>
#include <numeric>
#include <vector>

#include "test/drivers/serial/pseudo_terminal.hpp"
#include "test/refusal.hpp"

namespace kphi::serial {
namespace port_test {

using fake::PseudoTerminal;

std::string refusal(const std::string& device, unsigned baud) {
  return kphi::refusal([&] { Port port(device, baud); });
}

TEST(Port, IsRawEightBitsWithoutParityAtTheBaudAskedFor) {
  PseudoTerminal terminal;
  const Port port(terminal.name(), 921600);
  const termios line = terminal.line();
  EXPECT_EQ(cfgetospeed(&line), static_cast<speed_t>(B921600));
  EXPECT_EQ(line.c_cflag & static_cast<tcflag_t>(CSIZE), static_cast<tcflag_t>(CS8));
  EXPECT_EQ(line.c_cflag & static_cast<tcflag_t>(PARENB | CSTOPB | CRTSCTS), 0u);
  EXPECT_EQ(line.c_lflag & static_cast<tcflag_t>(ICANON | ECHO | ISIG), 0u);
  EXPECT_EQ(line.c_iflag & static_cast<tcflag_t>(IXON | ICRNL | ISTRIP), 0u);
  EXPECT_EQ(line.c_oflag & static_cast<tcflag_t>(OPOST), 0u);
}

TEST(Port, CarriesEveryByteUnchangedBothWays) {
  PseudoTerminal terminal;
  Port port(terminal.name(), 115200);
  std::vector<std::uint8_t> all(256);
  std::iota(all.begin(), all.end(), std::uint8_t{0});
  ASSERT_EQ(::write(terminal.master(), all.data(), all.size()), static_cast<ssize_t>(all.size()));
  std::vector<std::uint8_t> got(all.size());
  for (std::size_t n = 0; n < all.size();) {
    ASSERT_TRUE(port.wait(std::chrono::seconds(2)));
    n += port.read(std::span(got).subspan(n));
  }
  EXPECT_EQ(got, all);
  ASSERT_EQ(port.write(all), all.size());
  for (std::size_t n = 0; n < all.size();) {
    const auto more = ::read(terminal.master(), got.data() + n, got.size() - n);
    ASSERT_GT(more, 0);
    n += static_cast<std::size_t>(more);
  }
  EXPECT_EQ(got, all);
}

TEST(Port, NeverBlocks) {
  PseudoTerminal terminal;
  Port port(terminal.name(), 115200);
  std::array<std::uint8_t, 16> some;
  EXPECT_EQ(port.read(some), 0u);
  EXPECT_FALSE(port.wait(std::chrono::milliseconds(1)));
  const std::vector<std::uint8_t> much(4096);
  // The kernel carries on what it was given, which may make room once more.
  int refusals = 0;
  for (int i = 0; i < 1000 && refusals < 10; ++i) refusals += port.write(much) == 0 ? 1 : 0;
  EXPECT_EQ(refusals, 10) << "nobody reads at the other end";
}

TEST(Port, ThrowsWhenItIsUnplugged) {
  PseudoTerminal terminal;
  Port port(terminal.name(), 115200);
  terminal.unplug();
  std::array<std::uint8_t, 16> some;
  EXPECT_THROW((void)port.read(some), PortGone);
  EXPECT_TRUE(port.wait(std::chrono::seconds(1))) << "there is something to tell";
}

TEST(Port, ChangesItsBaudAndForgetsWhatWasOnItsWay) {
  PseudoTerminal terminal;
  Port port(terminal.name(), 115200);
  ASSERT_EQ(::write(terminal.master(), "old", 3), 3);
  ASSERT_TRUE(port.wait(std::chrono::seconds(2)));
  port.set_baud(921600);
  EXPECT_EQ(port.baud(), 921600u);
  const termios line = terminal.line();
  EXPECT_EQ(cfgetospeed(&line), static_cast<speed_t>(B921600));
  std::array<std::uint8_t, 16> some;
  EXPECT_EQ(port.read(some), 0u);
  EXPECT_THROW(port.set_baud(250000), DeviceError);
}

TEST(Port, IsRefusedToASecondOpener) {
  PseudoTerminal terminal;
  auto first = std::make_unique<Port>(terminal.name(), 115200);
  EXPECT_NE(refusal(terminal.name(), 115200).find("in use by another program"), std::string::npos);
  first.reset();
  EXPECT_EQ(refusal(terminal.name(), 115200), "") << "and free again afterwards";
}

TEST(Port, RefusesAnUnknownBaudBeforeTouchingTheDevice) {
  EXPECT_NE(refusal("/dev/no_such_tty", 250000).find("unknown baud rate 250000"), std::string::npos);
  EXPECT_NE(refusal("/dev/no_such_tty", 0).find("unknown baud rate 0"), std::string::npos);
  for (const unsigned baud : {9600u, 19200u, 38400u, 57600u, 115200u, 230400u, 460800u, 921600u, 1000000u, 2000000u}) {
    PseudoTerminal terminal;
    EXPECT_EQ(refusal(terminal.name(), baud), "") << baud;
  }
}

TEST(Port, SaysWhatIsWrongAndWhatToDo) {
  const std::string missing = refusal("/dev/no_such_tty", 115200);
  EXPECT_NE(missing.find("/dev/no_such_tty: open: No such file"), std::string::npos) << missing;
  EXPECT_TRUE(missing.find("plug it in") != std::string::npos ||
              missing.find("/dev/serial/by-id/") != std::string::npos);
  EXPECT_NE(refusal("/dev/null", 115200).find("not a serial port"), std::string::npos);
}

TEST(Port, NamesTheGroupWhenPermissionIsMissing) {
  PseudoTerminal terminal;
  ASSERT_EQ(chmod(terminal.name().c_str(), 0), 0);
  // Root is permitted everything: who opens is somebody else then.
  constexpr uid_t kNobody = 65534;
  const uid_t user = geteuid();
  if (user == 0) ASSERT_EQ(seteuid(kNobody), 0);
  const std::string text = refusal(terminal.name(), 115200);
  if (user == 0) ASSERT_EQ(seteuid(user), 0);
  EXPECT_NE(text.find("dialout"), std::string::npos) << text;
}

}  // namespace port_test
}  // namespace kphi::serial
