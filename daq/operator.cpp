#include "daq/operator.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>

namespace kphi::daq {
namespace {

bool is_angle(const std::string& text, double expected_deg) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end && value == expected_deg;
}

}  // namespace

std::optional<std::string> TerminalOperator::read_line() {
  std::string line;
  for (;;) {
    char c = 0;
    const ssize_t n = read(input_, &c, 1);
    if (stop_asked_()) throw Interrupted("stopped at the prompt");
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return std::nullopt;
    if (c == '\n') return line;
    if (c != '\r') line += c;
  }
}

std::string TerminalOperator::answer_to(const std::string& about, const std::string& question) {
  if (!about.empty()) fmt::print(words_, "\n{}\n", about);
  fmt::print(words_, "{} ", question);
  std::fflush(words_);
  asked(about.empty() ? question : about + " " + question);
  const std::optional<std::string> answer = read_line();
  answered(answer.value_or("(no more input)"));
  return answer.value_or("q");
}

void TerminalOperator::mount(const profiles::Propeller& propeller, double occlusion_deg) {
  const std::string what =
      occlusion_deg == 0 ? std::string("no occlusion") : fmt::format("the {:g}° occlusion", occlusion_deg);
  std::string about = fmt::format("Mount {} under propeller {} ({}). The motor is locked. Step back, then", what,
                                  propeller.id, propeller.name);
  for (;; about.clear()) {
    const std::string answer =
        answer_to(about, fmt::format("type the mounted angle ({:g}) and Enter, or q to stop:", occlusion_deg));
    if (is_angle(answer, occlusion_deg)) return;
    if (answer == "q") throw NotMounted(fmt::format("mounting of {:g}° was not confirmed", occlusion_deg));
    fmt::print(words_, "\"{}\" is not {:g}.\n", answer, occlusion_deg);
  }
}

bool TerminalOperator::run_again(const AnotherRun& question) {
  std::string about = fmt::format("{:g}°: {}. All of them stay on record.", question.occlusion_deg, question.reason);
  for (;; about.clear()) {
    const std::string answer =
        answer_to(about, fmt::format("run {:g}° again (extra run {} of at most {})? Enter or y: yes, n: no, q to stop:",
                                     question.occlusion_deg, question.extra, question.extra_max));
    if (answer.empty() || answer == "y" || answer == "yes") return true;
    if (answer == "n" || answer == "no") return false;
    if (answer == "q") throw Interrupted("stopped at the question for another run");
    fmt::print(words_, "\"{}\" is neither y nor n.\n", answer);
  }
}

}  // namespace kphi::daq
