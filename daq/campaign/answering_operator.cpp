#include "daq/campaign/answering_operator.hpp"

#include <fmt/format.h>

#include "base/error.hpp"

namespace kphi::daq {
namespace {

[[noreturn]] void refuse(const profiles::Answers& answers, const profiles::Mark& mark, const std::string& what) {
  throw ConfigurationError(answers.place(mark) + ": " + what);
}

}  // namespace

void AnsweringOperator::clear_safety_stop(const std::string& reason) {
  if (answers_.continue_after_safety_stop) return;
  throw ConfigurationError(fmt::format(
      "{}: a safety stop ended this campaign: {}; look at the stand, then add continue_after_safety_stop: true",
      answers_.path, reason));
}

void AnsweringOperator::mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string&) {
  asked(fmt::format("mounted angle for propeller {}, {:g} degrees?", propeller.id, occlusion_deg));
  if (remounting_) {
    remounting_ = false;
    answered(fmt::format("{:g}, with the answer to run again", occlusion_deg));
    return;
  }
  if (mountings_ == answers_.mountings.size()) {
    refuse(answers_, answers_.end_of_mountings,
           fmt::format("mountings has no answer {}: the campaign asks for {:g} degrees; add it", mountings_ + 1,
                       occlusion_deg));
  }
  const auto& [angle, mark] = answers_.mountings[mountings_++];
  answered(fmt::format("{:g}", angle));
  if (angle == occlusion_deg) return;
  refuse(answers_, mark,
         fmt::format("mounting {} is {:g} degrees, the campaign asks for {:g}; the motor stays locked", mountings_,
                     angle, occlusion_deg));
}

bool AnsweringOperator::run_again(const AnotherRun& question) {
  asked(fmt::format("run {:g} degrees again? {}", question.occlusion_deg, question.reason));
  if (decisions_ == answers_.run_again.size()) {
    refuse(answers_, answers_.end_of_run_again,
           fmt::format(
               "run_again has no answer {}: {:g} degrees, {}; add true or false, or set repetitions_extra_max: 0 in "
               "the campaign",
               decisions_ + 1, question.occlusion_deg, question.reason));
  }
  const bool yes = answers_.run_again[decisions_++].value;
  answered(yes ? "true" : "false");
  remounting_ = yes && question.mounted_anew;
  return yes;
}

void AnsweringOperator::finish() {
  if (mountings_ < answers_.mountings.size())
    refuse(answers_, answers_.mountings[mountings_].mark,
           fmt::format("mounting {} is left over: never asked for; remove it", mountings_ + 1));
  if (decisions_ < answers_.run_again.size())
    refuse(answers_, answers_.run_again[decisions_].mark,
           fmt::format("answer {} of run_again is left over: never asked for; remove it", decisions_ + 1));
}

}  // namespace kphi::daq
