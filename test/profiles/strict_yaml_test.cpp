#include "profiles/strict_yaml.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace strict_yaml_test {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

json value_of(const std::string& text) {
  const SourceDocument document = parse_strict_yaml(text, "f.yaml");
  EXPECT_THAT(document.findings, IsEmpty()) << describe("f.yaml", document.findings.front());
  return document.value;
}

/// All that strict YAML says, whether it could read on or not.
std::vector<std::string> findings_of(const std::string& text) {
  return refusals([&] {
    const SourceDocument document = parse_strict_yaml(text, "");
    if (!document.findings.empty()) throw RefusedFile("", document.findings);
    return 0;
  });
}

std::string finding_of(const std::string& text) {
  const auto findings = findings_of(text);
  EXPECT_THAT(findings, SizeIs(1)) << text;
  return findings.empty() ? "" : findings.front();
}

TEST(StrictYaml, ReadsScalarsByTheirLook) {
  EXPECT_EQ(value_of("[5, -5, +5, 0, 2.5, -0.5, .5, 5., 1e3, 1.5e-3, true, false, word, 5x3, 127.0.0.1, ~]"),
            json({5, -5, 5, 0, 2.5, -0.5, 0.5, 5.0, 1000.0, 0.0015, true, false, "word", "5x3", "127.0.0.1", nullptr}));
}

TEST(StrictYaml, TellsWholeNumbersFromOthers) {
  EXPECT_TRUE(value_of("[40]")[0].is_number_integer());
  EXPECT_TRUE(value_of("[40.0]")[0].is_number_float());
  EXPECT_TRUE(value_of("[123456789012345678901234567890]")[0].is_number_float());
}

TEST(StrictYaml, KeepsQuotedTextText) {
  EXPECT_EQ(value_of("['5', \"true\", 'no', \"010\", '', 'null', \"1e3\"]"),
            json({"5", "true", "no", "010", "", "null", "1e3"}));
}

TEST(StrictYaml, KnowsThePlaceOfEveryValueAndKey) {
  const SourceDocument document = parse_strict_yaml("a: 1\nb:\n  c: [10, 20]\n  d: {e: x}\n", "f.yaml");
  const auto value_at = [&](const char* pointer) {
    const Mark mark = document.value_mark(pointer);
    return std::pair(mark.line, mark.column);
  };
  EXPECT_EQ(value_at("/a"), std::pair(1, 4));
  EXPECT_EQ(value_at("/b/c/1"), std::pair(3, 11));
  EXPECT_EQ(value_at("/b/d/e"), std::pair(4, 10));
  EXPECT_EQ(document.key_mark("/b/d/e").column, 7);
  EXPECT_EQ(value_at("/b/c/1/no/such"), std::pair(3, 11)) << "the nearest value around it";
}

TEST(StrictYaml, CountsColumnsInCharactersAndLinesOfCarriageReturnFiles) {
  EXPECT_THAT(finding_of("{φφφ: ü, b: no}"), HasSubstr("1:13: no is a boolean"));
  EXPECT_THAT(finding_of("a: 1\r\nb: 2\r\nc: 010\r\n"), HasSubstr("3:4: 010 looks octal"));
}

TEST(StrictYaml, TakesAByteOrderMark) {
  EXPECT_EQ(value_of("\xEF\xBB\xBF"
                     "a: 1"),
            json({{"a", 1}}));
  EXPECT_THAT(finding_of("\xEF\xBB\xBF"
                         "a: no"),
              HasSubstr("1:4: no is a boolean"));
}

TEST(StrictYaml, RefusesDuplicateKeysWithBothLines) {
  EXPECT_EQ(finding_of("a: 1\nb:\n  c: 2\n  d: 3\n  c: 4\n"),
            "5:3: b.c is already given on line 3; keep one of the two");
  EXPECT_EQ(finding_of("a: 1\n\"a\": 2"), "2:1: a is already given on line 1; keep one of the two");
}

TEST(StrictYaml, RefusesOtherSpellingsOfBooleans) {
  for (const char* word : {"yes", "no", "on", "off", "Yes", "NO", "On", "OFF", "y", "N", "True", "FALSE"}) {
    EXPECT_EQ(finding_of(std::string("a: ") + word),
              std::string("1:4: ") + word +
                  " is a boolean to some YAML readers and text to others; write true or "
                  "false, or quote it: \"" +
                  word + "\"");
  }
}

