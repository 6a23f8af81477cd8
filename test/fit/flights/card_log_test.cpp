// Crazyflie card logs of known content.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/error.hpp"
#include "fit/flights/flight_log.hpp"
#include "test/fit/flights/flight_writers.hpp"
#include "test/refusal.hpp"

namespace kphi::fit {
namespace card_log_test {

using test::CardLogWriter;
using test::LogBytes;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

const std::vector<CardLogWriter::Kind> kKinds{
    {0xFFFF,
     "fixedFrequency",
     {"acc.x(f)", "acc.y(f)", "acc.z(f)", "gyro.x(f)", "gyro.y(f)", "gyro.z(f)", "motor.m1(H)", "motor.m2(I)"}},
    {7, "slow", {"pm.vbat(e)", "range.zrange(H)", "pm.state(b)"}}};

LogBytes fast(float k) {
  return LogBytes()
      .single(0.25f)
      .single(0.5f * k)
      .single(1 + k)
      .single(90)
      .single(0)
      .single(0)
      .whole<std::uint16_t>(13107)
      .whole(39321u);
}

std::string flight(int records, std::uint16_t version = 2) {
  CardLogWriter log(version, kKinds);
  const std::uint64_t unit = version == 1 ? 1 : 1000;  // of a millisecond
  for (int k = 0; k < records; ++k) {
    log.record(0xFFFF, (500 + static_cast<std::uint64_t>(k)) * unit, fast(0.125f * static_cast<float>(k)));
    // 3.75 as binary16
    if (k % 2 == 1)
      log.record(7, 500 * unit + static_cast<std::uint64_t>(k) * unit,
                 LogBytes().whole<std::uint16_t>(0x4380).whole<std::uint16_t>(1250).whole<std::int8_t>(-1));
  }
  return log.bytes();
}

std::string words_of(const FlightLog& log) {
  std::string words;
  for (const Finding& finding : log.findings) words += finding.line() + "\n";
  return words;
}

TEST(CardLog, GivesChannelsInOurUnits) {
  for (const std::uint16_t version : {1, 2}) {
    const FlightLog log = parse_flight(flight(3, version), "log10");
    EXPECT_EQ(log.format, "Crazyflie card log");
    ASSERT_EQ(log.specific_force[2].values.size(), 3u);
    EXPECT_NEAR(log.specific_force[2].time_s[2], 0.002, 1e-12) << "from the first record on";
    EXPECT_NEAR(log.specific_force[2].values[1], 1.125 * 9.80665, 1e-9);
    EXPECT_NEAR(log.specific_force[1].values[2], 0.125 * 9.80665, 1e-9);
    EXPECT_NEAR(log.angular_rate[0].values[0], M_PI / 2, 1e-9);
    ASSERT_EQ(log.command.size(), 2u);
    EXPECT_NEAR(log.command[0].values[0], 0.2, 1e-12);
    EXPECT_NEAR(log.command[1].values[0], 0.6, 1e-12);
    EXPECT_THAT(log.voltage.values, ElementsAre(3.75));
    EXPECT_THAT(log.height.values, ElementsAre(1.25));
    EXPECT_EQ(words_of(log), "");
  }
}

TEST(CardLog, NamesACrcThatIsNotThatOfItsBytes) {
  std::string bytes = flight(5);
  bytes[bytes.size() - 30] ^= 1;
  const FlightLog log = parse_flight(bytes, "log10");
  EXPECT_EQ(log.specific_force[2].values.size(), 5u);
  EXPECT_THAT(words_of(log), HasSubstr("warning: the CRC-32 at the log's end is not that of its bytes"));
}

TEST(CardLog, ReadsUpToARecordOfAnUnknownKind) {
  CardLogWriter log(2, kKinds);
  log.record(0xFFFF, 1000, fast(0)).record(8, 2000, fast(0)).record(0xFFFF, 3000, fast(0));
  const FlightLog read = parse_flight(log.bytes(), "log10");
  EXPECT_EQ(read.specific_force[2].values.size(), 1u);
  EXPECT_THAT(words_of(read), HasSubstr("cannot be read, from byte"));
}

TEST(CardLog, NamesGapsAndASensorAtTheEndOfItsRange) {
  CardLogWriter log(2, kKinds);
  std::mt19937 dice(1);
  std::normal_distribution<float> noise(0, 1);
  std::uint64_t us = 0;
  for (int k = 0; k < 2000; ++k) {
    us += k == 700 || k == 900 ? 30'000 : 1000;
    const float z = 1 + 0.01f * noise(dice) + (k > 1000 && k < 1100 ? 20.f : 0.f);
    log.record(0xFFFF, us,
               LogBytes()
                   .single(noise(dice))
                   .single(noise(dice))
                   .single(std::min(z, 16.f))
                   .single(noise(dice))
                   .single(noise(dice))
                   .single(noise(dice))
                   .whole<std::uint16_t>(0)
                   .whole(0u));
  }
  const FlightLog read = parse_flight(log.bytes(), "log10");
  EXPECT_THAT(words_of(read),
              HasSubstr("specific_force: 2 gaps of more than 5 periods of 0.001 s, 0.03 s at most, at 0.699 s"));
  EXPECT_THAT(words_of(read), HasSubstr("specific_force 3: 99 values stay at 156.9, the end of its range"));
  EXPECT_THAT(words_of(read), testing::Not(HasSubstr("specific_force 1")));
}

TEST(CardLog, NamesAxesThatLookWrong) {
  const auto at_rest = [](float x, float z) {
    CardLogWriter log(2, kKinds);
    for (std::uint64_t k = 0; k < 50; ++k)
      log.record(0xFFFF, 1000 * k,
                 LogBytes()
                     .single(x + 1e-3f * static_cast<float>(k % 3))
                     .single(1e-3f * static_cast<float>(k % 2))
                     .single(z + 1e-3f * static_cast<float>(k % 4))
                     .single(static_cast<float>(k))
                     .single(static_cast<float>(k))
                     .single(static_cast<float>(k))
                     .whole<std::uint16_t>(0)
                     .whole(0u));
    return words_of(parse_flight(log.bytes(), "log10"));
  };
  EXPECT_EQ(at_rest(0, 1), "");
  EXPECT_THAT(at_rest(0, -1), HasSubstr("z points down; say frame FRD"));
  EXPECT_THAT(at_rest(1, 0), HasSubstr("another axis is up"));
  EXPECT_THAT(at_rest(0, 9.8f), HasSubstr("check the unit and the axes"));
}

TEST(CardLog, RefusesByOneLine) {
  const auto words = [](const std::string& bytes) { return refusal([&] { return parse_flight(bytes, "log10"); }); };
  EXPECT_THAT(words(CardLogWriter(3, kKinds).bytes()), HasSubstr("log10: a Crazyflie card log of version 3"));
  EXPECT_THAT(words(CardLogWriter(2, {{1, "a", {"acc.x(y)"}}}).bytes()), HasSubstr("\"acc.x(y)\" has no type"));
  EXPECT_THAT(words(CardLogWriter(2, {{1, "a", {"x"}}}).bytes()), HasSubstr("\"x\" has no type"));
  EXPECT_THAT(
      words(CardLogWriter(2, std::vector<CardLogWriter::Kind>(3, {1, "a", std::vector<std::string>(60'000, "a(f)")}))
                .bytes()),
      HasSubstr("more than 100000 variables"));
}

TEST(CardLog, CutAtAnyByteGivesTheRecordsBeforeTheCut) {
  const std::string bytes = flight(4);
  const std::size_t description = CardLogWriter(2, kKinds).bytes().size() - 4;
  for (std::size_t n = 1; n < bytes.size(); ++n) {
    const std::string_view cut = std::string_view(bytes).substr(0, n);
    if (n < description) {
      EXPECT_THAT(refusal([&] { return parse_flight(cut, "log10"); }), HasSubstr("ends in the description")) << n;
      continue;
    }
    const FlightLog log = parse_flight(cut, "log10");
    EXPECT_LE(log.specific_force[2].values.size(), 4u);
    if (n >= description + 4) {
      EXPECT_THAT(words_of(log), HasSubstr("CRC-32")) << n;
    }
    for (std::size_t k = 0; k < log.specific_force[2].values.size(); ++k)
      EXPECT_NEAR(log.specific_force[2].values[k], (1 + 0.125 * static_cast<double>(k)) * 9.80665, 1e-5);
  }
}

TEST(CardLog, WithFlippedBitsIsReadOrRefused) {
  const std::string bytes = flight(6);
  std::size_t read = 0;
  for (unsigned seed = 0; seed < 3000; ++seed) {
    std::mt19937 dice(seed);
    std::string flipped = bytes;
    for (unsigned flips = 0; flips <= seed % 3; ++flips)
      flipped[1 + dice() % (bytes.size() - 1)] ^= static_cast<char>(1u << dice() % 8);
    try {
      const FlightLog log = parse_flight(flipped, "log10");
      ++read;
      EXPECT_NE(words_of(log), "") << seed;
      EXPECT_TRUE(std::ranges::is_sorted(log.specific_force[0].time_s)) << seed;
    } catch (const ConfigurationError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << seed;
    }
  }
  EXPECT_GT(read, 1000u);
}

}  // namespace card_log_test
}  // namespace kphi::fit
