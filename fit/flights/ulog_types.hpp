// The types of messages that a ULog defines, and where in a message a number is.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fit/flights/raw_number.hpp"

namespace kphi::fit {

/// A number in a message.
struct RawPlace {
  std::size_t offset = 0;
  const RawType* type = nullptr;
  [[nodiscard]] double in(std::string_view message) const { return type->read(message.substr(offset)); }
};

/// Views into the log, which must stay. Throws ConfigurationError where the definitions cannot be meant, or are too
/// many.
class UlogTypes {
 public:
  explicit UlogTypes(const std::string& path) : path_(path) {}

  /// "name:type field;type[n] field;", the payload of a message F. The first definition of a name counts.
  void define(std::string_view text);
  [[nodiscard]] bool has(std::string_view type) const { return types_.contains(type); }
  /// Bytes of a message without the padding at its end, which is not logged, and with it.
  [[nodiscard]] std::pair<std::size_t, std::size_t> logged_bytes(std::string_view type);
  /// "esc[2].esc_rpm" in a message of the type; nullopt: it has no such number.
  [[nodiscard]] std::optional<RawPlace> find(std::string_view type, std::string_view path, int depth = 0);

 private:
  struct Field {
    std::string_view type, name;
    std::size_t count = 1;
  };
  std::size_t bytes_of(const Field& field, int depth);
  std::size_t bytes_of(std::string_view type, int depth);
  [[nodiscard]] std::size_t within(std::size_t bytes) const;

  const std::string& path_;
  std::map<std::string_view, std::vector<Field>> types_;
  std::map<std::string_view, std::size_t> bytes_;
  std::size_t fields_ = 0;
};

}  // namespace kphi::fit
