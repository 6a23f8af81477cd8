// What `kphi check` says about files: what each is, whether it is in order, what it means.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace kphi::profiles {

struct CheckedFile {
  std::string path;
  std::string kind;                 ///< campaign, bench, vehicle or a foreign one; empty if it cannot be told
  std::string summary;              ///< a few lines; empty if refused
  std::vector<std::string> errors;  ///< "path:line:column: what; next move", in the order of the file
  nlohmann::ordered_json report;    ///< the same for programs: file, kind, ok, errors, plan of a campaign

  [[nodiscard]] bool ok() const { return errors.empty(); }
};

/// A kind of file that another folder reads.
struct ForeignKind {
  std::string format;  ///< as in its line `format: …`
  std::string word;
  /// Gives the summary or throws std::runtime_error with "path:line: what; next move".
  std::function<std::string(const std::string& path)> judge;
};

/// Checks every file by itself, then every campaign against every bench, and all answers against every
/// campaign, among them. Throws nothing about their content.
[[nodiscard]] std::vector<CheckedFile> check_files(const std::vector<std::string>& paths,
                                                   const std::vector<ForeignKind>& foreign);

}  // namespace kphi::profiles
