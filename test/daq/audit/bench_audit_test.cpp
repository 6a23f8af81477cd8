#include "daq/audit/bench_audit.hpp"

#include "test/daq/campaign_on_bench.hpp"

namespace kphi::daq {
namespace bench_audit_test {

using testing::HasSubstr;

class BenchAudit : public CampaignOnBench {
 protected:
  /// Words of the refusal; empty when there is none.
  std::string refusal() {
    bench_.emplace(config_);
    bench_->simulation().netbox().configure(settings_);
    (void)bench_->load_cell().start();  // reads the configuration
    bench_->load_cell().stop();
    found_.clear();
    return test::words_of<ConfigurationError>([&] { return found_ = audit_bench(*bench_, campaign_, config_); });
  }
  sim::NetBoxSettings settings_;
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
  (void)run();
  std::erase_if(said_.lines, [](const std::string& line) { return !line.starts_with("motor: warning"); });
  EXPECT_THAT(said_.lines, testing::ElementsAre(HasSubstr("motor: warning: the module derates above")));
  const auto entry = journal().at(1);
  EXPECT_EQ(entry.event, "motor_finding");
  EXPECT_EQ(entry.data.at("severity"), "warning");
}

TEST_F(BenchAudit, RefusesARateThatFoldsAStepIntoAConstantForce) {
  settings_.rate_hz = config_.netbox.rate_hz = 100;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("6000.0 RPM"), HasSubstr("set the RDT output rate to 7000 Hz")));
}

TEST_F(BenchAudit, RefusesALineThatIsConstantOverTheShortWindowsOfTheCampaign) {
  campaign_.profile.steps = 2;
  campaign_.profile.first = from_rpm(9900);
  settings_.rate_hz = config_.netbox.rate_hz = 500;
  EXPECT_THAT(refusal(), HasSubstr("9900.0 RPM (3-blade pass at 495.00 Hz appears at 5.00 Hz)"));
  campaign_.profile.dwell = Seconds(2);
  campaign_.minimum_discard = Seconds(1);
  EXPECT_EQ(refusal(), "");
}

TEST_F(BenchAudit, RefusesALimitOfThrustThatTheCellCannotBear) {
  campaign_.limits["thrust_max_n"] = 60;
  EXPECT_THAT(refusal(), HasSubstr("60 N expected on Fz, its range is 60 N"));
  campaign_.limits["thrust_max_n"] = 50;
  EXPECT_EQ(refusal(), "");
  ASSERT_EQ(found_.size(), 1u);
  EXPECT_EQ(found_[0].line(),
            "load cell: warning: 50 N expected on Fz, its range is 60 N; choose a calibration with a larger range "
            "on the box's Configurations page, or lower the speeds");
}

TEST_F(BenchAudit, RefusesSettingsThatAreNotTheBoxs) {
  settings_.filter = 5;
  config_.netbox.settings.filter_hz = 35;
  EXPECT_EQ(refusal(), "");
  config_.netbox.settings.filter_hz = 0;
  EXPECT_THAT(refusal(), HasSubstr("the box filters at 35 Hz, netbox.settings.filter_hz is 0"));
  config_.netbox.settings = {};
  config_.netbox.settings.configuration = 3;
  EXPECT_THAT(refusal(), HasSubstr("where it is number 4"));
}

TEST_F(BenchAudit, WarnsOfAnotherBufferSize) {
  settings_.records_per_datagram = 10;
  EXPECT_EQ(refusal(), "");
  EXPECT_THAT(found_.at(0).finding.what, HasSubstr("10 records per datagram"));
}

TEST_F(BenchAudit, TakesAModuleWithoutClient84OrVoltsLimitByNameAndRunsIt) {
  sim::BenchSettings lacking;
  lacking.module.quirks.no_power_safety = lacking.module.quirks.no_volts_limit = true;
  bench_.emplace(config_, lacking);
  EXPECT_THAT(test::words_of<ConfigurationError>([&] { return audit_bench(*bench_, campaign_, config_); }),
              HasSubstr("no answer from the module for volts_limit, fault_now"));
  config_.iq.accept_without = {"power_safety", "volts_limit"};
  found_ = audit_bench(*bench_, campaign_, config_);
  ASSERT_EQ(found_.size(), 3u);
  EXPECT_THAT(found_[2].finding.what, HasSubstr("does not know brushless_drive.volts_limit, power_safety"));
  bench_->mounted("5x3", 0);
  const std::uint64_t timeouts = bench_->motor().counts()[2];  // of the audit
  const test::TemporaryFolder folder;
  Progress silent;
  const RunResult run =
      record_run(*bench_, test::first_run(campaign_, config_, folder.path() / "run.h5"), silent, test::never);
  EXPECT_EQ(run.account.lost_host, 0u);
  EXPECT_EQ(bench_->motor().counts()[2], timeouts) << "nothing is asked that has no answer";
}

}  // namespace bench_audit_test
}  // namespace kphi::daq
