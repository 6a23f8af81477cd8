// The program as a person types it, against the simulated bench over the real transports.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <boost/asio.hpp>
#include <nlohmann/json.hpp>
#include <thread>

#include "results/run_reader.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/source_dir.hpp"

namespace kphi::test {
namespace program_test {

using nlohmann::json;
using testing::HasSubstr;

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

TEST(Program, RunsACampaignOverTheRealTransportsAndFitsWhatTheBenchWasBuiltWith) {
  RunningBench bench({3});  // of the means is asked that they have settled, on an instrumented bench, too
  Process run(bench.run_command());
  ASSERT_EQ(run.wait(), 0) << run.err();
  const std::string folder = first_line(run.out());
  EXPECT_THAT(run.err(), HasSubstr("0 lost"));
  EXPECT_THAT(run.err(), HasSubstr("step  4/4"));
  EXPECT_EQ(run.err().find('\r'), std::string::npos) << "no terminal, no control characters";

  Process verify({kphi(), "verify", folder});
  EXPECT_EQ(verify.wait(), 0) << verify.out() << verify.err();
  Process replay({kphi(), "replay", folder});
  EXPECT_EQ(replay.wait(), 0) << replay.err();
  EXPECT_EQ(replay.out(), bytes_of(folder + "/steps.csv"));

  Process fit({kphi(), "fit", folder});
  ASSERT_EQ(fit.wait(), 0) << fit.err();
  const YAML::Node found = YAML::LoadFile(folder + "/coefficients.yaml");
  const YAML::Node truth = YAML::LoadFile(bench.path("truth.yaml"));
  const double true_k = truth["propellers"]["5x3"]["K_T"].as<double>();
  EXPECT_NEAR(found["K_T"]["value"].as<double>(), true_k, 0.01 * true_k);
  EXPECT_TRUE(std::filesystem::exists(folder + "/report.html"));

  Process compensate({kphi(), "compensate", "--coefficients", folder + "/coefficients.yaml", "--vehicle",
                      kphi::test::source_dir() + "/profiles/foldable_drone.yaml"},
                     "theta1_deg,theta2_deg,theta3_deg,theta4_deg,thrust1_n,thrust2_n,thrust3_n,thrust4_n\n"
                     "180,180,165.676,180,1.5,1.5,1.5,1.5\n");
  EXPECT_EQ(compensate.wait(), 0) << compensate.err();
  EXPECT_THAT(compensate.out(), HasSubstr("64.8"));
}

TEST(Program, TellsWhoItsDevicesAreAndHowTheirClocksRun) {
  RunningBench bench;
  Process devices({kphi(), "devices", "--bench", bench.path("bench.yaml"), "--json", "--clock-gain", "10"});
  ASSERT_EQ(devices.wait(), 0) << devices.err();
  const json motor = json::parse(devices.out()).at(1);
  EXPECT_EQ(motor.at("uid"), "002300064d4b501120343353");
  EXPECT_EQ(motor.at("firmware"), "speed 0.0.32");
  EXPECT_EQ(motor.at("parameters").at("brushless_drive.volts_limit"), 27.0);
  EXPECT_EQ(motor.at("parameters").at("propeller_motor_control.timeout"), 0.5);
  EXPECT_LE(motor.at("clock_gain").at("lowest"), 1.0);
  EXPECT_GE(motor.at("clock_gain").at("highest"), 1.0);
  EXPECT_EQ(motor.at("clock_gain").at("uid"), motor.at("uid"));
  for (const json& finding : motor.at("findings")) EXPECT_NE(finding.at("severity"), "fault") << finding;
}

TEST(Program, TellsThatAModuleCannotAnswerWhileTheSupplysOutputIsOff) {
  Manner manner;
  manner.supply = true;
  RunningBench bench(manner);
  Process devices({kphi(), "devices", "--bench", bench.path("bench.yaml"), "--json"});
  ASSERT_EQ(devices.wait(), 0) << devices.err();
  const json answers = json::parse(devices.out());
  EXPECT_EQ(answers.at(1).at("output"), false);
  EXPECT_EQ(answers.at(2).at("answers"), false) << "its module, which is not missed then";
  Process measured({kphi(), "devices", "--bench", bench.path("bench.yaml"), "--clock-gain", "10"});
  EXPECT_EQ(measured.wait(), 3) << "unless its clock is asked for";
  EXPECT_THAT(measured.out(), HasSubstr("clock not measured: the supply's output is off"));
}

TEST(Program, StopsOnCtrlCWithTheMotorCoastingAndTheFileKept) {
  for (const int signal_number : {SIGINT, SIGTERM, SIGHUP}) {
    RunningBench bench;
    Process run(bench.run_command());
    run.wait_for("step  2/4");
    run.signal(signal_number);
    EXPECT_EQ(run.wait(), 130) << run.err();
    EXPECT_THAT(run.err(), HasSubstr("this run so far in "));
    EXPECT_TRUE(bench.motor_stops());
  }
}

TEST(Program, LeavesTheMotorStoppedWhenItIsKilled) {
  RunningBench bench;
  Process run(bench.run_command());
  run.wait_for("step  3/4");
  run.signal(SIGKILL);
  EXPECT_EQ(run.wait(), 128 + SIGKILL);
  EXPECT_TRUE(bench.motor_stops()) << "the module's own timeout should have coasted it";
}

TEST(Program, StopsWhenTheBenchVanishesMidRun) {
  RunningBench bench;
  Process run(bench.run_command());
  run.wait_for("step  2/4");
  bench.process().signal(SIGKILL);
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("this run so far in "));
}

json info_of(const std::string& path) {
  Process info({kphi(), "info", "--json", path});
  EXPECT_EQ(info.wait(), 0) << info.err();
  return json::parse(info.out());
}

TEST(Program, AccountsForWhatTheWireLoses) {
  RunningBench bench({8, 7000,
                      "  - {at_s: 0, for_s: 100000, kind: loss, p: 0.002}\n"
                      "  - {at_s: 0, for_s: 100000, kind: duplicate, p: 0.01}\n"
                      "  - {at_s: 0, for_s: 100000, kind: wrong_size, p: 0.01, size: 37}\n"});
  write(bench.path("short.yaml"), short_campaign_text("0, 90", 1, 8));
  Process run(bench.run_command());
  ASSERT_EQ(run.wait(), 0) << run.err();
  const std::string folder = first_line(run.out());
  for (const char* verb : {"verify", "replay"}) {
    Process again({kphi(), verb, folder});
    EXPECT_EQ(again.wait(), 0) << again.out() << again.err();
  }
  bench.process().signal(SIGTERM);
  ASSERT_EQ(bench.process().wait(), 0) << bench.process().err();
  const std::string log = bytes_of(bench.path("wire.jsonl"));
  const std::size_t totals = log.find("{\"totals\"");
  ASSERT_NE(totals, std::string::npos) << log.substr(log.size() - std::min<std::size_t>(log.size(), 400));
  const json truth = json::parse(log.substr(totals, log.find('\n', totals) - totals)).at("totals");
  std::uint64_t lost = 0, duplicates = 0, malformed = 0;
  const json info = info_of(folder);
  for (const json& one : info.at("runs")) {
    lost += one.at("lost_network").get<std::uint64_t>() + one.at("lost_host").get<std::uint64_t>();
    duplicates += one.at("duplicates").get<std::uint64_t>();
    malformed += one.at("malformed").get<std::uint64_t>();
  }
  EXPECT_GT(lost, 0u);
  EXPECT_GT(duplicates, 0u);
  EXPECT_GT(malformed, 0u);
  // What went wrong before a run's first record and after its last is no part of it.
  EXPECT_LE(lost, truth.at("records_dropped").get<std::uint64_t>());
  EXPECT_LE(duplicates, truth.at("records_duplicated").get<std::uint64_t>());
  EXPECT_LE(malformed, truth.at("malformed").get<std::uint64_t>());
}

/// Sends what a second client would send to the box.
void take_stream_over(int rdt_port) {
  const int socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in box{};
  box.sin_family = AF_INET;
  box.sin_port = htons(static_cast<std::uint16_t>(rdt_port));
  box.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  constexpr std::array<std::uint8_t, 8> kStart{0x12, 0x34, 0, 2, 0, 0, 0, 0};
  EXPECT_EQ(::sendto(socket_, kStart.data(), kStart.size(), 0, reinterpret_cast<const sockaddr*>(&box), sizeof box), 8);
  ::close(socket_);
}

TEST(Program, StopsWhenAnotherClientTakesTheStreamAndSaysSo) {
  RunningBench bench;
  Process run(bench.run_command());
  run.wait_for("step  2/4");
  take_stream_over(YAML::LoadFile(bench.path("bench.yaml"))["netbox"]["rdt_port"].as<int>());
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("another client has taken the stream"));
  EXPECT_TRUE(bench.motor_stops());
}

