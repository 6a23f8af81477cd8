#include "drivers/iq/service/audit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "test/drivers/iq/fake_dialogue.hpp"

namespace kphi::iq {
namespace audit_test {

using fake::FakeDialogue;
using testing::Contains;
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

/// Without the list of what the fake module's firmware does not know.
std::vector<Finding> judged(const AuditRecord& module, const Intention& intention = {}) {
  std::vector<Finding> findings = iq::audit(module, intention);
  std::erase_if(findings,
                [](const Finding& finding) { return finding.what.starts_with("this firmware does not know"); });
  return findings;
}

TEST(IqAudit, FindsNothingInAGoodModule) {
  FakeDialogue module;
  EXPECT_THAT(judged(read_audit(module.ask(), true), paper()), IsEmpty());
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

/// What a module tells instead; nothing: it lacks the entry.
using Told = std::vector<std::pair<std::string_view, std::optional<double>>>;

void tell(FakeDialogue& module, const Told& told) {
  for (const auto& [path, value] : told) {
    ASSERT_NE(find(path), nullptr) << path;
    module.values.erase(find(path));
    if (value) module.values[find(path)] = *value;
  }
}

/// Of a firmware with the older estimator of the coil's temperature.
Told old_coil(std::optional<double> celsius) {
  return {{"coil_temperature_estimator.t_coil", {}}, {"coil_temperature_estimator.otw", {}},
          {"coil_temperature_estimator.otlo", {}},   {"coil_temperature_estimator.derate", {}},
          {"temperature_estimator.temp", celsius},   {"temperature_estimator.derate", 65536}};
}

TEST(IqAudit, ReadsTheCoilOfOldFirmwareFromTheClientItHas) {
  FakeDialogue module;
  tell(module, old_coil(30));
  const AuditRecord record = read_audit(module.ask(), false);
  EXPECT_EQ(record.coil_temperature_client(), 77);
  EXPECT_EQ(record.value<"temperature_estimator.temp">(), 30);
  const auto findings = judged(record, paper());
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::note);
}

using enum Severity;

/// The one finding about a good module that tells something else, or is to do something else.
void finds(const char* name, const Told& told, Severity severity, const char* what, const char* next_move,
           const std::function<void(Intention&)>& intend = {}) {
  SCOPED_TRACE(name);
  FakeDialogue module;
  tell(module, told);
  Intention intention = paper();
  if (intend) intend(intention);
  const std::vector<Finding> findings = judged(read_audit(module.ask(), true), intention);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, severity);
  EXPECT_THAT(findings[0].what, HasSubstr(what));
  EXPECT_THAT(findings[0].next_move, HasSubstr(next_move));
}

TEST(IqAudit, NamesWhatIsWrongAndWhatToDo) {
  finds("UntoldEssentials", {{"brushless_drive.volts_limit", {}}, {"system_control.hardware_version", {}}}, fault,
        "no answer from the module for hardware_version, volts_limit", "firmware");
  finds("OtherModule", {}, fault, "module 002300064d4b501120343353, not ffff", "clock gain",
        [](Intention& i) { i.uid = "ffff"; });
  finds("ServoFirmware", {{"system_control.firmware_version", 0x00200020}}, fault, "servo 0.0.32, not a speed firmware",
        "load speed firmware");
  finds("OtherHardware", {{"system_control.hardware_version", 0x00020100}}, fault, "type 2.1 batch 0, not a 2306",
        "connect the 2306");
  finds("OtherElectronics", {{"system_control.electronics_version", 0x00040000}}, warning, "type 4.0",
        "intended module");
  finds("OldFirmware", {{"system_control.firmware_version", 0x0010001F}}, warning, "speed 0.0.31 is older than 0.0.32",
        "update");
  finds("FaultNow", {{"power_safety.fault_now", 0x42}}, fault, "input voltage, coil temperature", "remove the cause");
  finds("FaultLatched", {{"power_safety.fault_ever", 0x10}}, fault,
        "latched, the module stays in safe mode: motor current", "fault_ever to 0");
  finds("FaultOnce", {{"power_safety.fault_ever", 1}, {"power_safety.fault_latching", {}}}, warning,
        "was last cleared: under-voltage", "fault_ever to 0");
  finds("NotLatching", {{"power_safety.fault_latching", 0}}, warning, "do not latch", "fault_latching to 1");
  finds("RunAwayBySupplysMaximum", {}, fault, "volts_limit 27 V is not above the supply's 27 V: the motor may run away",
        "raise", [](Intention& i) { i.supply_voltage_max_v = 27; });
  finds("RunAwayByVoltageNow", {{"brushless_drive.volts_limit", 12}, {"brushless_drive.v_max_start", 11}}, fault,
        "volts_limit 12 V is not above the supply's 12 V", "raise", [](Intention& i) { i.supply_voltage_max_v = 0; });
  finds("RunAwayByNaN", {{"brushless_drive.volts_limit", std::nan("")}, {"brushless_drive.v_max_start", {}}}, fault,
        "volts_limit nan V is not above", "raise");
  finds("LateRegenerationLimit", {{"brushless_drive.v_max_start", 28}}, warning,
        "v_max_start 28 V is above volts_limit 27 V", "between");
  finds("LowInputLimit", {{"power_safety.volt_input_high", 15}}, warning, "trips at 15 V, the supply may reach 16 V",
        "lower the supply");
  finds("LongTimeout", {{"propeller_motor_control.timeout", 10}}, fault, "timeout is 10 s, the limit 1 s",
        "timeout to 0.5");
  finds("BrakingTimeout", {{"propeller_motor_control.timeout_behavior", 2}}, fault, "instead of coasting",
        "timeout_behavior to 0");
  finds("BrakingDisarm", {{"propeller_motor_control.timeout_meaning", 1}, {"arming_handler.disarm_behavior", 1}}, fault,
        "runs its disarm behaviour", "timeout_meaning to 0");
  finds("UntoldDisarm", {{"propeller_motor_control.timeout_meaning", 1}, {"arming_handler.disarm_behavior", {}}}, fault,
        "runs its disarm behaviour", "timeout_meaning to 0");
  finds("Song", {{"propeller_motor_control.timeout_song_option", 2}}, warning, "plays its song",
        "timeout_song_option to 0");
  finds("FixedTimeoutBehavior", {{"propeller_motor_control.timeout_behavior", {}}}, warning,
        "coasts and plays its song", "update");
  finds("HobbyInput", {{"hobby_input.allowed_protocols", 255}}, fault, "hobby input is enabled (allowed_protocols 255)",
        "to 254");
  finds("PolePairs", {{"brushless_drive.motor_pole_pairs", 6}}, warning, "motor_pole_pairs is 6, a 2306 has 7",
        "correct");
  finds("Kv", {{"brushless_drive.motor_Kv", 220}}, warning, "motor_Kv is 220 RPM/V", "correct");
  finds("HighCurrent", {{"brushless_drive.motor_I_max", 60}}, warning, "motor_I_max is 60 A", "lower");
  finds("Redline", {{"brushless_drive.motor_redline_start", 1900}}, warning,
        "derates above 1900 rad/s (redline), the fastest step needs 2000 rad/s", "top speed");
  finds("CoilLimit", {{"coil_temperature_estimator.otw", 90}}, warning,
        "derates above a coil temperature of 90 °C, the limit is 100 °C", "lower the coil temperature limit");
  finds("Hot", {{"temperature_monitor_uc.derate", 0.9}}, warning, "already derates", "cool down");
  finds("NoCoilTemperature", old_coil({}), warning, "no coil temperature", "update");
  finds("SlowSlew", {{"brushless_drive.slew_enable", 1}, {"brushless_drive.slew_volts_per_second", 50}}, warning,
        "limited to 50 V/s", "100 or more");
  finds("Slew", {{"brushless_drive.slew_enable", 1}}, note, "limited to 500 V/s", "");
  finds("SlowInputFilter", {{"propeller_motor_control.input_filter_fc", 1}}, warning,
        "input_filter_fc is 1 Hz: a new speed reaches the controller only after 0.16 s", "10 Hz or more");
  finds("UncheckedClock", {}, note, "clock is unchecked", "--clock-gain",
        [](Intention& i) { i.clock_unchecked = true; });
  finds("NoControl", {{"propeller_motor_control.velocity_Kp", 0}, {"propeller_motor_control.velocity_Ki", 0}}, warning,
        "the speed is not controlled", "tune");
  finds("NoFeedForward", {{"propeller_motor_control.velocity_ff2", 0}}, warning, "velocity_ff2 is unset", "identify");
}

TEST(IqAudit, PutsTheWorstFirst) {
  FakeDialogue module;
  tell(
      module,
      {{"brushless_drive.slew_enable", 1}, {"brushless_drive.motor_Kv", 1000}, {"hobby_input.allowed_protocols", 255}});
  const auto findings = judged(read_audit(module.ask(), true), paper());
  const auto is = [](Severity severity) { return testing::Field(&Finding::severity, severity); };
  EXPECT_THAT(findings, testing::ElementsAre(is(fault), is(warning), is(note)));
}

TEST(IqAudit, RefusesAModuleThatSaysNothing) {
  FakeDialogue module;
  module.values.clear();
  const auto findings = judged(read_audit(module.ask(), true), paper());
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

TEST(IqAudit, ListsOnceWhatTheFirmwareDoesNotKnowAClientByItsName) {
  FakeDialogue module;
  std::map<const Entry*, double> all = module.values;
  for (const Entry& one : kEntries)
    if (one.audited) all.try_emplace(&one, 0);
  for (const char* path :
       {"brushless_drive.v_max_start", "stopping_handler.stopped_speed", "stopping_handler.stopped_time"})
    all.erase(find(path));
  module.values = all;
  std::vector<Finding> findings = iq::audit(read_audit(module.ask(), true), paper());
  std::erase_if(findings,
                [](const Finding& finding) { return finding.what.find("does not know") == std::string::npos; });
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, note);
  EXPECT_EQ(
      findings[0].what,
      "this firmware does not know brushless_drive.v_max_start, stopping_handler: what hangs on that is not checked");
}

TEST(IqAudit, TakesAModuleWithoutFaultsOrVoltsLimitOnlyWhereTheBenchFileAcceptsThatByName) {
  FakeDialogue module;
  tell(module, {{"brushless_drive.volts_limit", {}}, {"power_safety.fault_now", {}}, {"power_safety.fault_ever", {}}});
  const AuditRecord record = read_audit(module.ask(), true);
  Intention intention = paper();
  ASSERT_EQ(judged(record, intention).front().severity, fault);
  EXPECT_THAT(judged(record, intention).front().words(), HasSubstr("iq.accept_without"));
  intention.accepted_without = {"volts_limit"};
  EXPECT_THAT(judged(record, intention).front().what, HasSubstr("no answer from the module for fault_now"));
  intention.accepted_without = {"power_safety", "volts_limit"};
  const auto findings = judged(record, intention);
  ASSERT_EQ(findings.size(), 2u);
  for (const Finding& finding : findings) {
    EXPECT_EQ(finding.severity, warning);
    EXPECT_THAT(finding.what, HasSubstr("accepted by accept_without in the bench file"));
  }
  tell(module, {{"propeller_motor_control.timeout", {}}});
  EXPECT_EQ(judged(read_audit(module.ask(), true), intention).front().severity, fault) << "never without its time-out";
}

}  // namespace audit_test
}  // namespace kphi::iq
