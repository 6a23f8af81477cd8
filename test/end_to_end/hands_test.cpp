// What a person's hands do at a terminal, and when: nothing turns on a word that nobody said now. Over the true
// transports, through a pseudo-terminal; where jobs are controlled, by bash.
#include <gmock/gmock.h>

#include <random>

#include "results/journal.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/end_to_end/terminal.hpp"

namespace kphi::test::hands_test {

using testing::HasSubstr;
using testing::Not;

std::vector<std::string> spin(const RunningBench& bench, const std::string& dead_man_s = "4") {
  return {kphi(),       "spin",     "--bench", bench.path("bench.yaml"), "--rpm", "6000",
          "--dead-man", dead_man_s, "--out",   bench.path("results")};
}

bool has_turned(const Account& account) { return account.last_speed_at() >= 0; }

/// A campaign of two mountings, asked for at a terminal.
class TwoMountings {
 public:
  TwoMountings() {
    write(bench.path("two.yaml"), short_campaign_text("0, 180", 1, 2));
    run.emplace(std::vector<std::string>{kphi(), "run", bench.path("two.yaml"), "--bench", bench.path("bench.yaml"),
                                         "--out", bench.path("results")},
                "", Surroundings{{}, terminal.descriptor(), 0});
  }
  RunningBench bench{Manner{.time_scale = 4, .supply = true}};
  Terminal terminal;
  std::optional<Process> run;
};

TEST(TypedAhead, AnswersNoQuestionThatIsStillToBeAsked) {
  TwoMountings stand;
  stand.run->wait_for_prompt();
  stand.terminal.press("0\n180\n");
  stand.run->wait_for("Mount the 180° occlusion");
  stand.run->wait_for_prompt();
  stand.terminal.type("q");
  EXPECT_EQ(stand.run->wait(), 130) << stand.run->err();
  EXPECT_THAT(stand.run->err(), HasSubstr("1 of 2 runs finished"));
  EXPECT_TRUE(safely(stand.bench.account().ends_without_power()));
}

TEST(TypedAhead, IsNoticedInTheJournalByTheTimeThatAnAnswerTook) {
  TwoMountings stand;
  stand.run->wait_for_prompt();
  stand.terminal.type("Q");
  EXPECT_EQ(stand.run->wait(), 130) << stand.run->err();
  const auto folder = campaign_below(stand.bench.path("results"), "journal.jsonl");
  ASSERT_TRUE(folder);
  double after_s = -1;
  for (const auto& entry : results::read_journal(folder->journal()).entries)
    if (entry.event == "operator_answered") after_s = entry.data.at("after_s").get<double>();
  EXPECT_GE(after_s, 0);
  EXPECT_LT(after_s, 60);
}

TEST(TypedAhead, DoesNotStartTheMotorThatIsStillBeingConnected) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  Terminal terminal;
  terminal.type("go");
  Process program(in_real_time(spin(bench)), {}, {{}, terminal.descriptor(), 0});
  program.wait_for_prompt();
  terminal.type("q");
  EXPECT_EQ(program.wait(), 130) << program.err();
  EXPECT_TRUE(safely(!has_turned(bench.account())));
}

/// When after the answer a key is pressed.
class SecondAfterGo : public testing::TestWithParam<const char*> {};

TEST_P(SecondAfterGo, BelongsToTheKeyThatStops) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  Terminal terminal;
  Process program(in_real_time(spin(bench)), {}, {{}, terminal.descriptor(), 0});
  program.wait_for_prompt();
  const std::string when = GetParam();
  terminal.press(when == "AtOnce" ? "Go\n " : "go\n");
  if (when == "WithPower") {
    ASSERT_TRUE(bench.await([](const auto& now) { return now["supply"]["output"] == true; }));
  }
  if (when != "AtOnce") terminal.press(" ");
  EXPECT_EQ(program.wait(), 130) << program.err();
  const Account account = bench.account();
  EXPECT_TRUE(safely(!has_turned(account)));
  EXPECT_TRUE(safely(account.ends_without_power()));
}

INSTANTIATE_TEST_SUITE_P(Pressed, SecondAfterGo, testing::Values("AtOnce", "WithPower"),
                         [](const auto& when) { return std::string(when.param); });

/// As RPM.
double fastest(const Account& account, double from_ms, double to_ms) {
  double rpm = 0;
  for (const Account::Command& command : account.commands)
    if (command.mode == "velocity" && command.at >= from_ms && command.at <= to_ms)
      rpm = std::max(rpm, to_rpm(RadPerSec(std::abs(command.target))));
  return rpm;
}

