#include "fit/export/mcap_writer.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "fit/coefficients/coefficients.hpp"
#include "fit/export/run_export.hpp"
#include "fit/export/targets.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/fit/export/outside_reader.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace mcap_writer_test {

using test::read_with;
using test::TemporaryFolder;
using test::works;

/// @mcap/core, from the folder that KPHI_NODE_MODULES names or build/node_modules. It reads the same file twice: as a
/// stream, and by its indexes, with all checksums checked.
constexpr const char* kReader = R"js(
const { McapStreamReader, McapIndexedReader } = require("@mcap/core");
const fs = require("fs");
(async () => {
  const bytes = fs.readFileSync(process.argv[2]);
  const stream = new McapStreamReader({ validateCrcs: true });
  stream.append(bytes);
  const topics = {}, messages = [];
  let metadata = null;
  for (let record; (record = stream.nextRecord()); ) {
    if (record.type === "Channel") topics[record.id] = record.topic;
    if (record.type === "Metadata") metadata = Object.fromEntries(record.metadata);
    if (record.type === "Message")
      messages.push({ topic: topics[record.channelId], time: record.logTime.toString(), sequence: record.sequence,
                      data: JSON.parse(new TextDecoder().decode(record.data)) });
  }
  if (!stream.done()) throw new Error("the stream does not end");
  const readable = { size: async () => BigInt(bytes.length),
                     read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)) };
  const indexed = await McapIndexedReader.Initialize({ readable });
  let count = 0;
  for await (const message of indexed.readMessages()) ++count;
  const named = [];
  for await (const one of indexed.readMetadata()) named.push(one.name);
  console.log(JSON.stringify({ messages, metadata, named, indexed: count,
      statistics: indexed.statistics.messageCount.toString(), chunks: indexed.chunkIndexes.length,
      channelMetadata: [...indexed.channelsById.values()].map((c) => Object.fromEntries(c.metadata)) }));
})().catch((error) => { console.error(String(error)); process.exit(1); });
)js";

class Mcap : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* config = std::getenv("KPHI_NODE_MODULES");
    modules = config != nullptr ? config : kphi::test::source_dir() + "/build/node_modules";
    if (!works("NODE_PATH=" + modules + " node -e 'require(\"@mcap/core\")'"))
      GTEST_SKIP() << "no @mcap/core in " << modules
                   << "; npm install --prefix build @mcap/core, or set KPHI_NODE_MODULES";
  }
  [[nodiscard]] nlohmann::json read(const std::string& bytes) const {
    const TemporaryFolder folder;
    test::write_file(folder.path() / "file.mcap", bytes);
    test::write_file(folder.path() / "read.js", kReader);
    const auto reading = read_with("NODE_PATH=" + modules + " node " + (folder.path() / "read.js").string() + " " +
                                   (folder.path() / "file.mcap").string());
    EXPECT_EQ(reading.status, 0) << reading.out;
    return reading.status == 0 ? nlohmann::json::parse(reading.out) : nlohmann::json();
  }
  std::string modules;
};

std::string file_of(int messages) {
  std::ostringstream out;
  McapWriter writer(out, "kphi test");
  const auto a = writer.add_channel("/a", "A", "{}", {{"unit", "N"}});
  const auto b = writer.add_channel("/b", "B", "{}");
  for (int i = 0; i < messages; ++i)
    writer.write(i % 3 == 0 ? a : b, 1'000'000'000u + static_cast<std::uint64_t>(i),
                 "{\"i\":" + std::to_string(i) + "}");
  writer.add_metadata("about", {{"who", "us"}});
  writer.close();
  return std::move(out).str();
}

TEST_F(Mcap, IsReadByTheFormatsOwnLibrary) {
  const auto json = read(file_of(10));
  ASSERT_EQ(json["messages"].size(), 10u);
  EXPECT_EQ(json["messages"][3]["topic"], "/a");
  EXPECT_EQ(json["messages"][3]["time"], "1000000003");
  EXPECT_EQ(json["messages"][3]["sequence"], 1);
  EXPECT_EQ(json["messages"][9]["data"]["i"], 9);
  EXPECT_EQ(json["indexed"], 10);
  EXPECT_EQ(json["statistics"], "10");
  EXPECT_EQ(json["metadata"]["who"], "us");
  EXPECT_EQ(json["channelMetadata"][0]["unit"], "N");
}

