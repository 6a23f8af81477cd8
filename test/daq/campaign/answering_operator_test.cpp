#include "daq/campaign/answering_operator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"

namespace kphi::daq {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const profiles::Propeller kPropeller{"5x3", "Test 5 inch", 5, 3};

AnsweringOperator answering(const std::string& lists) {
  return AnsweringOperator(profiles::parse_answers("format: kphi-answers/1\n" + lists, "a.yaml"));
}

template <class Ask>
std::string refused(Ask ask) {
  try {
    ask();
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return {};
}

AnotherRun question(bool mounted_anew = false) { return {45, "repetition 2 is off", 1, 2, mounted_anew}; }

TEST(AnsweringOperator, GivesItsAnswersInOrder) {
  auto person = answering("mountings: [0, 45]\nrun_again: [true, false]\n");
  EXPECT_EQ(person.confirm_mounting(kPropeller, 0).occlusion_deg(), 0);
  EXPECT_EQ(person.confirm_mounting(kPropeller, 45).occlusion_deg(), 45);
  EXPECT_TRUE(person.run_again(question()));
  EXPECT_FALSE(person.run_again(question()));
  EXPECT_EQ(refused([&] { person.finish(); }), "");
  EXPECT_EQ(person.name(), "a.yaml");
}

TEST(AnsweringOperator, LeavesTheMotorLockedAfterAWrongAnswer) {
  auto person = answering("mountings: [0, 45]\n");
  (void)person.confirm_mounting(kPropeller, 0);
  EXPECT_EQ(refused([&] { (void)person.confirm_mounting(kPropeller, 90); }),
            "a.yaml:2:16: mounting 2 is 45 degrees, the campaign asks for 90; the motor stays locked");
}

TEST(AnsweringOperator, RefusesWhatItHasNoAnswerTo) {
  auto person = answering("mountings: [0]\nrun_again: [true]\n");
  (void)person.confirm_mounting(kPropeller, 0);
  EXPECT_EQ(refused([&] { (void)person.confirm_mounting(kPropeller, 45); }),
            "a.yaml:2:13: mountings has no answer 2: the campaign asks for 45 degrees; add it");
  EXPECT_TRUE(person.run_again(question()));
  EXPECT_THAT(refused([&] { (void)person.run_again(question()); }),
              AllOf(HasSubstr("a.yaml:3:13: run_again has no answer 2: 45 degrees, repetition 2 is off; add")));
}

TEST(AnsweringOperator, NamesWhatIsLeftOver) {
  auto person = answering("mountings: [0, 45]\nrun_again: [true]\n");
  (void)person.confirm_mounting(kPropeller, 0);
  EXPECT_THAT(refused([&] { person.finish(); }), HasSubstr("a.yaml:2:16: mounting 2 is left over"));
  (void)person.confirm_mounting(kPropeller, 45);
  EXPECT_THAT(refused([&] { person.finish(); }), HasSubstr("a.yaml:3:13: answer 1 of run_again is left over"));
}

TEST(AnsweringOperator, ConfirmsTheMountingOfAnotherRunWithTheAnswerToRunIt) {
  auto person = answering("mountings: [45]\nrun_again: [true]\n");
  (void)person.confirm_mounting(kPropeller, 45);
  EXPECT_TRUE(person.run_again(question(true)));
  EXPECT_EQ(person.confirm_mounting(kPropeller, 45).occlusion_deg(), 45);
  EXPECT_NE(refused([&] { (void)person.confirm_mounting(kPropeller, 45); }), "") << "once";
}

TEST(AnsweringOperator, DictatesEachQuestionAndAnswer) {
  auto person = answering("mountings: [0, 45]\nrun_again: [true]\n");
  std::vector<std::string> record;
  person.log_to([&](const char* event, const std::string& words) { record.push_back(event + (": " + words)); });
  (void)person.confirm_mounting(kPropeller, 0);
  (void)person.run_again(question());
  EXPECT_NE(refused([&] { (void)person.confirm_mounting(kPropeller, 90); }), "");
  EXPECT_THAT(record,
              ElementsAre("operator_asked: mounted angle for propeller 5x3, 0 degrees?", "operator_answered: 0",
                          "operator_asked: run 45 degrees again? repetition 2 is off", "operator_answered: true",
                          "operator_asked: mounted angle for propeller 5x3, 90 degrees?", "operator_answered: 45"));
}

}  // namespace
}  // namespace kphi::daq
