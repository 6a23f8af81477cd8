#include "daq/campaign/operator.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>

#include "base/error.hpp"
#include "base/number.hpp"
#include "daq/run/console.hpp"

namespace kphi::daq {
namespace {

constexpr int kPollMs = 20;

bool is_angle(const std::string& text, double expected_deg) { return parse_double(text) == expected_deg; }

}  // namespace

std::optional<std::string> TerminalOperator::read_line() {
  std::string line;
  for (;;) {
    pollfd waiting{input_, POLLIN, 0};
    const int ready = ::poll(&waiting, 1, kPollMs);
    if (stop_asked_()) throw Interrupted("stopped at the prompt");
    poll();
    if (ready <= 0) continue;
    char c = 0;
    const ssize_t n = read(input_, &c, 1);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return std::nullopt;
    if (c == '\n') return line;
    if (c != '\r') line += c;
  }
}

std::string TerminalOperator::answer_to(const std::string& about, const std::string& question) {
  put(words_, (about.empty() ? "" : fmt::format("\n{}\n", about)) + question + " ");
  asked(about.empty() ? question : about + " " + question);
  const std::optional<std::string> answer = read_line();
  answered(answer.value_or("(no more input)"));
  return answer.value_or("q");
}

void Operator::clear_safety_stop(const std::string& reason) {
  throw ConfigurationError(fmt::format(
      "a safety stop ended this campaign: {}; look at the stand, then resume it at a terminal without --yes, "
      "or with an answers file that says continue_after_safety_stop: true",
      reason));
}

void AutoConfirmOperator::clear_safety_stop(const std::string& reason) {
  if (!clears_safety_stops_) Operator::clear_safety_stop(reason);
}

void TerminalOperator::clear_safety_stop(const std::string& reason) {
  std::string about = fmt::format("A safety stop ended this campaign: {}.\nLook at the stand.", reason);
  for (;; about.clear()) {
    const std::string answer = answer_to(about, "Type continue and press Enter, or q to stop:");
    if (answer == "continue") return;
    if (answer == "q") throw NotMounted("not continued after the safety stop");
    put(words_, fmt::format("You typed \"{}\".\n", answer));
  }
}

void TerminalOperator::mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string& condition) {
  const std::string what =
      occlusion_deg == 0 ? std::string("no occlusion") : fmt::format("the {:g}° occlusion", occlusion_deg);
  std::string about = fmt::format("{}{}Mount {} under propeller {} ({}). Step back.", condition,
                                  condition.empty() ? "" : "\n", what, propeller.id, propeller.name);
  for (;; about.clear()) {
    const std::string answer = answer_to(
        about, fmt::format("Type the mounted angle in degrees ({:g}) and press Enter, or q to stop:", occlusion_deg));
    if (is_angle(answer, occlusion_deg)) return;
    if (answer == "q") throw NotMounted(fmt::format("mounting of {:g}° not confirmed", occlusion_deg));
    put(words_, fmt::format("You typed \"{}\"; this run needs {:g} degrees.\n", answer, occlusion_deg));
  }
}

bool TerminalOperator::run_again(const AnotherRun& question) {
  std::string about =
      fmt::format("{:g}°: {}. All runs are kept, whatever you answer.", question.occlusion_deg, question.reason);
  for (;; about.clear()) {
    const std::string answer =
        answer_to(about, fmt::format("Run {:g}° again (extra run {} of {})? [Y/n, q to stop]", question.occlusion_deg,
                                     question.extra, question.extra_max));
    if (answer.empty() || answer == "y" || answer == "yes") return true;
    if (answer == "n" || answer == "no") return false;
    if (answer == "q") throw Interrupted("stopped at the question for another run");
    put(words_, fmt::format("You typed \"{}\"; type y, n or q.\n", answer));
  }
}

}  // namespace kphi::daq
