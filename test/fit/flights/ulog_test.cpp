// ULogs of known content: what is read, in which units and axes, and what becomes of damaged ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "base/error.hpp"
#include "fit/flights/flight_log.hpp"
#include "test/fit/flights/flight_writers.hpp"
#include "test/refusal.hpp"

namespace kphi::fit {
namespace ulog_test {

using test::LogBytes;
using test::UlogWriter;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint64_t kStart = 5'000'000;

void define(UlogWriter& log) {
  log.flags();
  log.format("vehicle_acceleration:uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;uint8_t[4] _padding0;");
  log.format(
      "vehicle_angular_velocity:uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;float[3] xyz_derivative;");
  log.format("sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;");
  // A type that is used before it is defined, with padding inside.
  log.format("esc_status:uint64_t timestamp;uint16_t counter;uint8_t[6] _padding0;esc_report[8] esc;");
  log.format("esc_report:uint64_t timestamp;int32_t esc_rpm;uint8_t actuator_function;uint8_t[3] _padding0;");
  log.format("actuator_motors:uint64_t timestamp;float[12] control;");
  log.format("actuator_servos:uint64_t timestamp;float[8] control;");
  log.format("battery_status:uint64_t timestamp;float voltage_v;");
  log.format("vehicle_air_data:uint64_t timestamp;float rho;");
  log.format("vehicle_local_position:uint64_t timestamp;float z;float vz;float dist_bottom;bool dist_bottom_valid;");
  log.message('I', LogBytes().whole<std::uint8_t>(17).text("char[3] sys_name PX4").bytes);
  const char* topics[] = {"vehicle_acceleration", "vehicle_angular_velocity", "sensor_combined",
                          "esc_status",           "actuator_motors",          "actuator_servos",
                          "battery_status",       "vehicle_air_data",         "vehicle_local_position"};
  for (std::uint16_t id = 0; id < 9; ++id) log.subscribe(id, topics[id]);
  log.subscribe(9, "battery_status", 1);
}

LogBytes at(std::uint64_t us) { return LogBytes().whole(kStart + us); }

LogBytes acceleration(std::uint64_t us, float x, float y, float z) {
  return at(us).whole(kStart + us - 300).single(x).single(y).single(z);
}

/// One millisecond of flight, each topic once; the k-th.
void write_ms(UlogWriter& log, std::uint64_t k) {
  const std::uint64_t us = 1000 * k;
  const auto f = static_cast<float>(k);
  log.data(0, acceleration(us, 0.5f, 0.25f * f, -9.5f - f));
  log.data(1, at(us).whole(kStart + us - 200).single(1 + f).single(2).single(3).single(4).single(5 + f).single(6));
  log.data(2, at(us).single(7).single(7).single(7).single(8).single(8).single(8));
  LogBytes escs = at(us).whole(static_cast<std::uint16_t>(k)).whole<std::uint16_t>(0).whole<std::uint32_t>(0);
  for (int esc = 0; esc < 8; ++esc) {
    const bool there = esc < 4;
    escs.whole(there ? kStart + us - 100 * static_cast<std::uint64_t>(esc) : std::uint64_t{0});
    // The second reports a propeller that turns the other way; each drives the motor of its place.
    escs.whole(there ? (esc == 1 ? -1 : 1) * (6000 + 100 * esc) : 0).whole<std::uint8_t>(there ? 101 + esc : 0);
    escs.whole<std::uint8_t>(0).whole<std::uint16_t>(0);
  }
  log.data(3, escs);
  LogBytes motors = at(us), servos = at(us);
  for (int i = 0; i < 12; ++i)
    motors.single(i == 2 && k == 1 ? kNan : i < 4 ? 0.125f * static_cast<float>(i + 1) : kNan);
  for (int i = 0; i < 8; ++i) servos.single(i == 0 ? -0.5f : 0.25f);
  log.data(4, motors).data(5, servos);
  log.data(6, at(us).single(14.5f)).data(9, at(us).single(3.3f));
  log.data(7, at(us).single(1.125f));
  log.data(8, at(us).single(-2).single(0.5f).single(1.5f).whole<std::uint8_t>(k % 2));
}

std::string flight(
    std::uint64_t ms, void (*before)(UlogWriter&, std::uint64_t) = [](UlogWriter&, std::uint64_t) {}) {
  UlogWriter log(kStart);
  define(log);
  for (std::uint64_t k = 1; k <= ms; ++k) {
    before(log, k);
    write_ms(log, k);
  }
  return log.bytes();
}

FlightLayout arms() {
  return {{{FlightQuantity::arm_angle, 0, "actuator_servos.control[0]", 0.5, 1},
           {FlightQuantity::arm_angle, 1, "actuator_servos.control[1]", -0.5, 0}}};
}

std::vector<std::string> words_of(const FlightLog& log) {
  std::vector<std::string> words;
  for (const Finding& finding : log.findings) words.push_back(finding.line());
  return words;
}

TEST(Ulog, GivesChannelsInOurUnitsAndAxesOnTheirOwnClocks) {
  const FlightLog log = parse_flight(flight(3), "f.ulg", arms());
  EXPECT_EQ(log.format, "PX4 ULog");
  EXPECT_THAT(log.specific_force[0].time_s,
              ElementsAre(DoubleNear(0.0007, 1e-12), DoubleNear(0.0017, 1e-12), DoubleNear(0.0027, 1e-12)));
  EXPECT_THAT(log.specific_force[1].values, ElementsAre(-0.25, -0.5, -0.75));
  EXPECT_THAT(log.specific_force[2].values, ElementsAre(10.5, 11.5, 12.5));
  EXPECT_THAT(log.angular_rate[0].values, ElementsAre(2, 3, 4));
  EXPECT_THAT(log.angular_rate[2].values, ElementsAre(-3, -3, -3));
  EXPECT_THAT(log.angular_acceleration[1].values, ElementsAre(-6, -7, -8));
  ASSERT_EQ(log.rotor_speed.size(), 4u);
  EXPECT_NEAR(log.rotor_speed[1].values[0], 6100 * M_PI / 30, 1e-9);
  EXPECT_NEAR(log.rotor_speed[3].time_s[1], 0.0017, 1e-12);
  ASSERT_EQ(log.command.size(), 4u);
  EXPECT_THAT(log.command[2].values, ElementsAre(0, 0.375, 0.375));
  ASSERT_EQ(log.arm_angle.size(), 2u);
  EXPECT_THAT(log.arm_angle[0].values, ElementsAre(0.75, 0.75, 0.75));
  EXPECT_THAT(log.arm_angle[1].values, ElementsAre(-0.125, -0.125, -0.125));
  EXPECT_THAT(log.voltage.values, ElementsAre(14.5, 14.5, 14.5));
  EXPECT_THAT(log.density.values, ElementsAre(1.125, 1.125, 1.125));
  EXPECT_THAT(log.height.values, ElementsAre(1.5, 1.5)) << "where dist_bottom is valid";
  EXPECT_THAT(log.climb.values, ElementsAre(-0.5, -0.5, -0.5));
  EXPECT_THAT(words_of(log), testing::IsEmpty());
}

TEST(Ulog, TakesTheOlderTopicWhereTheNewerIsMissing) {
  UlogWriter log(kStart);
  define(log);
  log.data(2, at(0).single(1).single(2).single(3).single(4).single(5).single(-6));
  const FlightLog read = parse_flight(log.bytes(), "f.ulg");
  EXPECT_THAT(read.specific_force[2].values, ElementsAre(6));
  EXPECT_THAT(read.angular_rate[1].values, ElementsAre(-2));
}

TEST(Ulog, TakesTheOlderTopicWhereTheNewerWasLoggedSeldom) {
  const auto read = [](int older) {
    UlogWriter log(kStart);
    define(log);
    log.data(0, acceleration(500, 0, 0, -9));
    for (int k = 0; k < older; ++k)
      log.data(2,
               at(1000 * static_cast<std::uint64_t>(k)).single(0).single(0).single(0).single(0).single(0).single(-8));
    return parse_flight(log.bytes(), "f.ulg").specific_force[2].values;
  };
  EXPECT_THAT(read(2), ElementsAre(9));
  EXPECT_THAT(read(3), ElementsAre(8, 8, 8));
}

TEST(Ulog, PutsASpeedToTheMotorThatTheControllerNames) {
  UlogWriter log(kStart);
  define(log);
  LogBytes escs = at(1000).whole<std::uint64_t>(0);
  for (int esc = 0; esc < 8; ++esc)
    escs.whole(esc < 2 ? kStart + 1000 : std::uint64_t{0})
        .whole(esc < 2 ? 3000 * (esc + 1) : 0)
        .whole<std::uint8_t>(esc == 0   ? 102
                             : esc == 1 ? 101
                                        : 0)
        .whole<std::uint8_t>(0)
        .whole<std::uint16_t>(0);
  log.data(3, escs);
  const FlightLog read = parse_flight(log.bytes(), "f.ulg");
  ASSERT_EQ(read.rotor_speed.size(), 2u);
  EXPECT_NEAR(read.rotor_speed[0].values.at(0), 6000 * M_PI / 30, 1e-9);
  EXPECT_NEAR(read.rotor_speed[1].values.at(0), 3000 * M_PI / 30, 1e-9);
}

TEST(Ulog, ReadsAnInstanceThatTheLayoutNames) {
  const FlightLog log =
      parse_flight(flight(2), "f.ulg", {{{FlightQuantity::voltage, 0, "battery_status:1.voltage_v"}}});
  ASSERT_EQ(log.voltage.values.size(), 2u);
  EXPECT_NEAR(log.voltage.values[0], 3.3, 1e-6);
}

TEST(Ulog, NamesWhatTheLayoutWantsAndTheLogLacks) {
  const FlightLog log = parse_flight(flight(2), "f.ulg", {{{FlightQuantity::arm_angle, 1, "my_arms.angle[1]"}}});
  EXPECT_TRUE(log.arm_angle.empty());
  EXPECT_THAT(words_of(log), testing::Contains(HasSubstr("\"my_arms.angle[1]\" of the layout is not in the log")));
}

TEST(Ulog, NamesDropoutsAndTimesThatStepBack) {
  const FlightLog log = parse_flight(flight(40,
                                            [](UlogWriter& writer, std::uint64_t k) {
                                              if (k == 10) writer.dropout(120).dropout(80);
                                              if (k == 30) writer.data(0, acceleration(3000, 0, 0, -9));
                                            }),
                                     "f.ulg");
  EXPECT_EQ(log.specific_force[2].values.size(), 40u);
  EXPECT_THAT(words_of(log), testing::Contains(HasSubstr("dropped messages 2 times, 0.2 s together, 0.12 s at most")));
  EXPECT_THAT(words_of(log),
              testing::Contains(HasSubstr("vehicle_acceleration.xyz[2]: 1 of 41 values have a time before")));
}

TEST(Ulog, ReadsOnBehindDamageFromTheNextMarkOn) {
  const std::string bytes = flight(30, [](UlogWriter& writer, std::uint64_t k) {
    if (k == 10) writer.raw("\xFF\xFF\x44 what a card forgot");
    if (k == 12) writer.sync();
  });
  const FlightLog log = parse_flight(bytes, "f.ulg");
  EXPECT_EQ(log.specific_force[2].values.size(), 28u);
  EXPECT_THAT(words_of(log), testing::Contains(HasSubstr("1 damaged parts")));
}

TEST(Ulog, ReadsWhatWasAppendedToALogThatEndsInAMessage) {
  UlogWriter whole(kStart), appended(kStart);
  define(whole);
  write_ms(whole, 1);
  std::string begin = whole.bytes();
  begin += std::string("\x30\x00\x44\x00", 4);  // 48 bytes of data are announced, one comes
  appended.data(0, acceleration(7000, 0, 0, -8));
  const std::string behind = appended.bytes().substr(16);
  // The flags are the first message: their payload begins 3 bytes behind the header of 16.
  const std::string offset = LogBytes().whole<std::uint64_t>(begin.size()).bytes;
  begin[16 + 3 + 8] = 1;
  begin.replace(16 + 3 + 16, 8, offset);
  EXPECT_THAT(parse_flight(begin + behind, "f.ulg").specific_force[2].values, ElementsAre(10.5, 8));
}

TEST(Ulog, IgnoresMessagesOfLaterVersions) {
  const FlightLog log = parse_flight(
      flight(3, [](UlogWriter& writer, std::uint64_t) { writer.message('Z', "of a later version"); }), "f.ulg");
  EXPECT_EQ(log.specific_force[2].values.size(), 3u);
  EXPECT_THAT(words_of(log), testing::IsEmpty());
}

TEST(Ulog, RefusesByOneLine) {
  UlogWriter incompatible(kStart), circle(kStart), missing(kStart), huge(kStart), odd_clock(kStart);
  incompatible.flags(2);
  circle.flags().format("vehicle_acceleration:uint64_t timestamp;a b;float[3] xyz;").format("a:b c;").format("b:a c;");
  circle.subscribe(0, "vehicle_acceleration");
  missing.flags().format("vehicle_acceleration:uint64_t timestamp;nowhere b;float[3] xyz;");
  missing.subscribe(0, "vehicle_acceleration");
  huge.flags().format("vehicle_acceleration:uint64_t timestamp;a[60000] b;float[3] xyz;").format("a:double[60000] c;");
  huge.subscribe(0, "vehicle_acceleration");
  odd_clock.flags()
      .format("vehicle_acceleration:uint32_t timestamp;float[3] xyz;")
      .subscribe(0, "vehicle_acceleration");
  const auto words = [](const UlogWriter& log) { return refusal([&] { return parse_flight(log.bytes(), "f.ulg"); }); };
  EXPECT_THAT(words(incompatible), HasSubstr("f.ulg: a ULog with features that kphi does not know"));
  EXPECT_THAT(words(circle), HasSubstr("nested too deeply or in itself"));
  EXPECT_THAT(words(missing), HasSubstr("\"nowhere\" is not defined"));
  EXPECT_THAT(words(huge), HasSubstr("more than 65,535 bytes"));
  EXPECT_THAT(words(odd_clock), HasSubstr("no timestamp of 64 bits"));
}

TEST(Ulog, CutAtAnyByteGivesTheMessagesBeforeTheCut) {
  const std::string bytes = flight(2);
  for (std::size_t n = 7; n < bytes.size(); ++n) {
    try {
      const FlightLog log = parse_flight(std::string_view(bytes).substr(0, n), "f.ulg");
      EXPECT_LE(log.specific_force[2].values.size(), 2u);
      for (const double value : log.specific_force[2].values) EXPECT_GE(value, 10.5);
    } catch (const ConfigurationError& error) {
      EXPECT_LT(n, 16u) << error.what();
    }
  }
}

TEST(Ulog, WithFlippedBitsIsReadOrRefused) {
  const std::string bytes = flight(5);
  std::size_t read = 0;
  for (unsigned seed = 0; seed < 3000; ++seed) {
    std::mt19937 dice(seed);
    std::string flipped = bytes;
    for (unsigned flips = 0; flips <= seed % 4; ++flips)
      flipped[7 + dice() % (bytes.size() - 7)] ^= static_cast<char>(1u << dice() % 8);
    try {
      const FlightLog log = parse_flight(flipped, "f.ulg", arms());
      ++read;
      for (const FlightChannel& channel : log.specific_force) {
        ASSERT_EQ(channel.time_s.size(), channel.values.size());
        EXPECT_LE(channel.values.size(), 5u);
        EXPECT_TRUE(std::ranges::is_sorted(channel.time_s)) << seed;
        EXPECT_TRUE(std::ranges::all_of(channel.values, [](double value) { return std::isfinite(value); })) << seed;
      }
    } catch (const ConfigurationError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << seed;
    }
  }
  EXPECT_GT(read, 2000u);
}

}  // namespace ulog_test
}  // namespace kphi::fit