TEST(KeyHeldDown, LeadsTheMotorByOneStepWhenItIsLetGo) {
  constexpr double kStart = 3000, kStep = 500, kSlew = 2000;          // RPM, RPM/s
  constexpr double kEvery_ms = 33, kHeld_ms = 1000, kTaken_ms = 200;  // by the program; on a busy computer
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  Terminal terminal;
  Process program(in_real_time({kphi(), "spin", "--bench", bench.path("bench.yaml"), "--rpm", "3000", "--dead-man", "4",
                                "--out", bench.path("results")}),
                  {}, {{}, terminal.descriptor(), 0});
  program.wait_for_prompt();
  terminal.type("go");
  ASSERT_TRUE(bench.await([](const auto& now) {
    return to_rpm(RadPerSec(now["drive"]["target"].template get<double>())) > kStart - 1 && now["speed_rad_s"] > 290;
  })) << program.err();
  const double pressed_ms = bench.time_ms();
  double let_go_ms = pressed_ms;
  for (double due_ms = pressed_ms; let_go_ms < pressed_ms + kHeld_ms; due_ms += kEvery_ms) {
    terminal.press("\x1b[A");
    ASSERT_TRUE(
        bench.await([&](const auto& now) { return 1e3 * now["bench_time_s"].template get<double>() > due_ms; }));
    let_go_ms = bench.time_ms();
  }
  ASSERT_EQ(program.wait(), 0) << program.err();  // what else ended it says nothing about keys
  EXPECT_THAT(program.err(), HasSubstr("no key for 4 s"));
  const Account account = bench.account();
  const double led_rpm = fastest(account, let_go_ms - kTaken_ms, let_go_ms + kTaken_ms);
  EXPECT_GT(led_rpm, kStart + kStep) << "it follows";
  EXPECT_TRUE(safely(fastest(account, 0, account.coasts_at()) <= led_rpm + kStep + 1))
      << led_rpm << " RPM when the key was let go, then " << fastest(account, 0, account.coasts_at());
  EXPECT_LE(led_rpm, kStart + kSlew * 1e-3 * (let_go_ms - pressed_ms + 2 * kTaken_ms)) << "no faster than its slew";
  EXPECT_TRUE(safely(account.ends_without_power()));
}

TEST(SignalAtTheStart, LetsNoPowerComeOnAndNoneStay) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  constexpr double kObeyed_ms = 400;  // an order on the wire is answered and checked before the next one
  constexpr double kUnderWay_ms = 100;
  struct Run {
    double signal_ms, ended_ms;
  };
  std::vector<Run> runs;
  for (const int delay_ms : {200, 350, 500, 650, 800, 950, 1100, 1200}) {
    Process run(bench.run_command());
    const double due_ms = bench.time_ms() + delay_ms;
    ASSERT_TRUE(
        bench.await([&](const auto& now) { return 1e3 * now["bench_time_s"].template get<double>() > due_ms; }));
    run.signal(SIGINT);
    const double signal_ms = bench.time_ms();
    EXPECT_EQ(run.wait(), 130) << delay_ms << run.err();
    runs.push_back({signal_ms, bench.time_ms()});
  }
  const Account account = bench.account();
  EXPECT_TRUE(safely(!has_turned(account)));
  for (std::size_t i = 0; i < account.outputs.size(); ++i) {
    if (!account.outputs[i]) continue;
    // On before the signal of its run, unless that order was under way, or not at all; off soon after it.
    const auto run = std::ranges::find_if(runs, [&](const Run& one) { return account.outputs_at[i] <= one.ended_ms; });
    ASSERT_NE(run, runs.end());
    ASSERT_LT(i + 1, account.outputs.size());
    const double on_ms = account.outputs_at[i] - run->signal_ms, off_ms = account.outputs_at[i + 1] - run->signal_ms;
    EXPECT_TRUE(safely(on_ms <= kUnderWay_ms && off_ms <= kObeyed_ms))
        << "on " << on_ms << " ms and off " << off_ms << " ms after the signal";
  }
}

