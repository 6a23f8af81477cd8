// The program on a bench whose supply and sensor of the air are on USB: true libusb in the program, simulated devices
// on a virtual bus that it inherits from this test.
#include <gmock/gmock.h>

#include "drivers/ambient/air.hpp"
#include "drivers/sim/usb/mcp2221.hpp"
#include "results/run_reader.hpp"
#include "test/drivers/sim_equipment/usbtmc.hpp"
#include "test/drivers/usb/virtual_bus.hpp"
#include "test/end_to_end/running_bench.hpp"

namespace kphi::test::usb_bench_test {

using testing::HasSubstr;

constexpr double kPrompt = 200;  // ms
constexpr int kSupplySocket = 1, kSensorSocket = 2;
constexpr const char* kDevices =
    "supply: {uri: \"scpi-usb:1209:5c91\", voltage_v: 12, current_limit_a: 8, over_voltage_v: 14, over_current_a: 9}\n"
    "ambient: usb:04d8:00dd:0001\n";

class UsbBench : public OnVirtualBus {
 protected:
  void SetUp() override {
    OnVirtualBus::SetUp();
    if (IsSkipped()) return;
    instrument.connect_load(6);
    wire->plug(kSupplySocket, supply);
    wire->plug(kSensorSocket, sensor);
    bench.emplace(Manner{1});
    write(bench->path("short.yaml"), short_campaign_text("0", 1, 4));
    write(bench->path("usb.yaml"), bytes_of(bench->path("bench.yaml")) + kDevices);
  }
  [[nodiscard]] std::vector<std::string> run_command() const {
    return in_real_time({kphi(), "run", bench->path("short.yaml"), "--bench", bench->path("usb.yaml"), "--yes", "--out",
                         bench->path("results")});
  }
  [[nodiscard]] results::RunRecording recording(const std::string& ending) const {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(bench->path("results"))) {
      if (entry.path().string().ends_with(ending)) return results::read_run(entry.path());
    }
    ADD_FAILURE() << "no file ..." << ending;
    return {};
  }
  [[nodiscard]] Ended devices(const char* file, int exit_code = 0) const {
    return ran({kphi(), "devices", "--bench", bench->path(file)}, exit_code);
  }

  sim::TrueAir truth{21.37, 98'765, 0.43};
  sim::ScpiInstrument instrument;
  sim::Usbtmc supply{instrument, faults};
  sim::Mcp2221 sensor{faults, "0001", sim::Bme280(truth)};
  std::optional<RunningBench> bench;
};

TEST_F(UsbBench, IsListedWithWhoIsThereAndWhatItShows) {
  EXPECT_THAT(devices("usb.yaml").out, testing::AllOf(HasSubstr("supply scpi-usb:1209:5c91: SIM3010"),
                                                      HasSubstr("ambient usb:04d8:00dd:0001: BME280"),
                                                      HasSubstr("21.37 °C, 987.6 hPa, 43.0 % humidity: air 1.16")));
}

TEST_F(UsbBench, ListsWhatTheBenchFileDoesNotName) {
  EXPECT_THAT(devices("bench.yaml").out,
              testing::AllOf(HasSubstr("found  SCPI scpi-usb:1209:5c91:SN0001: KPHI,SIM3010,SN0001,1.00"),
                             HasSubstr("found  ambient usb:04d8:00dd:0001: BME280")));
}

TEST_F(UsbBench, SaysWhatIsMissingAndExitsWithThree) {
  wire->unplug(kSensorSocket);
  EXPECT_THAT(devices("usb.yaml", 3).out, HasSubstr("ambient usb:04d8:00dd:0001: does not answer\n"));
  EXPECT_THAT(ran(run_command(), 3).err, HasSubstr("04d8:00dd"));
  EXPECT_FALSE(instrument.state().output);
}

TEST_F(UsbBench, RecordsPowerAndAir) {
  (void)ran(run_command());
  const results::RunRecording kept = recording("rep1.h5");
  const auto air = ambient::density_of({truth.temperature_c, truth.pressure_pa, truth.relative_humidity, 0, 0, 0});
  EXPECT_NEAR(kept.header.air_density_kg_m3, air.kg_m3, 1e-4);
  EXPECT_GT(kept.header.air_density_u_kg_m3, 1e-4);
  EXPECT_THAT(kept.header.supply_identity, HasSubstr("SIM3010"));
  ASSERT_GT(kept.supply.size(), 8u);
  for (const auto& seen : kept.supply) {
    EXPECT_DOUBLE_EQ(seen.voltage_v, 12);
    EXPECT_DOUBLE_EQ(seen.current_a, 2);
    EXPECT_EQ(seen.output, 1u);
  }
  EXPECT_FALSE(instrument.state().output);
}

TEST_F(UsbBench, CoastsWithinAFifthOfASecondWhenTheSupplyIsPulledOut) {
  Process run(run_command());
  run.wait_for("step  1/");
  const double cause_ms = bench->time_ms();
  wire->unplug(kSupplySocket);
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("supply"));
  const Account account = bench->account();
  EXPECT_EQ(account.stage_at(cause_ms), "drive");
  EXPECT_LE(account.coasts_at() - cause_ms, kPrompt) << run.err();
  const results::RunRecording kept = recording("aborted.h5");
  EXPECT_GT(kept.load_cell.size(), 3000u);
  EXPECT_THAT(kept.outcome_reason, HasSubstr("supply"));
  ASSERT_FALSE(kept.events.empty());
  EXPECT_EQ(kept.events.back().kind, EventKind::supply_stop);
  EXPECT_THAT(kept.events.back().text, HasSubstr("step 2"));
}

TEST_F(UsbBench, IsSwitchedOffByTheSentinelWhenTheProgramIsKilled) {
  Process run(run_command());
  ASSERT_TRUE(bench->await_speed(500)) << run.err();
  ASSERT_TRUE(instrument.state().output);
  run.signal(SIGKILL);
  const auto killed = std::chrono::steady_clock::now();
  EXPECT_TRUE(soon([&] { return !instrument.state().output; }, std::chrono::seconds(5)));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - killed;
  fmt::print("off {:.3f} s after the kill\n", took.count());
  EXPECT_LT(took.count(), 1);
  (void)run.wait_for("kphi-sentinel: kphi has died; supply SIM3010");
  EXPECT_EQ(run.wait(), 128 + SIGKILL);
}

}  // namespace kphi::test::usb_bench_test
