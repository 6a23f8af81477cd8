#include "daq/audit/bench_audit.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"
#include "daq/campaign/campaign_run.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/journal.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace bench_audit_test {

using testing::HasSubstr;

class BenchAudit : public testing::Test {
 protected:
  /// Words of the refusal; empty when there is none.
  std::string refusal() {
    DeterministicBench bench(config_);
    try {
      found_ = audit_bench(bench, campaign_, config_);
      return "";
    } catch (const ConfigurationError& error) {
      return error.what();
    }
  }
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::BenchConfig config_ = test::deterministic_config(1);
  std::vector<BenchFinding> found_;
};

TEST_F(BenchAudit, HasNothingToSayOfAWellSetBench) {
  EXPECT_EQ(refusal(), "");
  EXPECT_TRUE(found_.empty());
}

TEST_F(BenchAudit, RefusesAnotherModuleThanTheOneWhoseClockWasMeasured) {
  config_.iq.clock_gain = profiles::ClockGain{1.005, 1e-5, "000000000000000000000001", ""};
  EXPECT_THAT(refusal(), AllOf(HasSubstr("IQ module /dev/null: this is module"),
                               HasSubstr("not 000000000000000000000001"), HasSubstr("; connect the intended module")));
}

TEST_F(BenchAudit, TellsFaultsOfBothDevicesAtOnce) {
  config_.iq.clock_gain = profiles::ClockGain{1.005, 1e-5, "000000000000000000000001", ""};
  campaign_.limits["thrust_max_n"] = 60;
  campaign_.supply = Volts(60);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("Net Box 127.0.0.1: 60 N"), HasSubstr("IQ module /dev/null: this is module"),
                               HasSubstr("60 V")));
}

TEST_F(BenchAudit, SaysAWarningOnceAndJournalsIt) {
  campaign_ = test::short_campaign("0", 1, 2);
  campaign_.limits["coil_temperature_max_degc"] = 190;
  test::SaidLines said;
  const test::TemporaryFolder folder;
  const auto results = results::CampaignFolder::create(folder.path(), "u", "c");
  DeterministicBench bench(config_);
  AutoConfirmOperator person;
  (void)run_campaign(bench, campaign_, config_, results, person, said, [] { return false; });
  std::erase_if(said.lines, [](const std::string& line) { return !line.starts_with("motor: warning"); });
  EXPECT_THAT(said.lines, testing::ElementsAre(HasSubstr("motor: warning: the module derates above")));
  const auto entry = results::read_journal(results.journal()).entries.at(1);
  EXPECT_EQ(entry.event, "motor_finding");
  EXPECT_EQ(entry.data.at("severity"), "warning");
}

class Audit : public testing::Test {
 protected:
  /// Words of the refusal; empty when there is none.
  std::string refusal() {
    DeterministicBench bench(config_);
    bench.simulation().netbox().configure(settings_);
    (void)bench.load_cell().start();  // reads the configuration
    bench.load_cell().stop();
    found_.clear();
    try {
      for (const BenchFinding& found : audit_bench(bench, campaign_, config_))
        if (found.device == Source::load_cell) found_.push_back(found);
      return "";
    } catch (const ConfigurationError& error) {
      return error.what();
    }
  }
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::BenchConfig config_ = test::deterministic_config(1);
  sim::NetBoxSettings settings_;
  std::vector<BenchFinding> found_;
};

TEST_F(Audit, LetsAWellSetBoxPass) {
  EXPECT_EQ(refusal(), "");
  EXPECT_TRUE(found_.empty());
}

TEST_F(Audit, RefusesARateThatFoldsAStepIntoAConstantForce) {
  settings_.rate_hz = config_.netbox.rate_hz = 100;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("6000.0 RPM"), HasSubstr("set the RDT output rate to 7000 Hz")));
}

TEST_F(Audit, RefusesALineThatIsConstantOverTheShortWindowsOfTheCampaign) {
  campaign_.profile.steps = 2;
  campaign_.profile.first = from_rpm(9900);
  settings_.rate_hz = config_.netbox.rate_hz = 500;
  EXPECT_THAT(refusal(), HasSubstr("9900.0 RPM (3-blade pass at 495.00 Hz appears at 5.00 Hz)"));
  campaign_.profile.dwell = Seconds(2);
  campaign_.minimum_discard = Seconds(1);
  EXPECT_EQ(refusal(), "");
}

TEST_F(Audit, RefusesALimitOfThrustThatTheCellCannotBear) {
  campaign_.limits["thrust_max_n"] = 60;
  EXPECT_THAT(refusal(), HasSubstr("60 N expected on Fz, its range is 60 N"));
  campaign_.limits["thrust_max_n"] = 50;
  EXPECT_EQ(refusal(), "");
  ASSERT_EQ(found_.size(), 1u);
  EXPECT_EQ(found_[0].line(),
            "load cell: warning: 50 N expected on Fz, its range is 60 N; choose a calibration with a larger range "
            "on the box's Configurations page, or lower the speeds");
}

TEST_F(Audit, RefusesSettingsThatAreNotTheBoxs) {
  settings_.filter = 5;
  config_.netbox.settings.filter_hz = 35;
  EXPECT_EQ(refusal(), "");
  config_.netbox.settings.filter_hz = 0;
  EXPECT_THAT(refusal(), HasSubstr("the box filters at 35 Hz, netbox.settings.filter_hz is 0"));
  config_.netbox.settings = {};
  config_.netbox.settings.configuration = 3;
  EXPECT_THAT(refusal(), HasSubstr("where it is number 4"));
}

TEST_F(Audit, WarnsOfAnotherBufferSize) {
  settings_.records_per_datagram = 10;
  EXPECT_EQ(refusal(), "");
  EXPECT_THAT(found_.at(0).finding.what, HasSubstr("10 records per datagram"));
}

}  // namespace bench_audit_test
}  // namespace kphi::daq
