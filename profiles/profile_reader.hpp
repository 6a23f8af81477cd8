// From a file's text to typed values: strict YAML, then the schema, then the checks of the kind at hand.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "profiles/schema.hpp"

namespace kphi::profiles {

/// Reads values by JSON pointer. Values that the schema requires are present with their type; others need a default.
class ProfileReader {
 public:
  /// Throws RefusedFile with everything that strict YAML and the schema find.
  ProfileReader(const std::string& text, const std::string& path, FileKind kind);

  [[nodiscard]] bool has(const std::string& pointer) const;
  [[nodiscard]] double number(const std::string& pointer) const;
  [[nodiscard]] std::string text(const std::string& pointer) const;

  /// T: bool, an integer, double or std::string.
  template <class T>
  [[nodiscard]] T get(const std::string& pointer) const {
    read_.insert(pointer);
    return value(pointer).get<T>();
  }
  template <class T>
  [[nodiscard]] std::optional<T> find(const std::string& pointer) const {
    return has(pointer) ? std::optional<T>(get<T>(pointer)) : std::nullopt;
  }
  template <class T>
  [[nodiscard]] T get_or(const std::string& pointer, T otherwise) const {
    return find<T>(pointer).value_or(otherwise);
  }
  [[nodiscard]] bool is_text(const std::string& pointer) const { return value(pointer).is_string(); }
  /// How many items a list has.
  [[nodiscard]] std::size_t size(const std::string& pointer) const { return value(pointer).size(); }
  /// The keys of an object.
  [[nodiscard]] std::vector<std::string> keys(const std::string& pointer) const;

  /// Where a value stands.
  [[nodiscard]] Mark mark(const std::string& pointer) const { return document_.value_mark(pointer); }

  /// Adds a finding at the value; `what` follows "name: ".
  void refuse(const std::string& pointer, const std::string& what, const std::string& next_move);
  /// Adds one unless the number at `high` is above that at `low`; `unit` follows the latter: " m" or nothing.
  void require_above(const std::string& high, const std::string& low, const char* unit, const std::string& next_move);
  /// Refuses keys that nobody has read: a limit that kphi does not know must not look as if it held.
  /// Throws RefusedFile if anything was refused.
  void finish();
  /// Throws RefusedFile if anything was refused so far.
  void throw_findings() const;

 private:
  [[nodiscard]] const nlohmann::json& value(const std::string& pointer) const;
  SourceDocument document_;
  mutable std::set<std::string> read_{"/format"};  ///< pointers; with what they hold
};

}  // namespace kphi::profiles
