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
#include "test/drivers/sim/fault_words.hpp"
#include "test/drivers/sim/hex.hpp"
#include "test/soon.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::sim::server_test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using kphi::test::soon;
using kphi::test::TemporaryFolder;
using namespace test;

constexpr std::string_view kGetFirmware = "55 02 05 10 00 2B 81";
const std::string kFirmware = hex("55 06 05 10 03 20 00 10 00 39 08");

sockaddr_in address_of(std::uint16_t port, const char* host = "127.0.0.1") {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  ::inet_pton(AF_INET, host, &address.sin_addr);
  return address;
}

bool connects(const Descriptor& socket, const sockaddr_in& address) {
  return ::connect(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

bool connects(const sockaddr_in& address) { return connects(Descriptor(::socket(AF_INET, SOCK_STREAM, 0)), address); }

bool has_data(const Descriptor& from, int patience_ms = 5000) {
  pollfd waiting{from.number(), POLLIN, 0};
  return ::poll(&waiting, 1, patience_ms) > 0 && (waiting.revents & POLLIN) != 0;
}

/// Waits for data with a deadline of 5 s; "" when none came.
std::string receive(const Descriptor& from) {
  if (!has_data(from)) return {};
  std::array<char, 2048> buffer{};
  const ssize_t count = ::read(from.number(), buffer.data(), buffer.size());
  return count > 0 ? std::string(buffer.data(), static_cast<std::size_t>(count)) : std::string();
}

/// So many bytes, or what came until the end.
std::string receive(const Descriptor& from, std::size_t size) {
  std::string all;
  for (std::string part = "-"; all.size() < size && !part.empty(); all += part) part = receive(from);
  return all;
}

std::string hex_of(const std::string& data) {
  return hex(std::span(reinterpret_cast<const std::uint8_t*>(data.data()), data.size()));
}

void give(const Descriptor& to, const std::string& data) {
  EXPECT_EQ(::write(to.number(), data.data(), data.size()), static_cast<ssize_t>(data.size()));
}
void give_hex(const Descriptor& to, std::string_view spelt) {
  const auto data = bytes(spelt);
  give(to, std::string(data.begin(), data.end()));
}

class RunningServer : public ::testing::Test {
 protected:
  RunningServer() {
    settings.device = folder / "dev/motor";
    settings.control = folder / "control";
    settings.bench.time_scale = 5;
    begin();
  }
  ~RunningServer() override { stop(); }
  void begin() {
    server.emplace(settings);
    thread = std::thread([this] { server->run(); });
  }
  void end() {
    if (!thread.joinable()) return;
    server->request_stop();
    thread.join();
  }
  void stop() {
    end();
    server.reset();
  }
  [[nodiscard]] Descriptor connected(int type, std::uint16_t port) const {
    Descriptor socket(::socket(AF_INET, type, 0));
    EXPECT_TRUE(connects(socket, address_of(port)));
    return socket;
  }
  [[nodiscard]] Descriptor rdt() const { return connected(SOCK_DGRAM, server->addresses().rdt_port); }
  [[nodiscard]] std::string page(const std::string& target) const {
    const Descriptor socket = connected(SOCK_STREAM, server->addresses().http_port);
    give(socket, "GET /" + target + " HTTP/1.0\r\nHost: box\r\n\r\n");
    return receive(socket, 1 << 20);
  }
  [[nodiscard]] Descriptor motor_port() const {
    return Descriptor(::open(server->addresses().device.c_str(), O_RDWR | O_NOCTTY));
  }
  [[nodiscard]] nlohmann::json status() const {
    return nlohmann::json::parse(tell(server->addresses().control, "status"));
  }

  const TemporaryFolder folder;
  ServerSettings settings;
  std::optional<Server> server;
  std::thread thread;
};

TEST_F(RunningServer, StreamsOverUdp) {
  const Descriptor socket = rdt();
  give_hex(socket, "12 34 00 03 00 00 00 64");  // 100 samples
  std::vector<std::size_t> sizes;
  std::string first;
  for (int i = 0; i < 3; ++i) {
    const std::string datagram = receive(socket);
    sizes.push_back(datagram.size());
    if (i == 0) first = datagram;
  }
  EXPECT_EQ(sizes, (std::vector<std::size_t>{1440, 1440, 720}));
  EXPECT_EQ(hex_of(first.substr(0, 4)), hex("00 00 00 01"));
}

TEST_F(RunningServer, KeepsThePaceOfItsClock) {
  const Descriptor socket = rdt();
  const int buffer = 4 << 20;
  ::setsockopt(socket.number(), SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
  const auto begin = std::chrono::steady_clock::now();
  give_hex(socket, "12 34 00 03 00 00 88 b8");  // 35000 samples: 5 s of the bench, 1 s of wall time
  int records = 0;
  while (records < 35000) {
    const std::string datagram = receive(socket);
    ASSERT_FALSE(datagram.empty()) << "after " << records;
    records += static_cast<int>(datagram.size() / 36);
  }
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_GT(wall, 0.9);
  EXPECT_LT(wall, 4.0);
}

TEST_F(RunningServer, ServesItsConfigurationOverHttp) {
  for (int i = 0; i < 3; ++i) {
    const std::string answer = page("netftapi2.xml");
    EXPECT_EQ(answer.substr(0, 15), "HTTP/1.0 200 OK");
    EXPECT_NE(answer.find("</netft>"), std::string::npos) << "whole, and the connection closed";
  }
}

TEST_F(RunningServer, AnswersOverTcpInOneOrManySegments) {
  const Descriptor socket = connected(SOCK_STREAM, server->addresses().tcp_port);
  std::string question(20, '\0');
  question[0] = 1;  // READCALINFO
  give(socket, question.substr(0, 7));
  give(socket, question.substr(7));
  const std::string answer = receive(socket, 24);
  ASSERT_EQ(answer.size(), 24u);
  EXPECT_EQ(hex_of(answer.substr(0, 12)), hex("12 34 02 03 00 0f 42 40 00 0f 42 40"));
}

TEST_F(RunningServer, MotorAnswersOnThePtyAlsoAfterAReopen) {
  for (int i = 0; i < 2; ++i) {
    const Descriptor port = motor_port();
    ASSERT_GE(port.number(), 0);
    give_hex(port, kGetFirmware);
    EXPECT_EQ(hex_of(receive(port, 11)), kFirmware);
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
  give_hex(port, "55 06 34 05 01 00 00 C8 42 95 37");  // 100 rad/s
  EXPECT_TRUE(soon([&] { return std::abs(status()["speed_rad_s"].get<double>() - 100) <= 1; }, 5s));
  const nlohmann::json told = status();
  EXPECT_EQ(told["mounted"], "5x3 90");
  EXPECT_EQ(told["drive"]["mode"], "velocity");
  EXPECT_EQ(told["drive"]["target"], 100);
  EXPECT_GT(told["last_motion_command_s"].get<double>(), 0);
  EXPECT_EQ(tell(control, "mount 5x3 180").substr(0, 6), "error ") << "it turns";
}

TEST_F(RunningServer, ASecondSimulatorOnTheSameControlLineIsRefused) {
  ServerSettings same;
  same.control = server->addresses().control;
  EXPECT_THROW(Server second(same), DeviceError);
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
  EXPECT_EQ(page("setting.cgi?setuserfilter=4").substr(0, 18), "HTTP/1.0 302 Found");
  EXPECT_NE(page("netftapi2.xml").find("<setuserfilter>4</setuserfilter>"), std::string::npos);
}

/// A server with a script of faults from its first moment on.
struct FaultyServer : RunningServer {
  void begin_again(const std::vector<std::string>& entries) {
    stop();
    settings.bench.time_scale = 1;
    settings.bench.faults = test::fault_script(entries);
    begin();
  }
};

TEST_F(FaultyServer, LosesWhatTheScriptSaysAndCountsIt) {
  begin_again({"loss at_s=0 count=3"});
  const Descriptor socket = rdt();
  give_hex(socket, "12 34 00 03 00 00 01 90");  // 400 samples: ten datagrams
  EXPECT_EQ(hex_of(receive(socket).substr(0, 4)), hex("00 00 00 79")) << "121 comes first";
  for (int i = 0; i < 6; ++i) EXPECT_EQ(receive(socket).size(), 1440u);
  end();
  EXPECT_EQ(server->truth().dropped, 3u);
  EXPECT_EQ(server->truth().arrived, 7u);
}

TEST_F(FaultyServer, ForeignDatagramsComeFromAnotherAddress) {
  begin_again({"foreign_source at_s=0 for_s=100"});
  const Descriptor socket(::socket(AF_INET, SOCK_DGRAM, 0));  // not connected: it hears everybody
  const sockaddr_in box = address_of(server->addresses().rdt_port);
  const auto start = bytes("12 34 00 02 00 00 00 05");
  ASSERT_EQ(
      ::sendto(socket.number(), start.data(), start.size(), 0, reinterpret_cast<const sockaddr*>(&box), sizeof box), 8);
  int true_ones = 0, foreign = 0;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(has_data(socket));
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
  begin_again({"http_refused at_s=0 for_s=0.5"});
  const sockaddr_in web = address_of(server->addresses().http_port);
  EXPECT_TRUE(soon([&] { return !connects(web); }, 5s));
  EXPECT_TRUE(soon([&] { return connects(web); }, 5s));
}

TEST_F(FaultyServer, AnswersOverTcpInSegmentsOrTogether) {
  begin_again({"tcp_split at_s=0 count=1 size=7 delay_s=0.1", "tcp_merged at_s=0 for_s=1000 delay_s=0.3"});
  const Descriptor socket = connected(SOCK_STREAM, server->addresses().tcp_port);
  std::string question(20, '\0');
  question[0] = 1;
  give(socket, question);
  std::vector<std::size_t> segments;
  for (std::size_t received = 0; received < 24; received += segments.back()) {
    segments.push_back(receive(socket).size());
    ASSERT_GT(segments.back(), 0u);
  }
  EXPECT_EQ(segments, (std::vector<std::size_t>{7, 7, 7, 3}));
  give(socket, question);
  give(socket, question);
  EXPECT_EQ(receive(socket).size(), 48u);
}

TEST_F(FaultyServer, MovesToAnotherAddressOfThisMachine) {
  begin_again({"address at_s=0.2 address=127.0.0.3"});
  const auto answers_at = [&](const char* host) { return connects(address_of(server->addresses().http_port, host)); };
  EXPECT_TRUE(soon([&] { return answers_at("127.0.0.3"); }, 5s));
  EXPECT_FALSE(answers_at("127.0.0.1"));
}

TEST_F(FaultyServer, AnAddressOfNobodyIsSilenceNotAnEnd) {
  begin_again({"address at_s=0.1 for_s=0.2 address=203.0.113.9"});
  ASSERT_TRUE(soon([&] { return status()["bench_time_s"].get<double>() >= 0.4; }, 5s));
  const Descriptor socket = rdt();
  give_hex(socket, "12 34 00 02 00 00 00 01");
  EXPECT_EQ(receive(socket).size(), 36u) << "back where it was";
}

/// What has come of the answer until 200 ms pass without a byte, or 5 s in all.
std::string ask_port(const Descriptor& port, std::string_view spelt, std::size_t size) {
  give_hex(port, spelt);
  std::string answer;
  (void)soon([&] { return !has_data(port, 200) || (answer += receive(port)).size() >= size; }, 5s);
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
  EXPECT_EQ(ask_port(port, kGetFirmware, 11), "");
  set_rate(port.number(), B115200);
  std::string answer;
  for (int i = 0; i < 20 && answer.size() < 33; ++i) answer = ask_port(port, kGetFirmware, 11);
  EXPECT_NE(answer.find(kFirmware), std::string::npos);
}

TEST_F(FaultyServer, UnpluggedTheLinkIsGoneAndComesBackAsAnotherTerminal) {
  stop();
  settings.bench.time_scale = 1;
  settings.bench.faults = test::fault_script({"motor_unplug at_s=0.3 for_s=0.3 other=true"});
  server.emplace(settings);
  const std::string link = server->addresses().device;
  const fs::path first = fs::read_symlink(link);
  const Descriptor port = motor_port();
  thread = std::thread([this] { server->run(); });
  pollfd waiting{port.number(), POLLIN, 0};
  ASSERT_GT(::poll(&waiting, 1, 5000), 0);
  EXPECT_NE(waiting.revents & (POLLHUP | POLLERR), 0) << "the client sees the hang-up";
  std::error_code error;
  EXPECT_TRUE(soon([&] { return !fs::exists(fs::symlink_status(link, error)); }, 5s));
  EXPECT_TRUE(soon([&] { return fs::exists(fs::symlink_status(link, error)); }, 5s));
  const Descriptor again(::open(link.c_str(), O_RDWR | O_NOCTTY));
  ASSERT_GE(again.number(), 0);
  EXPECT_EQ(ask_port(again, "55 02 05 04 00 9C 4E", 11).substr(15, 12), "18 00 41 00 ") << "another uid";
}

TEST(Server, RefusesToReplaceAFileByItsLink) {
  const TemporaryFolder folder;
  ServerSettings settings;
  settings.control = folder / "control";
  settings.device = folder / "precious";
  { const Descriptor file(::open(settings.device.c_str(), O_CREAT | O_WRONLY, 0600)); }
  EXPECT_THROW(Server server(settings), DeviceError);
  EXPECT_TRUE(fs::is_regular_file(settings.device));
}

TEST(Server, ReplacesTheSocketAndLinkOfADeadSimulator) {
  const TemporaryFolder folder;
  ServerSettings settings;
  settings.control = folder / "control";
  settings.device = folder / "motor";
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
}

// The client still holds the lock of that number: whoever got it would be refused as a second program.
TEST(Pty, KeepsTheNumberOfAPulledAdapter) {
  const TemporaryFolder folder;
  Pty line(folder / "motor");
  const fs::path pulled = fs::read_symlink(folder / "motor");
  line.unplug();
  EXPECT_FALSE(fs::exists(pulled)) << "the client sees a hang-up";
  const Pty other(folder / "other"), third(folder / "third");
  EXPECT_NE(fs::read_symlink(folder / "other"), pulled);
  EXPECT_NE(fs::read_symlink(folder / "third"), pulled);
  line.plug();
  EXPECT_NE(fs::read_symlink(folder / "motor"), pulled);
}

}  // namespace kphi::sim::server_test
