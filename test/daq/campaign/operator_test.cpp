#include "daq/campaign/operator.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <array>

#include "base/error.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/guard/run_stopped.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace operator_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

const profiles::Propeller kPropeller{"5x3", "Test 5 inch", 5, 3};

class Prompt : public testing::Test {
 protected:
  ~Prompt() override {
    close(pipe_[0]);
    leave();
  }
  /// Each line once a question is asked; then the end of the input.
  void answer(const std::string& typed) { typed_ = typed; }
  void type(const std::string& words) {
    EXPECT_EQ(write(pipe_[1], words.data(), words.size()), static_cast<ssize_t>(words.size()));
  }
  void leave() {
    if (pipe_[1] >= 0) close(std::exchange(pipe_[1], -1));
  }
  void type_the_next() {
    if (typed_.empty()) return leave();
    const std::size_t line = std::min(typed_.find('\n'), typed_.size() - 1) + 1;
    type(typed_.substr(0, line));
    if (typed_[line - 1] != '\n') leave();
    typed_.erase(0, line);
  }
  void mount(double occlusion_deg) {
    const MountConfirmation mounted =
        person().confirm_mounting(kPropeller, occlusion_deg, "The supply's output is off.");
    EXPECT_EQ(mounted.occlusion_deg(), occlusion_deg);
  }
  bool run_again() { return person().run_again({90, "repetition 2 is 3 % off", 1, 2}); }
  TerminalOperator person() {
    TerminalOperator person(terminal_, words_.stream, [this] { return stop_; });
    person.log_to([this](const std::string& event, const std::string& words, const std::optional<Duration>& took) {
      record_.push_back(event + ": " + words);
      EXPECT_EQ(took.has_value(), event == "operator_answered");
      if (event == "operator_asked") type_the_next();
    });
    return person;
  }
  std::string said() { return words_.text(); }

  std::array<int, 2> pipe_ = [] {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe(ends.data()), 0);
    return ends;
  }();
  test::Written words_;
  Terminal terminal_{pipe_[0], words_.stream};
  std::string typed_;
  bool stop_ = false;
  std::vector<std::string> record_;
};

TEST_F(Prompt, NamesWhatToMountAndWhatMotorAndSupplyDo) {
  answer("90\n");
  mount(90);
  EXPECT_THAT(said(), StartsWith("\nThe supply's output is off.\nMount the 90° occlusion under propeller 5x3"));
}

TEST_F(Prompt, SaysNoOcclusionForZero) {
  answer("0\n");
  mount(0);
  EXPECT_THAT(said(), HasSubstr("Mount no occlusion"));
}

TEST_F(Prompt, AsksAgainAfterAWrongAngle) {
  answer("45\nninety\n\n 90 \n");
  mount(90);
  EXPECT_THAT(said(), AllOf(HasSubstr("You typed \"45\"; this run needs 90 degrees."),
                            HasSubstr("You typed \"ninety\"; this run needs 90 degrees.")));
}

class Unmounted : public Prompt, public testing::WithParamInterface<const char*> {};

TEST_P(Unmounted, IsWhatQAndTheEndOfTheInputMean) {
  answer(GetParam());
  EXPECT_THROW(mount(90), NotMounted);
  EXPECT_EQ(record_.back(), std::string("operator_answered: ") + (*GetParam() == 'q' ? "q" : "(no more input)"));
}

INSTANTIATE_TEST_SUITE_P(Prompt, Unmounted, testing::Values("q\n", "9", ""));

TEST_F(Prompt, TakesNothingForAnAnswerThatWasTypedBeforeItsQuestion) {
  type("90\n90\n");
  answer("q\n");
  EXPECT_THROW(mount(90), NotMounted);
  EXPECT_THAT(said(), HasSubstr("What was typed before the question does not count.\n"));
}

