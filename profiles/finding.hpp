// What is wrong in a file a person wrote, and where: the pieces of which refusals are made.
#pragma once

#include <string>
#include <vector>

#include "profiles/configuration_error.hpp"

namespace kphi::profiles {

/// A place in a text. Both count from 1; columns count characters, not bytes.
struct Mark {
  int line = 1;
  int column = 1;
};

struct Finding {
  Mark mark;
  std::string pointer;  ///< JSON pointer of the guilty value or key; empty for the whole file
  std::string what;
  std::string next_move;
};

/// "path:line:column: what; next move"
[[nodiscard]] std::string describe(const std::string& path, const Finding& finding);

/// A file with findings; what() has one line per finding, in the order of the file, at most kShownFindings.
class RefusedFile : public ConfigurationError {
 public:
  static constexpr std::size_t kShownFindings = 20;
  RefusedFile(std::string path, std::vector<Finding> findings);
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] const std::vector<Finding>& findings() const noexcept { return findings_; }

 private:
  std::string path_;
  std::vector<Finding> findings_;
};

}  // namespace kphi::profiles
