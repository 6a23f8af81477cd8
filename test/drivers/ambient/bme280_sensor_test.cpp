#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>

#include "drivers/ambient/bme280.hpp"
#include "test/drivers/ambient/fake_bridge.hpp"
#include "test/refusal.hpp"

namespace kphi::ambient {
namespace bme280_sensor_test {

using testing::HasSubstr;

class Bme280SensorTest : public testing::Test {
 protected:
  FakeBridge usb;
  Mcp2221 bridge{usb, no_pause};

  Bme280Sensor sensor() { return Bme280Sensor(bridge, usb.name(), no_pause); }
  std::string refusal() {
    return kphi::refusal([&] { return sensor().read(); });
  }
};

TEST_F(Bme280SensorTest, MeasuresTheAirWithItsTolerances) {
  Bme280Sensor measured = sensor();
  const Air air = measured.read();
  EXPECT_DOUBLE_EQ(air.temperature_c, 25.08);
  EXPECT_NEAR(air.pressure_pa, 100653.25, 0.01);
  EXPECT_NEAR(air.relative_humidity, 0.51, 0.05);
  EXPECT_NEAR(air.u_temperature_c, 0.577, 1e-3);
  EXPECT_NEAR(air.u_pressure_pa, 57.7, 0.1);
  EXPECT_NEAR(air.u_relative_humidity, 0.0173, 1e-4);
  EXPECT_EQ(measured.identity(), "BME280 at 0x76 behind USB device 04d8:00dd, serial 0001");
}

TEST_F(Bme280SensorTest, WritesHumidityControlBeforeMeasureControl) {
  (void)sensor().read();
  using Write = std::pair<int, int>;
  EXPECT_THAT(usb.writes, testing::ElementsAre(Write{0xE0, 0xB6}, Write{0xE0, 0xB6}, Write{0xF5, 0}, Write{0xF2, 5},
                                               Write{0xF4, 0xB5}));
}

TEST_F(Bme280SensorTest, IsFoundAtItsSecondAddress) {
  usb.sensor_address = 0x77;
  EXPECT_THAT(sensor().identity(), HasSubstr("0x77"));
}

TEST_F(Bme280SensorTest, RefusesACalibrationThatChangesBetweenTwoReadings) {
  int read = 0;
  usb.spoil = [&](std::vector<std::uint8_t>& answer) {
    if (answer[0] == 0x40 && answer[3] == 24 && ++read == 2) answer[10] ^= 1;
    return false;
  };
  EXPECT_THAT(refusal(), HasSubstr("two readings differ"));
}

TEST_F(Bme280SensorTest, NamesWhatIsNotThere) {
  usb.registers[0xD0] = 0x58;
  EXPECT_THAT(refusal(), HasSubstr("chip id 0x58"));
  usb.sensor_address = 0x10;
  EXPECT_THAT(refusal(), HasSubstr("no device answers"));
}

TEST_F(Bme280SensorTest, RefusesAMeasurementThatIsMissingImpossibleOrEndless) {
  Bme280Sensor measured = sensor();
  const auto refused = [&](const std::function<void(std::vector<std::uint8_t>&)>& change) {
    usb.spoil = [=](std::vector<std::uint8_t>& answer) {
      if (answer[0] == 0x40 && answer[3] == 8) change(answer);
      return false;
    };
    return kphi::refusal([&] { return measured.read(); });
  };
  EXPECT_NE(refused([](auto& answer) { answer[10] = 0x80, answer[11] = 0; }), "") << "a quantity was not measured";
  EXPECT_THAT(refused([](auto& answer) { answer[7] = 0xFF; }), HasSubstr("implausible for air"));
  usb.registers[0xF3] = 0x08;
  EXPECT_THAT(refused([](auto&) {}), HasSubstr("not finished in time"));
}

TEST(SensorAddress, IsThatOfTheBridge) {
  EXPECT_EQ(sensor_address("usb:04d8:00dd"), (UsbAddress{0x04d8, 0x00dd, "", ""}));
  EXPECT_EQ(sensor_address("usb:04D8:00DD:0001AB").serial, "0001AB");
  EXPECT_EQ(sensor_address("usb:04d8:00dd@1-1.4").port_path, "1-1.4");
}

TEST(SensorAddress, RefusesWhatIsNoSensorOfTheAir) {
  for (const char* text : {"", "Unknown", "unknown", "usb:04d8", "usb:0403:6001", "tcp:host:1", "usb:04d8:00de"})
    EXPECT_THROW((void)sensor_address(text), std::invalid_argument) << text;
}

}  // namespace bme280_sensor_test
}  // namespace kphi::ambient
