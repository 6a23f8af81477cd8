#include "daq/run/progress.hpp"

#include <gtest/gtest.h>

#include <array>
#include <memory>

namespace kphi::daq {
namespace progress_test {

Position in_a_step() {
  Position position;
  position.name("5x3");
  position.occlusion_deg = 90;
  position.repetition = 2;
  position.repetitions = 3;
  position.step = 16;
  position.steps = 40;
  position.commanded = from_rpm(7895);
  position.remaining_s = 372.4;
  return position;
}

Observation seen() {
  Observation observation;
  observation.speed_rad_s = from_rpm(7893.6).value();
  observation.thrust_n = 1.1621;
  return observation;
}

std::string printed(void (*talk)(Progress&), bool terminal) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  {
    PrintedProgress progress(stream, terminal);
    talk(progress);
  }
  std::fclose(stream);
  std::string result(text, size);
  std::free(text);
  return result;
}

TEST(Progress, CallsAReferenceRunSo) {
  Position position = in_a_step();
  position.repetition = -2;
  EXPECT_EQ(describe(position, seen()).substr(0, 30), "5x3  φ  90°  ref 2  step 17/");
}

TEST(Progress, NamesPropellerOcclusionRepetitionStepSpeedsThrustAndTimeLeft) {
  EXPECT_EQ(describe(in_a_step(), seen()),
            "5x3  φ  90°  rep 2/3  step 17/40  speed  7894 of  7895 RPM  thrust  1.162 N  left 06:12");
}

TEST(Progress, ShowsNoNumberForWhatNoLongerComes) {
  Observation observation = seen();
  observation.load_cell_age = std::chrono::milliseconds(840);
  EXPECT_EQ(
      describe(in_a_step(), observation),
      "5x3  φ  90°  rep 2/3  step 17/40  speed  7894 of  7895 RPM  thrust      ? N  left 06:12  no thrust for 0.8 s");
  observation.motor_age = std::chrono::seconds(2);
  EXPECT_EQ(
      describe(in_a_step(), observation),
      "5x3  φ  90°  rep 2/3  step 17/40  speed     ? of  7895 RPM  thrust      ? N  left 06:12  no speed for 2.0 s"
      "  no thrust for 0.8 s");
}

TEST(Progress, NamesThePhaseOutsideSteps) {
  Position position = in_a_step();
  position.step = -1;
  position.phase = "zero";
  EXPECT_NE(describe(position, seen()).find("zero"), std::string::npos);
}

TEST(Progress, ShowsHoursWhenThereAreAny) {
  Position position = in_a_step();
  position.remaining_s = 3725;
  EXPECT_NE(describe(position, seen()).find("left 1:02:05"), std::string::npos);
}

TEST(ProgressElsewhere, IsOneLinePerStepWithoutControlCharacters) {
  const std::string text = printed(
      [](Progress& progress) {
        for (int i = 0; i < 3; ++i) progress.tick(in_a_step(), seen());
        progress.step_done(in_a_step(), seen());
      },
      false);
  EXPECT_EQ(text, describe(in_a_step(), seen()) + "\n");
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST(ProgressOnATerminal, IsRewrittenInPlaceAndClearedBeforeAnythingElse) {
  const std::string text = printed(
      [](Progress& progress) {
        progress.tick(in_a_step(), seen());
        progress.say("run 1 of 15 done");
      },
      true);
  EXPECT_TRUE(text.starts_with("\r5x3"));
  EXPECT_NE(text.find("\r\x1b[Krun 1 of 15 done\n"), std::string::npos);
}

}  // namespace progress_test
}  // namespace kphi::daq
