// `kphi spin` at a terminal, on a bench over its true transports: whatever is pressed, pulled or killed, the motor
// coasts by its own account, and the supply is off.
#include <gmock/gmock.h>

#include "test/end_to_end/running_bench.hpp"
#include "test/end_to_end/terminal.hpp"

namespace kphi::test::spin_test {

using testing::HasSubstr;

constexpr double kPrompt = 200;       // ms
constexpr double kModuleAlone = 600;  // ms: it is told 0.5 s

struct Way {
  const char* name;
  void (*deed)(Process&, Terminal&);
  int exit_code;
  const char* words;
  double limit_ms = kPrompt;
};

std::ostream& operator<<(std::ostream& out, const Way& way) { return out << way.name; }

template <int Number>
void send(Process& spin, Terminal&) {
  spin.signal(Number);
}

template <char Key>
void press(Process&, Terminal& terminal) {
  terminal.press(std::string(1, Key));
}

class SpinAtATerminal : public testing::TestWithParam<Way> {};

TEST_P(SpinAtATerminal, EndsWithTheMotorCoasting) {
  const Way& way = GetParam();
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  Terminal terminal;
  Process spin(in_real_time({kphi(), "spin", "--bench", bench.path("bench.yaml"), "--rpm", "6000", "--dead-man", "4",
                             "--out", bench.path("results")}),
               {}, {{}, terminal.descriptor(), 0});
  spin.wait_for_prompt();
  terminal.type("go");
  ASSERT_TRUE(bench.await_speed(600)) << spin.err();
  const double cause_ms = bench.time_ms();
  way.deed(spin, terminal);
  EXPECT_EQ(spin.wait(), way.exit_code) << spin.err();
  EXPECT_THAT(spin.err(), HasSubstr(way.words));
  ASSERT_TRUE(bench.await([](const auto& now) { return now["drive"]["mode"] == "coast"; }));
  ASSERT_TRUE(bench.await([](const auto& now) { return now["supply"]["output"] == false; }));
  const Account account = bench.account();
  const double coasts_ms = account.coasts_at() - cause_ms;
  fmt::print("{:<12} coasts {:6.1f} ms after the cause; wanted {:.0f} ms\n", way.name, coasts_ms, way.limit_ms);
  (void)safely(coasts_ms <= way.limit_ms);
  EXPECT_LE(coasts_ms, way.limit_ms);
  EXPECT_TRUE(safely(account.ends_without_power()));
}

const Way kWays[] = {
    {"Space", press<' '>, 0, "stopping: a key was pressed"},
    {"Interrupt", send<SIGINT>, 130, "stopped by request"},
    {"HangUp", send<SIGHUP>, 130, "stopped by request"},
    {"Killed", send<SIGKILL>, 128 + SIGKILL, "", kModuleAlone},
    {"DeadMan", [](Process&, Terminal&) {}, 0, "stopping: no key for 4 s", 4500},
};
INSTANTIATE_TEST_SUITE_P(Each, SpinAtATerminal, testing::ValuesIn(kWays),
                         [](const testing::TestParamInfo<Way>& way) { return std::string(way.param.name); });

TEST(Spin, NeedsSomebodyAtTheKeysAndSomebodyWhoSaysThatTheStandIsClear) {
  RunningBench bench;
  const std::vector<std::string> spin{kphi(), "spin", "--bench", bench.path("bench.yaml"), "--rpm", "6000"};
  EXPECT_THAT(ran(spin, 2).err, HasSubstr("nobody can press a key"));
  EXPECT_THAT(ran(joined(spin, {"--for", "1"}), 2).err, HasSubstr("cannot ask whether the stand is clear"));
  EXPECT_THAT(ran(joined(spin, {"--for", "1", "--yes", "--percent", "3"}), 2).err, HasSubstr("--percent"));
}

}  // namespace kphi::test::spin_test
