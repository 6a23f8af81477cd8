// The only file that sees valijson: it takes some ten seconds to compile.
#include "profiles/schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "profiles/key_names.hpp"

namespace kphi::profiles {
namespace {

using nlohmann::json;

struct LoadedSchema {
  json text;
  valijson::Schema rules;
  explicit LoadedSchema(FileKind kind) : text(json::parse(schema_text(kind))) {
    valijson::adapters::NlohmannJsonAdapter adapter(text);
    valijson::SchemaParser(valijson::SchemaParser::kDraft7).populateSchema(adapter, rules);
  }
};

const LoadedSchema& loaded(FileKind kind) {
  static const std::array<LoadedSchema, 4> kSchemas{LoadedSchema(FileKind::campaign), LoadedSchema(FileKind::bench),
                                                    LoadedSchema(FileKind::vehicle), LoadedSchema(FileKind::answers)};
  return kSchemas[static_cast<std::size_t>(kind)];
}

/// One complaint of valijson, with the value and the part of the schema that it is about.
struct Complaint {
  const SourceDocument& document;
  const json& whole_schema;
  const json& schema;
  const json& value;
  std::string pointer;
  std::string description;  ///< valijson's words

  std::string name() const { return pointer.empty() ? "the file" : dotted(pointer); }
  std::string own_key() const { return pointer.substr(pointer.rfind('/') + 1); }
  /// " RPM" after a number of a key like last_rpm, or of a list like occlusions_deg.
  std::string unit() const {
    for (std::string rest = pointer; !rest.empty(); rest.resize(rest.rfind('/'))) {
      const std::string unit = split_unit(rest.substr(rest.rfind('/') + 1)).unit;
      if (!unit.empty()) return " " + unit;
    }
    return "";
  }
  Finding at_value(std::string what, std::string next_move) const {
    return {document.value_mark(pointer), pointer, name() + ": " + std::move(what), std::move(next_move)};
  }
  std::string purpose(std::string_view otherwise) const { return schema.value("description", std::string(otherwise)); }
};

constexpr std::size_t kShownBytes = 60;

std::string shown(const json& value) {
  if (value.is_null()) return "nothing";
  if (value.is_object()) return "keys";
  if (value.is_array()) return "a list";
  std::string text = value.dump();
  if (text.size() > kShownBytes) {
    std::size_t end = kShownBytes;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0u) == 0x80u) --end;  // not inside a character
    text = text.substr(0, end) + "...";
  }
  return value.is_string() ? "text " + text : text;
}

std::string joined(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, ", ")); }

std::vector<std::string> keys_of(const json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, unused] : object.items()) keys.push_back(key);
  return keys;
}

std::vector<std::string> known_keys(const json& schema) {
  const auto properties = schema.find("properties");
  return properties == schema.end() ? std::vector<std::string>{} : keys_of(*properties);
}

std::vector<Finding> wrong_type(const Complaint& c) {
  static const std::array<std::pair<std::string_view, std::string_view>, 6> kWords{{{"integer", "a whole number"},
                                                                                    {"number", "a number"},
                                                                                    {"string", "text"},
                                                                                    {"boolean", "true or false"},
                                                                                    {"array", "a list"},
                                                                                    {"object", "keys"}}};
  if (c.schema["type"].is_array()) {
    return {c.at_value(fmt::format("{} does not fit", shown(c.value)), "write " + c.schema.value("x_expected", ""))};
  }
  const std::string type = c.schema.value("type", "");
  const auto* word = std::find_if(kWords.begin(), kWords.end(), [&](const auto& w) { return w.first == type; });
  const std::string expected(word->second);
  std::string next_move = fmt::format("write {} here ({})", expected, c.purpose(c.name()));
  const bool number_as_text = c.value.is_string() && (type == "number" || type == "integer");
  if (number_as_text && !c.unit().empty()) next_move = fmt::format("write the number alone, in{}", c.unit());
  if (type == "string" && c.value.is_number()) next_move = fmt::format("quote it: \"{}\"", c.value.dump());
  if (type == "array" && c.value.is_number()) next_move = fmt::format("write a list: [{}]", c.value.dump());
  return {c.at_value(fmt::format("expected {}, found {}", expected, shown(c.value)), next_move)};
}

