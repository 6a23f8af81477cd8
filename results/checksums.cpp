#include "results/checksums.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "base/error.hpp"
#include "results/digest.hpp"
#include "results/file_layer.hpp"

namespace kphi::results {
namespace {

constexpr std::string_view kSeal = "# sha256: ";
constexpr std::size_t kDigits = 64;

}  // namespace

bool lies_inside(const std::filesystem::path& name) {
  return !name.empty() && name.is_relative() && std::find(name.begin(), name.end(), "..") == name.end();
}

std::string sealed(std::string text) {
  const std::string digest = sha256(text);
  return std::move(text) + fmt::format("{}{}\n", kSeal, digest);
}

void require_seal(std::string_view text, const std::string& path) {
  const std::size_t at = text.rfind(kSeal);
  if (at == std::string_view::npos) return;
  const bool own_line = at == 0 || text[at - 1] == '\n';
  const bool last = own_line && text.size() == at + kSeal.size() + kDigits + 1 && text.back() == '\n';
  if (last && text.substr(at + kSeal.size(), kDigits) == sha256(text.substr(0, at))) return;
  throw DataRejected(
      path +
      ": changed after kphi wrote it: its last line, # sha256, does not match; fit again, or remove that "
      "line if the change is yours");
}

std::map<std::string, std::string> read_sums(const std::filesystem::path& folder) {
  std::map<std::string, std::string> sums;
  const std::filesystem::path list = folder / kSumsFile;
  if (!std::filesystem::exists(list)) return sums;
  std::istringstream lines(read_text(list));
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.size() < kDigits + 3 || line.compare(kDigits, 2, "  ") != 0 ||
        line.find_first_not_of("0123456789abcdef") < kDigits)
      throw DataRejected(fmt::format("{}:{}: not a line of sha256sum; fit again", list.string(), number));
    sums[line.substr(kDigits + 2)] = line.substr(0, kDigits);
  }
  return sums;
}

void record_sums(const std::filesystem::path& folder, std::span<const std::filesystem::path> written) {
  std::map<std::string, std::string> sums;
  try {
    sums = read_sums(folder);
  } catch (const DataRejected&) {  // it is written again
  }
  for (const auto& file : written) sums[file.lexically_proximate(folder).generic_string()] = sha256_of_file(file);
  std::string text;
  for (const auto& [file, digest] : sums) text += digest + "  " + file + "\n";
  write_text(folder / kSumsFile, text);
}

std::vector<std::string> unlike_sums(const std::filesystem::path& folder, std::span<const std::filesystem::path> made) {
  std::vector<std::string> problems;
  const std::map<std::string, std::string> sums = read_sums(folder);
  for (const auto& file : made)
    if (std::filesystem::exists(file) && !sums.contains(file.lexically_proximate(folder).generic_string()))
      problems.push_back(fmt::format("{}: has no line in {}, which kphi gives each file of a fit; fit again",
                                     file.string(), kSumsFile));
  for (const auto& [file, digest] : sums) {
    const std::filesystem::path path = folder / file;
    if (!lies_inside(file)) {
      problems.push_back(fmt::format("{}: {} names a file outside the folder", path.string(), kSumsFile));
    } else if (!std::filesystem::is_regular_file(std::filesystem::symlink_status(path))) {
      problems.push_back(fmt::format("{}: missing, but in {}", path.string(), kSumsFile));
    } else if (sha256_of_file(path) != digest) {
      problems.push_back(
          fmt::format("{}: changed since kphi wrote it: SHA-256 does not match {}", path.string(), kSumsFile));
    }
  }
  return problems;
}

}  // namespace kphi::results
