#include "daq/campaign/operator.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/text.hpp"
#include "daq/run/console.hpp"
#include "profiles/stand_drawing.hpp"

namespace kphi::daq {
namespace {

[[noreturn]] void refuse(const profiles::Answers& answers, const profiles::Mark& mark, const std::string& what) {
  throw ConfigurationError(answers.place(mark) + ": " + what);
}

}  // namespace

std::string understood(const std::string& typed) {
  const auto first = typed.find_first_not_of(" \t"), last = typed.find_last_not_of(" \t");
  std::string answer = first == std::string::npos ? "" : typed.substr(first, last - first + 1);
  for (char& c : answer)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return answer;
}

void TerminalOperator::ask(std::string about, const std::string& question, const std::string& retort,
                           const std::function<bool(const std::string& answer)>& accept, const std::string& drawing) {
  const auto poll_all = [this] {
    if (stop_asked_()) throw Interrupted("stopped at the prompt");
    poll();
  };
  for (;; about.clear()) {
    if (!about.empty()) put(words_, fmt::format("\n{}\n{}", about, drawing));
    const auto [line, took] = terminal_.ask(
        question, [&] { asked(about.empty() ? question : about + " " + question); }, poll_all);
    answered(line.value_or("(no more input)"), took);
    if (accept(understood(line.value_or("q")))) return;
    put(words_, fmt::format(fmt::runtime(retort), printable(line.value_or(""))));
  }
}

void Operator::clear_safety_stop(const std::string& reason) {
  throw ConfigurationError(fmt::format(
      "a safety stop ended this campaign: {}; look at the stand, then resume it at a terminal without --yes, "
      "or with an answers file that says continue_after_safety_stop: true",
      reason));
}

void Operator::clear_stand(double, const std::string&) { throw NotMounted("nobody confirmed that the stand is clear"); }

void TerminalOperator::clear_stand(double speed_rpm, const std::string& condition) {
  ask(fmt::format(
          "{}{}The propeller will turn at {:.0f} RPM. Is it tight, and is nobody and nothing near it? Step back.",
          condition, condition.empty() ? "" : "\n", speed_rpm),
      "Type go and press Enter, or q to stop:", "You typed \"{}\".\n", [](const std::string& answer) {
        if (answer == "q") throw NotMounted("not confirmed that the stand is clear");
        return answer == "go";
      });
}

void AutoConfirmOperator::clear_safety_stop(const std::string& reason) {
  if (!clears_safety_stops_) Operator::clear_safety_stop(reason);
}

void TerminalOperator::clear_safety_stop(const std::string& reason) {
  ask(fmt::format("A safety stop ended this campaign: {}.\nLook at the stand.", reason),
      "Type continue and press Enter, or q to stop:", "You typed \"{}\".\n", [](const std::string& answer) {
        if (answer == "q") throw NotMounted("not continued after the safety stop");
        return answer == "continue";
      });
}

void TerminalOperator::accept_doubts(const std::string& doubts) {
  ask(fmt::format("Is this meant?\n{}", doubts), "Type continue and press Enter, or q to stop:", "You typed \"{}\".\n",
      [](const std::string& answer) {
        if (answer == "q") throw NotMounted("the campaign was not meant so");
        return answer == "continue";
      });
}

void TerminalOperator::mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string& condition) {
  const std::string what =
      occlusion_deg == 0 ? std::string("no occlusion") : fmt::format("the {:g}° occlusion", occlusion_deg);
  ask(
      fmt::format("{}{}Mount {} under propeller {} ({}). Step back.", condition, condition.empty() ? "" : "\n", what,
                  propeller.id, propeller.name),
      fmt::format("Type the mounted angle in degrees ({:g}) and press Enter, or q to stop:", occlusion_deg),
      fmt::format("You typed \"{{}}\"; this run needs {:g} degrees.\n", occlusion_deg),
      [&](const std::string& answer) {
        if (answer == "q") throw NotMounted(fmt::format("mounting of {:g}° not confirmed", occlusion_deg));
        return parse_double(answer) == occlusion_deg;
      },
      fmt::format("\n    {}\n\n    from above: # plate, . free part of the disk\n\n",
                  fmt::join(profiles::plate_in_characters(occlusion_deg), "\n    ")));
}

bool TerminalOperator::run_again(const AnotherRun& question) {
  bool yes = false;
  ask(fmt::format("{:g}°: {}. All runs are kept, whatever you answer.", question.occlusion_deg, question.reason),
      fmt::format("Run {:g}° again (extra run {} of {})? [Y/n, q to stop]", question.occlusion_deg, question.extra,
                  question.extra_max),
      "You typed \"{}\"; type y, n or q.\n", [&](const std::string& answer) {
        if (answer == "q") throw Interrupted("stopped at the question for another run");
        yes = answer.empty() || answer == "y" || answer == "yes";
        return yes || answer == "n" || answer == "no";
      });
  return yes;
}

void AnsweringOperator::clear_safety_stop(const std::string& reason) {
  if (answers_.continue_after_safety_stop) return;
  throw ConfigurationError(fmt::format(
      "{}: a safety stop ended this campaign: {}; look at the stand, then add continue_after_safety_stop: true",
      answers_.path, reason));
}

void AnsweringOperator::mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string&) {
  asked(fmt::format("mounted angle for propeller {}, {:g}°?", propeller.id, occlusion_deg));
  if (remounting_) {
    remounting_ = false;
    answered(fmt::format("{:g}, with the answer to run again", occlusion_deg));
    return;
  }
  if (mountings_ == answers_.mountings.size()) {
    refuse(answers_, answers_.end_of_mountings,
           fmt::format("mountings has no answer {}: the campaign needs {:g}°; add it", mountings_ + 1, occlusion_deg));
  }
  const auto& [angle, mark] = answers_.mountings[mountings_++];
  answered(fmt::format("{:g}", angle));
  if (angle == occlusion_deg) return;
  refuse(answers_, mark,
         fmt::format("mounting {} is {:g}°, the campaign needs {:g}°; the motor stays locked", mountings_, angle,
                     occlusion_deg));
}

bool AnsweringOperator::run_again(const AnotherRun& question) {
  asked(fmt::format("run {:g}° again? {}", question.occlusion_deg, question.reason));
  if (decisions_ == answers_.run_again.size()) {
    refuse(answers_, answers_.end_of_run_again,
           fmt::format("run_again has no answer {}: {:g}°, {}; add true or false, or set repetitions_extra_max: 0 in "
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
           fmt::format("mounting {} is one too many: the campaign did not need it; remove it", mountings_ + 1));
  if (decisions_ < answers_.run_again.size())
    refuse(
        answers_, answers_.run_again[decisions_].mark,
        fmt::format("answer {} of run_again is one too many: the campaign did not need it; remove it", decisions_ + 1));
}

}  // namespace kphi::daq