TEST_F(Prompt, SaysOnceThatItDiscardsWhatWasTypedBefore) {
  for (int question = 0; question < 3; ++question) {
    type("90\n");
    answer("90\n");
    mount(90);
  }
  const std::string words = said();
  EXPECT_EQ(words.find("What was typed before"), words.rfind("What was typed before"));
}

TEST_F(Prompt, UnderstandsCapitalsAndBlanks) {
  answer(" Y \n");
  EXPECT_TRUE(run_again());
  answer("Continue\n");
  person().clear_safety_stop("thrust");
  answer("Q\n");
  EXPECT_THROW(mount(90), NotMounted);
}

TEST_F(Prompt, ShowsWhatWasTypedWithoutItsControlCharacters) {
  answer("\x1b[2J\n90\n");
  mount(90);
  EXPECT_THAT(said(), testing::Not(HasSubstr("\x1b")));
}

TEST_F(Prompt, StopsWhenASignalCame) {
  stop_ = true;
  answer("90\n");
  EXPECT_THROW(mount(90), Interrupted);
}

TEST_F(Prompt, RunsAgainWhenThePersonJustPressesEnter) {
  answer("\n");
  EXPECT_TRUE(run_again());
  EXPECT_THAT(said(), AllOf(HasSubstr("90°: repetition 2 is 3 % off. All runs are kept, whatever you answer."),
                            HasSubstr("Run 90° again (extra run 1 of 2)?")));
}

TEST_F(Prompt, TakesYesAndNoAndAsksAgainOtherwise) {
  answer("maybe\nn\n");
  EXPECT_FALSE(run_again());
  EXPECT_THAT(said(), HasSubstr("You typed \"maybe\"; type y, n or q."));
}

TEST_F(Prompt, StopsTheCampaignOnQInsteadOfAnotherRun) {
  answer("q\n");
  EXPECT_THROW((void)run_again(), Interrupted);
}

TEST_F(Prompt, DictatesWhatIsAskedAndWhateverIsTyped) {
  answer("45\n90\n");
  mount(90);
  EXPECT_THAT(
      record_,
      ElementsAre("operator_asked: The supply's output is off.\nMount the 90° occlusion under propeller 5x3 (Test 5 "
                  "inch). Step back. Type the mounted angle in degrees (90) and press Enter, or q to stop:",
                  "operator_answered: 45",
                  "operator_asked: Type the mounted angle in degrees (90) and press Enter, or q to stop:",
                  "operator_answered: 90"));
}

TEST_F(Prompt, EndsAsSoonAsTheGuardThatLivesThroughItTrips) {
  TerminalOperator asked = person();
  asked.log_to({});
  int looks = 0;
  asked.while_waiting([&] {
    if (++looks == 3) throw SafetyStop("motor: the rotor turns at 100 RPM while somebody may be near");
  });
  EXPECT_THROW((void)asked.confirm_mounting(kPropeller, 90), SafetyStop) << "nobody types";
}

TEST_F(Prompt, ContinuesAfterASafetyStopOnlyByAPersonsWord) {
  answer("y\n\ncontinue\n");
  person().clear_safety_stop("thrust 21 N is above 20 N");
  EXPECT_THAT(said(), StartsWith("\nA safety stop ended this campaign: thrust 21 N is above 20 N.\n"));
}

TEST_F(Prompt, LeavesACampaignStoppedWhenThePersonSaysNo) {
  answer("q\n");
  EXPECT_THROW(person().clear_safety_stop("thrust"), NotMounted);
}

TEST(AutoConfirmOperator, ClearsNoSafetyStopOfALiveBench) {
  EXPECT_THROW(AutoConfirmOperator().clear_safety_stop("thrust"), ConfigurationError);
  AutoConfirmOperator(true).clear_safety_stop("thrust");
}

double ask(Operator& person, double occlusion_deg) {
  return person.confirm_mounting(kPropeller, occlusion_deg).occlusion_deg();
}

