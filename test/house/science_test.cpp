// docs/science.md and the sources name each other: no equation without code, no estimator without an equation.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "test/source_dir.hpp"

namespace kphi::house {
namespace science_test {

using testing::IsEmpty;
namespace fs = std::filesystem;

const fs::path kRoot(kphi::test::source_dir());

std::string read(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::set<int> numbers(const std::string& text, const std::regex& form) {
  std::set<int> found;
  for (std::sregex_iterator match(text.begin(), text.end(), form), end; match != end; ++match) {
    const int first = std::stoi((*match)[1]), last = (*match)[3].matched ? std::stoi((*match)[3]) : first;
    if ((*match)[2] == "to")
      for (int one = first; one < last; ++one) found.insert(one);
    found.insert({first, last});
  }
  return found;
}

/// An indented line that ends with "(7)" is an equation.
std::set<int> equations(const std::string& page) {
  return numbers(page, std::regex(R"(\n {4}\S[^\n]*\((\d+)\)(x)?(x)?(?=\n))"));
}

/// "science.md, eq. 7", "science.md, eq. 4 to 6", "science.md, eq. 8 and 9"; a comment may break the line.
std::set<int> named(std::string text) {
  text = std::regex_replace(text, std::regex(R"(\s+///?<?\s*)"), " ");
  return numbers(text, std::regex(R"(science\.md, eq\. (\d+)(?: (to|and) (\d+))?)"));
}

/// By folder, what each unit says in header and source.
std::vector<std::pair<fs::path, std::string>> units() {
  std::vector<std::pair<fs::path, std::string>> found;
  for (const char* folder : {"results/reduction", "fit/model", "fit/numerics", "fit/uncertainty", "fit/plan",
                             "fit/propellers", "fit/signal", "fit/flights", "profiles", "compensation"}) {
    std::map<fs::path, std::string> here;
    for (const auto& entry : fs::directory_iterator(kRoot / folder))
      if (entry.path().extension() == ".hpp" || entry.path().extension() == ".cpp")
        here[fs::path(folder) / entry.path().stem()] += read(entry.path());
    found.insert(found.end(), here.begin(), here.end());
  }
  return found;
}

TEST(Science, NumbersItsEquationsFromOneOn) {
  const std::string page = read(kRoot / "docs/science.md");
  const std::set<int> all = equations(page);
  ASSERT_GT(all.size(), 30u);
  EXPECT_EQ(*all.begin(), 1);
  EXPECT_EQ(*all.rbegin(), static_cast<int>(all.size()));
}

TEST(Science, HasNoEquationThatNoSourceNamesAndNoSourceNamesOneThatIsNotThere) {
  std::set<int> in_sources;
  for (const auto& [unit, text] : units()) {
    const std::set<int> here = named(text);
    in_sources.insert(here.begin(), here.end());
  }
  EXPECT_EQ(in_sources, equations(read(kRoot / "docs/science.md")));
}

TEST(Science, HasAnEquationForEachEstimatorOrSaysThatThereIsNone) {
  const std::string page = read(kRoot / "docs/science.md");
  const std::string none = page.substr(page.find("## Without an equation"));
  std::vector<std::string> wrong;
  for (const auto& [unit, text] : units()) {
    // A few of these estimate: when a step ends, whether the thrust is as told.
    if (unit.parent_path() == "profiles" || unit.parent_path() == "compensation") continue;
    const bool says_none = none.find("`" + unit.stem().string() + "`") != std::string::npos;
    if (named(text).empty() != says_none) wrong.push_back(unit.string());
  }
  EXPECT_THAT(wrong, IsEmpty());
}

}  // namespace science_test
}  // namespace kphi::house