TEST_F(Mcap, OfManyChunksIsReadByItsIndexes) {
  const auto json = read(file_of(60000));
  EXPECT_EQ(json["indexed"], 60000);
  EXPECT_GT(json["chunks"], 2);
}

TEST_F(Mcap, WithoutMessagesIsWhole) { EXPECT_EQ(read(file_of(0))["indexed"], 0); }

TEST_F(Mcap, OfCoefficientsHoldsTheTableAndItsProvenance) {
  Provenance provenance;
  provenance.runs = {{"runs/a.h5", std::string(64, 'a'), "", std::nullopt}};
  const auto file =
      compensation::parse_coefficients(format_coefficients(analysed(identify(campaign_steps())), provenance), "c");
  const auto json = read(to_mcap(file, {}).text);
  ASSERT_EQ(json["messages"].size(), 5u);
  EXPECT_EQ(json["messages"][0]["data"]["k"].get<double>(), file.curve.thrust_coefficient().value());
  EXPECT_NEAR(json["messages"][4]["data"]["phi_deg"].get<double>(), 270, 1e-9);
  EXPECT_EQ(json["metadata"]["k_unit"], "N/(rad/s)^2");
  EXPECT_EQ(json["metadata"]["sha256 runs/a.h5"], std::string(64, 'a'));
}

results::RunRecording recording() {
  results::RunRecording run;
  run.header.started_utc = "2021-05-30T08:00:00Z";
  run.header.load_cell.counts_per_newton = 1000;
  run.header.load_cell.counts_per_newton_metre = 10000;
  run.load_cell.push_back({{1000, -2000, 500, 10000, 0, 0}, 1, 7, 0, 2'000'000'000});
  run.motor.push_back({MotorChannel::speed, 1'500'000'000, 0, 123.5});
  run.phases.push_back({results::Phase::step, 0, 1'000'000'000, 120});
  return run;
}

TEST_F(Mcap, OfARunHoldsEverySampleAtItsTime) {
  std::ostringstream out;
  EXPECT_FALSE(run_to_mcap(recording(), out).empty());
  const auto json = read(out.str());
  ASSERT_EQ(json["messages"].size(), 3u);
  for (const auto& message : json["messages"]) {
    if (message["topic"] == "/load_cell") {
      EXPECT_EQ(message["data"]["force_y_n"], -2.0);
      EXPECT_EQ(message["data"]["torque_x_nm"], 1.0);
      EXPECT_EQ(message["time"], "1622361602000000000");
    }
    if (message["topic"] == "/motor/speed") {
      EXPECT_EQ(message["data"]["value"], 123.5);
    }
  }
}

TEST(McapWriter, EndsWithTheMagicItBeginsWith) {
  const std::string bytes = file_of(4);
  EXPECT_EQ(bytes.substr(0, 8), bytes.substr(bytes.size() - 8));
  std::size_t at = 8, records = 0;
  while (at + 9 <= bytes.size() - 8) {
    std::uint64_t length = 0;
    for (int i = 7; i >= 0; --i)
      length = (length << 8) | static_cast<unsigned char>(bytes[at + 1 + static_cast<std::size_t>(i)]);
    at += 9 + length;
    ++records;
  }
  EXPECT_EQ(at, bytes.size() - 8) << "records fill the file";
  EXPECT_GT(records, 8u);
}

TEST(RunExport, AsCsvHasUnitsInItsHeader) {
  std::ostringstream out;
  (void)run_to_csv(recording(), out);
  EXPECT_EQ(out.str(),
            "time_s,force_x_n,force_y_n,force_z_n,torque_x_nm,torque_y_nm,torque_z_nm,ft_sequence,status,origin\n"
            "2.000000000,1,-2,0.5,1,0,0,7,0,unknown\n");
}

TEST(RunExport, KnowsTheTime) {
  EXPECT_EQ(nanoseconds_since_1970("1970-01-02T00:00:01Z"), 86401'000'000'000u);
  EXPECT_EQ(nanoseconds_since_1970("2021-05-30T08:00:00Z"), 1622361600'000'000'000u);
  EXPECT_EQ(nanoseconds_since_1970("yesterday"), 0u);
  EXPECT_EQ(nanoseconds_since_1970("2021-02-31T00:00:00Z"), 0u);
}

}  // namespace mcap_writer_test
}  // namespace kphi::fit
