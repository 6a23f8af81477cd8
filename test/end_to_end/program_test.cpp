// The program as a person types it, against the simulated bench over the real transports.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <boost/asio.hpp>
#include <regex>
#include <thread>

#include "results/run_reader.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/end_to_end/terminal.hpp"
#include "test/profiles/refusals.hpp"

namespace kphi::test::program_test {

using nlohmann::json;
using namespace testing;

TEST(Program, RunsACampaignOverTheRealTransportsAndFitsWhatTheBenchWasBuiltWith) {
  RunningBench bench({3});  // of the means is asked that they have settled, on an instrumented bench, too
  const Ended run = ran(bench.run_command());
  const std::string folder = run.folder();
  EXPECT_THAT(run.err, AllOf(HasSubstr("0 lost"), HasSubstr("step  4/4")));
  EXPECT_THAT(run.err, Not(HasSubstr("\r"))) << "no terminal, no control characters";
  (void)ran({kphi(), "verify", folder});
  EXPECT_EQ(ran({kphi(), "replay", folder, "--csv"}).out, bytes_of(folder + "/steps.csv"));
  EXPECT_THAT(ran({kphi(), "replay", folder}).out, HasSubstr("/steps.csv: agrees, "));
  (void)ran({kphi(), "fit", "--accept", folder});
  const YAML::Node found = YAML::LoadFile(folder + "/coefficients.yaml");
  const YAML::Node truth = YAML::LoadFile(bench.path("truth.yaml"));
  const double true_k = truth["propellers"]["5x3"]["K_T"].as<double>();
  EXPECT_NEAR(found["K_T"]["value"].as<double>(), true_k, 0.01 * true_k);
  EXPECT_TRUE(std::filesystem::exists(folder + "/report.html"));

  Process compensate({kphi(), "compensate", "--coefficients", folder + "/coefficients.yaml", "--vehicle",
                      profiles::shipped("foldable_drone.yaml")},
                     "theta1_deg,theta2_deg,theta3_deg,theta4_deg,thrust1_n,thrust2_n,thrust3_n,thrust4_n\n"
                     "180,180,165.676,180,1.5,1.5,1.5,1.5\n");
  EXPECT_EQ(compensate.wait(), 0) << compensate.err();
  EXPECT_THAT(compensate.out(), HasSubstr("64.8"));
}

TEST(Program, NeedsNoControlLineOfASimulatorThatIsToldByHand) {
  const RunningBench bench;
  (void)ran({kphi(), "sim", bench.path("bench.yaml"), "--mount", "5x3 0"});
  const std::string foreign =
      std::regex_replace(bytes_of(bench.path("bench.yaml")), std::regex(", control: [^,}]*"), "");
  write(bench.path("foreign.yaml"), foreign);
  write(bench.path("one.yaml"), short_campaign_text("0"));
  const std::string folder = ran({kphi(), "run", bench.path("one.yaml"), "--bench", bench.path("foreign.yaml"), "--yes",
                                  "--out", bench.path("f")})
                                 .folder();
  EXPECT_NE(bytes_of(std::filesystem::path(folder) / "steps.csv"), "");
  EXPECT_THAT(ran({kphi(), "sim", bench.path("foreign.yaml")}, 2).err,
              HasSubstr("a simulator of another make is meant"));
}

TEST(Program, TellsWhoItsDevicesAreAndHowTheirClocksRun) {
  RunningBench bench;
  const std::vector<std::string> command{kphi(),   "devices",      "--bench", bench.path("bench.yaml"),
                                         "--json", "--clock-gain", "10"};
  const json motor = json::parse(ran(command).out).at(1);
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
  const std::vector<std::string> command{kphi(), "devices", "--bench", bench.path("bench.yaml")};
  const json answers = json::parse(ran(joined(command, {"--json"})).out);
  EXPECT_EQ(answers.at(1).at("output"), false);
  EXPECT_EQ(answers.at(2).at("answers"), false) << "its module, which is not missed then";
  EXPECT_THAT(ran(command).out,
              AllOf(HasSubstr("without power"), HasSubstr("give --switch-on to ask it"), Not(HasSubstr("FAULT"))));
  EXPECT_THAT(ran(joined(command, {"--clock-gain", "10"}), 3).out,
              HasSubstr("clock not measured: the supply's output is off"))
      << "unless its clock is asked for";
}

TEST(Program, TellsOfItsDevicesOnOneScreenWorstFirst) {
  RunningBench bench(Manner{4, 3500, "  - {at_s: 0, kind: frozen, axes: 4}\n"});
  const auto begun = std::chrono::steady_clock::now();
  const Ended devices = ran({kphi(), "devices", "--bench", bench.path("bench.yaml")}, 1);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(9)) << "without the look at this computer";
  EXPECT_THAT(devices.out, StartsWith("FAULT  Net Box 127.0.0.1: "));
  const std::size_t fault = devices.out.find("fault: Fz repeats one value"),
                    warning = devices.out.find("warning: 3500 Hz");
  EXPECT_LT(fault, warning);
  EXPECT_LT(warning, devices.out.find("ok     IQ module"));
  EXPECT_LE(std::ranges::count(devices.out, '\n'), 24) << devices.out;
  EXPECT_THAT(devices.out, Not(HasSubstr("this computer: late")));
  EXPECT_THAT(ran({kphi(), "devices", "--timing", "0.2", "--details", "--bench", bench.path("bench.yaml")}, 1).out,
              AllOf(HasSubstr("this computer: late by at most"), HasSubstr("receive buffer")));
}