TEST(Program, TakesTheBoxesBiasWhenTheCampaignSaysSo) {
  RunningBench bench;
  write(bench.path("short.yaml"), short_campaign_text("0") + "box_bias: true\n");
  Process run(bench.run_command());
  ASSERT_EQ(run.wait(), 0) << run.err();
  const std::string folder = first_line(run.out());
  const json bias = info_of(folder).at("runs").at(0).at("box_bias");
  EXPECT_GT(bias.at("records"), 1000);
  EXPECT_LT(std::abs(bias.at("after").at(2).get<double>()), 0.05);
  Process replay({kphi(), "replay", folder});
  EXPECT_EQ(replay.wait(), 0) << replay.err();
}

TEST(Program, RefusesARateThatFoldsStepsOfTheCampaignAndNamesThem) {
  RunningBench bench({8, 100, "  []\n"});
  Process devices({kphi(), "devices", "--bench", bench.path("bench.yaml"), "--campaign", bench.path("short.yaml")});
  EXPECT_EQ(devices.wait(), 0) << devices.err();
  EXPECT_THAT(devices.out(), HasSubstr("6000.0 RPM (1/rev at 100.00 Hz appears at 0.00 Hz)"));
  Process run(bench.run_command());
  EXPECT_EQ(run.wait(), 2) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("set the RDT output rate to 7000 Hz"));
  EXPECT_TRUE(!std::filesystem::exists(bench.path("results")) || std::filesystem::is_empty(bench.path("results")));
}

