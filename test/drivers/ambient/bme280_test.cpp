#include "drivers/ambient/bme280.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace kphi::ambient::bme280 {
namespace bme280_test {

/// BMP280 data sheet, 3.12.
Calibration data_sheet() {
  Calibration c;
  c.t1 = 27504, c.t2 = 26435, c.t3 = -1000;
  c.p1 = 36477, c.p2 = -10685, c.p3 = 3024, c.p4 = 2855, c.p5 = 140, c.p6 = -7, c.p7 = 15500, c.p8 = -14600,
  c.p9 = 6000;
  c.h1 = 75, c.h2 = 362, c.h3 = 0, c.h4 = 326, c.h5 = 50, c.h6 = 30;
  return c;
}

TEST(Bme280, CompensatesTheDataSheetsExample) {
  const Measured measured = compensate({415148, 519888, 0x8000}, data_sheet());
  EXPECT_EQ(measured.temperature_centi_c, 2508);
  EXPECT_EQ(measured.pressure_256th_pa, 25767233u) << "what the published formula yields; the sheet prints 25767236";
  EXPECT_DOUBLE_EQ(measured.temperature_c(), 25.08);
  EXPECT_NEAR(measured.pressure_pa(), 100653.25, 0.01);
}

TEST(Bme280, CompensatesHumidity) {
  const auto humidity = [](std::uint32_t raw) {
    return compensate({415148, 519888, raw}, data_sheet()).humidity_1024th_rh;
  };
  EXPECT_EQ(humidity(25000), 22945u);
  EXPECT_EQ(humidity(32768), 67325u);
  EXPECT_EQ(humidity(20000), 0u);
  EXPECT_EQ(humidity(40000), 102400u);
  EXPECT_NEAR(compensate({415148, 519888, 32768}, data_sheet()).relative_humidity(), 0.6575, 1e-4);
}

/// The formulas of the BMP280's data sheet in floating point (appendix 8.1), for comparison.
struct InDoubles {
  double temperature_c, pressure_pa;
};
InDoubles in_doubles(const Raw& raw, const Calibration& c) {
  const double at = raw.temperature, ap = raw.pressure;
  const double first = (at / 16384 - c.t1 / 1024.0) * c.t2;
  const double offset = at / 131072 - c.t1 / 8192.0;
  const double fine = first + offset * offset * c.t3;
  double v1 = fine / 2 - 64000, v2 = v1 * v1 * c.p6 / 32768;
  v2 = (v2 + v1 * c.p5 * 2) / 4 + c.p4 * 65536.0;
  v1 = (c.p3 * v1 * v1 / 524288 + c.p2 * v1) / 524288;
  v1 = (1 + v1 / 32768) * c.p1;
  double p = (1048576 - ap - v2 / 4096) * 6250 / v1;
  p += (c.p9 * p * p / 2147483648.0 + p * c.p8 / 32768 + c.p7) / 16;
  return {fine / 5120, p};
}

TEST(Bme280, AgreesWithTheFloatingPointFormulasEverywhereInRange) {
  std::mt19937 random(11);
  std::uniform_int_distribution<std::uint32_t> temperature(420000, 620000), pressure(250000, 560000);
  for (int i = 0; i < 10000; ++i) {
    const Raw raw{pressure(random), temperature(random), 30000};
    const Measured measured = compensate(raw, data_sheet());
    const InDoubles expected = in_doubles(raw, data_sheet());
    ASSERT_NEAR(measured.temperature_c(), expected.temperature_c, 0.011);
    ASSERT_NEAR(measured.pressure_pa(), expected.pressure_pa, 1.0);
  }
}

TEST(Bme280, ReadsItsCalibrationWithSigns) {
  const std::array<std::uint8_t, 24> first{0x70, 0x6B, 0x43, 0x67, 0x18, 0xFC, 0x7D, 0x8E, 0x43, 0xD6, 0xD0, 0x0B,
                                           0x27, 0x0B, 0x8C, 0x00, 0xF9, 0xFF, 0x8C, 0x3C, 0xF8, 0xC6, 0x70, 0x17};
  // h4 = 326 = 0x146, h5 = 50 = 0x032: E4 = 0x14, E5 = 0x26, E6 = 0x03.
  const std::array<std::uint8_t, 7> second{0x6A, 0x01, 0x00, 0x14, 0x26, 0x03, 0x1E};
  EXPECT_EQ(calibration_of(first, 75, second), data_sheet());
  const std::array<std::uint8_t, 7> negative{0, 0, 0, 0xFF, 0x1E, 0x80, 0xFF};
  const Calibration c = calibration_of(first, 75, negative);
  EXPECT_EQ(c.h4, -2);
  EXPECT_EQ(c.h5, -2047);
  EXPECT_EQ(c.h6, -1);
}

TEST(Bme280, RefusesACalibrationThatNoSensorHas) {
  EXPECT_EQ(refusal_of(data_sheet()), "");
  EXPECT_NE(refusal_of(Calibration{}), "");
  std::array<std::uint8_t, 24> ones{};
  ones.fill(0xFF);
  EXPECT_NE(refusal_of(calibration_of(ones, 0xFF, std::array<std::uint8_t, 7>{255, 255, 255, 255, 255, 255, 255})), "");
}

TEST(Bme280, TakesTheResetValueForNoMeasurement) {
  const std::array<std::uint8_t, 8> data{0x65, 0x5A, 0xC0, 0x7E, 0xED, 0x00, 0x80, 0x01};
  EXPECT_EQ(raw_of(data), (Raw{415148, 519888, 0x8001}));
  EXPECT_TRUE(complete(raw_of(data)));
  EXPECT_FALSE(complete({0x80000, 519888, 30000}));
  EXPECT_FALSE(complete({415148, 0x80000, 30000}));
  EXPECT_FALSE(complete({415148, 519888, 0x8000}));
}

TEST(Bme280, IsDefinedForAnyBytes) {
  std::mt19937_64 random(13);
  for (int i = 0; i < 200000; ++i) {
    std::array<std::uint8_t, 24> first;
    std::array<std::uint8_t, 7> second;
    std::array<std::uint8_t, 8> data;
    for (auto* bytes : {first.data(), second.data(), data.data()}) {
      const std::size_t n = bytes == first.data() ? 24 : bytes == second.data() ? 7 : 8;
      for (std::size_t k = 0; k < n; ++k) bytes[k] = static_cast<std::uint8_t>(random());
    }
    const Measured measured =
        compensate(raw_of(data), calibration_of(first, static_cast<std::uint8_t>(random()), second));
    ASSERT_LE(measured.humidity_1024th_rh, 102400u);
  }
}

}  // namespace bme280_test
}  // namespace kphi::ambient::bme280