TEST(StrictYaml, RefusesNumbersThatReadersDisagreeOn) {
  const std::string next = "; write a plain decimal number, or quote it if it is text";
  for (const auto& [number, what] :
       std::vector<std::pair<std::string, std::string>>{{"010", "looks octal"},
                                                        {"-007", "looks octal"},
                                                        {"08.5", "looks octal"},
                                                        {"00", "looks octal"},
                                                        {"0x1F", "is not decimal"},
                                                        {"0o17", "is not decimal"},
                                                        {"0b11", "is not decimal"},
                                                        {"1_000", "has separators"},
                                                        {"\n  1,000.5", "has separators"},
                                                        {"12:30", "is base 60 to some readers"}}) {
    const std::string shown = number[0] == '\n' ? number.substr(3) : number;
    EXPECT_EQ(finding_of("a: " + number), (number[0] == '\n' ? "2:3: " : "1:4: ") + shown + " " + what + next);
  }
}

TEST(StrictYaml, RefusesNumbersThatAreNotFinite) {
  for (const char* number : {".inf", "-.inf", "+.Inf", ".nan", ".NaN", "nan", "inf", "-Infinity", "1e999", "-1e999"}) {
    EXPECT_EQ(finding_of(std::string("a: ") + number),
              std::string("1:4: ") + number + " is not a finite number; write a finite number");
  }
}

TEST(StrictYaml, CollectsWhatDoesNotStopTheReading) {
  EXPECT_THAT(findings_of("a: no\nb: 010\nb: 1\nc: .nan\n"),
              ElementsAre(HasSubstr("1:4: no"), HasSubstr("2:4: 010"), HasSubstr("3:1: b is already given"),
                          HasSubstr("4:4: .nan")));
}

TEST(StrictYaml, RefusesASecondDocumentAndWhateverElseFollows) {
  EXPECT_THAT(finding_of("a: 1\n---\nb: 2\n"), HasSubstr("2:1: a second document follows; keep one"));
  EXPECT_THAT(findings_of("[1, 2]\n]\n"), SizeIs(1));
  EXPECT_EQ(value_of("---\na: 1\n...\n"), json({{"a", 1}}));
}

TEST(StrictYaml, RefusesTabsInTheIndentation) {
  EXPECT_EQ(finding_of("a:\n\tb: 1\n"), "2:1: a tab in the indentation; indent with spaces");
  EXPECT_EQ(finding_of("a:\n  \tb: 1\n"), "2:3: a tab in the indentation; indent with spaces");
  EXPECT_EQ(value_of("a: 1\t# tabs before a comment are seen by nobody\n\t\n\t# nor these\n"), json({{"a", 1}}));
}

TEST(StrictYaml, RefusesControlCharacters) {
  EXPECT_EQ(finding_of("a: 1\nb: x\x01y\n"), "2:5: a control character (0x01); save the file as UTF-8 text");
  EXPECT_EQ(finding_of(std::string("a: x\0y", 6)), "1:5: a control character (0x00); save the file as UTF-8 text");
  EXPECT_EQ(finding_of("a: x\x7fy"), "1:5: a control character (0x7f); save the file as UTF-8 text");
  EXPECT_EQ(finding_of("a: 1\rb: 2"), "1:5: a control character (0x0d); save the file as UTF-8 text");
  EXPECT_EQ(finding_of("a: \"x\\0y\""), "1:4: a control character (0x00); write it without") << "written as an escape";
}

TEST(StrictYaml, RefusesBytesThatAreNotUtf8) {
  for (const char* bytes : {"\xFF", "\x80", "\xC3", "\xC0\xAF", "\xE0\x80\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80"}) {
    EXPECT_EQ(finding_of(std::string("a: 1\nb: ") + bytes),
              "2:4: a byte sequence that is not UTF-8; save the file as UTF-8 text");
  }
  EXPECT_EQ(value_of("[é, €, 🚁]"), json({"é", "€", "🚁"}));
}

TEST(StrictYaml, FollowsAliasesAndPointsToTheirAnchors) {
  const SourceDocument document = parse_strict_yaml("a: &x {k: [1, 2]}\nb: *x\nc: *x\n", "f.yaml");
  EXPECT_EQ(document.value["c"], json({{"k", {1, 2}}}));
  EXPECT_EQ(document.value_mark("/c/k/1").line, 1);
  EXPECT_EQ(document.value_mark("/c/k/1").column, 15);
}

TEST(StrictYaml, RefusesAliasesThatContainThemselves) {
  EXPECT_THAT(finding_of("a: &x [1, *x]"), HasSubstr("1:11: this alias names a key, or a value that contains it"));
}

TEST(StrictYaml, RefusesAliasesThatMultiplyBeyondReason) {
  std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int j = 0; j < 10; ++j) text += "*a" + std::to_string(i - 1) + ", ";
    text += "]\n";
  }
  EXPECT_THAT(finding_of(text), HasSubstr("more than 10000 values"));
}

