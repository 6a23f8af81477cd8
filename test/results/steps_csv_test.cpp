#include "results/steps_csv.hpp"

#include <gmock/gmock.h>
#include <rapidcheck.h>

#include <bit>
#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "test/results/recordings.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::results::steps_csv_test {

using kphi::test::TemporaryFolder;
using test::error_of;
using namespace testing;

std::vector<StepMean> arbitrary_steps() {
  return *rc::gen::container<std::vector<StepMean>>(rc::gen::exec([] {
    const auto number = [] {
      const double value = std::bit_cast<double>(*rc::gen::arbitrary<std::uint64_t>());  // of any magnitude
      return std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value;
    };
    StepMean s;
    s.propeller = *rc::gen::string<std::string>();
    std::erase_if(s.propeller, [](char c) { return c == '\0' || c == '\r' || c == '\n'; });
    s.blades = *rc::gen::arbitrary<int>();
    s.step = *rc::gen::arbitrary<int>();
    s.repetition = *rc::gen::arbitrary<int>();
    s.thrust_samples = *rc::gen::arbitrary<std::uint64_t>();
    s.speed_n = *rc::gen::arbitrary<std::uint64_t>();
    s.thrust_n = number();
    s.speed_rad_s = number();
    s.supply_voltage_v = number();
    s.window_end_s = number();
    s.quality_flags = *rc::gen::inRange<std::uint32_t>(0, 128);
    return s;
  }));
}

TEST(StepsCsv, ReadsBackAsWritten) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<StepMean> steps = arbitrary_steps();
    const std::string text = format_steps(steps);
    const std::vector<StepMean> again = parse_steps(text, "steps.csv");
    RC_ASSERT(again.size() == steps.size());
    RC_ASSERT(format_steps(again) == text);
    for (std::size_t i = 0; i < steps.size(); ++i) {
      RC_ASSERT(again[i].propeller == steps[i].propeller);
      RC_ASSERT(again[i].quality_flags == steps[i].quality_flags);
      const bool both_missing = std::isnan(steps[i].thrust_n) && std::isnan(again[i].thrust_n);
      RC_ASSERT(both_missing || again[i].thrust_n == steps[i].thrust_n);
    }
  }));
}

