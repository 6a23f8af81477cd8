#include "drivers/sim/usb/bme280.hpp"

#include <gtest/gtest.h>

namespace kphi::sim::bme280_test {

using namespace std::chrono_literals;

std::uint32_t twenty(Bme280& sensor, std::uint8_t at, Instant now) {
  return static_cast<std::uint32_t>(sensor.peek(at, now) << 12 |
                                    sensor.peek(static_cast<std::uint8_t>(at + 1), now) << 4 |
                                    sensor.peek(static_cast<std::uint8_t>(at + 2), now) >> 4);
}

void write(Bme280& sensor, std::initializer_list<std::uint8_t> bytes, Instant now) {
  sensor.write(std::span(bytes.begin(), bytes.size()), now);
}

/// Both kinds of oversampling 16 times, forced.
void measure(Bme280& sensor, Instant now) {
  write(sensor, {0xF2, 0x05}, now);
  write(sensor, {0xF4, 0xB5}, now);
}

TEST(SimulatedBme280, LeavesTheCountsOfTheDataSheetsExample) {
  // t_fine 128422 and 25767233/256 Pa belong to 519888 and 415148.
  Bme280 sensor({128422 / 5120.0, 25767233 / 256.0, 0.2241});
  measure(sensor, 10ms);
  EXPECT_NEAR(twenty(sensor, 0xFA, 200ms), 519888, 1);
  EXPECT_NEAR(twenty(sensor, 0xF7, 200ms), 415148, 1);
  EXPECT_NEAR(sensor.peek(0xFD, 200ms) << 8 | sensor.peek(0xFE, 200ms), 25000, 2) << "22.41 %RH at that temperature";
}

TEST(SimulatedBme280, CopiesItsCalibrationAfterAReset) {
  Bme280 sensor;
  write(sensor, {0xE0, 0xB6}, 10ms);
  EXPECT_EQ(sensor.peek(0xF3, 11ms) & 1, 1);
  EXPECT_EQ(sensor.peek(0x88, 11ms), 0) << "not copied yet";
  EXPECT_EQ(sensor.peek(0xF3, 13ms) & 1, 0);
  EXPECT_EQ(sensor.peek(0x88, 13ms) | sensor.peek(0x89, 13ms) << 8, 27504);
  EXPECT_EQ(sensor.peek(0xE4, 13ms) << 4 | (sensor.peek(0xE5, 13ms) & 15), 326);
  EXPECT_EQ(sensor.peek(0xE6, 13ms) << 4 | sensor.peek(0xE5, 13ms) >> 4, 50);
  EXPECT_EQ(sensor.peek(0xD0, 11ms), 0x60) << "who it is needs no copy";
}

TEST(SimulatedBme280, MeasuresForAsLongAsItTakes) {
  Bme280 sensor;
  measure(sensor, 10ms);
  EXPECT_EQ(sensor.peek(0xF3, 100ms) & 8, 8);
  EXPECT_EQ(twenty(sensor, 0xFA, 100ms), 0x80000u) << "the last value stays until the new one is whole";
  EXPECT_EQ(sensor.peek(0xF3, 123ms) & 8, 0) << "1.25 + 48 × 2.3 + 2 × 0.575 = 112.8 ms";
  EXPECT_NE(twenty(sensor, 0xFA, 123ms), 0x80000u);
  EXPECT_EQ(sensor.peek(0xF4, 123ms) & 3, 0) << "forced mode ends in sleep";
}

TEST(SimulatedBme280, HearsOfHumidityOnlyWithTheNextWriteOfMeasureControl) {
  Bme280 sensor;
  write(sensor, {0xF4, 0xB5}, 10ms);
  write(sensor, {0xF2, 0x05}, 10ms);
  EXPECT_EQ(sensor.peek(0xFD, 200ms) << 8 | sensor.peek(0xFE, 200ms), 0x8000) << "the wrong order";
  write(sensor, {0xF4, 0xB5}, 200ms);
  EXPECT_NE(sensor.peek(0xFD, 400ms) << 8 | sensor.peek(0xFE, 400ms), 0x8000);
}

TEST(SimulatedBme280, SkipsWhatIsNotAskedFor) {
  Bme280 sensor;
  write(sensor, {0xF2, 0x00}, 10ms);
  write(sensor, {0xF4, 0xA1}, 10ms);  // temperature alone
  EXPECT_NE(twenty(sensor, 0xFA, 200ms), 0x80000u);
  EXPECT_EQ(twenty(sensor, 0xF7, 200ms), 0x80000u);
  EXPECT_EQ(sensor.peek(0xFD, 200ms), 0x80);
}

TEST(SimulatedBme280, ReadsOnFromWhereItWasPointed) {
  Bme280 sensor;
  write(sensor, {0xD0}, 10ms);
  EXPECT_EQ(sensor.read(10ms), 0x60);
  EXPECT_EQ(sensor.pointer(), 0xD1);
}

TEST(SimulatedBme280, TakesSeveralRegistersInOneWrite) {
  Bme280 sensor;
  write(sensor, {0xF2, 0x05, 0xF4, 0xB5}, 10ms);
  EXPECT_EQ(sensor.peek(0xF2, 10ms), 0x05);
  EXPECT_EQ(sensor.peek(0xF4, 10ms), 0xB5);
}

}  // namespace kphi::sim::bme280_test
