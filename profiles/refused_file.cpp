#include "profiles/refused_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace kphi::profiles {
namespace {

std::vector<FileFinding> in_file_order(std::vector<FileFinding> findings) {
  std::stable_sort(findings.begin(), findings.end(), [](const FileFinding& a, const FileFinding& b) {
    return std::tie(a.mark.line, a.mark.column) < std::tie(b.mark.line, b.mark.column);
  });
  return findings;
}

std::string describe_all(const std::string& path, const std::vector<FileFinding>& unordered) {
  const auto findings = in_file_order(unordered);
  std::string lines;
  for (std::size_t i = 0; i < std::min(findings.size(), RefusedFile::kShownFindings); ++i) {
    lines += (i == 0 ? "" : "\n") + describe(path, findings[i]);
  }
  if (findings.size() > RefusedFile::kShownFindings) {
    lines +=
        fmt::format("\n{}: {} more problems; fix these first", path, findings.size() - RefusedFile::kShownFindings);
  }
  return lines;
}

}  // namespace

std::string describe(const std::string& path, const FileFinding& finding) {
  return fmt::format("{}:{}:{}: {}", path, finding.mark.line, finding.mark.column, finding.words());
}

RefusedFile::RefusedFile(const std::string& path, std::vector<FileFinding> findings)
    : ConfigurationError(describe_all(path, findings)), findings_(in_file_order(std::move(findings))) {}

}  // namespace kphi::profiles
