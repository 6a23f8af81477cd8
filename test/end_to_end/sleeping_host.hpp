// A computer that falls asleep in the midst of `kphi run`, beside a simulated bench that does not: the program stands
// still, its CLOCK_MONOTONIC with it, and the module lets the motor go by itself.
#pragma once

#include <fcntl.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "test/end_to_end/running_bench.hpp"
#include "test/end_to_end/terminal.hpp"

namespace kphi::test {

inline constexpr double kFirstRpm = 6000, kLastRpm = 12000;
inline constexpr double kRadPerSec = 2 * 3.14159265358979 / 60;  // of 1 RPM
inline constexpr int kRealTimePriority = 10;
inline constexpr int kWatchPriority = 15;  // of who looks for the moment
inline constexpr int kLookEveryMs = 2;
inline constexpr auto kPatience = std::chrono::seconds(40);
inline const std::string kQuestion = "Enter, or q to stop:";
inline const std::string kMountedAngle = "0";

/// Runs of three steps, between two ramps up and before a ramp down.
inline std::string sleepy_campaign_text(const char* occlusions_deg) {
  return fmt::format(
      "format: kphi-campaign/1\nname: short\n"
      "propeller: {{id: 5x3, name: 5-inch three-blade, diameter_in: 5, blades: 3}}\n"
      "occlusions_deg: [{}]\nrepetitions: 1\nrepetitions_extra_max: 0\norder: {{steps: up_and_down}}\n"
      "profile: {{steps: 2, dwell_s: 0.6, first_rpm: {}, last_rpm: {}, slew_rpm_s: 2500}}\n"
      "zero_s: 0.6\nminimum_discard_s: 0.3\nsupply_v: 12.0\n"
      "limits: {{speed_max_rpm: 19100, thrust_max_n: 20, supply_current_max_a: 35, coil_temperature_max_degc: 110}}\n",
      occlusions_deg, kFirstRpm, kLastRpm);
}

inline bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Share of the way from one speed to the other.
inline double share(double rad_s, double from_rpm, double to_rpm) {
  return (std::abs(rad_s) / kRadPerSec - from_rpm) / (to_rpm - from_rpm);
}

/// This thread's, not its children's.
inline void watch_in_real_time() {
  const sched_param priority{kWatchPriority};
  (void)sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority);
}

inline bool is_midway(double share) { return share > 0.3 && share < 0.7; }

/// What the program does when its computer falls asleep.
enum class Moment { connecting, prompt, zero, ramp_up, ramp_down, step, spin_down };

struct Sleep {
  Moment moment = Moment::step;
  double seconds = 1;
  bool supply = false;    ///< the bench has one of its own
  bool real_time = true;  ///< the program has a real-time priority, where that is granted
  /// What the box sent meanwhile waits for the program, as in a virtual machine that paused.
  bool sockets_kept = false;
};

/// What became of it.
struct Awakening {
  double asleep_ms = 0, woken_ms = 0, ended_ms = 0;  ///< bench time
  double speed_rad_s = 0;                            ///< when it woke
  double fastest_rad_s = 0;                          ///< since then
  int exit_code = -1;
  bool was_real_time = false;
  bool output_is_on = false;  ///< of the supply, in the end
  std::string words;          ///< of the program, to stderr
  Account account;            ///< of what was before `ended_ms` and after

  /// Orders to turn that the module got between the waking and the end.
  [[nodiscard]] int told_to_turn() const {
    return static_cast<int>(std::count_if(account.commands.begin(), account.commands.end(), [&](const auto& command) {
      return command.at > woken_ms && command.at <= ended_ms && command.mode != "coast" && command.mode != "brake";
    }));
  }
  [[nodiscard]] std::string stage_at_the_end() const { return account.stage_at(ended_ms); }
};

