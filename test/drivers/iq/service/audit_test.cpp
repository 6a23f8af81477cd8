#include "drivers/iq/service/audit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/drivers/iq/fake_dialogue.hpp"

namespace kphi::iq {
namespace audit_test {

using fake::FakeDialogue;
using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Intention paper() {
  Intention intention;
  intention.supply_voltage_max_v = 16;
  intention.speed_max_rad_s = 2000.15;
  intention.coil_temperature_max_degc = 100;
  return intention;
}

TEST(IqAudit, FindsNothingInAGoodModule) {
  FakeDialogue module;
  EXPECT_THAT(audit(read_audit(module.ask(), true), paper()), IsEmpty());
}

TEST(IqAudit, TellsWhoTheModuleIs) {
  FakeDialogue module;
  const AuditRecord record = read_audit(module.ask(), true);
  EXPECT_EQ(record.uid(), "002300064d4b501120343353");
  EXPECT_EQ(record.firmware()->text(), "speed 0.0.32");
  EXPECT_EQ(record.hardware()->text(), "type 1.1 batch 0");
  EXPECT_EQ(record.electronics()->text(), "type 3.0 batch 0");
  EXPECT_EQ(record.value<"brushless_drive.volts_limit">(), 27);
  EXPECT_EQ(record.coil_temperature_client(), 83);
}

TEST(IqAudit, WritesWhatItWasToldForTheRunsHeader) {
  FakeDialogue module;
  const std::string text = read_audit(module.ask(), true).text();
  EXPECT_THAT(text, HasSubstr("uid: \"002300064d4b501120343353\"\nfirmware: speed 0.0.32\n"));
  EXPECT_THAT(text, HasSubstr("brushless_drive.volts_limit: 27  # V\n"));
  EXPECT_THAT(text, HasSubstr("propeller_motor_control.velocity_ff2: 3.2e-07  # V/(rad/s)^2\n"));
  EXPECT_THAT(text, HasSubstr("system_control.firmware_version: 1048608  # version\n"));
  EXPECT_THAT(text, Not(HasSubstr("power_safety.vref"))) << "not asked";
  EXPECT_THAT(text, Not(HasSubstr("stopping_handler"))) << "not told";
}

TEST(IqAudit, ReadsWhatItWroteIntoTheRunsHeader) {
  FakeDialogue module;
  const AuditRecord told = read_audit(module.ask(), true);
  const AuditRecord again = AuditRecord::of(told.text());
  EXPECT_EQ(again.text(), told.text());
  EXPECT_EQ(again.uid(), told.uid());
  EXPECT_EQ(AuditRecord::of("nothing: of the kind\n\nbrushless_drive.volts_limit: many\nx").text(), "");
}

TEST(IqAudit, AsksOneClientForTheCoil) {
  FakeDialogue module;
  (void)read_audit(module.ask(), true);
  EXPECT_THAT(module.asked, Contains(&entry<"coil_temperature_estimator.t_coil">));
  EXPECT_THAT(module.asked, Not(Contains(&entry<"temperature_estimator.temp">)));
}

TEST(IqAudit, AsksNothingThatCannotBeRead) {
  FakeDialogue module;
  (void)read_audit(module.ask(), true);
  for (const Entry* asked : module.asked) EXPECT_TRUE(asked->allows(Access::get)) << asked->path;
}

void become_old(std::map<const Entry*, double>& values) {
  for (auto it = values.begin(); it != values.end();) {
    it = it->first->type == Client::coil_temperature_estimator ? values.erase(it) : std::next(it);
  }
  values[&entry<"temperature_estimator.temp">] = 30;
  values[&entry<"temperature_estimator.derate">] = 65536;
}

TEST(IqAudit, ReadsTheCoilOfOldFirmwareFromTheClientItHas) {
  FakeDialogue module;
  become_old(module.values);
  const AuditRecord record = read_audit(module.ask(), false);
  EXPECT_EQ(record.coil_temperature_client(), 77);
  EXPECT_EQ(record.value<"temperature_estimator.temp">(), 30);
  const auto findings = audit(record, paper());
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::note);
}

struct Case {
  const char* name;
  void (*spoil)(std::map<const Entry*, double>&, Intention&);
  Severity severity;
  const char* what;
  const char* next_move;
};

class IqAuditOf : public testing::TestWithParam<Case> {};

TEST_P(IqAuditOf, NamesWhatIsWrongAndWhatToDo) {
  FakeDialogue module;
  Intention intention = paper();
  GetParam().spoil(module.values, intention);
  const std::vector<Finding> findings = audit(read_audit(module.ask(), true), intention);
  ASSERT_EQ(findings.size(), 1u) << findings.size();
  EXPECT_EQ(findings[0].severity, GetParam().severity);
  EXPECT_THAT(findings[0].what, HasSubstr(GetParam().what));
  EXPECT_THAT(findings[0].next_move, HasSubstr(GetParam().next_move));
}

using Values = std::map<const Entry*, double>;

template <Path path>
void set(Values& values, double value) {
  values[&entry<path>] = value;
}

INSTANTIATE_TEST_SUITE_P(
    Table, IqAuditOf,
    testing::Values(
        Case{"UntoldEssentials",
             [](Values& v, Intention&) {
               v.erase(&entry<"brushless_drive.volts_limit">);
               v.erase(&entry<"system_control.hardware_version">);
             },
             Severity::fault, "no answer from the module for hardware_version, volts_limit", "firmware"},
        Case{"OtherModule", [](Values&, Intention& i) { i.uid = "ffff"; }, Severity::fault,
             "module 002300064d4b501120343353, not ffff", "clock gain"},
        Case{"ServoFirmware", [](Values& v, Intention&) { set<"system_control.firmware_version">(v, 0x00200020); },
             Severity::fault, "servo 0.0.32, not a speed firmware", "load speed firmware"},
        Case{"OtherHardware", [](Values& v, Intention&) { set<"system_control.hardware_version">(v, 0x00020100); },
             Severity::fault, "type 2.1 batch 0, not a 2306", "connect the 2306"},
        Case{"OtherElectronics",
             [](Values& v, Intention&) { set<"system_control.electronics_version">(v, 0x00040000); }, Severity::warning,
             "type 4.0", "intended module"},
        Case{"OldFirmware", [](Values& v, Intention&) { set<"system_control.firmware_version">(v, 0x0010001F); },
             Severity::warning, "speed 0.0.31 is older than 0.0.32", "update"},
        Case{"FaultNow", [](Values& v, Intention&) { set<"power_safety.fault_now">(v, 0x42); }, Severity::fault,
             "input voltage, coil temperature", "remove the cause"},
        Case{"FaultLatched", [](Values& v, Intention&) { set<"power_safety.fault_ever">(v, 0x10); }, Severity::fault,
             "latched, the module stays in safe mode: motor current", "fault_ever to 0"},
        Case{"FaultOnce",
             [](Values& v, Intention&) {
               set<"power_safety.fault_ever">(v, 1);
               v.erase(&entry<"power_safety.fault_latching">);
             },
             Severity::warning, "was last cleared: under-voltage", "fault_ever to 0"},
        Case{"NotLatching", [](Values& v, Intention&) { set<"power_safety.fault_latching">(v, 0); }, Severity::warning,
             "do not latch", "fault_latching to 1"},
        Case{"RunAwayBySupplysMaximum", [](Values&, Intention& i) { i.supply_voltage_max_v = 27; }, Severity::fault,
             "volts_limit 27 V is not above the supply's 27 V: the motor may run away", "raise"},
        Case{"RunAwayByVoltageNow",
             [](Values& v, Intention& i) {
               i.supply_voltage_max_v = 0;
               set<"brushless_drive.volts_limit">(v, 12);
               set<"brushless_drive.v_max_start">(v, 11);
             },
             Severity::fault, "volts_limit 12 V is not above the supply's 12 V", "raise"},
        Case{"RunAwayByNaN",
             [](Values& v, Intention&) {
               set<"brushless_drive.volts_limit">(v, std::nan(""));
               v.erase(&entry<"brushless_drive.v_max_start">);
             },
             Severity::fault, "volts_limit nan V is not above", "raise"},
        Case{"LateRegenerationLimit", [](Values& v, Intention&) { set<"brushless_drive.v_max_start">(v, 28); },
             Severity::warning, "v_max_start 28 V is above volts_limit 27 V", "between"},
        Case{"LowInputLimit", [](Values& v, Intention&) { set<"power_safety.volt_input_high">(v, 15); },
             Severity::warning, "trips at 15 V, the supply may reach 16 V", "lower the supply"},
        Case{"LongTimeout", [](Values& v, Intention&) { set<"propeller_motor_control.timeout">(v, 10); },
             Severity::fault, "timeout is 10 s, the limit 1 s", "timeout to 0.5"},
        Case{"BrakingTimeout", [](Values& v, Intention&) { set<"propeller_motor_control.timeout_behavior">(v, 2); },
             Severity::fault, "instead of coasting", "timeout_behavior to 0"},
        Case{"BrakingDisarm",
             [](Values& v, Intention&) {
               set<"propeller_motor_control.timeout_meaning">(v, 1);
               set<"arming_handler.disarm_behavior">(v, 1);
             },
             Severity::fault, "runs its disarm behaviour", "timeout_meaning to 0"},
        Case{"UntoldDisarm",
             [](Values& v, Intention&) {
               set<"propeller_motor_control.timeout_meaning">(v, 1);
               v.erase(&entry<"arming_handler.disarm_behavior">);
             },
             Severity::fault, "runs its disarm behaviour", "timeout_meaning to 0"},
        Case{"Song", [](Values& v, Intention&) { set<"propeller_motor_control.timeout_song_option">(v, 2); },
             Severity::warning, "plays its song", "timeout_song_option to 0"},
        Case{"FixedTimeoutBehavior",
             [](Values& v, Intention&) { v.erase(&entry<"propeller_motor_control.timeout_behavior">); },
             Severity::warning, "coasts and plays its song", "update"},
        Case{"HobbyInput", [](Values& v, Intention&) { set<"hobby_input.allowed_protocols">(v, 255); }, Severity::fault,
             "hobby input is enabled (allowed_protocols 255)", "to 254"},
        Case{"PolePairs", [](Values& v, Intention&) { set<"brushless_drive.motor_pole_pairs">(v, 6); },
             Severity::warning, "motor_pole_pairs is 6, a 2306 has 7", "correct"},
        Case{"Kv", [](Values& v, Intention&) { set<"brushless_drive.motor_Kv">(v, 220); }, Severity::warning,
             "motor_Kv is 220 RPM/V", "correct"},
        Case{"HighCurrent", [](Values& v, Intention&) { set<"brushless_drive.motor_I_max">(v, 60); }, Severity::warning,
             "motor_I_max is 60 A", "lower"},
        Case{"Redline", [](Values& v, Intention&) { set<"brushless_drive.motor_redline_start">(v, 1900); },
             Severity::warning, "derates above 1900 rad/s (redline), the fastest step needs 2000 rad/s", "top speed"},
        Case{"CoilLimit", [](Values& v, Intention&) { set<"coil_temperature_estimator.otw">(v, 90); },
             Severity::warning, "derates above a coil temperature of 90 °C, the limit is 100 °C",
             "lower the coil temperature limit"},
        Case{"Hot", [](Values& v, Intention&) { set<"temperature_monitor_uc.derate">(v, 0.9); }, Severity::warning,
             "already derates", "cool down"},
        Case{"NoCoilTemperature",
             [](Values& v, Intention&) {
               become_old(v);
               v.erase(&entry<"temperature_estimator.temp">);
             },
             Severity::warning, "no coil temperature", "update"},
        Case{"SlowSlew",
             [](Values& v, Intention&) {
               set<"brushless_drive.slew_enable">(v, 1);
               set<"brushless_drive.slew_volts_per_second">(v, 50);
             },
             Severity::warning, "limited to 50 V/s", "100 or more"},
        Case{"Slew", [](Values& v, Intention&) { set<"brushless_drive.slew_enable">(v, 1); }, Severity::note,
             "limited to 500 V/s", ""},
        Case{"SlowInputFilter", [](Values& v, Intention&) { set<"propeller_motor_control.input_filter_fc">(v, 1); },
             Severity::warning, "input_filter_fc is 1 Hz: a new speed reaches the controller only after 0.16 s",
             "10 Hz or more"},
        Case{"UncheckedClock", [](Values&, Intention& i) { i.clock_unchecked = true; }, Severity::note,
             "clock is unchecked", "--clock-gain"},
        Case{"NoControl",
             [](Values& v, Intention&) {
               set<"propeller_motor_control.velocity_Kp">(v, 0);
               set<"propeller_motor_control.velocity_Ki">(v, 0);
             },
             Severity::warning, "the speed is not controlled", "tune"},
        Case{"NoFeedForward", [](Values& v, Intention&) { set<"propeller_motor_control.velocity_ff2">(v, 0); },
             Severity::warning, "velocity_ff2 is unset", "identify"}),
    [](const testing::TestParamInfo<Case>& one) { return one.param.name; });

TEST(IqAudit, PutsTheWorstFirst) {
  FakeDialogue module;
  set<"brushless_drive.slew_enable">(module.values, 1);
  set<"brushless_drive.motor_Kv">(module.values, 1000);
  set<"hobby_input.allowed_protocols">(module.values, 255);
  const auto findings = audit(read_audit(module.ask(), true), paper());
  ASSERT_EQ(findings.size(), 3u);
  EXPECT_EQ(findings[0].severity, Severity::fault);
  EXPECT_EQ(findings[1].severity, Severity::warning);
  EXPECT_EQ(findings[2].severity, Severity::note);
}

TEST(IqAudit, RefusesAModuleThatSaysNothing) {
  FakeDialogue module;
  module.values.clear();
  const auto findings = audit(read_audit(module.ask(), true), paper());
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].severity, Severity::fault);
  EXPECT_THAT(findings[0].what, HasSubstr("no answer from the module for firmware_version"));
}

TEST(Version, DecodesTheWords) {
  const FirmwareVersion firmware(0x00100020);
  EXPECT_EQ(firmware.style, 1);
  EXPECT_EQ(firmware.major, 0);
  EXPECT_EQ(firmware.minor, 0);
  EXPECT_EQ(firmware.patch, 32);
  const FirmwareVersion high(6u << 20 | 5u << 14 | 4u << 7 | 3u);
  EXPECT_EQ(high.text(), "pulsing velocity 5.4.3");
  EXPECT_TRUE(high.older_than(5, 4, 4));
  EXPECT_TRUE(high.older_than(6, 0, 0));
  EXPECT_FALSE(high.older_than(5, 4, 3));
  EXPECT_FALSE(high.older_than(5, 3, 99));
  EXPECT_EQ(FirmwareVersion(9u << 20).text(), "style 9 0.0.0");
  EXPECT_EQ(BoardVersion(0x00010102).text(), "type 1.1 batch 2");
}

TEST(FaultWords, NameEveryBit) {
  EXPECT_EQ(fault_words(0), "");
  EXPECT_EQ(fault_words(0x81), "under-voltage of the logic, bit 7");
}

}  // namespace audit_test
}  // namespace kphi::iq
