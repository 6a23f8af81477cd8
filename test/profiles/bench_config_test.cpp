#include "profiles/bench_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace bench_config_test {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;

std::vector<std::string> refused(const std::string& from, const std::string& to) {
  return refusals([&] { return parse_bench(changed(kBenchText, from, to), "b.yaml"); });
}

/// The shortest bench file, and more.
std::string with_power(const std::string& more) {
  return "format: kphi-bench/1\nname: b\nnetbox: {host: netbox.lab}\niq: {device: /dev/ttyS1, speed_max_rpm: 9000}\n"
         "thrust_axis: +Fz\n" +
         more;
}

TEST(BenchConfig, IsReadWhole) {
  const BenchConfig bench = parse_bench(kBenchText, "b.yaml");
  EXPECT_EQ(bench.name, "bench");
  EXPECT_EQ(bench.netbox.host, "192.168.1.1");
  EXPECT_EQ(bench.netbox.rdt_port, 50000);
  EXPECT_EQ(bench.netbox.http_port, 8080);
  EXPECT_EQ(bench.netbox.rate_hz, 3500);
  EXPECT_EQ(bench.netbox.records_per_datagram, 20);
  EXPECT_EQ(bench.iq.device, "/dev/ttyUSB0");
  EXPECT_EQ(bench.iq.baud, 921600u);
  EXPECT_EQ(bench.iq.module_id, 7);
  EXPECT_EQ(bench.iq.spin, -1);
  EXPECT_EQ(bench.iq.telemetry_hz, 100);
  EXPECT_EQ(bench.iq.speed_max, from_rpm(19300));
  EXPECT_EQ(bench.thrust_axis, 0);
  EXPECT_EQ(bench.thrust_sign, -1);
  ASSERT_TRUE(bench.simulation);
  EXPECT_FALSE(bench.simulation->in_process);
  EXPECT_EQ(bench.simulation->time_scale, 20);
  EXPECT_EQ(bench.simulation->seed, 5u);
  EXPECT_EQ(bench.simulation->control, "/tmp/control");
  EXPECT_EQ(bench.text, kBenchText);
  EXPECT_EQ(bench.path, "b.yaml");
}

TEST(BenchConfig, NeedsOnlyAddressesAxisAndSpeedLimit) {
  const BenchConfig bench = parse_bench(with_power(""), "b.yaml");
  EXPECT_EQ(bench.netbox.rdt_port, 49152);
  EXPECT_EQ(bench.netbox.http_port, 80);
  EXPECT_EQ(bench.netbox.rate_hz, 7000);
  EXPECT_EQ(bench.netbox.records_per_datagram, 40);
  EXPECT_EQ(bench.netbox.tcp_port, 49151);
  EXPECT_FALSE(bench.netbox.settings.rate_hz || bench.netbox.settings.filter_hz);
  EXPECT_EQ(bench.iq.baud, 115200u);
  EXPECT_EQ(bench.iq.module_id, 0);
  EXPECT_EQ(bench.iq.spin, +1);
  EXPECT_EQ(bench.iq.telemetry_hz, 50);
  EXPECT_FALSE(bench.simulation);
  EXPECT_FALSE(bench.supply);
  EXPECT_FALSE(bench.ambient.known());
}

TEST(BenchConfig, KnowsSixThrustAxes) {
  const std::vector<std::string> axes{"+Fx", "-Fx", "+Fy", "-Fy", "+Fz", "-Fz"};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const BenchConfig bench = parse_bench(changed(kBenchText, "-Fx", axes[i]), "b.yaml");
    EXPECT_EQ(bench.thrust_axis, static_cast<int>(i / 2)) << axes[i];
    EXPECT_EQ(bench.thrust_sign, i % 2 == 0 ? +1 : -1) << axes[i];
  }
  EXPECT_THAT(refused("-Fx", "Fz"),
              ElementsAre("16:14: thrust_axis: text \"Fz\" is not allowed; did you mean +Fz? write "
                          "one of +Fx, -Fx, +Fy, -Fy, +Fz, -Fz"));
}

