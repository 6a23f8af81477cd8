#include "profiles/schema.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace kphi::profiles {
namespace schema_test {

using nlohmann::json;
using testing::ElementsAre;
using testing::IsEmpty;

/// What the schema finds in the YAML text `x: VALUE`, where VALUE must fit `rule`: "pointer: what".
std::vector<std::string> found(const std::string& value, const json& rule) {
  const SourceDocument document = parse_strict_yaml("x: " + value + "\n", "x.yaml");
  std::vector<std::string> lines;
  for (const FileFinding& finding : check_schema(document, json{{"type", "object"}, {"properties", {{"x", rule}}}}))
    lines.push_back(finding.pointer + ": " + finding.what);
  return lines;
}

struct Case {
  json rule;
  std::vector<std::string> fitting, refused;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      {{{"type", "integer"}}, {"1", "-1"}, {"1.5", "1.0", "\"1\"", "true", "[]", "{}", ""}},
      {{{"type", "number"}}, {"1", "1.0"}, {"\"1\"", "true", "[]", "{}", ""}},
      {{{"type", "string"}}, {"a", "\"1\""}, {"1", "true", "[]", "{}", ""}},
      {{{"type", "boolean"}}, {"true", "false"}, {"1", "a", "[]", "{}", ""}},
      {{{"type", "array"}}, {"[]", "[1]"}, {"1", "a", "true", "{}", ""}},
      {{{"type", "object"}}, {"{}", "{a: 1}"}, {"1", "a", "true", "[]", ""}},
      {{{"type", {"string", "object"}}, {"x_expected", "text"}}, {"a", "{}"}, {"1", "true", "[]", ""}},
      {{{"enum", {1, 90, "a"}}}, {"1", "90", "90.0", "a"}, {"2", "b", "\"1\"", "true"}},
      {{{"pattern", "^a[0-9]{2}$"}}, {"a12", "3"}, {"a1", "a123", "b12", "\"\""}},
      {{{"maximum", 3}}, {"3", "-9", "a"}, {"4", "3.1"}},
      {{{"exclusiveMaximum", 3}}, {"2.9", "a"}, {"3", "4"}},
      {{{"minimum", 3}}, {"3", "9", "a"}, {"2", "2.9"}},
      {{{"exclusiveMinimum", 3}}, {"3.1", "a"}, {"3", "2"}},
      {{{"maxLength", 2}}, {"ab", "φφ", "123"}, {"abc", "φφφ"}},
      {{{"minLength", 1}}, {"a", "φ", "3"}, {"\"\""}},
      {{{"maxItems", 2}}, {"[]", "[1, 2]", "123"}, {"[1, 2, 3]"}},
      {{{"minItems", 2}}, {"[1, 2]", "[1, 2, 3]", "1"}, {"[]", "[1]"}},
      {{{"minProperties", 1}}, {"{a: 1}", "1"}, {"{}"}},
      {{{"properties", {{"a", {{"type", "number"}}}}}}, {"{}", "{a: 1}", "{b: c}", "3"}, {"{a: b}"}},
      {{{"additionalProperties", false}, {"properties", {{"a", json::object()}}}}, {"{a: 1}", "3"}, {"{b: 1}"}},
      {{{"additionalProperties", {{"type", "number"}}}}, {"{a: 1}", "3"}, {"{a: b}"}},
      {{{"required", {"a"}}}, {"{a: 1}", "3"}, {"{}", "{bbb: 1}"}},
      {{{"items", {{"type", "number"}}}}, {"[1]", "[]", "3"}, {"[a]"}},
  };
  return all;
}

TEST(Schema, ChecksEveryKeyword) {
  for (const Case& one : cases()) {
    for (const std::string& value : one.fitting) EXPECT_THAT(found(value, one.rule), IsEmpty()) << one.rule << value;
    for (const std::string& value : one.refused) EXPECT_EQ(found(value, one.rule).size(), 1u) << one.rule << value;
  }
}

