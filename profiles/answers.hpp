// The answers file: the operator's answers during a campaign, written before it, for a run without a terminal.
#pragma once

#include <string>
#include <vector>

#include "profiles/plan.hpp"
#include "profiles/strict_yaml.hpp"

namespace kphi::profiles {

template <class Value>
struct Answer {
  Value value;
  Mark mark;  ///< where it stands in the file
};

struct Answers {
  std::vector<Answer<double>> mountings;    ///< the angles that were mounted, degrees, in the order asked
  std::vector<Answer<bool>> run_again;      ///< when another run was asked for, in the order asked
  bool continue_after_safety_stop = false;  ///< a person has inspected the stand since the stop
  Mark end_of_mountings;                    ///< of the list, for a missing angle
  Mark end_of_run_again;                    ///< likewise; the file's beginning without such a list
  std::string path;

  /// "answers.yaml:4:5".
  [[nodiscard]] std::string place(const Mark& mark) const;
};

/// Strict, as load_campaign. Throws ConfigurationError with file:line:column.
[[nodiscard]] Answers load_answers(const std::string& path);
[[nodiscard]] Answers parse_answers(const std::string& text, const std::string& path);

/// Throws ConfigurationError, one line, unless the mountings are exactly those of the plan, in this order, and none is
/// decided while it runs.
void require_mountings(const Answers& answers, const Plan& plan);

}  // namespace kphi::profiles
