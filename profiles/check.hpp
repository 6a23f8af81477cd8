// What `kphi check` finds: the kind of each file, its errors, its summary.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace kphi::profiles {

struct CheckedFile {
  std::string path;
  std::string kind;                 ///< campaign, bench, vehicle, answers or a foreign one; empty if unknown
  std::string summary;              ///< a few lines; empty if refused
  std::vector<std::string> errors;  ///< "path:line:column: what; next move", in the order of the file
  nlohmann::ordered_json report;    ///< the same for programs: file, kind, ok, errors, plan of a campaign

  [[nodiscard]] bool ok() const { return errors.empty(); }
};

/// A kind of file that another room reads.
struct ForeignKind {
  std::string format;  ///< as in its line `format: …`
  std::string word;
  /// Returns the summary, or throws std::runtime_error with "path:line: what; next move".
  std::function<std::string(const std::string& path)> judge;
};

/// Checks every file by itself, then every campaign against every bench, and all answers against every
/// campaign, among them. Errors in the files are returned, not thrown.
[[nodiscard]] std::vector<CheckedFile> check_files(const std::vector<std::string>& paths,
                                                   const std::vector<ForeignKind>& foreign);

}  // namespace kphi::profiles
