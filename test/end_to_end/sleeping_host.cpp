#include "test/end_to_end/sleeping_host.hpp"

#include <poll.h>
#include <sched.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "drivers/sim/control_line.hpp"
#include "test/end_to_end/unheard.hpp"

namespace kphi::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using SteadyTime = std::chrono::steady_clock;

constexpr double kFirstRpm = 6000, kLastRpm = 12000;
constexpr double kRadPerSec = 2 * 3.14159265358979 / 60;  // of 1 RPM
constexpr int kRealTimePriority = 10;
constexpr int kWatchPriority = 15;  // of who looks for the moment
constexpr int kLookEveryMs = 2;
constexpr auto kPatience = std::chrono::seconds(40);
const std::string kQuestion = "Enter, or q to stop:";
const std::string kMountedAngle = "0";

/// One run of three steps, between two ramps up and before a ramp down.
std::string campaign_text() {
  return fmt::format(
      "format: kphi-campaign/1\nname: short\n"
      "propeller: {{id: 5x3, name: 5-inch three-blade, diameter_in: 5, blades: 3}}\n"
      "occlusions_deg: [0]\nrepetitions: 1\nrepetitions_extra_max: 0\norder: {{steps: up_and_down}}\n"
      "profile: {{steps: 2, dwell_s: 0.6, first_rpm: {}, last_rpm: {}, slew_rpm_s: 2500}}\n"
      "zero_s: 0.6\nminimum_discard_s: 0.3\nsupply_v: 12.0\n"
      "limits: {{speed_max_rpm: 19100, thrust_max_n: 20, supply_current_max_a: 35, coil_temperature_max_degc: 110}}\n",
      kFirstRpm, kLastRpm);
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Share of the way from one speed to the other.
double share(double rad_s, double from_rpm, double to_rpm) {
  return (std::abs(rad_s) / kRadPerSec - from_rpm) / (to_rpm - from_rpm);
}

/// This thread's, not its children's.
void watch_in_real_time() {
  const sched_param priority{kWatchPriority};
  (void)sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority);
}

bool is_midway(double share) { return share > 0.3 && share < 0.7; }

}  // namespace

int Awakening::told_to_turn() const {
  return static_cast<int>(std::count_if(account.commands.begin(), account.commands.end(), [&](const auto& command) {
    return command.at > woken_ms && command.at <= ended_ms && command.mode != "coast" && command.mode != "brake";
  }));
}

SleepingHost::SleepingHost(const Sleep& sleep)
    : sleep_(sleep), bench_({1, 7000, "  []\n", sleep.supply}), slept_(bench_.path("slept")) {
  write(bench_.path("short.yaml"), campaign_text());
}

std::optional<Awakening> SleepingHost::sleep_once() {
  watch_in_real_time();
  Process run(first_command(), {}, surroundings());
  if (!await_the_moment(run) || !run.freeze()) return std::nullopt;
  Awakening awakening;
  awakening.was_real_time = run.is_real_time();
  const json asleep = status();
  (void)run.hear();
  if (!is_at(asleep, run)) return std::nullopt;
  awakening.asleep_ms = 1e3 * asleep["bench_time_s"].get<double>();
  stay_asleep(run);
  live_on(run, awakening);
  return awakening;
}

std::optional<std::string> SleepingHost::folder() const {
  if (!fs::exists(bench_.path("results"))) return std::nullopt;
  const fs::directory_iterator found(bench_.path("results"));
  return found == fs::directory_iterator() ? std::nullopt : std::optional(found->path().string());
}

std::vector<std::string> SleepingHost::recorded() const {
  std::vector<std::string> names;
  const auto campaign = folder();
  if (!campaign || !fs::exists(*campaign + "/runs")) return names;
  for (const auto& file : fs::directory_iterator(*campaign + "/runs")) names.push_back(file.path().filename().string());
  return names;
}

int SleepingHost::verify() const { return Process({kphi(), "verify", folder().value()}).wait(); }

int SleepingHost::go_on(std::string& said) {
  const auto campaign = folder();
  Process run(campaign ? resume_command(*campaign) : bench_.run_command(), {},
              {slept_.environment(), -1, surroundings().fifo_priority});
  const int exit_code = run.wait();
  said = run.err();
  return exit_code;
}

