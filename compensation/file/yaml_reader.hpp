// Reads values out of a YAML map and says by file and line what cannot be used.
#pragma once

#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>
#include <vector>

namespace kphi::compensation {

/// Every member throws CoefficientError when the value is not what its name says.
class YamlReader {
 public:
  /// Parses `text`, whose top must be a map without a key given twice anywhere below it.
  YamlReader(const std::string& text, std::string path);

  [[nodiscard]] const YAML::Node& top() const { return top_; }

  /// The value of a required key, or nothing (an undefined node) for an optional one. `unknown` and null count as
  /// nothing.
  [[nodiscard]] YAML::Node required(const YAML::Node& map, const std::string& key) const;
  [[nodiscard]] YAML::Node optional(const YAML::Node& map, const std::string& key) const;
  [[nodiscard]] YAML::Node required_map(const YAML::Node& map, const std::string& key) const;
  /// An optional key holding a list; empty if it is not there.
  [[nodiscard]] std::vector<YAML::Node> list(const YAML::Node& map, const std::string& key) const;

  /// Finite numbers; text that no key asks for is never read.
  [[nodiscard]] double number(const YAML::Node& node, const std::string& name) const;
  [[nodiscard]] double number_at(const YAML::Node& map, const std::string& key) const;
  [[nodiscard]] std::optional<double> optional_number_at(const YAML::Node& map, const std::string& key) const;
  [[nodiscard]] std::optional<int> optional_count_at(const YAML::Node& map, const std::string& key) const;
  [[nodiscard]] bool truth_at(const YAML::Node& map, const std::string& key) const;
  [[nodiscard]] std::string text_at(const YAML::Node& map, const std::string& key) const;
  [[nodiscard]] std::string optional_text_at(const YAML::Node& map, const std::string& key) const;

  /// "path:line: what; next_move".
  [[noreturn]] void refuse(const YAML::Node& at, const std::string& what, const std::string& next_move) const;

 private:
  void refuse_repeated_keys(const YAML::Node& node) const;
  [[noreturn]] void refuse_line(int line, const std::string& what, const std::string& next_move) const;

  std::string path_;
  YAML::Node top_;
};

}  // namespace kphi::compensation