/// For how long the computer of a program under sleeping_clock.cpp has slept: a file that both see.
class SleptTime {
 public:
  /// Makes `file`, which lives as long as its folder. Nothing has slept yet.
  explicit SleptTime(std::string file) : file_(std::move(file)) {
    const int descriptor = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    void* page = MAP_FAILED;
    if (descriptor >= 0 && ftruncate(descriptor, sizeof(Nanoseconds)) == 0)
      page = mmap(nullptr, sizeof(Nanoseconds), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    if (descriptor >= 0) close(descriptor);
    if (page == MAP_FAILED) throw std::runtime_error("cannot share " + file_);
    slept_ = static_cast<Nanoseconds*>(page);
  }
  ~SleptTime() { munmap(slept_, sizeof(Nanoseconds)); }
  SleptTime(const SleptTime&) = delete;
  SleptTime& operator=(const SleptTime&) = delete;

  /// While the program stands still: it never sees its monotonic clock jump.
  void add(std::chrono::nanoseconds slept) { *slept_ += slept.count(); }
  /// Of a program that is to have these clocks.
  [[nodiscard]] std::vector<std::string> environment() const {
    return {"LD_PRELOAD=" KPHI_SLEEPING_CLOCK, "KPHI_SLEPT=" + file_};
  }

 private:
  using Nanoseconds = std::atomic<std::int64_t>;
  std::string file_;
  Nanoseconds* slept_ = nullptr;
};

// A computer that sleeps hears nothing: what is sent to it meanwhile is lost.

/// Throws away what waits in one socket if it takes datagrams.
inline void empty_datagrams(int socket) {
  int type = 0, domain = 0;
  socklen_t size = sizeof type;
  if (getsockopt(socket, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return;
  if (getsockopt(socket, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0 || domain != AF_INET) return;
  char byte = 0;
  while (recv(socket, &byte, sizeof byte, MSG_DONTWAIT | MSG_TRUNC) >= 0) {
  }
}

/// Throws away the datagrams that wait for the process `pid`, which stands still.
inline void lose_what_came_for(int pid) {
  const auto process = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  if (process < 0) throw std::system_error(errno, std::generic_category(), "pidfd_open");
  for (const auto& entry : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/fd")) {
    if (!std::filesystem::read_symlink(entry).string().starts_with("socket:")) continue;
    const auto socket = static_cast<int>(syscall(SYS_pidfd_getfd, process, std::stoi(entry.path().filename()), 0));
    if (socket < 0) throw std::system_error(errno, std::generic_category(), "pidfd_getfd");
    empty_datagrams(socket);
    close(socket);
  }
  close(process);
}

class SleepingHost {
 public:
  explicit SleepingHost(const Sleep& sleep)
      : sleep_(sleep), bench_({1, 7000, "  []\n", sleep.supply}), slept_(bench_.path("slept")) {
    write(bench_.path("short.yaml"), sleepy_campaign_text(sleep.moment == Moment::prompt ? "0, 90" : "0"));
  }

  /// Runs the campaign, sleeps once at the moment, and lives on to the program's end. Nothing: the program was past the
  /// moment, or had ended, before it stood still.
  [[nodiscard]] std::optional<Awakening> sleep_once() {
    watch_in_real_time();
    Process run(first_command(), {}, surroundings());
    if (!await_the_moment(run) || !run.freeze()) return std::nullopt;
    Awakening awakening;
    awakening.was_real_time = run.is_real_time();
    const nlohmann::json asleep = bench_.status();
    (void)run.hear();
    if (!is_at(asleep, run)) return std::nullopt;
    awakening.asleep_ms = 1e3 * asleep["bench_time_s"].get<double>();
    stay_asleep(run);
    live_on(run, awakening);
    return awakening;
  }
  /// Of the campaign, once there is one.
  [[nodiscard]] std::optional<std::string> folder() const {
    if (!std::filesystem::exists(bench_.path("results"))) return std::nullopt;
    const std::filesystem::directory_iterator found(bench_.path("results"));
    return found == std::filesystem::directory_iterator() ? std::nullopt : std::optional(found->path().string());
  }
  /// Names of the files in its runs/.
  [[nodiscard]] std::vector<std::string> recorded() const {
    std::vector<std::string> names;
    const auto campaign = folder();
    if (!campaign || !std::filesystem::exists(*campaign + "/runs")) return names;
    for (const auto& file : std::filesystem::directory_iterator(*campaign + "/runs"))
      names.push_back(file.path().filename().string());
    return names;
  }
  /// `kphi verify` of the folder: exit code.
  [[nodiscard]] int verify() const { return Process({kphi(), "verify", folder().value()}).wait(); }
  /// The same computer goes on with the folder, or begins anew if there is none: exit code, and words in `said`.
  [[nodiscard]] int go_on(std::string& said) {
    const auto campaign = folder();
    Process run(campaign ? resume_command(*campaign) : bench_.run_command(), {},
                {slept_.environment(), -1, surroundings().fifo_priority});
    const int exit_code = run.wait();
    said = run.err();
    return exit_code;
  }
  /// Ends the simulator, whose account is complete then.
  void complete(Awakening& awakening) { awakening.account = bench_.account(); }

 private:
  [[nodiscard]] std::vector<std::string> first_command() const {
    std::vector<std::string> command = bench_.run_command_at_any_priority();
    if (sleep_.moment == Moment::prompt) std::erase(command, "--yes");
    return command;
  }
  [[nodiscard]] std::vector<std::string> resume_command(const std::string& folder) const {
    return in_real_time({kphi(), "run", "--bench", bench_.path("bench.yaml"), "--yes", "--resume", folder});
  }
  [[nodiscard]] Surroundings surroundings() const {
    return {slept_.environment(), sleep_.moment == Moment::prompt ? terminal_.descriptor() : -1,
            sleep_.real_time ? kRealTimePriority : 0};
  }
  /// Whether the program is at the moment, by the truth of the bench.
  [[nodiscard]] bool is_at(const nlohmann::json& now, const Process& run) const {
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
        return now["streaming"] && mode == "coast" && std::abs(speed) < 5 && !recorded().empty() &&
               !has(words, " zero ");
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
  [[nodiscard]] bool await_the_moment(Process& run) const {
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    while (!is_at(bench_.status(), run)) {
      if (!run.hear(std::chrono::milliseconds(kLookEveryMs)) || std::chrono::steady_clock::now() > give_up)
        return false;
    }
    return true;
  }
  /// The program stands still meanwhile.
  void stay_asleep(const Process& run) {
    const auto begun = std::chrono::steady_clock::now();
    const double begun_s = bench_.status()["bench_time_s"];
    const std::chrono::duration<double> lasts(sleep_.seconds);
    while (bench_.status()["bench_time_s"] < begun_s + lasts.count() ||
           std::chrono::steady_clock::now() < begun + lasts)
      ::poll(nullptr, 0, kLookEveryMs);
    if (!sleep_.sockets_kept) lose_what_came_for(run.pid());
    slept_.add(std::chrono::steady_clock::now() - begun);
  }
  void live_on(Process& run, Awakening& awakening) const {
    nlohmann::json now = bench_.status();
    awakening.woken_ms = 1e3 * now["bench_time_s"].get<double>();
    awakening.speed_rad_s = std::abs(now["speed_rad_s"].get<double>());
    run.signal(SIGCONT);
    // Whoever sits there does not know that it slept.
    if (sleep_.moment == Moment::prompt) terminal_.type(kMountedAngle);
    const auto look = [&] {
      now = bench_.status();
      awakening.fastest_rad_s = std::max(awakening.fastest_rad_s, std::abs(now["speed_rad_s"].get<double>()));
    };
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    do look();
    while (run.hear(std::chrono::milliseconds(kLookEveryMs)) && std::chrono::steady_clock::now() < give_up);
    awakening.exit_code = run.wait(std::chrono::seconds(10));
    look();
    awakening.ended_ms = 1e3 * now["bench_time_s"].get<double>();
    awakening.output_is_on = now.contains("supply") && now["supply"]["output"].get<bool>();
    awakening.words = run.err();
  }

  Sleep sleep_;
  RunningBench bench_;
  SleptTime slept_;
  Terminal terminal_;
};

}  // namespace kphi::test