/// "write a value from 1 to 20"
std::string allowed_range(const Complaint& c) {
  const auto bound = [&](const char* closed, const char* open, const char* before_open) -> std::string {
    if (c.schema.contains(closed)) return c.schema[closed].dump();
    return c.schema.contains(open) ? before_open + c.schema[open].dump() : "";
  };
  return fmt::format("write a value from {} to {}{}", bound("minimum", "exclusiveMinimum", "above "),
                     bound("maximum", "exclusiveMaximum", "below "), c.unit());
}

std::vector<Finding> out_of_range(const Complaint& c, std::string_view relation, const char* keyword) {
  return {c.at_value(fmt::format("{} is {} {}{}", c.value.dump(), relation, c.schema[keyword].dump(), c.unit()),
                     allowed_range(c))};
}
std::vector<Finding> above(const Complaint& c) { return out_of_range(c, "above", "maximum"); }
std::vector<Finding> not_below(const Complaint& c) { return out_of_range(c, "not below", "exclusiveMaximum"); }
std::vector<Finding> below(const Complaint& c) { return out_of_range(c, "below", "minimum"); }
std::vector<Finding> not_above(const Complaint& c) { return out_of_range(c, "not above", "exclusiveMinimum"); }

std::vector<Finding> not_in_list(const Complaint& c) {
  std::vector<std::string> allowed;
  for (const json& value : c.schema["enum"])
    allowed.push_back(value.is_string() ? value.get<std::string>() : value.dump());
  std::string next_move = "write " + (allowed.size() > 1 ? "one of " + joined(allowed) : allowed.front());
  if (c.value.is_string()) {
    const auto near = nearest_name(c.value.get<std::string>(), allowed);
    if (near && allowed.size() > 1) next_move = fmt::format("did you mean {}? {}", *near, next_move);
  }
  return {c.at_value(fmt::format("{} is not known here", shown(c.value)), next_move)};
}

std::vector<Finding> wrong_pattern(const Complaint& c) {
  return {c.at_value(shown(c.value) + " does not fit", "write " + c.schema.value("x_expected", "another text"))};
}

std::vector<Finding> too_long(const Complaint& c) {
  return {
      c.at_value("this text is too long", fmt::format("write at most {} characters", c.schema["maxLength"].dump()))};
}
std::vector<Finding> too_short(const Complaint& c) {
  return {c.at_value("this text is empty", "say " + c.purpose("what it is"))};
}
std::vector<Finding> too_many(const Complaint& c) {
  return {c.at_value(fmt::format("{} values", c.value.size()),
                     fmt::format("write at most {}", c.schema["maxItems"].dump()))};
}
std::vector<Finding> too_few(const Complaint& c) {
  return {c.at_value(fmt::format("{} values", c.value.size()),
                     fmt::format("write at least {}", c.schema["minItems"].dump()))};
}
std::vector<Finding> too_few_keys(const Complaint& c) {
  return {c.at_value("no keys", fmt::format("write at least {}", c.schema["minProperties"].dump()))};
}

/// Dotted names of the objects, other than the one at hand, that know `key`.
void find_homes(const json& schema, const std::string& key, const std::string& pointer,
                std::vector<std::string>& homes) {
  const auto properties = schema.find("properties");
  if (properties == schema.end()) return;
  if (properties->contains(key)) homes.push_back(pointer.empty() ? "the top of the file" : dotted(pointer));
  for (const auto& [name, child] : properties->items()) find_homes(child, key, child_pointer(pointer, name), homes);
}

/// The known key that was meant by the unknown one, if that can be told.
std::optional<std::string> meant(const std::string& key, const std::vector<std::string>& known) {
  const auto by_unit = same_but_for_unit(key, known);
  return by_unit ? by_unit : nearest_name(key, known);
}

std::string advice(const Complaint& c, const std::string& key) {
  const std::vector<std::string> known = known_keys(c.schema);
  if (const auto other_unit = same_but_for_unit(key, known)) {
    const std::string unit = split_unit(*other_unit).unit;
    return unit.empty() ? fmt::format("write {}", *other_unit)
                        : fmt::format("the unit is part of the key: write {} and the value in {}", *other_unit, unit);
  }
  if (const auto near = nearest_name(key, known)) return fmt::format("did you mean {}?", *near);
  std::vector<std::string> homes;
  find_homes(c.whole_schema, key, "", homes);
  if (!homes.empty()) return "it belongs to " + joined(homes);
  return "known here: " + joined(known);
}

