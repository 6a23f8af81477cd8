#include "daq/audit/bench_audit.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"
#include "daq/campaign/campaign_run.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/journal.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace {

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
  campaign_.limits.thrust_max = Newtons(60);
  campaign_.supply = Volts(60);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("Net Box 127.0.0.1: 60 N"), HasSubstr("IQ module /dev/null: this is module"),
                               HasSubstr("60 V")));
}

TEST_F(BenchAudit, SaysAWarningOnceAndJournalsIt) {
  campaign_ = test::short_campaign("0", 1, 2);
  campaign_.limits.coil_temperature_max = Celsius(190);
  class Lines final : public Progress {
   public:
    void tick(const Position&, const Observation&) override {}
    void step_done(const Position&, const Observation&) override {}
    void say(const std::string& line) override { said += line + '\n'; }
    std::string said;
  } lines;
  const test::TemporaryFolder folder;
  const auto results = results::CampaignFolder::create(folder.path(), "u", "c");
  DeterministicBench bench(config_);
  AutoConfirmOperator person;
  (void)run_campaign(bench, campaign_, config_, results, person, lines, [] { return false; });
  EXPECT_THAT(lines.said, HasSubstr("motor: warning: the module derates above"));
  EXPECT_EQ(lines.said.find("motor: warning"), lines.said.rfind("motor: warning"));
  const auto entry = results::read_journal(results.journal()).entries.at(1);
  EXPECT_EQ(entry.event, "motor_finding");
  EXPECT_EQ(entry.data.at("severity"), "warning");
}

}  // namespace
}  // namespace kphi::daq