TEST(SignalAtTheStart, TellsOfASupplyThatDoesNotConfirmThatItIsOffAgain) {
  RunningBench bench(
      Manner{.time_scale = 1, .faults = "  - {at_s: 0, for_s: 1000, kind: motor_mute}\n", .supply = true});
  Process run(bench.run_command());
  ASSERT_TRUE(bench.await([](const auto& now) { return now["supply"]["output"] == true; })) << run.err();
  (void)bench.fault("kind=supply_ignored_writes for_s=1000");
  run.signal(SIGINT);
  EXPECT_EQ(run.wait(), 130) << run.err();
  EXPECT_NE(run.err().find("output NOT confirmed off, it may be ON"), std::string::npos) << run.err();
}

/// A shell that controls jobs, at a terminal.
class Shell {
 public:
  Shell()
      : process_({"setsid", "--ctty", "bash", "--norc", "--noprofile", "-i"}, {},
                 {{"PS1=READY> "}, terminal_.descriptor(), 0}) {
    await_ready();
  }
  void start(const std::vector<std::string>& command) { type(fmt::format("{}", fmt::join(command, " "))); }
  void type(const std::string& line) { terminal_.type(line); }
  void press(const std::string& keys) { terminal_.press(keys); }
  void hear(std::chrono::milliseconds limit) { (void)process_.hear(limit); }
  /// Until the program asks; false: it has ended or was stopped.
  bool is_asked() { return process_.wait_for_prompt({"to stop: ", "READY> "}) == 0; }
  void wait_for(const std::string& words) { process_.wait_for(words); }
  /// The program has ended or was stopped.
  void await_ready() { (void)process_.wait_for_prompt({"READY> "}); }
  /// Lets what was stopped continue, and presses a key that stops it until it has ended.
  void end_by_a_key() {
    type("fg");
    while (hear(std::chrono::milliseconds(200)), words().rfind("READY> ") < words().rfind("fg"))
      press("x");  // from the first moment in which the terminal is the program's again
    await_ready();
  }
  /// Of the last job, which has ended.
  int exit_code() {
    type(
        "\x15"
        "echo en''ded: $?");  // without what was typed after its end
    const std::string line = process_.wait_for("ended: ");
    return std::stoi(line.substr(line.find("ended: ") + 7));
  }
  /// Lets what was stopped continue; returns once no job is left.
  void await_end() {
    do {
      await_ready();
      type("fg 2>/dev/null || echo NO''JOB >&2");
    } while (process_.wait_for_prompt({"NOJOB", "READY> "}) != 0);
    await_ready();
  }
  [[nodiscard]] std::string words() const { return process_.err(); }

 private:
  Terminal terminal_;
  Process process_;
};

TEST(CtrlZ, CoastsFirstAndNothingTurnsAfterwards) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  Shell shell;
  shell.start(spin(bench));
  ASSERT_TRUE(shell.is_asked()) << shell.words();
  shell.type("go");
  ASSERT_TRUE(bench.await_speed(600)) << shell.words();
  shell.press("\x1a");
  ASSERT_TRUE(bench.await([](const auto& now) { return now["drive"]["mode"] == "coast"; }));
  ASSERT_TRUE(bench.await([](const auto& now) { return now["supply"]["output"] == false; })) << "before it stops";
  shell.await_ready();
  shell.type("fg");
  shell.await_ready();
  EXPECT_EQ(shell.exit_code(), 130) << shell.words();
  const Account account = bench.account();
  EXPECT_TRUE(safely(account.ends_without_power()));
  EXPECT_LT(account.last_speed_at(), account.coasts_at()) << "nothing turned after it";
}

TEST(CtrlZ, AtAQuestionOnlyStopsTheProgramAndTheQuestionIsAskedAgain) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  Shell shell;
  shell.start(spin(bench));
  ASSERT_TRUE(shell.is_asked()) << shell.words();
  shell.press("\x1a");
  shell.await_ready();
  shell.type("fg");
  ASSERT_TRUE(shell.is_asked()) << shell.words();
  shell.type("q");
  shell.await_ready();
  EXPECT_EQ(shell.exit_code(), 130) << shell.words();
  EXPECT_TRUE(safely(!has_turned(bench.account())));
}

TEST(CtrlZ, StopsInPlaceWhereNothingCanTurn) {
  RunningBench bench(Manner{.time_scale = 4, .supply = true});
  Shell shell;
  shell.start({kphi(), "weigh", "--bench", bench.path("bench.yaml"), "--kg", "0.5", "--out", bench.path("results")});
  shell.wait_for("Take everything off");
  shell.press("\x1a");
  shell.await_ready();
  EXPECT_THAT(shell.words(), HasSubstr("Stopped"));
  shell.end_by_a_key();
  EXPECT_EQ(shell.exit_code(), 130) << shell.words();
  EXPECT_TRUE(safely(bench.account().ends_without_power()));
}

