// The files in profiles/ load, say what the paper says, and survive any damage with a refusal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "profiles/answers.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "profiles/plan.hpp"
#include "profiles/schema.hpp"
#include "profiles/vehicle.hpp"
#include "profiles/world.hpp"
#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace shipped_files_test {

std::vector<std::string> shipped_files() {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(shipped(""))) {
    const auto name = entry.path().filename();
    if (name == "faults_example.yaml" || name == "motor_iq2306.yaml") continue;  // of the simulators: see commands_test
    if (entry.path().extension() == ".yaml") paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

FileKind kind_of(const std::string& text) {
  for (const FileKindInfo& kind : kFileKinds) {
    if (text.find(std::string("format: ") + kind.format + "\n") != std::string::npos) return kind.kind;
  }
  ADD_FAILURE() << "no format in the file";
  return FileKind::campaign;
}

void parse(FileKind kind, const std::string& text) {
  if (kind == FileKind::campaign) static_cast<void>(parse_campaign(text, "f.yaml"));
  if (kind == FileKind::bench) static_cast<void>(parse_bench(text, "f.yaml"));
  if (kind == FileKind::answers) static_cast<void>(parse_answers(text, "f.yaml"));
  if (kind == FileKind::vehicle) static_cast<void>(parse_vehicle(text, "f.yaml"));
  if (kind == FileKind::world) static_cast<void>(parse_world(text, "f.yaml"));
}

TEST(ShippedFiles, AllLoad) {
  const auto paths = shipped_files();
  EXPECT_EQ(paths.size(), 13u);
  for (const std::string& path : paths) {
    const std::string text = read_text(path);
    EXPECT_NO_THROW(parse(kind_of(text), text)) << path;
  }
}

TEST(ShippedFiles, NameTheirSchemaForEditorsAndTheSchemaIsThere) {
  for (const std::string& path : shipped_files()) {
    const std::string text = read_text(path);
    const std::string schema = std::string("schema/") + info(kind_of(text)).word + ".schema.json";
    EXPECT_THAT(text, testing::StartsWith("# yaml-language-server: $schema=" + schema + "\n")) << path;
    EXPECT_TRUE(std::filesystem::exists(shipped(schema))) << path;
  }
}

TEST(ShippedFiles, CarryTheirNameInside) {
  for (const std::string& path : shipped_files()) {
    if (auto kind = kind_of(read_text(path)); kind == FileKind::answers || kind == FileKind::flight_layout) continue;
    EXPECT_THAT(read_text(path), testing::HasSubstr("\nname: " + std::filesystem::path(path).stem().string() + "\n"));
  }
}

TEST(ShippedFiles, AreThePapersCampaigns) {
  struct Expected {
    const char* file;
    const char* id;
    double diameter_in;
    int blades;
    double last_rpm;
  };
  for (const Expected& expected : {Expected{"icra2021_5in_2blade.yaml", "5x2", 5, 2, 19100},
                                   Expected{"icra2021_5in_3blade.yaml", "5x3", 5, 3, 19100},
                                   Expected{"icra2021_6in_2blade.yaml", "6x2", 6, 2, 19100},
                                   Expected{"icra2021_6in_3blade.yaml", "6x3", 6, 3, 17188}}) {
    const Campaign campaign = load_campaign(shipped(expected.file));
    EXPECT_EQ(campaign.propeller.id, expected.id);
    EXPECT_EQ(campaign.propeller.diameter_in, expected.diameter_in);
    EXPECT_EQ(campaign.propeller.blades, expected.blades);
    EXPECT_THAT(campaign.occlusions_deg, testing::ElementsAre(0, 45, 90, 180, 270));
    EXPECT_EQ(campaign.repetitions, 3);
    EXPECT_EQ(campaign.profile.steps, 40);
    EXPECT_EQ(campaign.profile.dwell, Seconds(2));
    EXPECT_EQ(campaign.profile.first, from_rpm(100));
    EXPECT_EQ(campaign.profile.last, from_rpm(expected.last_rpm));
    EXPECT_EQ(campaign.limits["speed_max_rpm"], expected.last_rpm);
    EXPECT_EQ(campaign.supply, Volts(12));
  }
}

TEST(ShippedFiles, FitEachOther) {
  for (const char* campaign : {"5in_2blade", "5in_3blade", "6in_2blade", "6in_3blade"}) {
    for (const char* bench : {"bench_simulated.yaml", "bench_deterministic.yaml", "bench_lab.yaml"}) {
      EXPECT_NO_THROW(require_within(load_campaign(shipped(std::string("icra2021_") + campaign + ".yaml")),
                                     load_bench(shipped(bench))));
    }
  }
}

TEST(ShippedFiles, DescribeTheThreeBenches) {
  const BenchConfig simulated = load_bench(shipped("bench_simulated.yaml"));
  ASSERT_TRUE(simulated.simulation);
  EXPECT_FALSE(simulated.simulation->in_process);
  EXPECT_EQ(simulated.simulation->time_scale, 20);
  EXPECT_EQ(simulated.simulation->control, "/tmp/kphi-bench/control");
  EXPECT_EQ(simulated.netbox.http_port, 8049);
  EXPECT_EQ(simulated.iq.speed_max, from_rpm(19300));
  EXPECT_TRUE(load_bench(shipped("bench_deterministic.yaml")).simulation->in_process);
  EXPECT_FALSE(load_bench(shipped("bench_lab.yaml")).simulation);
}

TEST(ShippedFiles, DescribeTheFoldableDrone) {
  const Vehicle vehicle = load_vehicle(shipped("foldable_drone.yaml"));
  std::set<std::string> shapes;
  for (const auto& [name, unused] : vehicle.shapes) shapes.insert(name);
  EXPECT_EQ(shapes, (std::set<std::string>{"X", "H", "O", "T"}));
  EXPECT_EQ(vehicle.shapes.at("O")[2], from_degrees(165.676));
  EXPECT_EQ(vehicle.shapes.at("T")[0], from_degrees(90));
}

TEST(ShippedFiles, DescribeAHexacopterAndOneWhoseArmsGetShorter) {
  const Vehicle hexa = load_vehicle(shipped("foldable_hexa.yaml"));
  EXPECT_EQ(rotors_of(hexa), 6u);
  EXPECT_EQ(shapes_of(hexa), (std::vector<std::string>{"O", "X", "half"}));
  const Vehicle quad = load_vehicle(shipped("telescoping_quad.yaml"));
  EXPECT_EQ(rotors_of(quad), 4u);
  EXPECT_EQ(hubs_of(quad, "O")[1].x, Metres(-0.072));
}

TEST(Schemas, AreEmbeddedAsTheyLieInTheFolder) {
  for (const FileKindInfo& kind : kFileKinds) {
    const auto file = read_text(shipped(std::string("schema/") + kind.word + ".schema.json"));
    EXPECT_EQ(nlohmann::json::parse(schema_text(kind.kind)), nlohmann::json::parse(file)) << kind.word;
  }
}

TEST(Schemas, OfCampaignAndBenchDescribeTheSameLimits) {
  const auto limits = [](FileKind kind) { return schema_of(kind)["properties"]["limits"]["properties"]; };
  nlohmann::json campaign = limits(FileKind::campaign);
  campaign.erase("cooling");
  EXPECT_EQ(campaign, limits(FileKind::bench));
  EXPECT_EQ(campaign.size(), kLimitKeys.size());
  for (const std::string_view key : kLimitKeys) EXPECT_TRUE(campaign.contains(std::string(key))) << key;
}

TEST(Schemas, DescribeEveryKey) {
  const std::function<void(const nlohmann::json&)> visit = [&](const nlohmann::json& schema) {
    if (!schema.contains("properties")) return;
    for (const auto& [key, child] : schema["properties"].items()) {
      EXPECT_TRUE(child.contains("type")) << key;
      EXPECT_TRUE(child.contains("description")) << key;
      EXPECT_TRUE(!child.contains("properties") || child["additionalProperties"] == false) << key;
      visit(child);
    }
  };
  for (const FileKindInfo& kind : kFileKinds) visit(nlohmann::json::parse(schema_text(kind.kind)));
}

/// One small act of vandalism. Pieces of YAML hurt more than random bytes do.
std::string damaged(std::string text, std::mt19937_64& random) {
  static const std::vector<std::string> kPieces{// structure
                                                "[", "]", "{", "}", ":", ": ", "- ", "\n", "  ", "\t", "&a ", "*a",
                                                "!!x ", "#", "'", "\"", "|\n", ">", "? ", "---\n", "...\n", "%YAML 9\n",
                                                // values
                                                "010", "no", ".nan", "1e999", "~", "\xC3\xA9", "\xFF", "<<: ", "\r",
                                                "\\", "-", "9999999999999999999999", "format: ", "\x00"};
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  const std::size_t at = below(text.size());
  switch (below(5)) {
    case 0:
      return text.erase(at, 1 + below(20));
    case 1:
      return text.insert(at, kPieces[below(kPieces.size())]);
    case 2:
      text[at] = static_cast<char>(below(256));
      return text;
    case 3:
      return text.insert(at, text.substr(below(text.size()), below(60)));
    default:
      return text.replace(at, std::min<std::size_t>(text.size() - at, 1 + below(6)), kPieces[below(kPieces.size())]);
  }
}

#ifdef KPHI_SANITIZED
constexpr int kTrials = 50;
#else
constexpr int kTrials = 500;
#endif

TEST(ShippedFiles, DamagedAtRandomLoadOrAreRefusedWithAPlace) {
  std::mt19937_64 random(20210530);
  int refused = 0;
  for (const std::string& path : shipped_files()) {
    const std::string text = read_text(path);
    const FileKind kind = kind_of(text);
    for (int trial = 0; trial < kTrials; ++trial) {
      std::string broken = text;
      for (int times = 1 + trial % 4; times > 0 && !broken.empty(); --times) broken = damaged(broken, random);
      try {
        parse(kind, broken);
      } catch (const ConfigurationError& refusal) {
        ++refused;
        ASSERT_THAT(refusal.what(), testing::MatchesRegex("^f\\.yaml:[0-9]+:[0-9]+: (.|\n)+; (.|\n)+")) << broken;
      } catch (const std::exception& other) {
        FAIL() << other.what() << "\n" << broken;
      }
    }
  }
  EXPECT_GT(refused, 2 * kTrials) << "the damage is too gentle";
}

}  // namespace shipped_files_test
}  // namespace kphi::profiles
