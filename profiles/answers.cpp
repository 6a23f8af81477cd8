#include "profiles/answers.hpp"

#include <fmt/format.h>

#include "profiles/profile_reader.hpp"

namespace kphi::profiles {
namespace {

/// Items `pointer`/0, /1, … as long as there are some.
template <class Value>
std::vector<Answer<Value>> read_list(const ProfileReader& file, const std::string& pointer) {
  std::vector<Answer<Value>> answers;
  for (std::size_t i = 0; file.has(fmt::format("{}/{}", pointer, i)); ++i) {
    const std::string item = fmt::format("{}/{}", pointer, i);
    answers.push_back({file.get<Value>(item), file.mark(item)});
  }
  return answers;
}

}  // namespace

std::string Answers::place(const Mark& mark) const { return fmt::format("{}:{}:{}", path, mark.line, mark.column); }

Answers parse_answers(const std::string& text, const std::string& path) {
  ProfileReader file(text, path, FileKind::answers);
  Answers answers;
  answers.mountings = read_list<double>(file, "/mountings");
  answers.run_again = read_list<bool>(file, "/run_again");
  answers.end_of_mountings = answers.mountings.empty() ? file.mark("/mountings") : answers.mountings.back().mark;
  if (file.has("/run_again"))
    answers.end_of_run_again = answers.run_again.empty() ? file.mark("/run_again") : answers.run_again.back().mark;
  answers.continue_after_safety_stop = file.get_or("/continue_after_safety_stop", answers.continue_after_safety_stop);
  answers.path = path;
  file.finish();
  return answers;
}

Answers load_answers(const std::string& path) { return parse_answers(read_text(path), path); }

void require_mountings(const Answers& answers, const Plan& plan) {
  if (plan.mounts_more)
    throw ConfigurationError(
        answers.place(answers.end_of_mountings) +
        ": repetitions is a range and each is remounted, so how many mountings there are shows while it runs; give one "
        "number, or run it with a person instead of --answers");
  const std::vector<double> expected_deg = plan.mounting_angles();
  for (std::size_t i = 0; i < expected_deg.size(); ++i) {
    if (i == answers.mountings.size()) {
      throw ConfigurationError(
          fmt::format("{}: mountings ends after {} of {}: the next one is {:g}°; "
                      "kphi run --dry-run lists them",
                      answers.place(answers.end_of_mountings), i, expected_deg.size(), expected_deg[i]));
    }
    const auto& [value, mark] = answers.mountings[i];
    if (value == expected_deg[i]) continue;
    throw ConfigurationError(
        fmt::format("{}: mounting {} is {:g}°, the campaign needs {:g}°; kphi run --dry-run "
                    "lists them",
                    answers.place(mark), i + 1, value, expected_deg[i]));
  }
  if (answers.mountings.size() == expected_deg.size()) return;
  throw ConfigurationError(fmt::format("{}: mounting {} is one too many: the campaign needs {}; remove it",
                                       answers.place(answers.mountings[expected_deg.size()].mark),
                                       expected_deg.size() + 1, expected_deg.size()));
}

}  // namespace kphi::profiles
