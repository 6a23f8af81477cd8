#include "drivers/sim/iq/frame.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "test/drivers/sim/hex.hpp"

namespace kphi::sim::frame_test {

using namespace test;

struct Vector {
  std::uint8_t type, sub, access;
  std::string_view data;
  std::string_view frame;
};

// Frames of the vendor's library (access: id * 4 + code).
constexpr Vector kVectors[] = {
    {50, 13, 0, "", "55 02 32 0D 00 31 B4"},                         // get obs_velocity
    {52, 5, 20, "", "55 02 34 05 14 8D DD"},                         // get ctrl_velocity of id 5
    {52, 5, 1, "00 00 C8 42", "55 06 34 05 01 00 00 C8 42 95 37"},   // set ctrl_velocity 100
    {52, 5, 1, "B7 04 FA 44", "55 06 34 05 01 B7 04 FA 44 98 48"},   // 19100 RPM
    {52, 5, 1, "00 00 48 C1", "55 06 34 05 01 00 00 48 C1 E6 8D"},   // -12.5
    {52, 2, 1, "", "55 02 34 02 01 8E 06"},                          // coast
    {52, 18, 1, "01", "55 03 34 12 01 01 D5 17"},                    // timeout_behavior 1
    {52, 15, 2, "", "55 02 34 0F 02 B1 40"},                         // save timeout
    {50, 13, 3, "00 00 C8 42", "55 06 32 0D 03 00 00 C8 42 71 DF"},  // reply obs_velocity 100
    {50, 13, 3, "00 00 C0 7F", "55 06 32 0D 03 00 00 C0 7F 26 B1"},  // NaN
    {50, 41, 3, "00 00 01 00", "55 06 32 29 03 00 00 01 00 92 28"},  // derate 65536
    {50, 14, 3, "07 00", "55 04 32 0E 03 07 00 41 22"},              // pole pairs
    {5, 16, 3, "20 00 10 00", "55 06 05 10 03 20 00 10 00 39 08"},   // firmware
    {52, 2, 0xFD, "", "55 02 34 02 FD 1D 28"},                       // broadcast coast
    {50, 13, 3, "55 55 55 55", "55 06 32 0D 03 55 55 55 55 50 AF"},  // nothing is escaped
};

TEST(IqFrame, CrcHasThePublishedCheckValues) {
  EXPECT_EQ(iq_crc(bytes("31 32 33 34 35 36 37 38 39")), 0x29B1);
  EXPECT_EQ(iq_crc({}), 0xFFFF);
  EXPECT_EQ(iq_crc(bytes("01 02 03")), 0xADAD);
}

TEST(IqFrame, BuildsTheVendorsBytes) {
  for (const auto& vector : kVectors) {
    std::vector<std::uint8_t> out;
    append_iq_frame(out, vector.type, vector.sub, vector.access, bytes(vector.data));
    EXPECT_EQ(hex(out), hex(vector.frame));
  }
}

TEST(IqFrame, ReadsTheVendorsBytes) {
  IqScanner scanner;
  for (const auto& vector : kVectors) {
    scanner.feed(bytes(vector.frame));
    const auto frame = scanner.next();
    ASSERT_TRUE(frame) << vector.frame;
    EXPECT_EQ(frame->type, vector.type);
    ASSERT_GE(frame->payload.size(), 2u);
    EXPECT_EQ(frame->payload[0], vector.sub);
    EXPECT_EQ(frame->payload[1], vector.access);
    EXPECT_EQ(hex(frame->payload.subspan(2)), hex(vector.data));
    EXPECT_FALSE(scanner.next());
  }
}

int frames_in(std::string_view spelt) {
  IqScanner scanner;
  scanner.feed(bytes(spelt));
  int count = 0;
  while (scanner.next()) ++count;
  return count;
}

TEST(IqFrame, FindsFramesBehindNoise) {
  EXPECT_EQ(frames_in("55 02 34 02 01 8E 06"), 1);
  EXPECT_EQ(frames_in("00 FF 12 55 02 34 02 01 8E 06"), 1);
  EXPECT_EQ(frames_in("55 55 55 55 02 34 02 01 8E 06"), 1) << "LEN over 59 restarts at that byte";
  EXPECT_EQ(frames_in("55 FF 55 02 34 02 01 8E 06"), 1);
  EXPECT_EQ(frames_in("55 02 34 02 01 8E 07  55 02 34 02 01 8E 06"), 1) << "wrong CRC, then a good frame";
  EXPECT_EQ(frames_in("55 06 34 05 01 00  55 02 34 02 01 8E 06"), 1) << "truncated, then a good frame";
}

TEST(IqFrame, WaitsForTheRestInAnyChunks) {
  IqScanner scanner;
  int count = 0;
  for (int round = 0; round < 50; ++round) {
    for (const auto& vector : kVectors) {
      for (const std::uint8_t byte : bytes(vector.frame)) {
        scanner.feed({&byte, 1});
        while (scanner.next()) ++count;
      }
    }
  }
  EXPECT_EQ(count, 50 * static_cast<int>(std::size(kVectors)));
}

}  // namespace kphi::sim::frame_test