TEST(BenchConfig, EachMistakeEarnsItsRefusal) {
  expect_refusals(
      refused,
      {// Holds ports and identifiers
       {"50000", "0", "5:13: netbox.rdt_port: 0 is below 1; write a value from 1 to 65535"},
       {"8080", "65536", "6:14: netbox.http_port: 65536 is above 65535; write a value from 1 to 65535"},
       {"module_id: 7", "module_id: 63", "12:14: iq.module_id: 63 is above 62; write a value from 0 to 62"},
       {"module_id: 7", "module_id: -1", "12:14: iq.module_id: -1 is below 0…"},
       {"datagram: 20", "datagram: 41", "8:25: netbox.records_per_datagram: 41 is above 40…"},
       {"3500", "7001", "7:12: netbox.rate_hz: 7001 is above 7000 Hz; write a value from 1 to 7000 Hz"},
       // Needs no control line
       {"  control: /tmp/control\n", "", ""},  // of another simulator, which mounts by itself
       {"  control: /tmp/control\n", "  in_process: true\n", ""},
       {"seed: 5", "seed: -5", "19:9: simulation.seed: -5 is below 0…"},
       {"time_scale: 20", "time_scale: 0", "18:15: simulation.time_scale: 0 is below 0.1…"},
       {"  seed: 5\n", "  in_process: yes\n", "19:15: yes is a boolean to some…"},
       // Refuses settings of the box that contradict or do not exist
       {"iq:\n", "  settings: {rate_hz: 7000}\niq:\n",
        "9:23: netbox.settings.rate_hz: 7000 contradicts the 3500 of netbox.rate_hz; write the same, or remove "
        "netbox.rate_hz"},
       {"iq:\n", "  settings: {filter_hz: 100}\niq:\n", "9:25: netbox.settings.filter_hz: 100 is not allowed…"},
       {"iq:\n", "  settings: {configuration: 16}\niq:\n", "9:29: netbox.settings.configuration: 16 is above 15…"},
       {"iq:\n", "  settings: {comnetip: 1}\niq:\n", "9:14: comnetip is not a key of netbox.settings…"},
       // Wants a device that is a path and a host that is a name
       {"/dev/ttyUSB0", "ttyUSB0",
        "10:11: iq.device: text \"ttyUSB0\" does not fit; write a path that begins with /, or "
        "usb:VID:PID[:SERIAL][@PORT] with four hexadecimal digits or * each"},
       {"/dev/ttyUSB0", "usb:403:6001", "10:11: iq.device: text…"},
       {"/dev/ttyUSB0", "usb:0403:6001@here", "10:11: iq.device: text…"},
       {"/dev/ttyUSB0", "usb:0403:6001", ""},
       {"/dev/ttyUSB0", "usb:0403:6001:A10K0000", ""},
       {"/dev/ttyUSB0", "usb:*:*:A10K0000", ""},
       {"/dev/ttyUSB0", "usb:1a86:7523@1-4.2", ""},
       {"/dev/ttyUSB0", "usb:1a86:7523@1-4.2:1.0", ""},
       {"192.168.1.1", "\"http://192.168.1.1\"", "4:9: netbox.host: text \"http://192.168.1.1\" does not fit…"},
       {"192.168.1.1", "\"::1\"", ""},
       // Names the key that was meant
       {"  baud:", "  baud_rate:", "11:3: baud_rate is not a key of iq; known here: accept_without, baud,…"},
       {"rdt_port", "rtd_port", "5:3: rtd_port is not a key of netbox; did you mean rdt_port?"},
       {"speed_max_rpm", "speed_max_rad_s",
        "15:3: speed_max_rad_s is not a key of iq; the unit is part of the key: write speed_max_rpm and "
        "the value in RPM"}});
}

