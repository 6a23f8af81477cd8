#include "profiles/schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <regex>
#include <set>
#include <string_view>
#include <utility>

namespace kphi::profiles {
namespace {

struct UnitSuffix {
  std::string_view suffix;
  std::string_view unit;
};

/// Also units that we do not use and others do.
constexpr UnitSuffix kUnits[] = {
    {"_deg_s", "degrees/s"}, {"_degc", "°C"}, {"_ms", "ms"}, {"_mv", "mV"}, {"_v", "V"},
    {"_rad_s", "rad/s"},     {"_khz", "kHz"}, {"_us", "µs"}, {"_ma", "mA"}, {"_a", "A"},
    {"_rpm_s", "RPM/s"},     {"_rps", "1/s"}, {"_ns", "ns"}, {"_mm", "mm"}, {"_m", "m"},
    {"_deg", "degrees"},     {"_degf", "°F"}, {"_sec", "s"}, {"_cm", "cm"}, {"_h", "h"},
    {"_min", "minutes"},     {"_kgf", "kgf"}, {"_kn", "kN"}, {"_pa", "Pa"}, {"_k", "K"},
    {"_in", "inches"},       {"_hpa", "hPa"}, {"_mn", "mN"}, {"_c", "°C"},  {"_g", "g"},
    {"_rpm", "RPM"},         {"_nm", "N m"},  {"_gf", "gf"}, {"_n", "N"},   {"_rad", "rad"},
    {"_hz", "Hz"},           {"_kg", "kg"},   {"_s", "s"}};

/// Edit distance with swapped neighbours (optimal string alignment).
std::size_t slips(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before, previous(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) previous[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({previous[j] + 1, row[j - 1] + 1, previous[j - 1] + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = previous;
    previous = row;
  }
  return previous[b.size()];
}

}  // namespace

KeyParts split_unit(const std::string& key) {
  UnitSuffix longest{};
  for (const UnitSuffix& unit : kUnits) {
    const bool ends = key.size() > unit.suffix.size() && key.ends_with(unit.suffix);
    if (ends && unit.suffix.size() > longest.suffix.size()) longest = unit;
  }
  return {key.substr(0, key.size() - longest.suffix.size()), std::string(longest.unit)};
}

std::optional<std::string> nearest_name(const std::string& name, const std::vector<std::string>& names) {
  const auto distance = [&](const std::string& candidate) { return slips(name, candidate); };
  const auto nearest = std::ranges::min_element(names, {}, distance);
  const std::size_t most = std::clamp<std::size_t>(name.size() / 3, 1, 3);
  return nearest != names.end() && distance(*nearest) <= most ? std::optional(*nearest) : std::nullopt;
}

std::optional<std::string> same_but_for_unit(const std::string& name, const std::vector<std::string>& names) {
  const std::string stem = split_unit(name).stem;
  const auto same = std::ranges::find_if(
      names, [&](const std::string& candidate) { return candidate != name && split_unit(candidate).stem == stem; });
  return same != names.end() ? std::optional(*same) : std::nullopt;
}

namespace {

using nlohmann::json;
using Findings = std::vector<FileFinding>;

/// A value of the document, and the part of the schema that it must fit.
struct Spot {
  const SourceDocument& document;
  const json& whole_schema;
  const json& schema;
  const json& value;
  std::string pointer;

  std::string name() const { return pointer.empty() ? "the file" : dotted(pointer); }
  /// " RPM" after a number of a key like last_rpm, or of a list like occlusions_deg.
  std::string unit() const {
    for (std::string rest = pointer; !rest.empty(); rest.resize(rest.rfind('/'))) {
      const std::string unit = split_unit(rest.substr(rest.rfind('/') + 1)).unit;
      if (!unit.empty()) return " " + unit;
    }
    return "";
  }
  FileFinding at_value(const std::string& what, const std::string& next_move) const {
    return {document.value_mark(pointer), pointer, name() + ": " + what, next_move};
  }
  std::string purpose(std::string_view otherwise) const { return schema.value("description", std::string(otherwise)); }
};

void check(const Spot& spot, Findings& findings);

struct Type {
  std::string_view name;
  std::string_view words;
  bool (json::*is)() const noexcept;
};

constexpr std::array<Type, 6> kTypes{{{"integer", "a whole number", &json::is_number_integer},
                                      {"number", "a number", &json::is_number},
                                      {"string", "text", &json::is_string},
                                      {"boolean", "true or false", &json::is_boolean},
                                      {"array", "a list", &json::is_array},
                                      {"object", "keys", &json::is_object}}};

const Type& type_named(const std::string& name) { return *std::ranges::find(kTypes, name, &Type::name); }

std::string shown(const json& value) {
  constexpr std::size_t kShownBytes = 60;
  if (value.is_null()) return "nothing";
  if (value.is_object()) return "keys";
  if (value.is_array()) return "a list";
  std::string text = value.dump();
  if (text.size() > kShownBytes) {
    std::size_t end = kShownBytes;
    while (end > 0 && is_continuation(text[end])) --end;
    text = text.substr(0, end) + "...";
  }
  return value.is_string() ? "text " + text : text;
}

std::vector<std::string> keys_of(const json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, unused] : object.items()) keys.push_back(key);
  return keys;
}

std::vector<std::string> known_keys(const json& schema) { return keys_of(schema.value("properties", json::object())); }

void check_type(const Spot& s, const json& type, Findings& findings) {
  const auto fits = [&](const json& name) { return (s.value.*type_named(name).is)(); };
  if (type.is_array()) {
    if (std::ranges::none_of(type, fits))
      findings.push_back(s.at_value(shown(s.value) + " does not fit", "write " + s.schema.value("x_expected", "")));
    return;
  }
  if (fits(type)) return;
  const std::string_view expected = type_named(type).words;
  std::string next_move = fmt::format("write {} here ({})", expected, s.purpose(s.name()));
  const bool number_as_text = s.value.is_string() && (type == "number" || type == "integer");
  if (number_as_text && !s.unit().empty()) next_move = fmt::format("write the number alone, in{}", s.unit());
  if (type == "string" && s.value.is_number()) next_move = fmt::format("quote it: \"{}\"", s.value.dump());
  if (type == "array" && s.value.is_number()) next_move = fmt::format("write a list: [{}]", s.value.dump());
  findings.push_back(s.at_value(fmt::format("expected {}, found {}", expected, shown(s.value)), next_move));
}

void check_enum(const Spot& s, const json& values, Findings& findings) {
  if (std::ranges::find(values, s.value) != values.end()) return;
  std::vector<std::string> allowed;
  for (const json& value : values) allowed.push_back(value.is_string() ? value.get<std::string>() : value.dump());
  std::string next_move =
      allowed.size() > 1 ? fmt::format("write one of {}", fmt::join(allowed, ", ")) : "write " + allowed.front();
  if (s.value.is_string() && allowed.size() > 1) {
    if (const auto near = nearest_name(s.value.get<std::string>(), allowed))
      next_move = fmt::format("did you mean {}? {}", *near, next_move);
  }
  findings.push_back(s.at_value(shown(s.value) + " is not allowed", next_move));
}

void check_pattern(const Spot& s, const json& pattern, Findings& findings) {
  if (!s.value.is_string()) return;
  if (std::regex_search(s.value.get_ref<const std::string&>(), std::regex(pattern.get<std::string>()))) return;
  findings.push_back(
      s.at_value(shown(s.value) + " does not fit", "write " + s.schema.value("x_expected", "another text")));
}

/// "write a value from 1 to 20"
std::string allowed_range(const Spot& s) {
  const auto bound = [&](const char* closed, const char* open, const char* before_open) -> std::string {
    if (s.schema.contains(closed)) return s.schema[closed].dump();
    return s.schema.contains(open) ? before_open + s.schema[open].dump() : "";
  };
  return fmt::format("write a value from {} to {}{}", bound("minimum", "exclusiveMinimum", "above "),
                     bound("maximum", "exclusiveMaximum", "below "), s.unit());
}

/// `relation` is what the value is to the bound where it is not within.
auto bound_by(auto within, const char* relation) {
  return [=](const Spot& s, const json& bound, Findings& findings) {
    if (!s.value.is_number() || within(s.value.get<double>(), bound.get<double>())) return;
    findings.push_back(
        s.at_value(fmt::format("{} is {} {}{}", s.value.dump(), relation, bound.dump(), s.unit()), allowed_range(s)));
  };
}

std::size_t characters(const json& text) {
  const auto& bytes = text.get_ref<const std::string&>();
  return bytes.size() - static_cast<std::size_t>(std::ranges::count_if(bytes, is_continuation));
}

void check_longest(const Spot& s, const json& most, Findings& findings) {
  if (!s.value.is_string() || characters(s.value) <= most.get<std::size_t>()) return;
  findings.push_back(s.at_value("this text is too long", "write at most " + most.dump() + " characters"));
}

void check_shortest(const Spot& s, const json& least, Findings& findings) {
  if (!s.value.is_string() || characters(s.value) >= least.get<std::size_t>()) return;
  findings.push_back(s.at_value(fmt::format("this text is {}", characters(s.value) == 0 ? "empty" : "too short"),
                                "write " + s.purpose("what it is")));
}

/// Of the items of a list, or the keys of an object.
auto number_by(auto within, bool (json::*concerns)() const noexcept, const char* noun, const char* limit) {
  return [=](const Spot& s, const json& bound, Findings& findings) {
    if (!(s.value.*concerns)() || within(s.value.size(), bound)) return;
    const bool no_keys = s.value.is_object() && s.value.empty();
    findings.push_back(s.at_value(no_keys ? "no keys" : fmt::format("{} {}", s.value.size(), noun),
                                  fmt::format("write at {} {}", limit, bound.dump())));
  };
}

/// Dotted names of the objects, other than the one at hand, that know `key`.
void find_homes(const json& schema, const std::string& key, const std::string& pointer,
                std::vector<std::string>& homes) {
  const auto properties = schema.find("properties");
  if (properties == schema.end()) return;
  if (properties->contains(key)) homes.push_back(pointer.empty() ? "the top of the file" : dotted(pointer));
  for (const auto& [name, child] : properties->items()) find_homes(child, key, child_pointer(pointer, name), homes);
}

std::string advice_for_unknown(const Spot& s, const std::string& key, const std::vector<std::string>& known) {
  if (const auto other_unit = same_but_for_unit(key, known)) {
    const std::string unit = split_unit(*other_unit).unit;
    return unit.empty() ? fmt::format("write {}", *other_unit)
                        : fmt::format("the unit is part of the key: write {} and the value in {}", *other_unit, unit);
  }
  if (const auto near = nearest_name(key, known)) return fmt::format("did you mean {}?", *near);
  std::vector<std::string> homes;
  find_homes(s.whole_schema, key, "", homes);
  return homes.empty() ? fmt::format("known here: {}", fmt::join(known, ", "))
                       : fmt::format("it belongs to {}", fmt::join(homes, ", "));
}

void check_properties(const Spot& s, const json& properties, Findings& findings) {
  if (!s.value.is_object()) return;
  for (const auto& [key, schema] : properties.items()) {
    const auto value = s.value.find(key);
    if (value != s.value.end())
      check({s.document, s.whole_schema, schema, *value, child_pointer(s.pointer, key)}, findings);
  }
}

void check_other_keys(const Spot& s, const json& rule, Findings& findings) {
  if (!s.value.is_object()) return;
  const std::vector<std::string> known = known_keys(s.schema);
  for (const auto& [key, value] : s.value.items()) {
    if (std::ranges::count(known, key) > 0) continue;
    const std::string pointer = child_pointer(s.pointer, key);
    if (rule.is_object()) {
      check({s.document, s.whole_schema, rule, value, pointer}, findings);
    } else if (rule == false) {
      findings.push_back({s.document.key_mark(pointer), pointer,
                          fmt::format("{} is not a key{}", key, s.pointer.empty() ? "" : " of " + s.name()),
                          advice_for_unknown(s, key, known)});
    }
  }
}

/// Silent where an unknown key was meant to be this one: that finding says it all.
void check_required(const Spot& s, const json& required, Findings& findings) {
  if (!s.value.is_object()) return;
  const std::vector<std::string> known = known_keys(s.schema);
  const auto meant_elsewhere = [&](const std::string& key) {
    return std::ranges::any_of(keys_of(s.value), [&](const std::string& present) {
      const auto by_unit = same_but_for_unit(present, known);
      return std::ranges::count(known, present) == 0 && (by_unit ? by_unit : nearest_name(present, known)) == key;
    });
  };
  for (const json& name : required) {
    const std::string key = name;
    if (s.value.contains(key) || meant_elsewhere(key)) continue;
    const std::string pointer = child_pointer(s.pointer, key);
    findings.push_back(
        {s.document.key_mark(s.pointer), pointer, dotted(pointer) + " is missing",
         fmt::format("add the key {} ({})", key,
                     s.schema.value(json::json_pointer(child_pointer("/properties", key) + "/description"), key))});
  }
}

void check_items(const Spot& s, const json& schema, Findings& findings) {
  if (!s.value.is_array()) return;
  for (std::size_t i = 0; i < s.value.size(); ++i)
    check({s.document, s.whole_schema, schema, s.value[i], fmt::format("{}/{}", s.pointer, i)}, findings);
}

using Check = std::function<void(const Spot&, const json& argument, Findings&)>;

void check(const Spot& spot, Findings& findings) {
  // What a schema may say beside annotations. The type first: of the findings at one value the first is shown.
  static const std::pair<const char*, Check> kKeywords[] = {
      {"type", check_type},
      {"enum", check_enum},
      {"pattern", check_pattern},
      {"maximum", bound_by(std::less_equal(), "above")},
      {"exclusiveMaximum", bound_by(std::less(), "not below")},
      {"minimum", bound_by(std::greater_equal(), "below")},
      {"exclusiveMinimum", bound_by(std::greater(), "not above")},
      {"maxLength", check_longest},
      {"minLength", check_shortest},
      {"maxItems", number_by(std::less_equal(), &json::is_array, "values", "most")},
      {"minItems", number_by(std::greater_equal(), &json::is_array, "values", "least")},
      {"minProperties", number_by(std::greater_equal(), &json::is_object, "keys", "least")},
      {"properties", check_properties},
      {"additionalProperties", check_other_keys},
      {"required", check_required},
      {"items", check_items}};
  for (const auto& [name, check_it] : kKeywords) {
    const auto argument = spot.schema.find(name);
    if (argument != spot.schema.end()) check_it(spot, *argument, findings);
  }
}

}  // namespace

std::vector<FileFinding> check_schema(const SourceDocument& document, const json& schema) {
  Findings all;
  check({document, schema, schema, document.value, ""}, all);
  std::set<std::string> judged;
  for (const FileFinding& finding : document.findings) judged.insert(finding.pointer);
  std::erase_if(all, [&](const FileFinding& finding) { return !judged.insert(finding.pointer).second; });
  return all;
}

const json& schema_of(FileKind kind) {
  static const auto kSchemas = [] {
    std::array<json, kFileKinds.size()> schemas;
    for (const FileKindInfo& one : kFileKinds)
      schemas[static_cast<std::size_t>(one.kind)] = json::parse(schema_text(one.kind));
    return schemas;
  }();
  return kSchemas[static_cast<std::size_t>(kind)];
}

}  // namespace kphi::profiles