TEST(AutoConfirmOperator, AgreesToEachMountingAndToOneMoreRun) {
  AutoConfirmOperator person;
  EXPECT_EQ(ask(person, 45), 45);
  EXPECT_TRUE(person.run_again({90, "", 1, 3}));
  EXPECT_FALSE(person.run_again({90, "", 2, 3}));
}

AnsweringOperator answering(const std::string& lists) {
  return AnsweringOperator(profiles::parse_answers("format: kphi-answers/1\n" + lists, "a.yaml"));
}

template <class Ask>
std::string refused(Ask ask) {
  return test::words_of<ConfigurationError>(ask);
}

AnotherRun question(bool mounted_anew = false) { return {45, "repetition 2 is off", 1, 2, mounted_anew}; }

TEST(AnsweringOperator, GivesItsAnswersInOrder) {
  auto person = answering("mountings: [0, 45]\nrun_again: [true, false]\n");
  EXPECT_EQ(ask(person, 0), 0);
  EXPECT_EQ(ask(person, 45), 45);
  EXPECT_TRUE(person.run_again(question()));
  EXPECT_FALSE(person.run_again(question()));
  EXPECT_EQ(refused([&] { person.finish(); }), "");
  EXPECT_EQ(person.name(), "a.yaml");
}

TEST(AnsweringOperator, LeavesTheMotorLockedAfterAWrongAnswer) {
  auto person = answering("mountings: [0, 45]\n");
  ask(person, 0);
  EXPECT_EQ(refused([&] { ask(person, 90); }),
            "a.yaml:2:16: mounting 2 is 45°, the campaign needs 90°; the motor stays locked");
}

TEST(AnsweringOperator, RefusesWhatItHasNoAnswerTo) {
  auto person = answering("mountings: [0]\nrun_again: [true]\n");
  ask(person, 0);
  EXPECT_EQ(refused([&] { ask(person, 45); }),
            "a.yaml:2:13: mountings has no answer 2: the campaign needs 45°; add it");
  EXPECT_TRUE(person.run_again(question()));
  EXPECT_THAT(refused([&] { (void)person.run_again(question()); }),
              AllOf(HasSubstr("a.yaml:3:13: run_again has no answer 2: 45°, repetition 2 is off; add")));
}

TEST(AnsweringOperator, NamesWhatIsLeftOver) {
  auto person = answering("mountings: [0, 45]\nrun_again: [true]\n");
  ask(person, 0);
  EXPECT_THAT(refused([&] { person.finish(); }), HasSubstr("a.yaml:2:16: mounting 2 is one too many"));
  ask(person, 45);
  EXPECT_THAT(refused([&] { person.finish(); }), HasSubstr("a.yaml:3:13: answer 1 of run_again is one too many"));
}

TEST(AnsweringOperator, ConfirmsTheMountingOfAnotherRunWithTheAnswerToRunIt) {
  auto person = answering("mountings: [45]\nrun_again: [true]\n");
  ask(person, 45);
  EXPECT_TRUE(person.run_again(question(true)));
  EXPECT_EQ(ask(person, 45), 45);
  EXPECT_NE(refused([&] { ask(person, 45); }), "") << "once";
}

TEST(AnsweringOperator, DictatesEachQuestionAndAnswer) {
  auto person = answering("mountings: [0, 45]\nrun_again: [true]\n");
  std::vector<std::string> record;
  person.log_to([&](const char* event, const std::string& words, const std::optional<Duration>&) {
    record.push_back(event + (": " + words));
  });
  ask(person, 0);
  (void)person.run_again(question());
  EXPECT_NE(refused([&] { ask(person, 90); }), "");
  EXPECT_THAT(record, ElementsAre("operator_asked: mounted angle for propeller 5x3, 0°?", "operator_answered: 0",
                                  "operator_asked: run 45° again? repetition 2 is off", "operator_answered: true",
                                  "operator_asked: mounted angle for propeller 5x3, 90°?", "operator_answered: 45"));
}

}  // namespace operator_test
}  // namespace kphi::daq
