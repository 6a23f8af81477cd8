#include "test/house/rooms.hpp"

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
namespace rooms_test {

using testing::ElementsAre;
using testing::IsEmpty;
namespace fs = std::filesystem;

std::string include(const std::string& header) { return "#include \"" + header + "\"\n"; }

std::string read(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// Headers and sources of the product, from the repository's root.
std::vector<std::string> product_files() {
  const fs::path root(kphi::test::source_dir());
  std::set<std::string> tops;
  for (const Room& room : rooms()) tops.emplace(room.folder.substr(0, room.folder.find('/')));
  std::vector<std::string> files;
  for (const std::string& top : tops) {
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const auto extension = entry.path().extension();
      if (extension == ".hpp" || extension == ".cpp" || extension == ".h")
        files.push_back(fs::relative(entry.path(), root).generic_string());
    }
  }
  return files;
}

std::string unit_of(const std::string& path) { return path.substr(0, path.rfind('.')); }

TEST(Rooms, SeeOnlyWhatTheyMay) {
  const fs::path root(kphi::test::source_dir());
  std::vector<std::string> found;
  const auto files = product_files();
  for (const std::string& file : files) {
    const auto here = violations(file, read(root / file));
    found.insert(found.end(), here.begin(), here.end());
  }
  EXPECT_THAT(found, IsEmpty());
  EXPECT_GT(files.size(), 300u);
}

TEST(Rooms, SeeOnlyRoomsThatStandEarlier) {
  for (const Room& room : rooms()) {
    for (const std::string_view entry : room.sees) {
      const auto earlier = [&](const Room& other) {
        const bool is_named =
            other.folder == entry || other.folder.starts_with(std::string(entry) + "/") || room_of(entry) == &other;
        return is_named && &other < &room;
      };
      EXPECT_TRUE(std::any_of(rooms().begin(), rooms().end(), earlier)) << room.folder << " sees " << entry;
    }
  }
}

TEST(Rooms, HoldNoMoreThanOneCanOverlook) {
  std::map<std::string, std::set<std::string>> units;
  for (const std::string& file : product_files()) units[file.substr(0, file.rfind('/'))].insert(unit_of(file));
  for (const auto& [folder, inside] : units) EXPECT_LE(inside.size(), kUnitsSideBySide) << folder;
}

TEST(Rooms, HaveNoCircleOfUnits) {
  static const std::regex kInclude("#\\s*include\\s*\"([^\"]+)\"");
  const fs::path root(kphi::test::source_dir());
  std::map<std::string, std::set<std::string>> seen;
  for (const std::string& file : product_files()) {
    const std::string text = read(root / file);
    auto& units = seen[unit_of(file)];
    for (std::sregex_iterator i(text.begin(), text.end(), kInclude), end; i != end; ++i) {
      if (unit_of((*i)[1]) != unit_of(file)) units.insert(unit_of((*i)[1]));
    }
  }
  // Whatever sees nothing that is left, goes; what then is left goes round.
  for (bool moved = true; moved;) {
    moved = false;
    for (auto unit = seen.begin(); unit != seen.end();) {
      const bool is_free = std::none_of(unit->second.begin(), unit->second.end(),
                                        [&](const std::string& other) { return seen.count(other) != 0; });
      moved = moved || is_free;
      unit = is_free ? seen.erase(unit) : std::next(unit);
    }
  }
  std::vector<std::string> round;
  for (const auto& [unit, unused] : seen) round.push_back(unit);
  EXPECT_THAT(round, IsEmpty());
}

TEST(Violations, NameTheLine) {
  EXPECT_THAT(violations("results/x.cpp", "// one\n" + include("results/x.hpp") + include("daq/run/run.hpp")),
              ElementsAre("results/x.cpp:3: results must not see daq/run/run.hpp"));
}

struct Planted {
  const char* path;
  const char* header;
};

TEST(Violations, AreFoundWhereverTheyAre) {
  for (const Planted& planted : std::vector<Planted>{
           {"compensation/compensator.cpp", "profiles/vehicle.hpp"},
           {"compensation/compensator.hpp", "compensation/file/coefficient_file.hpp"},
           {"compensation/flight/flight.cpp", "profiles/vehicle.hpp"},
           {"compensation/file/coefficient_file.cpp", "fit/coefficients/coefficients.hpp"},
           {"base/clock.cpp", "daq/run/run.hpp"},
           {"base/clock.cpp", "compensation/units.hpp"},
           {"drivers/iq/session/session.cpp", "profiles/bench_config.hpp"},
           {"drivers/iq/session/session.cpp", "drivers/netbox/wire/codes.hpp"},
           {"drivers/iq/wire/packet.cpp", "drivers/iq/session/session.hpp"},
           {"drivers/netbox/wire/rdt.cpp", "results/records.hpp"},
           {"drivers/netbox/wire/rdt.cpp", "drivers/sim/transport/bytes.hpp"},
           {"drivers/sim/netbox/device.cpp", "drivers/netbox/wire/rdt.hpp"},
           {"drivers/sim/iq/device.cpp", "drivers/iq/wire/packet.hpp"},
           {"drivers/sim/bench.cpp", "profiles/bench_config.hpp"},
           {"drivers/future/device.cpp", ""},
           {"results/run_writer.cpp", "profiles/strict_yaml.hpp"},
           {"results/run_writer.cpp", "results/reduction/reduction.hpp"},
           {"results/reduction/reduction.cpp", "profiles/campaign.hpp"},
           {"results/reduction/reduction.cpp", "drivers/iq/wire/entries.hpp"},
           {"daq/run/run.cpp", "fit/coefficients/coefficients.hpp"},
           {"daq/guard/guard.cpp", "daq/run/run.hpp"},
           {"daq/run/run.cpp", "compensation/compensator.hpp"},
           {"daq/run/run.cpp", "commands/run.hpp"},
           {"fit/model/curve_fit.cpp", "daq/run/run.hpp"},
           {"fit/model/curve_fit.cpp", "fit/report/report.hpp"},
           {"fit/model/curve_fit.cpp", "profiles/campaign.hpp"},
           {"profiles/plan.cpp", "drivers/serial/port.hpp"},
           {"profiles/plan.cpp", "plan.hpp"},
           {"profiles/plan.cpp", "../profiles/plan.hpp"},
       }) {
    EXPECT_EQ(violations(planted.path, include(planted.header)).size(), 1u) << planted.path << " " << planted.header;
  }
}

TEST(Violations, AreNotFoundInWhatIsAllowed) {
  for (const Planted& planted : std::vector<Planted>{
           {"compensation/compensator.cpp", "compensation/units.hpp"},
           {"compensation/file/coefficient_file.cpp", "compensation/thrust_curve.hpp"},
           {"drivers/iq/link/motor.cpp", "drivers/serial/port.hpp"},
           {"drivers/netbox/stream/session.cpp", "base/error.hpp"},
           {"drivers/sim/iq/device.cpp", "drivers/iq/wire/codes.hpp"},
           {"results/reduction/reduction.cpp", "results/run_reader.hpp"},
           {"daq/run/run.cpp", "drivers/netbox/receive/bias.hpp"},
           {"daq/run/run.cpp", "profiles/plan.hpp"},
           {"fit/model/curve_fit.cpp", "results/step_mean.hpp"},
           {"commands/fit.cpp", "daq/run/run.hpp"},
       }) {
    EXPECT_THAT(violations(planted.path, include(planted.header)), IsEmpty());
  }
}

TEST(Violations, AreFoundInAngleBracketsAndOddSpacing) {
  EXPECT_EQ(violations("fit/model/x.cpp", "  #  include  <daq/run/run.hpp>\n").size(), 1u);
  EXPECT_EQ(violations("fit/model/x.cpp", "#include\"daq/run/run.hpp\"\n").size(), 1u);
  EXPECT_EQ(violations("fit/model/x.cpp", "#include \"daq/run/run.hpp\"\r\n").size(), 1u);
}

TEST(Violations, KeepTheFlyingLibraryToTheStandardLibraryAndEigen) {
  const auto system = [](const std::string& path, const std::string& header) {
    return violations(path, "#include <" + header + ">\n").size();
  };
  EXPECT_EQ(system("compensation/compensator.cpp", "cmath"), 0u);
  EXPECT_EQ(system("compensation/compensator.cpp", "Eigen/Dense"), 0u);
  EXPECT_EQ(system("compensation/compensator.cpp", "yaml-cpp/yaml.h"), 1u);
  EXPECT_EQ(system("compensation/file/coefficient_file.cpp", "yaml-cpp/yaml.h"), 0u);
  EXPECT_EQ(system("compensation/flight/study.cpp", "fmt/format.h"), 1u);
  EXPECT_EQ(system("daq/run/run.cpp", "fmt/format.h"), 0u);
}

/// Each row of the table names the tests that break it on purpose: all words of a link stand in its file, and that file
/// is built.
int rows_with_tests(const std::string& page) {
  const std::filesystem::path root = kphi::test::source_dir();
  static const std::regex kRow(R"(\|[^|\n]+\|[^|\n]+\|[^|\n]+\|([^|\n]*\.\./test/[^|\n]*)\|)"),
      kLink(R"(\[([^\]]+)\]\(\.\./([^)]+)\))");
  int rows = 0;
  for (std::sregex_iterator row(page.begin(), page.end(), kRow), end; row != end; ++row, ++rows) {
    const std::string tests = (*row)[1];
    for (std::sregex_iterator link(tests.begin(), tests.end(), kLink); link != end; ++link) {
      const std::filesystem::path file = root / (*link)[2].str();
      EXPECT_TRUE(std::filesystem::exists(file)) << file;
      const std::string source = read(file);
      std::istringstream words((*link)[1]);
      for (std::string word; words >> word;) EXPECT_THAT(source, testing::HasSubstr(word)) << file;
      std::string lists;
      for (auto folder = file.parent_path(); folder != root; folder = folder.parent_path())
        if (std::filesystem::exists(folder / "CMakeLists.txt")) lists += read(folder / "CMakeLists.txt");
      EXPECT_THAT(lists, testing::HasSubstr(file.filename())) << "nobody builds it";
    }
  }
  return rows;
}

TEST(Hazards, HaveATestEach) {
  const std::string page = read(fs::path(kphi::test::source_dir()) / "daq/README.md");
  EXPECT_THAT(page, testing::HasSubstr("A program is no emergency stop"));
  EXPECT_GE(rows_with_tests(page), 25);
}

TEST(Threats, HaveATestEach) {
  EXPECT_GE(rows_with_tests(read(fs::path(kphi::test::source_dir()) / "docs/SECURITY.md")), 9);
}

/// The string literals of a source, adjacent ones joined; comments hold none.
std::vector<std::string> literals_of(std::string source) {
  source = std::regex_replace(source, std::regex("//[^\n\"]*\n"), "\n");
  source = std::regex_replace(source, std::regex("\"\\s*\n\\s*\""), "");
  static const std::regex kLiteral(R"re("((?:[^"\\\n]|\\.)*)")re");
  std::vector<std::string> literals;
  for (std::sregex_iterator i(source.begin(), source.end(), kLiteral), end; i != end; ++i) literals.push_back((*i)[1]);
  return literals;
}

/// What the page quotes as printed, cut where it differs from bench to bench.
std::vector<std::string> quoted_on_the_page() {
  const std::string page = read(fs::path(kphi::test::source_dir()) / "docs/troubleshooting.md");
  static const std::regex kQuote(R"(\*\*`([^`]+)`\*\*)"), kPart(" *%? *… *%? *");
  std::vector<std::string> parts;
  for (std::sregex_iterator i(page.begin(), page.end(), kQuote), end; i != end; ++i) {
    const std::string quote = (*i)[1];
    for (std::sregex_token_iterator part(quote.begin(), quote.end(), kPart, -1), last; part != last; ++part)
      if (part->length() > 0) parts.push_back(*part);
  }
  return parts;
}

TEST(Troubleshooting, QuotesWhatTheProgramPrints) {
  const fs::path root(kphi::test::source_dir());
  std::string printed;
  for (const std::string& file : product_files())
    for (const std::string& literal : literals_of(read(root / file))) printed += literal + "\n";
  const std::vector<std::string> quoted = quoted_on_the_page();
  EXPECT_GE(quoted.size(), 50u);
  for (const std::string& part : quoted) EXPECT_THAT(printed, testing::HasSubstr(part));
}

/// A device that cannot be opened, asked or started ends the first hour of whoever meets it.
TEST(Troubleshooting, HasAnEntryForEachWayInWhichADeviceDoesNotStart) {
  static const std::set<std::string> kFirstHour{
      "open",      "connect",     "start the stream",  "look up the name",    "start",
      "lock",      "identify",    "take the zero",     "claim its interface", "spin",
      "switch on", "speak from ", "open a UDP socket", "compare settings"};
  static const std::regex kThrow(R"(DeviceError\(([^;]*?)\);)");
  constexpr std::size_t kACause = 10;  // shorter ones are names
  const fs::path root(kphi::test::source_dir());
  const std::vector<std::string> quoted = quoted_on_the_page();
  int found = 0;
  for (const std::string& file : product_files()) {
    if (file.find("/sim/") != std::string::npos || file.find("/virtual/") != std::string::npos) continue;
    const std::string text = read(root / file);
    for (std::sregex_iterator i(text.begin(), text.end(), kThrow), end; i != end; ++i) {
      std::vector<std::string> causes = literals_of((*i)[1]);
      const auto removed = std::erase_if(causes, [](const auto& literal) { return kFirstHour.contains(literal); });
      std::erase_if(causes, [](const auto& literal) { return literal.size() < kACause || literal.ends_with("{}:{}"); });
      if (removed == 0 || causes.empty()) continue;
      ++found;
      EXPECT_TRUE(std::ranges::any_of(causes,
                                      [&](const std::string& cause) {
                                        return std::ranges::any_of(quoted, [&](const auto& part) {
                                          return cause.find(part) != std::string::npos;
                                        });
                                      }))
          << file << ": " << testing::PrintToString(causes);
    }
  }
  EXPECT_GE(found, 15);
}

}  // namespace rooms_test
}  // namespace kphi::house
