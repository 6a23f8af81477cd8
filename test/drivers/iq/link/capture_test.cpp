#include "drivers/iq/link/capture.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "base/error.hpp"
#include "drivers/iq/link/motor.hpp"
#include "drivers/iq/wire/packet.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"
#include "test/held_lock.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::iq {

struct LockOfCapture : kphi::test::HeldLock {
  explicit LockOfCapture(Capture& capture) : HeldLock(capture.mutex_) {}
};

namespace capture_test {

using namespace std::chrono_literals;
using test::TemporaryFolder;
using Direction = Capture::Direction;

struct Captured {
  Direction direction = Direction::came;
  Instant time{0};
  fake::Bytes bytes;
};

std::uint64_t little_endian(const std::string& text, std::size_t at, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes; i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(text.at(at + i));
  return value;
}

/// By the format that capture.hpp specifies. A last record that was cut off is left out.
std::vector<Captured> read_capture(const std::string& path) {
  const std::string title = "kphi iq capture 1\n";
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(text.substr(0, title.size()), title);
  std::vector<Captured> records;
  for (std::size_t at = title.size(); at + 13 <= text.size();) {
    const std::size_t size = little_endian(text, at + 9, 4);
    if (text.size() - at - 13 < size) break;
    records.push_back({static_cast<Direction>(text[at]),
                       Instant(static_cast<std::int64_t>(little_endian(text, at + 1, 8))),
                       {text.begin() + static_cast<std::ptrdiff_t>(at) + 13,
                        text.begin() + static_cast<std::ptrdiff_t>(at + 13 + size)}});
    at += 13 + size;
  }
  return records;
}

fake::Bytes all_bytes(const std::vector<Captured>& records, Direction direction) {
  fake::Bytes bytes;
  for (const Captured& record : records) {
    if (record.direction == direction) bytes.insert(bytes.end(), record.bytes.begin(), record.bytes.end());
  }
  return bytes;
}

class CaptureOnDisk : public testing::Test {
 protected:
  const TemporaryFolder folder;
  const std::string path = folder / "line.iqc";
};

TEST_F(CaptureOnDisk, KeepsBytesTimesAndDirections) {
  {
    Capture capture(path);
    capture.add(Direction::sent, fake::Bytes{0x55, 0x02}, 5ns);
    capture.add(Direction::came, fake::Bytes{}, -7ns);
    capture.add(Direction::came, fake::Bytes(100'000, 0x3C), 1h);
  }
  const auto records = read_capture(path);
  ASSERT_EQ(records.size(), 3u);
  EXPECT_EQ(records[0].direction, Direction::sent);
  EXPECT_EQ(records[0].bytes, (fake::Bytes{0x55, 0x02}));
  EXPECT_EQ(records[1].time, -7ns);
  EXPECT_EQ(records[2].bytes.size(), 100'000u);
  EXPECT_EQ(records[2].time, Instant(1h));
}

TEST_F(CaptureOnDisk, ReplacesACaptureAndNoOtherFile) {
  for (int i = 0; i < 2; ++i) Capture(path).add(Direction::sent, fake::Bytes{1}, 5ns);
  EXPECT_EQ(read_capture(path).size(), 1u);
  const std::string other = folder / "bench.yaml";
  std::ofstream(other) << "format: kphi-bench/1\n";
  EXPECT_THROW(Capture{other}, DeviceError);
  EXPECT_EQ(std::filesystem::file_size(other), 21u);
}

TEST(Capture, RefusesAFolderThatIsNotThere) { EXPECT_THROW(Capture("/no/such/folder/line.iqc"), DeviceError); }

TEST_F(CaptureOnDisk, MarksWhatItCouldNotTake) {
  {
    Capture capture(path);
    const fake::Bytes too_much(5 << 20, 0);
    capture.add(Direction::came, too_much, 1ns);
    capture.add(Direction::came, fake::Bytes{1}, 2ns);
  }
  const auto records = read_capture(path);
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[0].direction, Direction::missing);
  EXPECT_EQ(records[1].bytes, fake::Bytes{1});
}

TEST_F(CaptureOnDisk, DelaysNoLineWhileItsWriterStandsStillInTheLock) {
  {
    Capture capture(path);
    const LockOfCapture held(capture);
    for (std::uint8_t i = 0; i < 3; ++i) capture.add(Direction::came, fake::Bytes{i}, Instant(i));
  }
  const auto records = read_capture(path);
  ASSERT_EQ(records.size(), 3u) << "and nothing is missing afterwards";
  EXPECT_EQ(records[2].bytes, fake::Bytes{2});
}

TEST_F(CaptureOnDisk, OfAMotorGoesThroughTheParserBitByBit) {
  Counters counters;
  fake::ModuleOnALine line;
  {
    const SteadyClock clock;
    Motor motor(line.device(), 115200, {}, clock, path);
    motor.spin_at(RadPerSec(1234.5));
    ASSERT_TRUE(line.heard_a_speed(1234.5));
    ASSERT_TRUE(motor.stop().safe());
    counters = motor.counters();
  }
  const auto records = read_capture(path);
  const fake::Bytes came = all_bytes(records, Direction::came), sent = all_bytes(records, Direction::sent);
  EXPECT_GE(came.size(), counters.bytes_in);
  EXPECT_GE(sent.size(), counters.bytes_out);

  // The replies: every byte belongs to a packet, each written again is the same.
  Parser parser;
  fake::Bytes again;
  std::size_t packets = 0;
  parser.push(came, [&](const Packet& packet, std::uint64_t) {
    std::array<std::uint8_t, kMaxFrame> frame;
    again.insert(again.end(), frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(encode(packet, frame)));
    ++packets;
  });
  EXPECT_EQ(again, came);
  EXPECT_GE(packets, counters.packets);

  // What was sent, told to another module, makes it do the same.
  fake::Module module;
  (void)module.receive(sent);
  EXPECT_TRUE(module.last_motion()->is_coast());
  EXPECT_EQ(module.count([](const auto& h) { return h.is_speed(); }), 1u);
  ASSERT_TRUE(line.left_coasting());
  EXPECT_EQ(module.heard.size(), line.with([](fake::Module& m) { return m.heard.size(); }));
}

}  // namespace capture_test
}  // namespace kphi::iq