TEST(StepsCsv, IsPlainAndShort) {
  StepMean step;
  step.propeller = "5x3";
  step.diameter_in = 5;
  step.thrust_n = 0.1;
  step.supply_voltage_v = std::nan("");
  step.quality_flags = 5;
  const std::string text = format_steps(std::span(&step, 1));
  EXPECT_THAT(text, StartsWith("propeller,blades,diameter_in,occlusion_deg,repetition,step,commanded_speed_rad_s,"));
  EXPECT_THAT(text, HasSubstr("\n5x3,0,5,0,0,0,0,0,0,0,0.1,0,0,0,0,0,,0,0,0,0,0,speed_not_reached+saturated\n"));
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST(StepsCsv, SaysWhereItDoesNotUnderstand) {
  StepMean step;
  step.propeller = "5x3";
  const std::string good = format_steps(std::vector<StepMean>(3, step));
  const auto complaint = [](const std::string& text) {
    return error_of([&] { (void)parse_steps(text, "steps.csv"); });
  };
  EXPECT_EQ(complaint(good), "no error");
  EXPECT_THAT(complaint(""), StartsWith("steps.csv:1: "));
  EXPECT_THAT(complaint("a,b\n"), StartsWith("steps.csv:1: "));
  EXPECT_THAT(complaint(good + "5x3,1\n"), StartsWith("steps.csv:5: 2 fields where the header has 23"));
  std::string bad = good;
  bad.replace(bad.rfind("5x3,0,0"), 7, "5x3,0,x");
  EXPECT_THAT(complaint(bad), StartsWith("steps.csv:4: diameter_in: \"x\" is not a number"));
  bad = good;
  bad.insert(bad.size() - 1, "tired");
  EXPECT_THAT(complaint(bad),
              AllOf(StartsWith("steps.csv:4: quality_flags"), HasSubstr("unknown quality flag \"tired\"")));
  EXPECT_THROW((void)parse_steps("", "steps.csv"), ConfigurationError);
}

TEST(StepsCsv, IsReadByTheNamesOfItsColumns) {
  StepMean step;
  step.propeller = "5x3";
  step.blades = 3;
  step.lag_s = 0.05;
  step.discarded_s = 1;
  const std::string text = format_steps(std::span(&step, 1));
  const auto complaint = [](const std::string& changed) {
    return error_of([&] { (void)parse_steps(changed, "steps.csv"); });
  };
  const auto replaced = [&](const char* from, const char* to) {
    std::string changed = text;
    return changed.replace(changed.find(from), std::string_view(from).size(), to);
  };
  std::string swapped = replaced("propeller,blades", "blades,propeller");
  swapped.replace(swapped.find("5x3,3"), 5, "3,5x3");
  const auto again = parse_steps(swapped, "steps.csv");
  EXPECT_EQ(again.at(0).propeller, "5x3");
  EXPECT_EQ(again.at(0).blades, 3);
  EXPECT_EQ(again.at(0).lag_s, 0.05);
  EXPECT_THAT(complaint(replaced("thrust_n,", "thrust,")), HasSubstr("steps.csv:1: unknown column \"thrust\""));
  EXPECT_THAT(complaint(replaced("torque_nm,", "thrust_n,")), HasSubstr("steps.csv:1: column thrust_n occurs twice"));
  EXPECT_THAT(complaint(replaced("torque_nm,", "lag_u_s,")), HasSubstr("occurs twice"));
  std::string without_zero = format_steps(std::vector<StepMean>{{.propeller = "5x3", .thrust_n = 2, .zero_n = 0.25}});
  const auto erase = [&](const char* part) {
    without_zero.erase(without_zero.find(part), std::string_view(part).size());
  };
  erase("zero_n,");
  erase("0.25,");
  EXPECT_TRUE(std::isnan(parse_steps(without_zero, "steps.csv").at(0).zero_n)) << "unknown, not zero";
  EXPECT_EQ(parse_steps(without_zero, "steps.csv").at(0).thrust_n, 2);
  EXPECT_THAT(complaint("propeller\n"), HasSubstr("steps.csv:1: column blades is missing"));
}

TEST(StepsCsv, AreTheSameMadeOneByOne) {
  const TemporaryFolder folder;
  std::vector<StepMean> steps(20'000);  // more than one piece
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i].step = static_cast<int>(i);
  steps.back().air_density_kg_m3 = 1.2;
  write_steps(folder / "steps.csv", {steps.size(), [&](std::size_t i) { return steps[i]; }});
  EXPECT_TRUE(read_text(folder / "steps.csv") == format_steps(steps));
}

TEST(StepsCsv, FilesAreReplacedWhole) {
  const TemporaryFolder folder;
  const StepMean step;
  write_steps(folder / "steps.csv", std::span(&step, 1));
  write_steps(folder / "steps.csv", std::vector<StepMean>());
  EXPECT_THAT(read_steps(folder / "steps.csv"), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(folder / "steps.csv.part"));
  EXPECT_THROW((void)read_steps(folder / "none.csv"), RecordError);
}

TEST(QualityFlags, HaveNamesBothWays) {
  EXPECT_EQ(quality_flag_names(0), "");
  EXPECT_EQ(quality_flag_names(127),
            "speed_not_reached+speed_unsteady+saturated+lost_samples+derated+few_samples+bad_status");
  for (std::uint32_t flags = 0; flags < 128; ++flags)
    EXPECT_EQ(quality_flags_from_names(quality_flag_names(flags)), flags);
}

TEST(FlaggedSteps, AreToldByTheirFlagsTheMostFrequentFirst) {
  const auto bits = [](auto... flags) { return (static_cast<std::uint32_t>(flags) | ...); };
  FlaggedSteps steps;
  EXPECT_EQ(in_words(steps), "0 of 0 steps flagged");
  steps.add(0);
  EXPECT_EQ(in_words(steps), "0 of 1 steps flagged");
  steps.add(bits(QualityFlag::supply_sag));
  EXPECT_EQ(in_words(steps), "1 of 2 steps flagged (supply sagged 1; none spoils k)");
  for (int i = 0; i < 2; ++i) steps.add(bits(QualityFlag::unsettled, QualityFlag::supply_sag));
  steps.add(bits(QualityFlag::derated));
  EXPECT_EQ(in_words(steps), "4 of 5 steps flagged (supply sagged 3, thrust never settled 2, motor derated 1)");
  EXPECT_THAT(flag_counts(steps), ElementsAre(Pair("derated", 1), Pair("supply_sag", 3), Pair("unsettled", 2)));
  steps.add(bits(QualityFlag::frozen, QualityFlag::silent));
  EXPECT_EQ(
      in_words(steps),
      "5 of 6 steps flagged (supply sagged 3, thrust never settled 2, motor derated 1, load cell fell silent 1, 1 "
      "more)");
}

}  // namespace kphi::results::steps_csv_test
