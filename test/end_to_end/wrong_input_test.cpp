// Numbers that are not finite, and thrust that cannot be: neither turns a motor on, nor becomes a result. Over the true
// transports.
#include <gmock/gmock.h>

#include <sstream>

#include "results/journal.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/end_to_end/terminal.hpp"
#include "test/profiles/refusals.hpp"

namespace kphi::test::wrong_input_test {

using testing::AllOf;
using testing::HasSubstr;

/// An option of `kphi spin`.
class NotFinite : public testing::TestWithParam<const char*> {};

TEST_P(NotFinite, IsRefusedBySpinBeforeAnythingHasPower) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  Terminal terminal;
  std::vector<std::string> command{
      kphi(), "spin", "--bench", bench.path("bench.yaml"), "--yes", "--out", bench.path("results")};
  const std::string option = GetParam();
  if (option != "--rpm" && option != "--percent") command.insert(command.end(), {"--rpm", "4000"});
  if (option != "--for" && option != "--dead-man") command.insert(command.end(), {"--for", "1"});
  Process spin(in_real_time(joined(command, {option, "nan"})), {}, {{}, terminal.descriptor(), 0});
  bool on = false;
  while (!on && spin.hear(std::chrono::milliseconds(5))) on = bench.status()["supply"]["output"] == true;
  EXPECT_TRUE(safely(!on));
  if (on) spin.signal(SIGTERM);
  EXPECT_EQ(spin.wait(), 2) << spin.err();
  EXPECT_THAT(spin.err(), AllOf(HasSubstr(option), HasSubstr("nan")));
  EXPECT_TRUE(safely(bench.account().last_speed_at() < 0)) << "nothing has turned";
}

INSTANTIATE_TEST_SUITE_P(Option, NotFinite,
                         testing::Values("--slew", "--rpm", "--percent", "--step", "--dead-man", "--for"),
                         [](const auto& option) {
                           std::string name = std::string(option.param).substr(2);
                           std::erase(name, '-');
                           return name;
                         });

TEST(NotFiniteEither, ReachesAWeighingNoMoreThanAnExport) {
  RunningBench bench(Manner{.time_scale = 8});
  const std::vector<std::string> weigh{kphi(), "weigh", "--bench", bench.path("bench.yaml"), "--kg",
                                       "0.5",  "--yes", "--out",   bench.path("weighed"),    "--u-kg",
                                       "nan"};
  EXPECT_THAT(ran(weigh, 2).err, AllOf(HasSubstr("--u-kg"), HasSubstr("nan")));
  EXPECT_FALSE(std::filesystem::exists(bench.path("weighed")));

  const VirtualCampaign here(short_campaign_text("0, 90, 180"));
  const std::string folder = ran(here.command()).folder();
  (void)ran({kphi(), "fit", "--accept", "--no-report", folder});
  const Ended exported =
      ran({kphi(), "export", folder + "/coefficients.yaml", "--to", "gazebo", "--speed-max-rpm", "nan"}, 2);
  EXPECT_THAT(exported.err, AllOf(HasSubstr("--speed-max-rpm"), HasSubstr("nan")));
  EXPECT_EQ(exported.out, "");
}

/// How a bench's file, or its stand, differs from the truth.
struct Wrong {
  const char* name;
  const char* axis;  ///< in the file
  bool mounted;      ///< whether there is a propeller
  double last_rpm;   ///< step at which it is found: where so little cannot be noise
  const char* words;
};

std::ostream& operator<<(std::ostream& out, const Wrong& wrong) { return out << wrong.name; }

class WrongThrust : public testing::TestWithParam<Wrong> {};

TEST_P(WrongThrust, StopsARunAtTheFirstSpeedThatShowsIt) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  std::string text = profiles::changed(bytes_of(bench.path("bench.yaml")), "thrust_axis: +Fz",
                                       std::string("thrust_axis: ") + GetParam().axis);
  const auto control = text.find(", control: ");
  text.erase(control, text.find_first_of(",}", control + 2) - control);  // it is told by hand what is mounted
  write(bench.path("wrong.yaml"), text);
  if (GetParam().mounted) {
    EXPECT_EQ(sim::tell(bench.path("control"), "mount 5x3 0"), "ok 5x3 0");
  }
  write(bench.path("one.yaml"),
        profiles::changed(short_campaign_text("0", 1, 3), "thrust_max_n: 20", "thrust_max_n: 10"));
  const Ended run = ran(in_real_time({kphi(), "run", bench.path("one.yaml"), "--bench", bench.path("wrong.yaml"),
                                      "--yes", "--out", bench.path("results")}),
                        4);
  EXPECT_THAT(run.err, HasSubstr(GetParam().words));
  const auto folder = campaign_below(bench.path("results"), "journal.jsonl");
  ASSERT_TRUE(folder);
  bool stopped = false;
  for (const auto& entry : results::read_journal(folder->journal()).entries)
    stopped = stopped || (entry.event == "campaign_stopped" && entry.data.at("safety_stop") == true);
  EXPECT_TRUE(stopped);
  const Account account = bench.account();
  for (const Account::Command& command : account.commands) {
    if (command.mode != "velocity") continue;
    EXPECT_TRUE(safely(to_rpm(RadPerSec(std::abs(command.target))) < 1.05 * GetParam().last_rpm))
        << command.at << " ms";
  }
  EXPECT_TRUE(safely(std::isfinite(account.coasts_at())));
  EXPECT_TRUE(safely(account.ends_without_power()));
}

const Wrong kWrong[] = {
    {"Mirrored", "-Fz", true, 6000, "mirror thrust_axis in the bench file"},
    {"Missing", "+Fz", false, 12000, "is the propeller mounted"},
    {"OfAnotherAxis", "+Fx", true, 12000, "does the load cell carry the motor"},
};
INSTANTIATE_TEST_SUITE_P(Of, WrongThrust, testing::ValuesIn(kWrong),
                         [](const auto& wrong) { return std::string(wrong.param.name); });

/// The table with each value of the column negated.
std::string negated(const std::string& csv, const std::string& column) {
  std::istringstream text(csv);
  std::string all;
  std::ptrdiff_t wanted = -1;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with('#')) continue;
    std::vector<std::string> cells(1);
    for (const char c : line) {
      if (c == ',')
        cells.emplace_back();
      else
        cells.back() += c;
    }
    if (wanted < 0)
      wanted = std::ranges::find(cells, column) - cells.begin();
    else
      cells.at(static_cast<std::size_t>(wanted)).insert(0, "-");
    all += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return all;
}

TEST(NegativeCoefficient, IsNoResult) {
  const VirtualCampaign here(short_campaign_text("0", 2));
  const std::string steps = bytes_of(std::filesystem::path(ran(here.command()).folder()) / "steps.csv");
  std::filesystem::create_directory(here.path("mirrored"));
  here.write("mirrored/steps.csv", negated(steps, "thrust_n"));
  const Ended fit = ran({kphi(), "fit", here.path("mirrored")}, 5);
  EXPECT_THAT(fit.err, HasSubstr("mirror thrust_axis in the bench file"));
  EXPECT_FALSE(std::filesystem::exists(here.path("mirrored/coefficients.yaml")));
}

}  // namespace kphi::test::wrong_input_test