/// Speaks the box's TCP once: units N and N m, and a scale that is another.
class OtherScale {
 public:
  OtherScale() : listener_(io_, {boost::asio::ip::address_v4::loopback(), 0}) {
    port_ = listener_.local_endpoint().port();
    thread_ = std::thread([this] {
      boost::asio::ip::tcp::socket peer(io_);
      boost::system::error_code error;
      listener_.accept(peer, error);
      std::array<std::uint8_t, 20> request{};
      boost::asio::read(peer, boost::asio::buffer(request), error);
      const std::array<std::uint8_t, 24> answer{0x12, 0x34, 2, 3, 0, 0, 0x27, 0x10, 0, 0x0f, 0x42, 0x40};
      boost::asio::write(peer, boost::asio::buffer(answer), error);
    });
  }
  ~OtherScale() {
    boost::system::error_code error;
    boost::asio::ip::tcp::socket(io_).connect(listener_.local_endpoint(), error);  // in case nobody came
    thread_.join();
  }
  [[nodiscard]] int port() const { return port_; }

 private:
  boost::asio::io_context io_;
  boost::asio::ip::tcp::acceptor listener_;
  int port_ = 0;
  std::thread thread_;
};

TEST(Program, RefusesABoxThatNamesTwoScales) {
  RunningBench bench;
  OtherScale other;
  YAML::Node file = YAML::LoadFile(bench.path("bench.yaml"));
  file["netbox"]["tcp_port"] = other.port();
  write(bench.path("bench.yaml"), YAML::Dump(file) + "\n");
  Process run(bench.run_command());
  EXPECT_EQ(run.wait(), 3) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("10000 counts per N"));
}

class BadInput : public testing::Test {
 protected:
  BadInput() {
    write(path("short.yaml"), short_campaign_text());
    write(path("bench.yaml"), bench_text(folder_.path(), 49999, 49998, 8));
  }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  /// Runs and expects the exit code and one clear line that holds `words`.
  void expect(const std::vector<std::string>& arguments, int exit_code, const std::string& words) {
    std::vector<std::string> command{kphi()};
    command.insert(command.end(), arguments.begin(), arguments.end());
    Process process(command);
    EXPECT_EQ(process.wait(), exit_code) << process.out() << process.err();
    EXPECT_THAT(process.err(), HasSubstr(words));
    EXPECT_EQ(process.err().find("terminate"), std::string::npos) << process.err();
  }
  TemporaryFolder folder_;
};