std::vector<Finding> unknown_keys(const Complaint& c) {
  const std::vector<std::string> known = known_keys(c.schema);
  std::vector<Finding> findings;
  for (const std::string& key : keys_of(c.value)) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    const std::string pointer = child_pointer(c.pointer, key);
    const std::string where = c.pointer.empty() ? "" : " of " + c.name();
    findings.push_back(
        {c.document.key_mark(pointer), pointer, fmt::format("{} is not a key{}", key, where), advice(c, key)});
  }
  return findings;
}

/// Silent where an unknown key was meant to be this one: that finding says it all.
std::vector<Finding> missing_key(const Complaint& c) {
  const auto open = c.description.find('\'');
  const std::string key = c.description.substr(open + 1, c.description.rfind('\'') - open - 1);
  const std::vector<std::string> known = known_keys(c.schema);
  for (const std::string& present : keys_of(c.value)) {
    const bool is_known = std::find(known.begin(), known.end(), present) != known.end();
    if (!is_known && meant(present, known) == key) return {};
  }
  const std::string pointer = child_pointer(c.pointer, key);
  const std::string purpose = c.schema["properties"][key].value("description", key);
  return {{c.document.key_mark(c.pointer), pointer, dotted(pointer) + " is missing",
           fmt::format("add the key {} ({})", key, purpose)}};
}

struct Explanation {
  std::string_view begin;  ///< of valijson's description
  std::vector<Finding> (*explain)(const Complaint&);
};

/// The longer of two beginnings comes first. "Failed to validate" is the chain of objects around a fault.
const std::array<Explanation, 15> kExplanations{{
    {"Value type not permitted", wrong_type},
    {"Expected number less than or equal", above},
    {"Expected number less than", not_below},
    {"Expected number greater than or equal", below},
    {"Expected number greater than", not_above},
    {"Failed to match against any enum", not_in_list},
    {"Failed to match regex", wrong_pattern},
    {"String should be no more", too_long},
    {"String should be no fewer", too_short},
    {"Array should contain no more", too_many},
    {"Array should contain no fewer", too_few},
    {"Object should have no fewer", too_few_keys},
    {"Object contains a property", unknown_keys},
    {"Missing required property", missing_key},
    {"Failed to validate", [](const Complaint&) { return std::vector<Finding>{}; }},
}};

std::vector<Finding> explain(const Complaint& complaint) {
  for (const Explanation& explanation : kExplanations) {
    if (complaint.description.compare(0, explanation.begin.size(), explanation.begin) == 0) {
      return explanation.explain(complaint);
    }
  }
  return {complaint.at_value(complaint.description, "see the schema of this kind of file")};
}

const json& schema_of_child(const json& schema, const std::string& token) {
  static const json kNothing = json::object();
  if (const auto p = schema.find("properties"); p != schema.end() && p->contains(token)) return (*p)[token];
  for (const char* keyword : {"additionalProperties", "items"}) {
    if (const auto child = schema.find(keyword); child != schema.end() && child->is_object()) return *child;
  }
  return kNothing;
}

/// valijson's context is {"<root>", "[profile]", "[steps]"}.
std::vector<Finding> explain(const SourceDocument& document, const json& whole_schema,
                             const valijson::ValidationResults::Error& error) {
  const json* schema = &whole_schema;
  const json* value = &document.value;
  std::string pointer;
  for (std::size_t i = 1; i < error.context.size(); ++i) {
    const std::string token = error.context[i].substr(1, error.context[i].size() - 2);
    schema = &schema_of_child(*schema, token);
    value = value->is_array() ? &value->at(static_cast<std::size_t>(std::stoul(token))) : &value->at(token);
    pointer = child_pointer(pointer, token);
  }
  return explain(Complaint{document, whole_schema, *schema, *value, pointer, error.description});
}

}  // namespace

std::vector<Finding> check_schema(const SourceDocument& document, FileKind kind) {
  const LoadedSchema& schema = loaded(kind);
  const valijson::adapters::NlohmannJsonAdapter target(document.value);
  valijson::ValidationResults results;
  valijson::Validator validator(valijson::Validator::kStrongTypes);
  if (validator.validate(schema.rules, target, &results)) return {};

  std::set<std::string> judged;
  for (const Finding& finding : document.findings) judged.insert(finding.pointer);
  std::vector<Finding> findings;
  for (const auto& error : results) {
    for (Finding& finding : explain(document, schema.text, error)) {
      if (judged.insert(finding.pointer).second) findings.push_back(std::move(finding));
    }
  }
  return findings;
}

}  // namespace kphi::profiles
