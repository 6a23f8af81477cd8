// `kphi sim` as another process, for tests of the program.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/descriptor.hpp"
#include "drivers/sim/control_line.hpp"
#include "test/end_to_end/account.hpp"
#include "test/end_to_end/program.hpp"

namespace kphi::test {

/// `more`: further lines of the file.
inline std::string bench_text(const std::filesystem::path& folder, int rdt_port, int http_port, double time_scale,
                              double rate_hz = 7000, const std::string& more = "") {
  return fmt::format(
      "format: kphi-bench/1\nname: test\n"
      "netbox: {{host: 127.0.0.1, rdt_port: {}, http_port: {}, rate_hz: {}, records_per_datagram: 40}}\n"
      "iq: {{device: {}/motor, baud: 921600, module_id: 0, spin: +1, telemetry_hz: 50, speed_max_rpm: 19300}}\n"
      "thrust_axis: \"+Fz\"\nsimulation: {{time_scale: {}, seed: 3, control: {}/control}}\n{}",
      rdt_port, http_port, rate_hz, folder.string(), time_scale, folder.string(), more);
}

/// A supply on a pseudo-terminal that gives what the simulated motor takes at 19,100 RPM.
inline std::string supply_text(const std::filesystem::path& folder) {
  return fmt::format(
      "supply: {{uri: \"modbus-rtu:{}/supply?model=RD6024&looks=8\", voltage_v: 12, current_limit_a: 24, "
      "over_voltage_v: 14, "
      "over_current_a: 24}}\n",
      folder.string());
}

struct Manner {
  double time_scale = 4;
  double rate_hz = 7000;
  std::string faults = "  []\n";  ///< entries of a fault script
  bool supply = false;            ///< the bench has one of its own
};

/// `kphi sim` on free ports, in a folder of its own.
class RunningBench {
 public:
  explicit RunningBench(const Manner& manner = {})
      : process_((write(folder_.path() / "wanted.yaml",
                        bench_text(folder_.path(), 49152, 8049, manner.time_scale, manner.rate_hz,
                                   manner.supply ? supply_text(folder_.path()) : "")),
                  write(folder_.path() / "faults.yaml", "format: kphi-faults/1\nfaults:\n" + manner.faults),
                  in_real_time(
                      {kphi(), "sim", path("wanted.yaml"), "--free-ports", "--resolved", path("bench.yaml"), "--truth",
                       path("truth.yaml"), "--faults", path("faults.yaml"), "--truth-log", path("wire.jsonl")},
                      kBenchPriority))) {
    process_.wait_for("\"rdt\"");
    for (const char* line : {"motor", "supply"})
      lines_.emplace_back(::open(path(line).c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
    write(folder_.path() / "short.yaml", short_campaign_text("0, 45, 180"));
  }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  [[nodiscard]] nlohmann::json status() const { return nlohmann::json::parse(sim::tell(path("control"), "status")); }
  [[nodiscard]] double time_ms() const { return 1e3 * status()["bench_time_s"].get<double>(); }
  /// Waits until the status is such; whether it came to that.
  template <class Holds>
  [[nodiscard]] bool await(Holds&& holds, std::chrono::seconds limit = std::chrono::seconds(20)) const {
    const auto give_up = std::chrono::steady_clock::now() + limit;
    while (!holds(status())) {
      if (std::chrono::steady_clock::now() > give_up) return false;
      ::poll(nullptr, 0, 5);
    }
    return true;
  }
  [[nodiscard]] bool await_speed(double rad_s) const {
    return await([=](const nlohmann::json& now) { return now["speed_rad_s"] > rad_s; });
  }
  /// Makes a fault begin at once; when that was, in ms of the bench.
  [[nodiscard]] double fault(const std::string& words) const {
    const std::string answer = sim::tell(path("control"), "fault " + words);
    EXPECT_EQ(answer.substr(0, 3), "ok ") << answer;
    return 1e3 * std::stod(answer.substr(3));
  }
  /// Waits until the simulated motor turns slower than it would on any command of the campaign.
  [[nodiscard]] bool motor_stops() const {
    for (int asked = 0; asked < 400; ++asked) {
      const auto said = nlohmann::json::parse(ran({kphi(), "sim", path("bench.yaml"), "--status"}).out);
      if (std::abs(said.at("speed_rad_s").get<double>()) < 5.0) return true;
    }
    return false;
  }
  /// Ends it: what its motor was told and did.
  [[nodiscard]] Account account() {
    process_.signal(SIGTERM);
    EXPECT_EQ(process_.wait(), 0) << process_.err();
    return account_of(bytes_of(path("wire.jsonl")));
  }
  [[nodiscard]] std::vector<std::string> run_command() const { return in_real_time(run_command_at_any_priority()); }
  [[nodiscard]] std::vector<std::string> run_command_at_any_priority() const {
    return {kphi(), "run", path("short.yaml"), "--bench", path("bench.yaml"), "--yes", "--out", path("results")};
  }
  Process& process() { return process_; }

 private:
  static constexpr int kBenchPriority = 20;  // above its programs'
  TemporaryFolder folder_;
  Process process_;
  /// Its pseudo-terminals, kept beyond its death: no other bench gets a number whose lock a program still holds.
  std::vector<Descriptor> lines_;
};

}  // namespace kphi::test
