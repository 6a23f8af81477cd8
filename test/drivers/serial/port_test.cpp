#include "drivers/serial/port.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <memory>

#include "drivers/device_error.hpp"
#include "test/drivers/serial/pseudo_terminal.hpp"

namespace kphi::serial {
namespace {

using fake::PseudoTerminal;

std::string refusal(const std::string& device, unsigned baud) {
  boost::asio::io_context io;
  try {
    Port port(io, device, baud);
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

TEST(Port, IsRawEightBitsWithoutParityAtTheBaudAskedFor) {
  PseudoTerminal terminal;
  boost::asio::io_context io;
  const Port port(io, terminal.name(), 921600);
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
  boost::asio::io_context io;
  Port port(io, terminal.name(), 115200);
  std::string all;
  for (int i = 0; i < 256; ++i) all.push_back(static_cast<char>(i));
  const auto size = static_cast<ssize_t>(all.size());
  ASSERT_EQ(::write(terminal.master(), all.data(), all.size()), size);
  std::string got(all.size(), '\0');
  boost::asio::read(port.stream(), boost::asio::buffer(got));
  EXPECT_EQ(got, all);
  boost::asio::write(port.stream(), boost::asio::buffer(all));
  for (std::size_t n = 0; n < all.size();) {
    const auto more = ::read(terminal.master(), got.data() + n, got.size() - n);
    ASSERT_GT(more, 0);
    n += static_cast<std::size_t>(more);
  }
  EXPECT_EQ(got, all);
}

TEST(Port, IsRefusedToASecondOpener) {
  PseudoTerminal terminal;
  boost::asio::io_context io;
  auto first = std::make_unique<Port>(io, terminal.name(), 115200);
  EXPECT_NE(refusal(terminal.name(), 115200).find("in use by another program"), std::string::npos);
  first.reset();
  EXPECT_EQ(refusal(terminal.name(), 115200), "") << "and free again afterwards";
}

TEST(Port, RefusesAnUnknownBaudBeforeTouchingTheDevice) {
  EXPECT_NE(refusal("/dev/no_such_tty", 250000).find("250000 baud is not a rate"), std::string::npos);
  EXPECT_NE(refusal("/dev/no_such_tty", 0).find("0 baud"), std::string::npos);
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
  EXPECT_NE(refusal("/dev/null", 115200).find("it is no serial port"), std::string::npos);
}

TEST(Port, NamesTheGroupWhenPermissionIsMissing) {
  if (geteuid() == 0) GTEST_SKIP() << "root is permitted everything";
  PseudoTerminal terminal;
  ASSERT_EQ(chmod(terminal.name().c_str(), 0), 0);
  EXPECT_NE(refusal(terminal.name(), 115200).find("dialout"), std::string::npos);
}

}  // namespace
}  // namespace kphi::serial