TEST(Program, SwitchesTheSupplyOnToAskTheModuleAtItsUsersWordAlone) {
  Manner manner;
  manner.supply = true;
  RunningBench bench(manner);
  const std::vector<std::string> command{kphi(), "devices", "--bench", bench.path("bench.yaml")};
  EXPECT_THAT(ran(joined(command, {"--switch-on"})).out,
              AllOf(HasSubstr("firmware"), HasSubstr("the supply's output was on to ask it, and is off again")));
  EXPECT_EQ(bench.status()["supply"]["output"], false);
  for (const char* answer : {"", "no", "On "}) {
    Terminal terminal;
    Process devices(command, {}, {{}, terminal.descriptor(), 0});
    devices.wait_for_prompt({"or only Enter: "});
    terminal.type(answer);
    EXPECT_EQ(devices.wait(), 0) << devices.err();
    EXPECT_EQ(devices.out().find("is off again") != std::string::npos, answer == std::string("On ")) << devices.out();
    EXPECT_EQ(bench.status()["supply"]["output"], false);
  }
  const Account account = bench.account();
  EXPECT_EQ(account.last_speed_at(), -1) << "and nothing turns";
}

TEST(Program, SaysAtTheFirstMountingThatTheKeysOfTheSupplySwitchNothing) {
  RunningBench bench(Manner{.time_scale = 4, .supply = true});
  write(bench.path("short.yaml"), short_campaign_text("0, 45", 1, 2));
  Terminal terminal;
  Process run(
      {kphi(), "run", bench.path("short.yaml"), "--bench", bench.path("bench.yaml"), "--out", bench.path("results")},
      {}, {{}, terminal.descriptor(), 0});
  const auto said = [&] {
    const std::string words = "keypad is locked while kphi asks it";
    const std::size_t at = run.err().find(words);
    return at == std::string::npos ? 0 : run.err().find(words, at + 1) == std::string::npos ? 1 : 2;
  };
  run.wait_for_prompt();
  EXPECT_EQ(said(), 1) << run.err();
  terminal.type("0");
  run.wait_for_prompt();
  EXPECT_EQ(said(), 1) << "not at the second";
  run.signal(SIGINT);
  EXPECT_EQ(run.wait(), 130) << run.err();
}

