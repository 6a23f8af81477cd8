#include "fit/flights/ulog_types.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/text.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kLargestMessage = 0xFFFF, kMostTypes = 10'000, kMostFields = 1'000'000;
constexpr int kDeepest = 16;  // nested types
constexpr std::string_view kPadding = "_padding";

const RawType* raw_type(std::string_view name) {
  const auto found = std::ranges::find(kRawTypes, name, &RawType::name);
  return found == std::end(kRawTypes) || name.empty() ? nullptr : found;
}

/// "esc[2]" → esc, 2
std::pair<std::string_view, std::size_t> split_index(std::string_view part) {
  const std::size_t open = part.find('[');
  if (open == std::string_view::npos || part.back() != ']') return {part, 0};
  const auto index = parse_integer<std::size_t>(part.substr(open + 1, part.size() - open - 2));
  return index ? std::pair(part.substr(0, open), *index) : std::pair(part, std::size_t{0});
}

}  // namespace

void UlogTypes::define(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos || has(text.substr(0, colon))) return;
  std::vector<Field>& fields = types_[text.substr(0, colon)];
  text.remove_prefix(colon + 1);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(';'), text.size());
    const std::string_view one = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t blank = one.find(' ');
    if (blank == std::string_view::npos) continue;
    const auto [type, open] = std::pair(one.substr(0, blank), one.find('['));
    Field field{type.substr(0, open), one.substr(blank + 1)};
    if (open < blank) field.count = std::clamp<std::size_t>(split_index(type).second, 1, kLargestMessage);
    fields.push_back(field);
  }
  fields_ += fields.size();
  if (types_.size() > kMostTypes || fields_ > kMostFields)
    throw ConfigurationError(fmt::format("{}: more than {} types or {} fields are defined: damaged, or not a log",
                                         path_, kMostTypes, kMostFields));
}

std::pair<std::size_t, std::size_t> UlogTypes::logged_bytes(std::string_view type) {
  const std::size_t all = bytes_of(type, 0);
  const auto& fields = types_.at(type);
  const bool is_padded = !fields.empty() && fields.back().name.starts_with(kPadding);
  return {is_padded ? all - bytes_of(fields.back(), 0) : all, all};
}

std::optional<RawPlace> UlogTypes::find(std::string_view type, std::string_view path, int depth) {
  const auto found = types_.find(type);
  // Padding may not be there.
  if (found == types_.end() || depth > kDeepest || path.starts_with(kPadding)) return std::nullopt;
  const std::size_t dot = path.find('.');
  const auto [name, index] = split_index(path.substr(0, dot));
  std::size_t offset = 0;
  for (const Field& field : found->second) {
    if (field.name != name || index >= field.count) {
      offset += bytes_of(field, 0);
      continue;
    }
    offset += index * bytes_of(field.type, 0);
    if (dot == std::string_view::npos)
      return raw_type(field.type) == nullptr ? std::nullopt : std::optional(RawPlace{offset, raw_type(field.type)});
    auto inside = find(field.type, path.substr(dot + 1), depth + 1);
    if (inside) inside->offset += offset;
    return inside;
  }
  return std::nullopt;
}

std::size_t UlogTypes::bytes_of(const Field& field, int depth) {
  return within(field.count * bytes_of(field.type, depth));
}

std::size_t UlogTypes::bytes_of(std::string_view type, int depth) {
  if (const RawType* number = raw_type(type)) return number->bytes;
  if (const auto known = bytes_.find(type); known != bytes_.end()) return known->second;
  const auto found = types_.find(type);
  if (found == types_.end() || depth > kDeepest)
    throw ConfigurationError(fmt::format("{}: type {} is {}: the log's definitions are damaged", path_, in_quotes(type),
                                         depth > kDeepest ? "nested too deeply or in itself" : "not defined"));
  std::size_t sum = 0;
  for (const Field& field : found->second) sum = within(sum + bytes_of(field, depth + 1));
  return bytes_[type] = sum;
}

std::size_t UlogTypes::within(std::size_t bytes) const {
  if (bytes > kLargestMessage)
    throw ConfigurationError(
        fmt::format("{}: a type of more than 65,535 bytes: the log's definitions are damaged", path_));
  return bytes;
}

}  // namespace kphi::fit