TEST(Schema, NamesTheInnermostValueAndEachValueOnce) {
  const json rule{{"items", {{"properties", {{"b", {{"type", "integer"}, {"enum", {1}}, {"maximum", 2}}}}}}}};
  EXPECT_THAT(found("[{b: 1}, {b: 3.5}]", rule), ElementsAre("/x/1/b: x[1].b: expected a whole number, found 3.5"));
}

TEST(Schema, LeavesValuesAloneThatAreRefusedAlready) {
  EXPECT_THAT(found("010", {{"type", "number"}}), IsEmpty()) << "the YAML reader refused it: it looks octal";
}

/// Calls `use` with each keyword and its argument.
template <class Use>
void visit(const json& schema, const Use& use) {
  for (const auto& [keyword, argument] : schema.items()) {
    use(keyword, argument);
    if (keyword == "properties") {
      for (const auto& [key, child] : argument.items()) visit(child, use);
    } else if (argument.is_object()) {
      visit(argument, use);
    }
  }
}

TEST(Schema, OfEveryKindHasOnlyKeywordsThatAreChecked) {
  std::set<std::string> checked{"$schema", "title", "description"}, types;
  for (const Case& one : cases()) {
    visit(one.rule, [&](const std::string& keyword, const json& argument) {
      checked.insert(keyword);
      if (keyword == "type" && argument.is_string()) types.insert(argument);
    });
  }
  for (const FileKindInfo& kind : kFileKinds) {
    visit(schema_of(kind.kind), [&](const std::string& keyword, const json& argument) {
      EXPECT_TRUE(checked.contains(keyword)) << kind.word << ": " << keyword;
      EXPECT_TRUE(keyword != "items" || argument.is_object()) << "one schema for all of them";
      if (keyword != "type") return;
      for (const json& type : argument.is_array() ? argument : json::array({argument}))
        EXPECT_TRUE(types.contains(type)) << kind.word << ": " << type;
    });
  }
}

const std::vector<std::string> kKeys{"steps", "dwell_s", "first_rpm", "last_rpm"};

TEST(KeyNames, EndWithTheirUnit) {
  EXPECT_EQ(split_unit("dwell_s").unit, "s");
  EXPECT_EQ(split_unit("dwell_ms").stem, "dwell");
  EXPECT_EQ(split_unit("speed_rad_s").stem, "speed");
  EXPECT_EQ(split_unit("coil_temperature_max_degc").unit, "°C");
  EXPECT_EQ(split_unit("steps").unit, "");
  EXPECT_EQ(split_unit("_s").stem, "_s") << "a unit alone is no key with a unit";
}

TEST(KeyNames, AreFoundAgainAfterSlipsOfTheFinger) {
  EXPECT_EQ(nearest_name("stesp", kKeys), "steps");
  EXPECT_EQ(nearest_name("step", kKeys), "steps");
  EXPECT_EQ(nearest_name("frist_rpm", kKeys), "first_rpm");
  EXPECT_EQ(nearest_name("las_rmp", kKeys), "last_rpm");
}

TEST(KeyNames, AreNotGuessedFromAfar) {
  EXPECT_FALSE(nearest_name("thrust_max_n", kKeys));
  EXPECT_FALSE(nearest_name("x", kKeys));
  EXPECT_FALSE(nearest_name("", kKeys));
  EXPECT_FALSE(nearest_name("steps", {}));
}

TEST(KeyNames, WithAnotherUnitOrNoneAreRecognised) {
  EXPECT_EQ(same_but_for_unit("dwell_ms", kKeys), "dwell_s");
  EXPECT_EQ(same_but_for_unit("dwell", kKeys), "dwell_s");
  EXPECT_EQ(same_but_for_unit("last_rad_s", kKeys), "last_rpm");
  EXPECT_EQ(same_but_for_unit("steps_n", kKeys), "steps");
  EXPECT_FALSE(same_but_for_unit("dwel_ms", kKeys));
}

}  // namespace schema_test
}  // namespace kphi::profiles
