// Raw sockets against the running simulator: a client of its own, not the drivers.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "base/error.hpp"
#include "drivers/sim/bench_server.hpp"
#include "drivers/sim/control_line.hpp"
#include "drivers/sim/transport/pty.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::sim {
namespace server_test {

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

TEST_F(RunningServer, AnswersOverTcpInOneOrManySegments) {
  const Descriptor socket = connected(SOCK_STREAM, server->addresses().tcp_port);
  std::string question(20, '\0');
  question[0] = 1;  // READCALINFO
  ASSERT_EQ(::send(socket.number(), question.data(), 7, 0), 7);
  ASSERT_EQ(::send(socket.number(), question.data() + 7, 13, 0), 13);
  std::string answer;
  while (answer.size() < 24) {
    const std::string part = receive(socket.number());
    ASSERT_FALSE(part.empty());
    answer += part;
  }
  EXPECT_EQ(hex_of(answer.substr(0, 12)), hex("12 34 02 03 00 0f 42 40 00 0f 42 40"));
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

TEST_F(RunningServer, TakesWritesOverHttp) {
  const auto ask = [&](const std::string& target) {
    const Descriptor socket = connected(SOCK_STREAM, server->addresses().http_port);
    const std::string request = "GET /" + target + " HTTP/1.0\r\n\r\n";
    EXPECT_EQ(::send(socket.number(), request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
    std::string answer;
    for (std::string part = receive(socket.number()); !part.empty(); part = receive(socket.number())) answer += part;
    return answer;
  };
  EXPECT_EQ(ask("setting.cgi?setuserfilter=4").substr(0, 18), "HTTP/1.0 302 Found");
  EXPECT_NE(ask("netftapi2.xml").find("<setuserfilter>4</setuserfilter>"), std::string::npos);
}

/// A server with a script of faults from its first moment on.
struct FaultyServer : RunningServer {
  void begin_again(const std::vector<FaultEntry>& entries) {
    stop();
    ServerSettings settings;
    settings.control = (folder / "control").string();
    for (const auto& entry : entries) settings.bench.faults.push_back(fault_of(entry));
    server.emplace(settings);
    thread = std::thread([this] { server->run(); });
  }
};

TEST_F(FaultyServer, LosesWhatTheScriptSaysAndCountsIt) {
  begin_again({{{"kind", "loss"}, {"at_s", "0"}, {"count", "3"}}});
  const Descriptor socket = connected(SOCK_DGRAM, server->addresses().rdt_port);
  const auto start = bytes("12 34 00 03 00 00 01 90");  // 400 samples: ten datagrams
  ASSERT_EQ(::send(socket.number(), start.data(), start.size(), 0), 8);
  EXPECT_EQ(hex_of(receive(socket.number()).substr(0, 4)), hex("00 00 00 79")) << "121 comes first";
  for (int i = 0; i < 6; ++i) EXPECT_EQ(receive(socket.number()).size(), 1440u);
  server->request_stop();
  thread.join();
  EXPECT_EQ(server->truth().dropped, 3u);
  EXPECT_EQ(server->truth().arrived, 7u);
}

TEST_F(FaultyServer, ForeignDatagramsComeFromAnotherAddress) {
  begin_again({{{"kind", "foreign_source"}, {"at_s", "0"}, {"for_s", "100"}}});
  const Descriptor socket(::socket(AF_INET, SOCK_DGRAM, 0));  // not connected: it hears everybody
  sockaddr_in box{};
  box.sin_family = AF_INET;
  box.sin_port = htons(server->addresses().rdt_port);
  box.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const auto start = bytes("12 34 00 02 00 00 00 05");
  ASSERT_EQ(::sendto(socket.number(), start.data(), start.size(), 0, reinterpret_cast<sockaddr*>(&box), sizeof box), 8);
  int true_ones = 0, foreign = 0;
  for (int i = 0; i < 10; ++i) {
    pollfd waiting{socket.number(), POLLIN, 0};
    ASSERT_GT(::poll(&waiting, 1, 5000), 0);
    std::array<char, 2048> buffer{};
    sockaddr_in from{};
    socklen_t size = sizeof from;
    ASSERT_EQ(::recvfrom(socket.number(), buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &size),
              36);
    ++(from.sin_port == box.sin_port ? true_ones : foreign);
  }
  EXPECT_EQ(true_ones, 5);
  EXPECT_EQ(foreign, 5);
}

TEST_F(FaultyServer, RefusesConnectionsForAWhileAndListensAgain) {
  begin_again({{{"kind", "http_refused"}, {"at_s", "0"}, {"for_s", "0.5"}}});
  const auto connects = [&] {
    const Descriptor socket(::socket(AF_INET, SOCK_STREAM, 0));
    sockaddr_in web{};
    web.sin_family = AF_INET;
    web.sin_port = htons(server->addresses().http_port);
    web.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return ::connect(socket.number(), reinterpret_cast<const sockaddr*>(&web), sizeof web) == 0;
  };
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  bool refused = false, served = false;
  while (!(refused && served) && std::chrono::steady_clock::now() < deadline) {
    const bool now = connects();
    refused = refused || !now;
    served = served || (refused && now);
  }
  EXPECT_TRUE(refused);
  EXPECT_TRUE(served);
}

TEST_F(FaultyServer, AnswersOverTcpInSegmentsOrTogether) {
  begin_again({{{"kind", "tcp_split"}, {"at_s", "0"}, {"count", "1"}, {"size", "7"}, {"delay_s", "0.1"}},
               {{"kind", "tcp_merged"}, {"at_s", "0"}, {"for_s", "1000"}, {"delay_s", "0.3"}}});
  const Descriptor socket = connected(SOCK_STREAM, server->addresses().tcp_port);
  std::string question(20, '\0');
  question[0] = 1;
  ASSERT_EQ(::send(socket.number(), question.data(), 20, 0), 20);
  std::vector<std::size_t> segments;
  for (std::size_t received = 0; received < 24; received += segments.back()) {
    segments.push_back(receive(socket.number()).size());
    ASSERT_GT(segments.back(), 0u);
  }
  EXPECT_EQ(segments, (std::vector<std::size_t>{7, 7, 7, 3}));
  ASSERT_EQ(::send(socket.number(), question.data(), 20, 0), 20);
  ASSERT_EQ(::send(socket.number(), question.data(), 20, 0), 20);
  EXPECT_EQ(receive(socket.number()).size(), 48u);
}

TEST_F(FaultyServer, MovesToAnotherAddressOfThisMachine) {
  begin_again({{{"kind", "address"}, {"at_s", "0.2"}, {"address", "127.0.0.3"}}});
  const auto answers_at = [&](const char* address) {
    const Descriptor socket(::socket(AF_INET, SOCK_STREAM, 0));
    sockaddr_in web{};
    web.sin_family = AF_INET;
    web.sin_port = htons(server->addresses().http_port);
    ::inet_pton(AF_INET, address, &web.sin_addr);
    return ::connect(socket.number(), reinterpret_cast<const sockaddr*>(&web), sizeof web) == 0;
  };
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (!answers_at("127.0.0.3") && std::chrono::steady_clock::now() < deadline) {
  }
  EXPECT_TRUE(answers_at("127.0.0.3"));
  EXPECT_FALSE(answers_at("127.0.0.1"));
}

TEST_F(FaultyServer, AnAddressOfNobodyIsSilenceNotAnEnd) {
  begin_again({{{"kind", "address"}, {"at_s", "0.1"}, {"for_s", "0.2"}, {"address", "203.0.113.9"}}});
  const std::string control = server->addresses().control;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (nlohmann::json::parse(tell(control, "status"))["bench_time_s"].get<double>() < 0.4 &&
         std::chrono::steady_clock::now() < deadline) {
  }
  const Descriptor socket = connected(SOCK_DGRAM, server->addresses().rdt_port);
  const auto start = bytes("12 34 00 02 00 00 00 01");
  ASSERT_EQ(::send(socket.number(), start.data(), start.size(), 0), 8);
  EXPECT_EQ(receive(socket.number()).size(), 36u) << "back where it was";
}

/// Writes to the port until the answer has come, 5 s at most.
std::string ask_port(int number, std::string_view spelt, std::size_t size) {
  const auto request = bytes(spelt);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  std::string answer;
  EXPECT_EQ(::write(number, request.data(), request.size()), static_cast<ssize_t>(request.size()));
  while (answer.size() < size && std::chrono::steady_clock::now() < deadline) {
    pollfd waiting{number, POLLIN, 0};
    if (::poll(&waiting, 1, 200) <= 0 || (waiting.revents & POLLIN) == 0) break;
    answer += receive(number);
  }
  return hex_of(answer);
}

void set_rate(int number, speed_t rate) {
  termios line{};
  ASSERT_EQ(::tcgetattr(number, &line), 0);
  cfmakeraw(&line);
  cfsetspeed(&line, rate);
  ASSERT_EQ(::tcsetattr(number, TCSANOW, &line), 0);
}

TEST_F(RunningServer, AtTheWrongRateTheMotorIsNotUnderstood) {
  const Descriptor port = motor_port();
  set_rate(port.number(), B921600);
  EXPECT_EQ(ask_port(port.number(), "55 02 05 10 00 2B 81", 11), "");
  set_rate(port.number(), B115200);
  std::string answer;
  for (int i = 0; i < 20 && answer.size() < 33; ++i) answer = ask_port(port.number(), "55 02 05 10 00 2B 81", 11);
  EXPECT_NE(answer.find(hex("55 06 05 10 03 20 00 10 00 39 08")), std::string::npos);
}

TEST_F(FaultyServer, UnpluggedTheLinkIsGoneAndComesBackAsAnotherTerminal) {
  stop();
  ServerSettings settings;
  settings.control = (folder / "control").string();
  settings.device = (folder / "dev" / "motor").string();
  settings.bench.faults.push_back(
      fault_of({{"kind", "motor_unplug"}, {"at_s", "0.3"}, {"for_s", "0.3"}, {"other", "true"}}));
  server.emplace(settings);
  const std::string link = server->addresses().device;
  const fs::path first = fs::read_symlink(link);
  const Descriptor port = motor_port();
  thread = std::thread([this] { server->run(); });
  pollfd waiting{port.number(), POLLIN, 0};
  ASSERT_GT(::poll(&waiting, 1, 5000), 0);
  EXPECT_NE(waiting.revents & (POLLHUP | POLLERR), 0) << "the client sees the hang-up";
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  std::error_code error;
  while (fs::exists(fs::symlink_status(link, error)) && std::chrono::steady_clock::now() < deadline) {
  }
  EXPECT_FALSE(fs::exists(fs::symlink_status(link, error)));
  while (!fs::exists(fs::symlink_status(link, error)) && std::chrono::steady_clock::now() < deadline) {
  }
  const Descriptor again(::open(link.c_str(), O_RDWR | O_NOCTTY));
  ASSERT_GE(again.number(), 0);
  EXPECT_EQ(ask_port(again.number(), "55 02 05 04 00 9C 4E", 11).substr(15, 12), "18 00 41 00 ") << "another uid";
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

// The client still holds the lock of that number: whoever got it would be refused as a second program.
TEST(Pty, KeepsTheNumberOfAPulledAdapter) {
  const fs::path folder = fresh_folder();
  Pty line(folder / "motor");
  const fs::path pulled = fs::read_symlink(folder / "motor");
  line.unplug();
  EXPECT_FALSE(fs::exists(pulled)) << "the client sees a hang-up";
  const Pty other(folder / "other"), third(folder / "third");
  EXPECT_NE(fs::read_symlink(folder / "other"), pulled);
  EXPECT_NE(fs::read_symlink(folder / "third"), pulled);
  line.plug();
  EXPECT_NE(fs::read_symlink(folder / "motor"), pulled);
  fs::remove_all(folder);
}

}  // namespace server_test
}  // namespace kphi::sim