/// What is stopped as soon as it has switched the supply on.
struct Powered {
  const char* verb;
  std::vector<std::string> more;  ///< of its command line; a word with a point is a path in the bench's folder
};

std::ostream& operator<<(std::ostream& out, const Powered& powered) { return out << powered.verb; }

class CtrlZWithPower : public testing::TestWithParam<Powered> {};

TEST_P(CtrlZWithPower, SwitchesItOffBeforeItStopsTheProgram) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  write(bench.path("two.yaml"), short_campaign_text("0, 180", 1, 2));
  std::vector<std::string> command{kphi(), GetParam().verb, "--bench", bench.path("bench.yaml")};
  for (const std::string& word : GetParam().more)
    command.push_back(word.find('.') == std::string::npos ? word : bench.path(word));
  Shell shell;
  shell.start(command);
  ASSERT_TRUE(bench.await([](const auto& now) { return now["supply"]["output"] == true; })) << shell.words();
  shell.press("\x1a");
  shell.await_ready();
  EXPECT_TRUE(safely(bench.status()["supply"]["output"] == false));
  EXPECT_THAT(shell.words(), HasSubstr("Stopped"));
  shell.end_by_a_key();
  EXPECT_EQ(shell.exit_code(), 130) << shell.words();
  const Account account = bench.account();
  EXPECT_TRUE(safely(!has_turned(account)));
  EXPECT_TRUE(safely(account.ends_without_power()));
}

const Powered kPowered[] = {
    {"devices", {"--switch-on", "--clock-gain", "20"}},
    {"weigh", {"--kg", "1", "--out", "out.d"}},
    {"spin", {"--rpm", "6000", "--out", "out.d"}},
    {"run", {"two.yaml", "--out", "out.d"}},
};
INSTANTIATE_TEST_SUITE_P(Of, CtrlZWithPower, testing::ValuesIn(kPowered),
                         [](const auto& powered) { return std::string(powered.param.verb); });

TEST(CtrlZ, LeavesNoMotorWhoseKeysBelongToTheShell) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  Shell shell;
  shell.start(joined(spin(bench), {"--yes", "&"}));
  shell.wait_for("in the background");
  EXPECT_TRUE(safely(!has_turned(bench.account())));
}

/// What random hands did at one program, in ms of the bench.
struct Deeds {
  double started = 0, ended = 0;
  std::vector<double> answers;  ///< right ones, each typed after its question
  double last_key = 0;          ///< that steers; or the answer
  std::string story;
};

/// Random keys, words and job-control signals, before, at and after the questions of a program.
class RandomHands {
 public:
  RandomHands(const RunningBench& bench, Shell& shell, unsigned seed) : bench_(bench), shell_(shell), random_(seed) {}

  /// `right`: the answers that the program wants, in their order.
  Deeds at(const std::vector<std::string>& command, const std::vector<std::string>& right) {
    deeds_ = {};
    deeds_.started = bench_.time_ms();
    shell_.start(command);
    if (once_in(2)) press(right.front() + "\n" + right.back() + "\n+ ");
    for (const std::string& answer : right)
      if (!answers(answer)) break;
    if (!deeds_.answers.empty() && command[1] == "spin") steer();
    shell_.await_end();
    deeds_.ended = bench_.time_ms();
    return std::move(deeds_);
  }