TEST(Program, RunsOnWhereTheKeyOfTheSupplyIsDeadAndStopsWhereItSwitches) {
  for (const bool dead : {true, false}) {
    RunningBench bench(Manner{.time_scale = 1, .supply = true});
    write(bench.path("short.yaml"), short_campaign_text("0", 1, 6));
    if (!dead) (void)bench.fault("kind=supply_keys_free for_s=1000");
    EXPECT_THAT(ran({kphi(), "devices", "--bench", bench.path("bench.yaml")}).out,
                HasSubstr(dead ? "its output key switches nothing" : "this one says that it does not"));
    Process run(bench.run_command());
    run.wait_for("step  1/");
    const double pressed_ms = bench.fault("kind=supply_key");
    EXPECT_EQ(run.wait(), dead ? 0 : 4) << run.err();
    if (!dead) {
      EXPECT_THAT(run.err(), AnyOf(HasSubstr("output is off"), HasSubstr("under-voltage"), HasSubstr("motor reading")))
          << "whichever is seen first";
    }
    const Account account = bench.account();
    EXPECT_TRUE(account.ends_without_power());
    EXPECT_EQ(account.last_speed_at() > pressed_ms + 1500, dead) << "ms after the key";
  }
}

TEST(Program, ThatIsEndedWhileItAsksTheModuleLeavesNoPowerOn) {
  Manner manner;
  manner.supply = true;
  RunningBench bench(manner);
  for (const auto& [signal, exit_code] : {std::pair(SIGKILL, 128 + SIGKILL), std::pair(SIGINT, 130)}) {
    Process devices({kphi(), "devices", "--clock-gain", "600", "--switch-on", "--bench", bench.path("bench.yaml")});
    ASSERT_TRUE(bench.await([](const json& now) { return now["supply"]["output"] == true; }));
    devices.signal(signal);
    EXPECT_EQ(devices.wait(), exit_code) << devices.err();
    if (signal == SIGINT) {
      EXPECT_TRUE(safely(bench.status()["supply"]["output"] == false)) << "before it ends";
    }
    EXPECT_TRUE(safely(bench.await([](const json& now) { return now["supply"]["output"] == false; })));
  }
}

TEST(Program, AsksAboutADoubtfulCampaignBeforeAnythingHasPower) {
  Manner manner;
  manner.supply = true;
  RunningBench bench(manner);
  write(bench.path("doubtful.yaml"), short_campaign_text("0.7854, 1.5708", 1, 2));
  const std::vector<std::string> command{
      kphi(), "run", bench.path("doubtful.yaml"), "--bench", bench.path("bench.yaml"), "--out", bench.path("results")};
  EXPECT_THAT(ran(joined(command, {"--dry-run"})).out, HasSubstr("these look like radians; write degrees"));
  for (const char* answer : {"q", "Continue"}) {
    Terminal terminal;
    Process run(command, {}, {{}, terminal.descriptor(), 0});
    run.wait_for("Is this meant?");
    run.wait_for_prompt();
    terminal.type(answer);
    if (answer == std::string("Continue")) {
      run.wait_for("Mount the 0.7854° occlusion");
      run.wait_for_prompt();
      terminal.type("q");
    }
    EXPECT_EQ(run.wait(), 130) << run.err();
  }
  EXPECT_EQ(bench.account().last_speed_at(), -1);
}

TEST(Program, StopsWhenTheBenchVanishesMidRun) {
  RunningBench bench;
  Process run(bench.run_command());
  run.wait_for("step  2/4");
  bench.process().signal(SIGKILL);
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("this run so far in "));
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
  const std::string folder = ran(bench.run_command()).folder();
  const json bias = json::parse(ran({kphi(), "info", "--json", folder}).out).at("runs").at(0).at("box_bias");
  EXPECT_GT(bias.at("records"), 1000);
  EXPECT_LT(std::abs(bias.at("after").at(2).get<double>()), 0.05);
  (void)ran({kphi(), "replay", folder});
}

TEST(Program, RefusesARateThatFoldsStepsOfTheCampaignAndNamesThem) {
  RunningBench bench({8, 100, "  []\n"});
  EXPECT_THAT(
      ran({kphi(), "devices", "--bench", bench.path("bench.yaml"), "--campaign", bench.path("short.yaml")}, 1).out,
      HasSubstr("6000.0 RPM (1/rev at 100.00 Hz appears at 0.00 Hz)"));
  EXPECT_THAT(ran(bench.run_command(), 2).err, HasSubstr("set the RDT output rate to 7000 Hz"));
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
  EXPECT_THAT(ran(bench.run_command(), 3).err, HasSubstr("10000 counts per N"));
}

