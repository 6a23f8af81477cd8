// A computer that falls asleep in the midst of `kphi run`, beside a simulated bench that does not: the program stands
// still, its CLOCK_MONOTONIC with it, and the module lets the motor go by itself.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "test/end_to_end/account.hpp"
#include "test/end_to_end/process.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/end_to_end/slept_time.hpp"
#include "test/end_to_end/terminal.hpp"

namespace kphi::test {

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
  [[nodiscard]] int told_to_turn() const;
  [[nodiscard]] std::string stage_at_the_end() const { return account.stage_at(ended_ms); }
};

class SleepingHost {
 public:
  explicit SleepingHost(const Sleep& sleep);

  /// Runs the campaign, sleeps once at the moment, and lives on to the program's end. Nothing: the program was past the
  /// moment, or had ended, before it stood still.
  [[nodiscard]] std::optional<Awakening> sleep_once();
  /// Of the campaign, once there is one.
  [[nodiscard]] std::optional<std::string> folder() const;
  /// Names of the files in its runs/.
  [[nodiscard]] std::vector<std::string> recorded() const;
  /// `kphi verify` of the folder: exit code.
  [[nodiscard]] int verify() const;
  /// The same computer goes on with the folder, or begins anew if there is none: exit code, and words in `said`.
  [[nodiscard]] int go_on(std::string& said);
  /// Ends the simulator, whose account is complete then.
  void complete(Awakening& awakening);

 private:
  [[nodiscard]] nlohmann::json status() const;
  [[nodiscard]] std::vector<std::string> first_command() const;
  [[nodiscard]] std::vector<std::string> resume_command(const std::string& folder) const;
  [[nodiscard]] Surroundings surroundings() const;
  /// Whether the program is at the moment, by the truth of the bench.
  [[nodiscard]] bool is_at(const nlohmann::json& now, const Process& run) const;
  [[nodiscard]] bool await_the_moment(Process& run) const;
  /// The program stands still meanwhile.
  void stay_asleep(const Process& run);
  void live_on(Process& run, Awakening& awakening) const;

  Sleep sleep_;
  RunningBench bench_;
  SleptTime slept_;
  Terminal terminal_;
};

}  // namespace kphi::test