 private:
  int pick(int below) { return std::uniform_int_distribution<int>(0, below - 1)(random_); }
  bool once_in(int n) { return pick(n) == 0; }
  std::string one_of(const std::vector<std::string>& all) {
    return all[static_cast<std::size_t>(pick(static_cast<int>(all.size())))];
  }
  void press(const std::string& keys) {
    std::string shown;
    for (const char c : keys) shown += c >= ' ' ? std::string(1, c) : fmt::format("^{}", static_cast<char>(c + '@'));
    deeds_.story += fmt::format("  {:.0f} ms: {}\n", bench_.time_ms(), shown);
    shell_.press(keys);
  }
  /// False: the program asks nothing more.
  bool answers(const std::string& answer) {
    if (!shell_.is_asked()) return false;
    while (once_in(3)) {
      press(one_of({"\n", "no\n", "yes\n", "45.5\n", "GO AWAY\n", "+\n"}));
      if (!shell_.is_asked()) return false;
    }
    while (once_in(4)) {
      press("\x1a");
      shell_.await_ready();
      shell_.type(once_in(2) ? "bg; fg" : "fg");
      if (!shell_.is_asked()) return false;
    }
    if (once_in(6)) {
      press(one_of({"q\n", "Q \n", "\x03", "\x04"}));
      return false;
    }
    deeds_.answers.push_back(deeds_.last_key = bench_.time_ms());
    press(answer + "\n");
    return true;
  }
  void steer() {
    for (int keys = pick(12); keys > 0; --keys) {
      shell_.hear(std::chrono::milliseconds(pick(400)));
      const std::string key = one_of({"+", "-", "h", "\n", "\x1b[A", "\x1b[B", "+", "-", "+++++", " ", "x", "\x1a"});
      if (key != " " && key != "x" && key != "\x1a") deeds_.last_key = bench_.time_ms();
      press(key);
      if (key == "\x1a" || key == " " || key == "x") return;
    }
  }

  const RunningBench& bench_;
  Shell& shell_;
  std::mt19937 random_;
  Deeds deeds_;
};

struct Trial {
  const char* verb;
  unsigned seed;
  int sequences;
};

std::ostream& operator<<(std::ostream& out, const Trial& trial) { return out << trial.verb << trial.seed; }

class Hands : public testing::TestWithParam<Trial> {};

/// On a busy computer, and to the module.
constexpr double kDeadManMs = 1000, kSlack_ms = 400;

TEST_P(Hands, NeverTurnAMotorWithoutAnAnswerToItsQuestion) {
  const Trial& trial = GetParam();
  const bool spins = trial.verb == std::string("spin");
  RunningBench bench(Manner{.time_scale = spins ? 1.0 : 4.0, .supply = true});
  write(bench.path("two.yaml"), short_campaign_text("0, 180", 1, 2));
  const std::vector<std::string> run{
      kphi(), "run", bench.path("two.yaml"), "--bench", bench.path("bench.yaml"), "--out", bench.path("results")};
  std::vector<Deeds> all;
  {
    Shell shell;
    RandomHands hands(bench, shell, trial.seed);
    for (int i = 0; i < trial.sequences; ++i) {
      all.push_back(spins ? hands.at(spin(bench, "1"), {"go"}) : hands.at(run, {"0", "180"}));
      ASSERT_TRUE(bench.await([](const auto& now) { return now["supply"]["output"] == false; })) << all.back().story;
      EXPECT_TRUE(safely(std::abs(bench.status()["speed_rad_s"].get<double>()) < 2000)) << all.back().story;
    }
  }
  const Account account = bench.account();
  for (const Account::Command& command : account.commands) {
    if (command.mode != "velocity" || command.target == 0) continue;
    const auto deeds = std::ranges::find_if(all, [&](const Deeds& one) { return command.at <= one.ended; });
    ASSERT_NE(deeds, all.end());
    EXPECT_TRUE(safely(!deeds->answers.empty() && command.at >= deeds->answers.front()))
        << command.at << " ms: turns without an answer\n"
        << deeds->story;
    if (!spins) continue;
    // Before the first speed there are a zero and the power; without a key it stops a dead man's time after the last.
    const double turns_from = std::max(deeds->last_key, deeds->answers.front() + 4000);
    EXPECT_TRUE(safely(command.at <= turns_from + kDeadManMs + kSlack_ms)) << command.at << " ms: turns without a key\n"
                                                                           << deeds->story;
  }
  EXPECT_TRUE(safely(account.ends_without_power()));
}

std::vector<Trial> trials(unsigned first, unsigned count, int sequences) {
  std::vector<Trial> all;
  for (unsigned seed = first; seed < first + count; ++seed)
    all.push_back({seed % 2 == 0 ? "spin" : "run", seed, sequences});
  return all;
}

std::string name_of_trial(const testing::TestParamInfo<Trial>& trial) {
  return fmt::format("{}{}", trial.param.verb, trial.param.seed);
}

INSTANTIATE_TEST_SUITE_P(Few, Hands, testing::ValuesIn(trials(0, 2, 3)), name_of_trial);
INSTANTIATE_TEST_SUITE_P(Many, Hands, testing::ValuesIn(trials(100, 20, 10)), name_of_trial);

}  // namespace kphi::test::hands_test