TEST(BadInput, IsToldInOneClearLine) {
  const VirtualCampaign here(short_campaign_text());
  const RunningBench bench;
  here.write("bench.yaml", bench_text(here.path(""), 49999, 49998, 8));  // no box answers there
  // A box that answers, and a serial line with nobody behind it.
  here.write("no_module.yaml", profiles::changed(bytes_of(bench.path("bench.yaml")), "/motor", "/no_motor"));
  here.write("unit.yaml", profiles::changed(short_campaign_text(), "dwell_s", "dwell_ms"));
  here.write("fast.yaml",
             profiles::changed(profiles::changed(short_campaign_text(), "last_rpm: 18000", "last_rpm: 25000"),
                               "speed_max_rpm: 19100", "speed_max_rpm: 25000"));
  const std::string bad_bench = here.path("bench.yaml");
  const auto run = [&](const char* campaign, const std::string& on) -> std::vector<std::string> {
    return {"run", here.path(campaign), "--bench", on, "--yes", "--out", here.path("r")};
  };
  const struct {
    std::vector<std::string> arguments;
    int exit_code;
    const char* words;
  } kInputs[] = {
      {run("campaign.yaml", bad_bench), 3, "its simulator does not run; start it in another terminal: kphi sim"},
      {run("campaign.yaml", here.path("no_module.yaml")), 3, "no_motor"},
      {run("unit.yaml", bad_bench), 2, "unit.yaml:7:21: dwell_ms is not a key of profile"},
      {run("fast.yaml", bad_bench), 2, "19300"},
      {run("nothing.yaml", bad_bench), 2, "nothing.yaml"},
      {{"fit", here.path("nothing")}, 2, "nothing"},
      {{"check", here.path("nothing.yaml")}, 2, "nothing.yaml"},
      {{"run", here.path("campaign.yaml"), "--bench", bad_bench}, 2, "--yes"},
      {{"runn"}, 2, "did you mean run?"},
      {{"run", "--fast"}, 2, "--help"},
  };
  for (const auto& [arguments, exit_code, words] : kInputs)
    EXPECT_THAT(ran(joined({kphi()}, arguments), exit_code).err, AllOf(HasSubstr(words), Not(HasSubstr("terminate"))));
}

TEST(Program, KeepsWhatWasWrittenBeforeTheDiskWasFull) {
  RunningBench bench;
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 20));
  // A file may not grow beyond 2.5 MB: the first run needs about 5.
  const Ended run = ran(by_shell(R"(trap '' XFSZ; ulimit -f 2500; exec "$@")", bench.run_command()), 1);
  EXPECT_TRUE(bench.motor_stops());
  std::filesystem::path left;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(bench.path("results"))) {
    if (entry.path().string().find(".h5") != std::string::npos) left = entry.path();
  }
  ASSERT_FALSE(left.empty()) << run.err;
  EXPECT_GT(results::read_run(left).load_cell.size(), 20'000u) << left;
}

TEST(Check, TakesEveryShippedFile) {
  for (const auto& entry : std::filesystem::directory_iterator(profiles::shipped(""))) {
    if (entry.path().extension() != ".yaml") continue;
    (void)ran({kphi(), "check", entry.path().string()});
  }
}

TEST(DryRun, PrintsThePlanAndTouchesNoDevice) {
  const json plan = json::parse(ran({kphi(), "run", profiles::shipped("icra2021_5in_3blade.yaml"), "--bench",
                                     profiles::shipped("bench_lab.yaml"), "--dry-run", "--json"})
                                    .out);
  EXPECT_EQ(plan.at("runs"), 15);
  EXPECT_EQ(plan.at("steps"), 600);
  EXPECT_EQ(plan.at("mountings"), 15);
  EXPECT_EQ(plan.at("spinning_s"), 1200.0);
}

}  // namespace kphi::test::program_test
