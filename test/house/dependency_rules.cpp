#include "test/house/dependency_rules.hpp"

#include <algorithm>
#include <regex>
#include <sstream>

namespace kphi::house {
namespace {

bool begins(const std::string& text, const std::string& beginning) { return text.rfind(beginning, 0) == 0; }

bool is_command(const std::string& path) {
  static const std::regex kCommands("(^|.*[/_])commands\\.cpp$");
  return std::regex_match(path, kCommands);
}

const Rule* rule_of(const std::string& path) {
  const Rule* most_specific = nullptr;
  for (const Rule& rule : rules()) {
    const bool longer = most_specific == nullptr || rule.folder.size() > most_specific->folder.size();
    if (begins(path, rule.folder) && longer) most_specific = &rule;
  }
  return most_specific;
}

bool allows(const std::string& entry, const std::string& header) {
  if (entry.back() == '/') return begins(header, entry);
  if (entry.back() != '*') return header == entry;
  const std::string folder = entry.substr(0, entry.size() - 1);
  return begins(header, folder) && header.find('/', folder.size()) == std::string::npos;
}

bool names_a_room(const std::string& header) {
  const auto room = [&](const Rule& rule) { return begins(header, rule.folder.substr(0, rule.folder.find('/') + 1)); };
  return std::any_of(rules().begin(), rules().end(), room);
}

/// The library that flies: the standard library ("cmath") and Eigen; its reader of files also yaml-cpp.
bool flies(const std::string& path, const std::string& header) {
  if (begins(header, "Eigen/") || header.find_first_of("/.") == std::string::npos) return true;
  return begins(path, "compensation/file/") && begins(header, "yaml-cpp/");
}

std::string complaint(const Rule& rule, const std::string& path, const std::string& header, bool quoted) {
  const bool ours = names_a_room(header);
  if (ours) {
    const auto allowed = [&](const std::string& entry) { return allows(entry, header); };
    return std::any_of(rule.allowed.begin(), rule.allowed.end(), allowed) ? ""
                                                                          : rule.folder + " must not see " + header;
  }
  if (quoted) return header + " is not named from the root of the repository";
  return begins(path, "compensation/") && !flies(path, header) ? "compensation must not need " + header : "";
}

}  // namespace

std::vector<std::string> violations(const std::string& path, const std::string& text) {
  static const std::regex kInclude(R"(^\s*#\s*include\s*([<"])([^">]+)[">])");
  const Rule* rule = rule_of(path);
  if (rule == nullptr || is_command(path)) return {};
  std::vector<std::string> found;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::smatch include;
    if (line.find("include") == std::string::npos || !std::regex_search(line, include, kInclude)) continue;
    const std::string what = complaint(*rule, path, include[2], include[1] == "\"");
    if (!what.empty()) found.push_back(path + ":" + std::to_string(number) + ": " + what);
  }
  return found;
}

}  // namespace kphi::house
