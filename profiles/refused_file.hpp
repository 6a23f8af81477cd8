// What is wrong in a file that a person wrote, where, and what to do about it.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/finding.hpp"

namespace kphi::profiles {

/// A place in a text. Both count from 1; columns count characters, not bytes.
struct Mark {
  int line = 1;
  int column = 1;
};

/// A fault: a file with any is refused.
struct FileFinding : Finding {
  FileFinding(Mark where, std::string json_pointer, std::string what_is_wrong, std::string next)
      : Finding{Severity::fault, std::move(what_is_wrong), std::move(next)},
        mark(where),
        pointer(std::move(json_pointer)) {}

  Mark mark;
  std::string pointer;  ///< JSON pointer of the guilty value or key; empty: the whole file
};

/// "path:line:column: what; next move"
[[nodiscard]] std::string describe(const std::string& path, const FileFinding& finding);

/// A file with findings; what() has one line per finding, in the order of the file, at most kShownFindings.
class RefusedFile : public ConfigurationError {
 public:
  static constexpr std::size_t kShownFindings = 20;
  RefusedFile(const std::string& path, std::vector<FileFinding> findings);
  [[nodiscard]] const std::vector<FileFinding>& findings() const noexcept { return findings_; }

 private:
  std::vector<FileFinding> findings_;
};

}  // namespace kphi::profiles
