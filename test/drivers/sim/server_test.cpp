// Raw sockets against the running simulator: a client of its own, not the drivers.
#include "drivers/sim/server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "drivers/device_error.hpp"
#include "drivers/sim/control_line.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::sim {
namespace {

namespace fs = std::filesystem;
using test::bytes;
using test::hex;

fs::path fresh_folder() {
  std::string name = (fs::temp_directory_path() / "kphi-sim-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  return name;
}

/// Waits for data with a deadline of 5 s; "" when none came.
std::string receive(int number) {
  pollfd waiting{number, POLLIN, 0};
  if (::poll(&waiting, 1, 5000) <= 0) return {};
  std::array<char, 2048> buffer{};
  const ssize_t count = ::read(number, buffer.data(), buffer.size());
  return count > 0 ? std::string(buffer.data(), static_cast<std::size_t>(count)) : std::string();
}

std::string hex_of(const std::string& data) {
  return hex(std::span(reinterpret_cast<const std::uint8_t*>(data.data()), data.size()));
}

class RunningServer : public ::testing::Test {
 protected:
  RunningServer() : folder(fresh_folder()) {
    ServerSettings settings;
    settings.bench.time_scale = 5;
    settings.device = (folder / "dev" / "motor").string();
    settings.control = (folder / "control").string();
    server.emplace(settings);
    thread = std::thread([this] { server->run(); });
  }
  ~RunningServer() override {
    stop();
    fs::remove_all(folder);
  }
  void stop() {
    if (thread.joinable()) {
      server->request_stop();
      thread.join();
    }
    server.reset();
  }
  [[nodiscard]] Descriptor connected(int type, std::uint16_t port) const {
    Descriptor socket(::socket(AF_INET, type, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return socket;
  }
  [[nodiscard]] Descriptor motor_port() const {
    return Descriptor(::open(server->addresses().device.c_str(), O_RDWR | O_NOCTTY));
  }

  fs::path folder;
  std::optional<Server> server;
  std::thread thread;
};

TEST_F(RunningServer, StreamsOverUdp) {
  const Descriptor socket = connected(SOCK_DGRAM, server->addresses().rdt_port);
  const auto start = bytes("12 34 00 03 00 00 00 64");  // 100 samples
  ASSERT_EQ(::send(socket.number(), start.data(), start.size(), 0), 8);
  std::vector<std::size_t> sizes;
  std::string first;
  for (int i = 0; i < 3; ++i) {
    const std::string datagram = receive(socket.number());
    sizes.push_back(datagram.size());
    if (i == 0) first = datagram;
  }
  EXPECT_EQ(sizes, (std::vector<std::size_t>{1440, 1440, 720}));
  EXPECT_EQ(hex_of(first.substr(0, 4)), hex("00 00 00 01"));
}

TEST_F(RunningServer, KeepsThePaceOfItsClock) {
  const Descriptor socket = connected(SOCK_DGRAM, server->addresses().rdt_port);
  const int buffer = 4 << 20;
  ::setsockopt(socket.number(), SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
  const auto start = bytes("12 34 00 03 00 00 88 b8");  // 35000 samples: 5 s of the bench, 1 s of wall time
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(::send(socket.number(), start.data(), start.size(), 0), 8);
  int records = 0;
  while (records < 35000) {
    const std::string datagram = receive(socket.number());
    ASSERT_FALSE(datagram.empty()) << "after " << records;
    records += static_cast<int>(datagram.size() / 36);
  }
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_GT(wall, 0.9);
  EXPECT_LT(wall, 4.0);
}

TEST_F(RunningServer, ServesItsConfigurationOverHttp) {
  for (int i = 0; i < 3; ++i) {
    const Descriptor socket = connected(SOCK_STREAM, server->addresses().http_port);
    const std::string request = "GET /netftapi2.xml HTTP/1.0\r\nHost: box\r\n\r\n";
    ASSERT_EQ(::send(socket.number(), request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
    std::string answer;
    for (std::string part = receive(socket.number()); !part.empty(); part = receive(socket.number())) answer += part;
    EXPECT_EQ(answer.substr(0, 15), "HTTP/1.0 200 OK");
    EXPECT_NE(answer.find("</netft>"), std::string::npos) << "whole, and the connection closed";
  }
}

TEST_F(RunningServer, MotorAnswersOnThePtyAlsoAfterAReopen) {
  for (int i = 0; i < 2; ++i) {
    const Descriptor port = motor_port();
    ASSERT_GE(port.number(), 0);
    const auto get = bytes("55 02 05 10 00 2B 81");
    ASSERT_EQ(::write(port.number(), get.data(), get.size()), 7);
    std::string answer;
    while (answer.size() < 11) {
      const std::string part = receive(port.number());
      ASSERT_FALSE(part.empty());
      answer += part;
    }
    EXPECT_EQ(hex_of(answer), hex("55 06 05 10 03 20 00 10 00 39 08"));
  }
}

TEST_F(RunningServer, PtyIsRaw) {
  const Descriptor port = motor_port();
  termios line{};
  ASSERT_EQ(::tcgetattr(port.number(), &line), 0);
  EXPECT_EQ(line.c_lflag & (ICANON | ECHO | ISIG), 0u);
  EXPECT_EQ(line.c_oflag & OPOST, 0u);
}

TEST_F(RunningServer, MountsOverTheControlLineAndTellsItsState) {
  const std::string control = server->addresses().control;
  EXPECT_EQ(tell(control, "mount 5x3 90"), "ok 5x3 90");
  EXPECT_EQ(tell(control, "mount 8x3 90").substr(0, 6), "error ");
  const Descriptor port = motor_port();
  const auto spin = bytes("55 06 34 05 01 00 00 C8 42 95 37");  // 100 rad/s
  ASSERT_EQ(::write(port.number(), spin.data(), spin.size()), 11);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  nlohmann::json status;
  do {
    status = nlohmann::json::parse(tell(control, "status"));
  } while (std::abs(status["speed_rad_s"].get<double>() - 100) > 1 && std::chrono::steady_clock::now() < deadline);
  EXPECT_NEAR(status["speed_rad_s"].get<double>(), 100, 1);
  EXPECT_EQ(status["mounted"], "5x3 90");
  EXPECT_EQ(status["drive"]["mode"], "velocity");
  EXPECT_EQ(status["drive"]["target"], 100);
  EXPECT_GT(status["last_motion_command_s"].get<double>(), 0);
  EXPECT_EQ(tell(control, "mount 5x3 180").substr(0, 6), "error ") << "it turns";
}

TEST_F(RunningServer, ASecondSimulatorOnTheSameControlLineIsRefused) {
  ServerSettings settings;
  settings.control = server->addresses().control;
  EXPECT_THROW(Server second(settings), DeviceError);
  EXPECT_EQ(tell(server->addresses().control, "mount 5x2 0"), "ok 5x2 0") << "the first one is unharmed";
}

TEST_F(RunningServer, LeavesNothingBehind) {
  const Addresses addresses = server->addresses();
  EXPECT_TRUE(fs::is_symlink(addresses.device));
  stop();
  EXPECT_FALSE(fs::exists(fs::symlink_status(addresses.device)));
  EXPECT_FALSE(fs::exists(addresses.control));
  EXPECT_THROW((void)tell(addresses.control, "status"), DeviceError);
}

TEST(Server, RefusesToReplaceAFileByItsLink) {
  const fs::path folder = fresh_folder();
  ServerSettings settings;
  settings.control = (folder / "control").string();
  settings.device = (folder / "precious").string();
  { const Descriptor file(::open(settings.device.c_str(), O_CREAT | O_WRONLY, 0600)); }
  EXPECT_THROW(Server server(settings), DeviceError);
  EXPECT_TRUE(fs::is_regular_file(settings.device));
  fs::remove_all(folder);
}

TEST(Server, ReplacesTheSocketAndLinkOfADeadSimulator) {
  const fs::path folder = fresh_folder();
  ServerSettings settings;
  settings.control = (folder / "control").string();
  settings.device = (folder / "motor").string();
  fs::create_symlink("/dev/pts/no-such", settings.device);
  {
    const Descriptor dead(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    settings.control.copy(address.sun_path, sizeof address.sun_path - 1);
    ASSERT_EQ(::bind(dead.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  Server server(settings);
  EXPECT_NE(fs::read_symlink(settings.device), "/dev/pts/no-such");
  fs::remove_all(folder);
}

}  // namespace
}  // namespace kphi::sim
