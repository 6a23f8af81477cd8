#include "test/house/rooms.hpp"

#include <algorithm>
#include <regex>
#include <sstream>

namespace kphi::house {
namespace {

bool is_in(std::string_view path, std::string_view folder) {
  return path == folder || (path.starts_with(folder) && path.substr(folder.size()).starts_with('/'));
}

bool sees(const Room& room, std::string_view header) {
  const Room* seen = room_of(header);
  if (seen == &room) return true;
  return seen != nullptr && seen < &room &&
         std::any_of(room.sees.begin(), room.sees.end(), [&](auto entry) { return is_in(header, entry); });
}

/// Our headers are named from the repository's root.
bool is_ours(std::string_view header) {
  const std::string_view top = header.substr(0, header.find('/'));
  return top.size() < header.size() &&
         std::any_of(rooms().begin(), rooms().end(), [&](const Room& room) { return is_in(room.folder, top); });
}

/// The library that flies: the standard library ("cmath") and Eigen; its reader of files also yaml-cpp, its
/// module for Python pybind11.
bool flies(std::string_view path, std::string_view header) {
  if (header.starts_with("Eigen/") || header.find_first_of("/.") == std::string_view::npos) return true;
  if (path.starts_with("compensation/python/") && header.starts_with("pybind11/")) return true;
  return path.starts_with("compensation/file/") && header.starts_with("yaml-cpp/");
}

std::string complaint(const Room& room, const std::string& path, const std::string& header, bool quoted) {
  if (is_ours(header)) return sees(room, header) ? "" : std::string(room.folder) + " must not see " + header;
  if (room.folder == "compensation/integrations")
    return "";  // lives in other houses, whose headers it names as they do
  if (quoted) return header + " is not named from the root of the repository";
  return path.starts_with("compensation/") && !flies(path, header) ? "compensation must not need " + header : "";
}

}  // namespace

const Room* room_of(std::string_view path) {
  const std::string_view folder = path.substr(0, std::min(path.rfind('/'), path.size()));
  const auto found = std::find_if(rooms().begin(), rooms().end(), [&](const Room& r) { return r.folder == folder; });
  return found == rooms().end() ? nullptr : &*found;
}

std::vector<std::string> violations(const std::string& path, const std::string& text) {
  static const std::regex kInclude(R"(^\s*#\s*include\s*([<"])([^">]+)[">])");
  const Room* room = room_of(path);
  if (room == nullptr) return {path + ": is in none of the modules"};
  std::vector<std::string> found;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::smatch include;
    if (line.find("include") == std::string::npos || !std::regex_search(line, include, kInclude)) continue;
    const std::string what = complaint(*room, path, include[2], include[1] == "\"");
    if (!what.empty()) found.push_back(path + ":" + std::to_string(number) + ": " + what);
  }
  return found;
}

}  // namespace kphi::house