TEST(StrictYaml, RefusesTagsAndMergeKeysAndKeysThatAreNoWords) {
  EXPECT_THAT(finding_of("a: !!str 5"), HasSubstr("1:4: the tag tag:yaml.org,2002:str is not supported"));
  EXPECT_THAT(finding_of("a: &x {k: 1}\nb: {<<: *x}"), HasSubstr("2:5: merge keys are not supported"));
  EXPECT_THAT(finding_of("[a, b]: 1"), HasSubstr("1:1: a key must be a word"));
  EXPECT_THAT(finding_of("a: 1\n: 2\n"), HasSubstr("a key must be a word"));
}

TEST(StrictYaml, RefusesTextsThatSayNothingAndBrokenYamlWhereItBreaks) {
  for (const char* text : {"", "\n\n", "# only a comment\n"})
    EXPECT_THAT(finding_of(text), HasSubstr("1:1: the file is empty"));
  EXPECT_THAT(finding_of("a: 1\nb: [1, 2\nc: 3\n"), HasSubstr("not readable as YAML"));
  EXPECT_THAT(finding_of("a: 1\nb: c: d\n"), HasSubstr("2:5: not readable as YAML: illegal map value; check colons"));
  EXPECT_THAT(finding_of("a: *nobody\n"), HasSubstr("1:4: not readable as YAML: the referenced anchor is not defined"));
}

TEST(StrictYaml, HoldsItsLimits) {
  EXPECT_THAT(finding_of(std::string(kMaxDepth + 1, '[') + std::string(kMaxDepth + 1, ']')),
              HasSubstr("1:17: nested deeper than 16"));
  EXPECT_EQ(findings_of(std::string(kMaxDepth, '[') + std::string(kMaxDepth, ']')).size(), 0u);
  EXPECT_THAT(findings_of(std::string(100'000, '[')), SizeIs(1)) << "and no stack overflows";
  EXPECT_THAT(finding_of("a: " + std::string(kMaxScalarBytes + 1, 'x')), HasSubstr("1:4: this text has 4097 bytes"));
  EXPECT_EQ(findings_of("a: " + std::string(kMaxScalarBytes, 'x')).size(), 0u);
  EXPECT_THAT(finding_of(std::string(kMaxKeyBytes + 1, 'x') + ": 1"), HasSubstr("1:1: this key is too long"));
  EXPECT_THAT(finding_of(std::string(kMaxTextBytes + 1, '#')), HasSubstr("1:1: larger than 1 MiB"));
  EXPECT_EQ(value_of("a: 1\n#" + std::string(kMaxTextBytes - 6, '#')), json({{"a", 1}}));
}

TEST(StrictYaml, NamesTheFileInItsMessages) {
  EXPECT_THAT([] { static_cast<void>(parse_strict_yaml("a: [", "profiles/x.yaml")); },
              testing::ThrowsMessage<ConfigurationError>(testing::StartsWith("profiles/x.yaml:")));
}

TEST(Pointers, AreEscapedAndDotted) {
  EXPECT_EQ(child_pointer("/a", "b/c~d"), "/a/b~1c~0d");
  EXPECT_EQ(dotted("/a/b~1c~0d/2"), "a.b/c~d[2]");
  EXPECT_EQ(dotted("/occlusions_deg/2"), "occlusions_deg[2]");
  EXPECT_EQ(dotted(""), "");
}

TEST(Files, ThatCannotBeReadAreNamedWithTheReason) {
  const auto read = [](const std::string& path) { return [path] { static_cast<void>(read_text(path)); }; };
  EXPECT_THAT(read("/no/such.yaml"), testing::ThrowsMessage<ConfigurationError>(
                                         "/no/such.yaml: cannot be opened: No such file or directory; check the name"));
  EXPECT_THAT(read("/"), testing::ThrowsMessage<ConfigurationError>("/: is a folder; name a file"));

  const auto path = std::filesystem::temp_directory_path() / ("kphi_large_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(path) << std::string(kMaxTextBytes + 1, '#');
  EXPECT_THAT(read(path.string()), testing::ThrowsMessage<ConfigurationError>(HasSubstr("larger than 1 MiB")));
  std::filesystem::remove(path);
}

TEST(Refusals, ListTheirFindingsInTheOrderOfTheFileAndNotWithoutEnd) {
  std::vector<FileFinding> findings;
  for (int line = 30; line > 0; --line) findings.push_back({{line, 1}, "", "wrong", "fix it"});
  const std::string message = RefusedFile("f.yaml", findings).what();
  EXPECT_THAT(message, testing::StartsWith("f.yaml:1:1: wrong; fix it\nf.yaml:2:1: wrong; fix it\n"));
  EXPECT_THAT(message, testing::EndsWith("f.yaml:20:1: wrong; fix it\nf.yaml: 10 more problems; fix these first"));
}

}  // namespace strict_yaml_test
}  // namespace kphi::profiles
