#include "drivers/netbox/receive/audit.hpp"

#include <gmock/gmock.h>

#include "test/drivers/netbox/record_bytes.hpp"

namespace kphi::netbox::audit_test {

using testing::HasSubstr;
using testing::IsEmpty;

/// A box as it should be.
Configuration good_box() {
  Configuration box;
  box.calibration_serial = "FT12345";
  box.device_rate_hz = box.rdt_rate_hz = 7000;
  box.records_per_datagram = 40;
  box.rdt_enabled = true;
  box.counts_per_newton = box.counts_per_newton_metre = 1e6;
  box.range = {20, 20, 60, 1, 1, 1};
  return box;
}

void set_divisor(Configuration& box, unsigned divisor) {
  box.divisor = divisor;
  box.rdt_rate_hz = 7000.0 / divisor;
}

/// The paper's profile: 40 equal steps.
std::vector<double> paper_speeds() {
  std::vector<double> speeds;
  for (int i = 0; i < 40; ++i) speeds.push_back(100 + i * (19'100.0 - 100) / 39);
  return speeds;
}

Intention of_the_paper() {
  Intention intention;
  intention.speeds_rpm = paper_speeds();
  intention.blades = 3;
  return intention;
}

TEST(Audit, FindsNothingInAGoodBox) {
  Intention intention = of_the_paper();
  intention.largest_thrust_n = 10;
  intention.rate_hz = 7000;
  intention.records_per_datagram = 40;
  EXPECT_THAT(audit(good_box(), intention), IsEmpty());
}

struct Case {
  const char* name;
  void (*spoil)(Configuration&, Intention&);
  Severity severity;
  const char* what;
  const char* next_move;
};

class AuditOf : public testing::TestWithParam<Case> {};

TEST_P(AuditOf, NamesWhatIsWrongAndWhatToDo) {
  Configuration box = good_box();
  Intention intention;
  GetParam().spoil(box, intention);
  const std::vector<Finding> findings = audit(box, intention);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, GetParam().severity);
  EXPECT_THAT(findings[0].what, HasSubstr(GetParam().what));
  EXPECT_THAT(findings[0].next_move, HasSubstr(GetParam().next_move));
}

INSTANTIATE_TEST_SUITE_P(
    Table, AuditOf,
    testing::Values(
        Case{"Disabled", [](Configuration& box, Intention&) { box.rdt_enabled = false; }, Severity::fault,
             "RDT is disabled", "Communications page"},
        Case{"OtherRate", [](Configuration&, Intention& intention) { intention.rate_hz = 1000; }, Severity::fault,
             "streams at 7000 Hz, the bench file expects 1000 Hz", "rate_hz"},
        Case{"OtherBuffer", [](Configuration&, Intention& intention) { intention.records_per_datagram = 1; },
             Severity::warning, "sends 40 records per datagram, the bench file expects 1", "RDT buffer size"},
        Case{"FilterAboveHalfTheRate",
             [](Configuration& box, Intention&) {
               set_divisor(box, 7);
               box.filter_code = 1;
             },
             Severity::warning, "cutoff, 838 Hz, is above half the rate, 500 Hz", "raise the RDT output rate"},
        Case{"UnfilteredLowRate", [](Configuration& box, Intention&) { set_divisor(box, 7); }, Severity::warning,
             "1000 Hz without a filter", "7000 Hz"},
        Case{"AliasedRotor",
             [](Configuration& box, Intention& intention) {
               set_divisor(box, 28);
               intention = of_the_paper();
             },
             Severity::fault, "4971.8 RPM (3-blade pass at 248.59 Hz appears at 1.41 Hz)", "7000 Hz"},
        Case{"CoarseCounts",
             [](Configuration& box, Intention& intention) {
               box.counts_per_newton = 1 / 9.80665;  // kgf
               intention.largest_thrust_n = 20;
             },
             Severity::fault, "one count is 9.81 N, the largest thrust 20 N", "force unit"},
        Case{"NarrowRange", [](Configuration&, Intention& intention) { intention.largest_thrust_n = 55; },
             Severity::warning, "55 N expected on Fz, its range is 60 N", "larger range"},
        Case{"SaturatingRange", [](Configuration&, Intention& intention) { intention.largest_thrust_n = 61; },
             Severity::fault, "61 N expected", "larger range"},
        Case{"SlowDatagrams",
             [](Configuration& box, Intention&) {
               set_divisor(box, 1400);
               box.filter_code = 8;
               box.rdt_rate_hz = 20;
             },
             Severity::warning, "a datagram takes 2.0 s", "lower the RDT buffer size"},
        Case{"UnknownFilter",
             [](Configuration& box, Intention&) {
               box.kind = Product::axia;
               box.filter_code = 3;
             },
             Severity::warning, "filter 3", "switch the filter off"},
        Case{"ToolTransform", [](Configuration& box, Intention&) { box.tool_transform[2] = 5; }, Severity::note,
             "applies a tool transform", "do not apply the offset again"},
        Case{"MonitorConditions",
             [](Configuration& box, Intention&) {
               box.monitoring = true;
               box.monitor_conditions = {{2, true, 55}, {5, false, -0.5}};
             },
             Severity::note, "monitor conditions at 7 kHz: Fz > 55 N, Tz < -0.5 N m", "until it is reset"},
        Case{"GageBias", [](Configuration& box, Intention&) { box.gage_bias[0] = 745; }, Severity::note, "setbias",
             "tare"}),
    [](const testing::TestParamInfo<Case>& one) { return one.param.name; });

TEST(Audit, PutsTheWorstFirst) {
  Configuration box = good_box();
  box.gage_bias[0] = 1;
  set_divisor(box, 7);
  box.rdt_enabled = false;
  const std::vector<Finding> findings = audit(box);
  ASSERT_EQ(findings.size(), 3u);
  EXPECT_EQ(findings[0].severity, Severity::fault);
  EXPECT_EQ(findings[1].severity, Severity::warning);
  EXPECT_EQ(findings[2].severity, Severity::note);
}

TEST(Audit, AFilterBelowTheRotorsLineKeepsItOut) {
  Configuration box = good_box();
  set_divisor(box, 28);
  box.filter_code = 4;  // 73 Hz
  EXPECT_THAT(audit(box, of_the_paper()), IsEmpty());
}

TEST(AliasedLines, AreThoseOfThePaperAtAHundredHertz) {
  const std::vector<double> speeds = paper_speeds();
  const auto of_three = aliased_lines(100, speeds, 3, 2);
  const auto find = [](const std::vector<AliasedLine>& lines, double rpm, int per_revolution) {
    for (const AliasedLine& line : lines) {
      if (std::abs(line.speed_rpm - rpm) < 0.1 && line.per_revolution == per_revolution) return line;
    }
    return AliasedLine{};
  };
  EXPECT_NEAR(find(of_three, 3997.4, 3).apparent_hz, 0.13, 0.005);
  EXPECT_NEAR(find(of_three, 5946.2, 1).apparent_hz, 0.90, 0.005);
  const auto of_two = aliased_lines(100, speeds, 2, 2);
  EXPECT_NEAR(find(of_two, 3023.1, 2).apparent_hz, 0.77, 0.005);
  EXPECT_NEAR(find(of_two, 5946.2, 2).apparent_hz, 1.79, 0.005);
}

TEST(AliasedLines, AreNoneFromFiveHundredHertzUp) {
  for (const double rate : {500.0, 1000.0, 7000.0}) {
    for (const int blades : {2, 3}) EXPECT_THAT(aliased_lines(rate, paper_speeds(), blades, 2), IsEmpty()) << rate;
  }
}

TEST(AliasedLines, ASlowRotorIsNotAliased) {
  const std::vector<double> slow = {60};
  EXPECT_THAT(aliased_lines(1000, slow, 2, 2), IsEmpty());
}

}  // namespace kphi::netbox::audit_test