void SleepingHost::complete(Awakening& awakening) {
  bench_.process().signal(SIGTERM);
  if (bench_.process().wait() != 0) throw std::runtime_error("kphi sim: " + bench_.process().err());
  awakening.account = account_of(bytes_of(bench_.path("wire.jsonl")));
}

json SleepingHost::status() const { return json::parse(sim::tell(bench_.path("control"), "status")); }

std::vector<std::string> SleepingHost::first_command() const {
  std::vector<std::string> command = bench_.run_command_at_any_priority();
  if (sleep_.moment == Moment::prompt) std::erase(command, "--yes");
  return command;
}

/// What a person must answer before a campaign goes on that a safety stop has ended.
std::vector<std::string> SleepingHost::resume_command(const std::string& folder) const {
  return in_real_time({kphi(), "run", "--bench", bench_.path("bench.yaml"), "--yes", "--resume", folder});
}

Surroundings SleepingHost::surroundings() const {
  return {slept_.environment(), sleep_.moment == Moment::prompt ? terminal_.descriptor() : -1,
          sleep_.real_time ? kRealTimePriority : 0};
}

bool SleepingHost::is_at(const json& now, const Process& run) const {
  const std::string& words = run.err();
  const std::string mode = now["drive"]["mode"];
  const double target = mode == "velocity" ? now["drive"]["target"].get<double>() : 0;
  const double speed = now["speed_rad_s"];
  switch (sleep_.moment) {
    case Moment::connecting:
      return !folder() && (!now["last_motion_command_s"].is_null() ||
                           (now.contains("supply") && now["supply"]["output"].get<bool>()));
    case Moment::prompt:
      return has(words, kQuestion);
    case Moment::zero:
      return now["streaming"] && mode == "coast" && std::abs(speed) < 5 && !recorded().empty() && !has(words, " zero ");
    case Moment::ramp_up:
      return !has(words, "step  1/") && is_midway(share(target, 0, kFirstRpm));
    case Moment::ramp_down:
      return has(words, "step  2/") && is_midway(share(target, kLastRpm, kFirstRpm));
    case Moment::step:
      return !has(words, "step  2/") && share(target, 0, kLastRpm) > 0.999 && share(speed, 0, kLastRpm) > 0.99;
    case Moment::spin_down:
      return has(words, "step  3/") && share(target, 0, kFirstRpm) < 0.99 && share(speed, 0, kFirstRpm) > 0.2;
  }
  return false;
}

bool SleepingHost::await_the_moment(Process& run) const {
  const auto give_up = SteadyTime::now() + kPatience;
  while (!is_at(status(), run)) {
    if (!run.hear(std::chrono::milliseconds(kLookEveryMs)) || SteadyTime::now() > give_up) return false;
  }
  return true;
}

void SleepingHost::stay_asleep(const Process& run) {
  const auto begun = SteadyTime::now();
  const double begun_s = status()["bench_time_s"];
  const std::chrono::duration<double> lasts(sleep_.seconds);
  while (status()["bench_time_s"] < begun_s + lasts.count() || SteadyTime::now() < begun + lasts)
    ::poll(nullptr, 0, kLookEveryMs);
  if (!sleep_.sockets_kept) lose_what_came_for(run.pid());
  slept_.add(SteadyTime::now() - begun);
}

void SleepingHost::live_on(Process& run, Awakening& awakening) const {
  json now = status();
  awakening.woken_ms = 1e3 * now["bench_time_s"].get<double>();
  awakening.speed_rad_s = std::abs(now["speed_rad_s"].get<double>());
  run.signal(SIGCONT);
  // Whoever sits there does not know that it slept.
  if (sleep_.moment == Moment::prompt) terminal_.type(kMountedAngle);
  const auto look = [&] {
    now = status();
    awakening.fastest_rad_s = std::max(awakening.fastest_rad_s, std::abs(now["speed_rad_s"].get<double>()));
  };
  const auto give_up = SteadyTime::now() + kPatience;
  do look();
  while (run.hear(std::chrono::milliseconds(kLookEveryMs)) && SteadyTime::now() < give_up);
  awakening.exit_code = run.wait(std::chrono::seconds(10));
  look();
  awakening.ended_ms = 1e3 * now["bench_time_s"].get<double>();
  awakening.output_is_on = now.contains("supply") && now["supply"]["output"].get<bool>();
  awakening.words = run.err();
}

}  // namespace kphi::test
