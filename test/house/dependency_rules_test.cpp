#include "test/house/dependency_rules.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "test/source_dir.hpp"

namespace kphi::house {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::string include(const std::string& header) { return "#include \"" + header + "\"\n"; }

std::string read(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

TEST(DependencyRules, AreKeptByEveryFile) {
  const std::filesystem::path root(kphi::test::source_dir());
  std::vector<std::string> found;
  int files = 0;
  for (const char* room : {"profiles", "drivers", "results", "daq", "fit", "compensation"}) {
    if (!std::filesystem::exists(root / room)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / room)) {
      const auto extension = entry.path().extension();
      if (extension != ".hpp" && extension != ".cpp") continue;
      ++files;
      const auto here = violations(std::filesystem::relative(entry.path(), root).generic_string(), read(entry.path()));
      found.insert(found.end(), here.begin(), here.end());
    }
  }
  EXPECT_THAT(found, IsEmpty());
  EXPECT_GT(files, 20) << "the rooms were not found under " << root;
}

TEST(DependencyRules, KnowEveryRoomOfTheBuild) {
  std::set<std::string> rooms;
  for (const Rule& rule : rules()) rooms.insert(rule.folder.substr(0, rule.folder.find('/')));
  EXPECT_EQ(rooms, (std::set<std::string>{"profiles", "drivers", "results", "daq", "fit", "compensation"}));
}

TEST(DependencyRules, NameTheLineOfAViolation) {
  EXPECT_THAT(violations("results/x.cpp", "// one\n" + include("results/x.hpp") + include("daq/run.hpp")),
              ElementsAre("results/x.cpp:3: results/ must not see daq/run.hpp"));
}

struct Planted {
  const char* path;
  const char* header;
};

TEST(DependencyRules, CatchWhatIsForbidden) {
  for (const Planted& planted : std::vector<Planted>{
           {"compensation/compensator.cpp", "profiles/vehicle.hpp"},
           {"compensation/compensator.hpp", "compensation/file/coefficient_file.hpp"},
           {"compensation/flight/fly.cpp", "profiles/vehicle.hpp"},
           {"compensation/file/coefficient_file.cpp", "fit/coefficients.hpp"},
           {"drivers/clock.cpp", "daq/run.hpp"},
           {"drivers/iq/session.cpp", "profiles/bench.hpp"},
           {"drivers/iq/session.cpp", "drivers/netbox/codes.hpp"},
           {"drivers/netbox/rdt.cpp", "results/records.hpp"},
           {"drivers/netbox/rdt.cpp", "drivers/iq/codes.hpp"},
           {"drivers/netbox/rdt.cpp", "drivers/sim/bytes.hpp"},
           {"drivers/sim/netbox_device.cpp", "drivers/netbox/rdt.hpp"},
           {"drivers/sim/iq_device.cpp", "drivers/iq/packet.hpp"},
           {"drivers/sim/bench.cpp", "profiles/bench.hpp"},
           {"drivers/future/device.cpp", "drivers/iq/codes.hpp"},
           {"results/run_writer.cpp", "profiles/strict_yaml.hpp"},
           {"results/run_writer.cpp", "drivers/clock.hpp"},
           {"results/run_writer.cpp", "fit/csv.hpp"},
           {"daq/run.cpp", "fit/coefficients.hpp"},
           {"daq/run.cpp", "compensation/compensator.hpp"},
           {"fit/line_fit.cpp", "daq/reduction.hpp"},
           {"fit/line_fit.cpp", "drivers/clock.hpp"},
           {"fit/line_fit.cpp", "profiles/campaign.hpp"},
           {"profiles/plan.cpp", "drivers/device_error.hpp"},
           {"profiles/plan.cpp", "compensation/compensator.hpp"},
           {"profiles/plan.cpp", "plan.hpp"},
           {"profiles/plan.cpp", "../profiles/plan.hpp"},
       }) {
    EXPECT_EQ(violations(planted.path, include(planted.header)).size(), 1u) << planted.path << " " << planted.header;
  }
}

TEST(DependencyRules, LetPassWhatIsAllowed) {
  for (const Planted& planted : std::vector<Planted>{
           {"compensation/compensator.cpp", "compensation/units.hpp"},
           {"compensation/flight/fly.cpp", "compensation/compensator.hpp"},
           {"compensation/file/coefficient_file.cpp", "compensation/thrust_line.hpp"},
           {"drivers/iq/session.cpp", "drivers/serial/port.hpp"},
           {"drivers/netbox/session.cpp", "drivers/device_error.hpp"},
           {"drivers/sim/iq_device.cpp", "drivers/iq/codes.hpp"},
           {"results/records.hpp", "profiles/campaign.hpp"},
           {"daq/run.cpp", "drivers/netbox/session.hpp"},
           {"daq/run.cpp", "profiles/plan.hpp"},
           {"fit/line_fit.cpp", "results/step_mean.hpp"},
           {"fit/coefficients.cpp", "compensation/thrust_line.hpp"},
           {"fit/fit_error.hpp", "profiles/configuration_error.hpp"},
           {"fit/commands.cpp", "daq/run.hpp"},
           {"daq/replay_commands.cpp", "fit/coefficients.hpp"},
           {"main.cpp", "fit/commands.hpp"},
       }) {
    EXPECT_THAT(violations(planted.path, include(planted.header)), IsEmpty());
  }
}

TEST(DependencyRules, HoldForAngleBracketsAndOddSpacing) {
  EXPECT_EQ(violations("fit/x.cpp", "  #  include  <daq/run.hpp>\n").size(), 1u);
  EXPECT_EQ(violations("fit/x.cpp", "#include\"daq/run.hpp\"\n").size(), 1u);
  EXPECT_EQ(violations("fit/x.cpp", "#include \"daq/run.hpp\"\r\n").size(), 1u);
}

TEST(DependencyRules, KeepTheFlyingLibraryToTheStandardLibraryAndEigen) {
  const auto system = [](const std::string& path, const std::string& header) {
    return violations(path, "#include <" + header + ">\n").size();
  };
  EXPECT_EQ(system("compensation/compensator.cpp", "cmath"), 0u);
  EXPECT_EQ(system("compensation/compensator.cpp", "Eigen/Dense"), 0u);
  EXPECT_EQ(system("compensation/file/yaml_reader.cpp", "yaml-cpp/yaml.h"), 0u);
  for (const char* header :
       {"yaml-cpp/yaml.h", "fmt/format.h", "boost/crc.hpp", "unistd.h", "sys/socket.h", "hdf5.h"}) {
    EXPECT_EQ(system("compensation/compensator.cpp", header), 1u) << header;
    EXPECT_EQ(system("fit/line_fit.cpp", header), 0u) << header;
  }
  EXPECT_EQ(system("compensation/file/yaml_reader.cpp", "fmt/format.h"), 1u);
}

}  // namespace
}  // namespace kphi::house