TEST_F(BadInput, NoBox) {
  expect({"run", path("short.yaml"), "--bench", path("bench.yaml"), "--yes", "--out", path("r")}, 3, "127.0.0.1");
}

TEST_F(BadInput, NoModule) {
  RunningBench bench;
  // A box that answers, and a serial line with nobody behind it.
  std::string text = bytes_of(bench.path("bench.yaml"));
  const std::size_t device = text.find("/motor");
  text.replace(device, 6, "/no_motor");
  write(path("no_module.yaml"), text);
  expect({"run", path("short.yaml"), "--bench", path("no_module.yaml"), "--yes", "--out", path("r")}, 3, "no_motor");
}

TEST_F(BadInput, WrongUnit) {
  std::string text = short_campaign_text();
  text.replace(text.find("dwell_s"), 7, "dwell_ms");
  write(path("unit.yaml"), text);
  expect({"run", path("unit.yaml"), "--bench", path("bench.yaml"), "--yes"}, 2,
         "unit.yaml:7:21: dwell_ms is not a key of profile");
}

TEST_F(BadInput, CampaignAboveTheMotorsLimit) {
  std::string text = short_campaign_text();
  text.replace(text.find("last_rpm: 18000"), 15, "last_rpm: 25000");
  text.replace(text.find("speed_max_rpm: 19100"), 20, "speed_max_rpm: 25000");
  write(path("fast.yaml"), text);
  expect({"run", path("fast.yaml"), "--bench", path("bench.yaml"), "--yes"}, 2, "19300");
}

TEST_F(BadInput, UnreadableFile) {
  expect({"run", path("nothing.yaml"), "--bench", path("bench.yaml"), "--yes"}, 2, "nothing.yaml");
  expect({"fit", path("nothing")}, 2, "nothing");
  expect({"check", path("nothing.yaml")}, 2, "nothing.yaml");
}

TEST_F(BadInput, NobodyToAskForMountings) {
  expect({"run", path("short.yaml"), "--bench", path("bench.yaml")}, 2, "--yes");
}

TEST_F(BadInput, MisspeltCommand) { expect({"runn"}, 2, "did you mean \"run\""); }

TEST_F(BadInput, UnknownOption) { expect({"run", "--fast"}, 2, "--help"); }

TEST_F(BadInput, FullDiskMidRunKeepsWhatWasWritten) {
  RunningBench bench;
  // A file may not grow beyond 2.5 MB: the first run needs about 5.
  std::vector<std::string> command{"bash", "-c", "trap '' XFSZ; ulimit -f 2500; exec \"$@\"", "bash"};
  const auto run_command = bench.run_command();
  command.insert(command.end(), run_command.begin(), run_command.end());
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 20));
  Process run(command);
  EXPECT_EQ(run.wait(), 1) << run.err();
  EXPECT_TRUE(bench.motor_stops());
  std::filesystem::path left;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(bench.path("results"))) {
    if (entry.path().string().find(".h5") != std::string::npos) left = entry.path();
  }
  ASSERT_FALSE(left.empty()) << run.err();
  EXPECT_GT(results::read_run(left).load_cell.size(), 20'000u) << left;
}

TEST(Check, TakesEveryShippedFile) {
  for (const auto& entry : std::filesystem::directory_iterator(kphi::test::source_dir() + "/profiles")) {
    if (entry.path().extension() != ".yaml") continue;
    Process check({kphi(), "check", entry.path().string()});
    EXPECT_EQ(check.wait(), 0) << check.err();
  }
}

TEST(DryRun, PrintsThePlanAndTouchesNoDevice) {
  const std::string profiles = kphi::test::source_dir() + "/profiles/";
  Process run({kphi(), "run", profiles + "icra2021_5in_3blade.yaml", "--bench", profiles + "bench_lab.yaml",
               "--dry-run", "--json"});
  EXPECT_EQ(run.wait(), 0) << run.err();
  const json plan = json::parse(run.out());
  EXPECT_EQ(plan.at("runs"), 15);
  EXPECT_EQ(plan.at("steps"), 600);
  EXPECT_EQ(plan.at("mountings"), 5);
  EXPECT_EQ(plan.at("spinning_s"), 1200.0);
}

}  // namespace program_test
}  // namespace kphi::test
