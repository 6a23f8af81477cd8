#include "drivers/netbox/wire/rdt.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <random>
#include <sstream>

#include "test/drivers/netbox/record_bytes.hpp"
#include "test/source_dir.hpp"

namespace kphi::netbox::rdt_test {

using test::Bytes;

struct Golden {
  std::string kind, name;
  std::vector<std::uint32_t> values;  // negative counts modulo 2^32
  Bytes bytes;
};

Golden parse(const std::string& line) {
  Golden golden;
  std::istringstream fields(line);
  std::string values, bytes, word;
  fields >> golden.kind;
  std::getline(fields, golden.name, '|');
  std::getline(fields, values, '|');
  std::getline(fields, bytes);
  std::istringstream value_words(values), byte_words(bytes);
  while (value_words >> word) golden.values.push_back(static_cast<std::uint32_t>(std::stoll(word, nullptr, 0)));
  while (byte_words >> word) golden.bytes.push_back(static_cast<std::uint8_t>(std::stoul(word, nullptr, 16)));
  return golden;
}

std::vector<Golden> golden(const std::string& kind) {
  std::ifstream file(kphi::test::source_dir() + "/test/golden/netbox_rdt.txt");
  std::vector<Golden> found;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(kind)) found.push_back(parse(line));
  }
  return found;
}

LoadCellRecord record_of(const Golden& golden) {
  LoadCellRecord record{{}, golden.values.at(0), golden.values.at(1), golden.values.at(2)};
  for (std::size_t axis = 0; axis < 6; ++axis)
    record.counts[axis] = static_cast<std::int32_t>(golden.values.at(3 + axis));
  return record;
}

TEST(RdtRequest, MatchesTheManualByteForByte) {
  const std::vector<Golden> requests = golden("request");
  ASSERT_EQ(requests.size(), 8u);
  for (const Golden& request : requests) {
    const auto encoded = encode_request(static_cast<Command>(request.values.at(0)), request.values.at(1));
    EXPECT_THAT(encoded, testing::ElementsAreArray(request.bytes)) << request.name;
  }
}

TEST(RdtRequest, CodesAreTheManuals) {
  EXPECT_EQ(static_cast<int>(Command::stop), 0);
  EXPECT_EQ(static_cast<int>(Command::real_time), 2);
  EXPECT_EQ(static_cast<int>(Command::buffered), 3);
  EXPECT_EQ(static_cast<int>(Command::set_bias), 0x42);
}

TEST(RdtRecord, DecodesTheManualsRecords) {
  const std::vector<Golden> records = golden("record");
  ASSERT_EQ(records.size(), 3u);
  for (const Golden& expected : records) {
    std::array<LoadCellRecord, kMaxRecords> out;
    ASSERT_EQ(decode(expected.bytes, out), 1u) << expected.name;
    EXPECT_EQ(out[0], record_of(expected)) << expected.name;
  }
}

TEST(RdtRecord, TheTestsOwnWriterWritesTheSameBytes) {
  Bytes bytes;
  test::put_record(bytes, 2, 1234574, 0x80010000, 5432101);
  const Bytes manual = golden("record").at(1).bytes;
  EXPECT_TRUE(std::equal(bytes.begin(), bytes.begin() + 12, manual.begin()));
  EXPECT_TRUE(std::equal(bytes.begin() + 20, bytes.begin() + 24, manual.begin() + 20));
}

TEST(RdtRecord, DecodesABufferedDatagramInItsOrder) {
  const std::vector<Golden> records = golden("record");
  Bytes datagram = records[0].bytes;
  datagram.insert(datagram.end(), records[1].bytes.begin(), records[1].bytes.end());
  std::array<LoadCellRecord, kMaxRecords> out;
  ASSERT_EQ(decode(datagram, out), 2u);
  EXPECT_EQ(out[0], record_of(records[0]));
  EXPECT_EQ(out[1], record_of(records[1]));
}

TEST(RdtRecord, TakesEveryWholeNumberOfRecordsUpTo40AndNoOtherSize) {
  const Bytes zeros(2000, 0);
  for (std::size_t size = 0; size <= zeros.size(); ++size) {
    std::array<LoadCellRecord, kMaxRecords> out;
    const bool whole = size > 0 && size % 36 == 0 && size <= 1440;
    EXPECT_EQ(decode(std::span(zeros).first(size), out), whole ? size / 36 : 0u) << size;
  }
}

TEST(RdtRecord, RandomDatagramsComeOutAsTheyWouldBeWritten) {
  std::mt19937 random(1);
  std::array<LoadCellRecord, kMaxRecords> out;
  for (int trial = 0; trial < 5000; ++trial) {
    Bytes datagram(36 * std::uniform_int_distribution<std::size_t>(1, 40)(random));
    for (auto& byte : datagram) byte = static_cast<std::uint8_t>(random());
    const std::size_t count = decode(datagram, out);
    ASSERT_EQ(count * 36, datagram.size());
    Bytes written;
    for (std::size_t i = 0; i < count; ++i) {
      test::put_u32(written, out[i].rdt_sequence);
      test::put_u32(written, out[i].ft_sequence);
      test::put_u32(written, out[i].status);
      for (const std::int32_t counts : out[i].counts) test::put_u32(written, static_cast<std::uint32_t>(counts));
    }
    ASSERT_EQ(written, datagram);
  }
}

TEST(RdtRecord, LeavesTheRestOfTheOutputAlone) {
  std::array<LoadCellRecord, kMaxRecords> out;
  out[2].rdt_sequence = 4711;
  EXPECT_EQ(decode(test::records(1, 1, 2), out), 2u);
  EXPECT_EQ(out[2].rdt_sequence, 4711u);
}

}  // namespace kphi::netbox::rdt_test