TEST(BenchConfig, NamesDevicesOfOtherDriversInsteadOfNetBoxAndModule) {
  const std::string text =
      "format: kphi-bench/1\nname: other\n"
      "load_cell: {driver: hx711, device: /dev/ttyACM0, baud: 57600, rate_hz: 80, settings: {counts_per_newton: 2e4}}\n"
      "motor: {driver: esc, device: /dev/ttyACM1, spin: -1, speed_max_rpm: 9000, settings: {pole_pairs: 7}}\n"
      "thrust_axis: \"-Fx\"\n";
  const BenchConfig bench = parse_bench(text, "b.yaml");
  ASSERT_TRUE(bench.load_cell && bench.motor);
  EXPECT_EQ(load_cell_words(bench), "hx711 /dev/ttyACM0");
  EXPECT_EQ(motor_words(bench), "esc /dev/ttyACM1");
  EXPECT_EQ(bench.load_cell->baud, 57600u);
  EXPECT_EQ(bench.load_cell->settings.at("counts_per_newton"), 2e4);
  EXPECT_EQ(bench.netbox.rate_hz, 80);
  EXPECT_EQ(bench.netbox.records_per_datagram, 1);
  EXPECT_EQ(bench.iq.device, "/dev/ttyACM1");
  EXPECT_EQ(bench.iq.spin, -1);
  EXPECT_NEAR(to_rpm(bench.iq.speed_max), 9000, 1e-6);
  const auto refused_with = [&](const std::string& more, const std::string& without = "") {
    std::string changed = text;
    if (!without.empty())
      changed.erase(changed.find(without), changed.find('\n', changed.find(without)) + 1 - changed.find(without));
    try {
      (void)parse_bench(changed + more, "b.yaml");
      return std::string();
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
  };
  EXPECT_THAT(refused_with("netbox: {host: 192.168.1.1}\n"), testing::HasSubstr("netbox and load_cell are both given"));
  EXPECT_THAT(refused_with("", "load_cell"), testing::HasSubstr("netbox and load_cell are missing"));
  EXPECT_THAT(refused_with("", "motor"), testing::HasSubstr("iq and motor are missing; write one of them"));
  EXPECT_THAT(refused_with("simulation: {in_process: true}\n"), testing::HasSubstr("has a Net Box and an IQ module"));
}

TEST(BenchConfig, AcceptsByNameWhatAFirmwareMayLack) {
  std::string text = kBenchText;
  text.insert(text.find("  module_id: 7"), "  accept_without: [power_safety]\n");
  EXPECT_THAT(parse_bench(text, "b.yaml").iq.accept_without, testing::ElementsAre("power_safety"));
  text.replace(text.find("[power_safety]"), 14, "[timeout]");
  EXPECT_THROW((void)parse_bench(text, "b.yaml"), RefusedFile);
}

TEST(BenchConfig, KnowsWhereTheBoxSpeaksTcp) {
  EXPECT_EQ(parse_bench(kBenchText, "b.yaml").netbox.tcp_port, 49999) << "one below the port of RDT";
  EXPECT_EQ(parse_bench(changed(kBenchText, "  rate_hz", "  tcp_port: 50017\n  rate_hz"), "b.yaml").netbox.tcp_port,
            50017);
}

TEST(BenchConfig, SaysWhatTheBoxIsToBeSetTo) {
  const BenchConfig bench = parse_bench(
      changed(kBenchText, "iq:\n", "  settings: {rate_hz: 3500, filter_hz: 838, configuration: 2}\niq:\n"), "b.yaml");
  EXPECT_EQ(bench.netbox.settings.rate_hz, 3500);
  EXPECT_EQ(bench.netbox.settings.records_per_datagram, std::nullopt);
  EXPECT_EQ(bench.netbox.settings.filter_hz, 838);
  EXPECT_EQ(bench.netbox.settings.configuration, 2);
  const BenchConfig alone =
      parse_bench(changed(kBenchText, "  rate_hz: 3500\n", "  settings: {rate_hz: 1000}\n"), "b.yaml");
  EXPECT_EQ(alone.netbox.rate_hz, 1000) << "what is set is expected";
}

TEST(BenchConfig, FindsItsFaultScriptBesideItself) {
  const auto text = changed(kBenchText, "  seed: 5\n", "  seed: 5\n  faults: bad_day.yaml\n");
  EXPECT_EQ(parse_bench(text, "/lab/benches/b.yaml").simulation->faults, "/lab/benches/bad_day.yaml");
  EXPECT_EQ(parse_bench(changed(text, "bad_day", "/tmp/bad_day"), "/lab/b.yaml").simulation->faults,
            "/tmp/bad_day.yaml");
  EXPECT_EQ(parse_bench(kBenchText, "b.yaml").simulation->faults, "");
}

TEST(BenchConfig, TakesOnlyStandardBaudRates) {
  for (const char* baud :
       {"9600", "19200", "38400", "57600", "115200", "230400", "460800", "921600", "1000000", "2000000"}) {
    EXPECT_THAT(refused("921600", baud), IsEmpty()) << baud;
  }
  EXPECT_THAT(
      refused("921600", "115201"),
      ElementsAre("11:9: iq.baud: 115201 is not allowed; write one of 9600, 19200, 38400, 57600, 115200, 230400, "
                  "460800, 921600, 1000000, 2000000"));
}

TEST(BenchConfig, SpinsOneWayOrTheOther) {
  EXPECT_THAT(refused("spin: -1", "spin: +1"), IsEmpty());
  for (const char* spin : {"0", "2", "-1.5", "\"+1\""})
    EXPECT_EQ(refused("spin: -1", std::string("spin: ") + spin).size(), 1u) << spin;
}

TEST(BenchConfig, MayKnowTheGainOfTheModulesClock) {
  EXPECT_FALSE(parse_bench(kBenchText, "b.yaml").iq.clock_gain);
  const auto with = [](const std::string& gain) { return "  clock_gain: {" + gain + "}\n  baud:"; };
  const BenchConfig bench =
      parse_bench(changed(kBenchText, "  baud:",
                          with("factor: 1.0050312, u: 3.0e-05, uid: \"002300064d4b501120343353\", measured_utc: "
                               "\"2026-05-01T12:00:00Z\", duration_s: 60.0")),
                  "b.yaml");
  ASSERT_TRUE(bench.iq.clock_gain);
  EXPECT_EQ(bench.iq.clock_gain->factor, 1.0050312);
  EXPECT_EQ(bench.iq.clock_gain->u_factor, 3.0e-5);
  EXPECT_EQ(bench.iq.clock_gain->uid, "002300064d4b501120343353");
  EXPECT_EQ(bench.iq.clock_gain->measured_utc, "2026-05-01T12:00:00Z");
  EXPECT_THAT(refused("  baud:", with("factor: 1.005, u: 1e-5")), IsEmpty());
  EXPECT_THAT(refused("  baud:", with("factor: 5031, u: 1e-5")),
              ElementsAre(StartsWith("11:24: iq.clock_gain.factor: 5031 is above 1.03")));
  EXPECT_THAT(refused("  baud:", with("factor: 1.005")), ElementsAre(testing::HasSubstr("u is missing")));
  EXPECT_THAT(refused("  baud:", with("factor: 1.005, u: 1e-5, uid: \"12\"")),
              ElementsAre(testing::HasSubstr("24 hexadecimal digits")));
}

TEST(BenchConfig, PutsTheCaptureOfTheMotorsLineBesideItself) {
  EXPECT_EQ(parse_bench(kBenchText, "folder/b.yaml").iq.capture, "");
  EXPECT_EQ(parse_bench(changed(kBenchText, "  baud:", "  capture: line.iq\n  baud:"), "folder/b.yaml").iq.capture,
            "folder/line.iq");
}

std::vector<std::string> refused_air(const std::string& ambient) {
  return refusals([&] { return parse_bench(kBenchText + ambient, "b.yaml"); });
}

constexpr const char* kManualAir =
    "ambient:\n"                        // 21
    "  manual:\n"                       // 22
    "    temperature_c: 21.5\n"         // 23
    "    pressure_pa: 98700\n"          // 24
    "    relative_humidity: 0.45\n"     // 25
    "    u_temperature_c: 0.5\n"        // 26
    "    u_pressure_pa: 100\n"          // 27
    "    u_relative_humidity: 0.05\n";  // 28

TEST(BenchConfig, KnowsWhereTheStateOfTheAirComesFrom) {
  EXPECT_FALSE(parse_bench(kBenchText, "b.yaml").ambient.known()) << "absent";
  const auto config = [](const std::string& text) { return parse_bench(kBenchText + text, "b.yaml").ambient; };
  EXPECT_FALSE(config("ambient: unknown\n").known());
  for (const char* sensor : {"usb:04d8:00dd", "usb:04D8:00DD:0001AB", "usb:04d8:00dd@1-1.4", "usb:04d8:00dd:A1@2-3"})
    EXPECT_EQ(config(std::string("ambient: ") + sensor + "\n").sensor, sensor);
  const AmbientConfig placed = config("ambient: {sensor: \"usb:04d8:00dd\", u_temperature_c: 1.5}\n");
  EXPECT_EQ(placed.sensor, "usb:04d8:00dd");
  EXPECT_EQ(placed.u_temperature_c, 1.5);
  EXPECT_TRUE(placed.known());
  EXPECT_THROW((void)config("ambient: {u_temperature_c: 1.5}\n"), RefusedFile);
  EXPECT_THROW((void)config("ambient: {}\n"), RefusedFile);
  const AmbientConfig by_hand = config(kManualAir);
  EXPECT_TRUE(by_hand.known());
  EXPECT_EQ(by_hand.sensor, "");
  ASSERT_TRUE(by_hand.manual);
  EXPECT_EQ(by_hand.manual->temperature_c, 21.5);
  EXPECT_EQ(by_hand.manual->pressure_pa, 98700);
  EXPECT_EQ(by_hand.manual->relative_humidity, 0.45);
  EXPECT_EQ(by_hand.manual->u_temperature_c, 0.5);
  EXPECT_EQ(by_hand.manual->u_pressure_pa, 100);
  EXPECT_EQ(by_hand.manual->u_relative_humidity, 0.05);
}

TEST(BenchConfig, RefusesAirFromNowhere) {
  const std::string advice =
      "write unknown, or usb:04d8:00dd (a BME280 behind an MCP2221A; :SERIAL or @PORT behind it if there are several), "
      "or sensor: and u_temperature_c, or manual: and the values";
  EXPECT_THAT(refused_air("ambient: usb:0403:6001\n"),
              ElementsAre("21:10: ambient: text \"usb:0403:6001\" does not fit; " + advice));
  EXPECT_THAT(refused_air("ambient: 21\n"), ElementsAre("21:10: ambient: 21 does not fit; " + advice));
  for (const char* text : {"Unknown", "usb:04d8:00dd:", "usb:04d8:00dd@", "[]", "\"\""})
    EXPECT_EQ(refused_air(std::string("ambient: ") + text + "\n").size(), 1u) << text;
}

TEST(BenchConfig, WantsAirByHandWholeWithUncertaintiesAndInItsUnits) {
  const auto changed_air = [](const std::string& from, const std::string& to) {
    return refused_air(changed(kManualAir, from, to));
  };
  expect_refusals(
      changed_air,
      {{"    u_pressure_pa: 100\n", "",
        "22:3: ambient.manual.u_pressure_pa is missing; add the key u_pressure_pa (standard uncertainty "
        "of pressure_pa)"},
       {"pressure_pa: 98700", "pressure_hpa: 987",
        "24:5: pressure_hpa is not a key of ambient.manual; the unit is part of the key: write "
        "pressure_pa and the value in Pa"},
       {"98700", "987",
        "24:18: ambient.manual.pressure_pa: 987 is below 50000 Pa; write a value from 50000 to 110000 "
        "Pa"},
       {"0.45", "45", "25:24: ambient.manual.relative_humidity: 45 is above 1…"},
       {"temperature_c: 21.5", "temperature_c: 294.6", "23:20: ambient.manual.temperature_c: 294.6 is above 60 °C…"},
       {"u_temperature_c: 0.5", "u_temperature_c: 0", "26:22: ambient.manual.u_temperature_c: 0 is not above 0…"}});
  EXPECT_EQ(refused_air("ambient: {}\n").size(), 1u);
}

constexpr const char* kSupply =
    "supply: {uri: \"modbus-rtu:/dev/ttyUSB1?model=RD6018\", voltage_v: 12, current_limit_a: 17, over_voltage_v: 14, "
    "over_current_a: 18}\n";

TEST(BenchConfig, KnowsTheSupply) {
  const BenchConfig bench = parse_bench(with_power(kSupply), "b.yaml");
  ASSERT_TRUE(bench.supply);
  EXPECT_EQ(bench.supply->uri, "modbus-rtu:/dev/ttyUSB1?model=RD6018");
  EXPECT_EQ(bench.supply->voltage, Volts(12));
  EXPECT_EQ(bench.supply->current_limit, Amperes(17));
  EXPECT_EQ(bench.supply->over_voltage, Volts(14));
  EXPECT_EQ(bench.supply->over_current, Amperes(18));
}

TEST(BenchConfig, RefusesASupplyThatWouldTripAtOnce) {
  const auto refused_supply = [](const std::string& from, const std::string& to) {
    return refusals([&] { return parse_bench(with_power(changed(kSupply, from, to)), "b.yaml"); });
  };
  EXPECT_THAT(refused_supply("over_voltage_v: 14", "over_voltage_v: 12"),
              ElementsAre(testing::HasSubstr("supply.over_voltage_v: 12 V is not above the 12 V of voltage_v")));
  EXPECT_THAT(refused_supply("over_current_a: 18", "over_current_a: 16.9"),
              ElementsAre(testing::HasSubstr("supply.over_current_a: 16.9 A is below the 17 A of current_limit_a")));
  EXPECT_THAT(refused_supply("over_current_a: 18", "over_current_a: 17"), ElementsAre()) << "equal is enough";
  EXPECT_THAT(refused_supply("modbus-rtu:", "riden:"),
              ElementsAre(testing::HasSubstr("write modbus-rtu:/dev/ttyUSB1")));
  EXPECT_THAT(refused_supply("current_limit_a: 17, ", ""),
              ElementsAre(testing::HasSubstr("supply.current_limit_a is missing")));
}

TEST(BenchConfig, MayLimitWhatItsStandTolerates) {
  EXPECT_EQ(parse_bench(kBenchText, "b.yaml").limits, Limits{});
  const BenchConfig bench = parse_bench(with_power("limits: {thrust_max_n: 15}\n"), "b.yaml");
  EXPECT_EQ(bench.limits["thrust_max_n"], 15);
  EXPECT_FALSE(bench.limits["torque_max_nm"]);
  const auto refused_limit = [](const std::string& limit) {
    return refusals([&] { return parse_bench(with_power(kSupply + ("limits: {" + limit + "}\n")), "b.yaml"); });
  };
  EXPECT_THAT(refused_limit("supply_voltage_min_v: 12"),
              ElementsAre(testing::HasSubstr("12 V is not below the 12 V of supply.voltage_v")));
  EXPECT_THAT(refused_limit("cooling: {}"), ElementsAre(testing::HasSubstr("cooling is not a key of limits")));
}

TEST(BenchConfig, MayGiveItsSimulatedStandALawAndDefects) {
  const SimulatedStand plain = parse_bench(with_power("simulation: {in_process: true}\n"), "b.yaml").simulation->stand;
  EXPECT_FALSE(plain.law || plain.zero_walk_n);
  EXPECT_EQ(plain.mounting, 0);
  const SimulatedStand stand =
      parse_bench(
          with_power("simulation:\n"
                     "  in_process: true\n"
                     "  stand:\n"
                     "    law: {K_T_n_s2_per_rad2: 1.55e-6, intercept_n_s2_per_rad2: 1.6e-6, "
                     "slope_n_s2_per_rad2_deg: -4.5e-9}\n"
                     "    bend: 0.01\n"
                     "    rise_per_krad_s: 0.05\n"
                     "    mounting: 0.003\n"
                     "    zero_walk_n: 0.007\n"
                     "    slow_noise_n: 0.001\n"
                     "    slow_noise_s: 2\n"
                     "    plates: [{named_deg: 90, true_deg: 180}, {named_deg: 45, true_deg: 55, repetition: 2}]\n"),
          "b.yaml")
          .simulation->stand;
  ASSERT_TRUE(stand.law);
  EXPECT_EQ(stand.law->K_T, 1.55e-6);
  EXPECT_EQ(stand.law->intercept, 1.6e-6);
  EXPECT_EQ(stand.law->slope_per_deg, -4.5e-9);
  EXPECT_EQ(stand.bend, 0.01);
  EXPECT_EQ(stand.rise_per_krad_s, 0.05);
  EXPECT_EQ(stand.mounting, 0.003);
  EXPECT_EQ(stand.zero_walk_n, 0.007);
  EXPECT_EQ(stand.slow_noise_n, 0.001);
  EXPECT_EQ(stand.slow_noise_s, 2);
  ASSERT_EQ(stand.plates.size(), 2u);
  EXPECT_EQ(stand.plates[0].true_deg, 180);
  EXPECT_FALSE(stand.plates[0].repetition);
  EXPECT_EQ(stand.plates[1].repetition, 2);
}

TEST(BenchConfig, RefusesAPlateOfOneRepetitionWhereTheBenchDoesNotKnowIt) {
  EXPECT_THAT(refusals([] {
                return parse_bench(
                    with_power("simulation: {control: c, stand: {plates: [{named_deg: 90, true_deg: 100, "
                               "repetition: 2}]}}\n"),
                    "b.yaml");
              }),
              ElementsAre(testing::HasSubstr("does not know its repetitions")));
}

}  // namespace bench_config_test
}  // namespace kphi::profiles
