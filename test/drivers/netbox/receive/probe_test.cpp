#include "drivers/netbox/receive/probe.hpp"

#include <gmock/gmock.h>

#include "test/drivers/netbox/load_cell_bench.hpp"

namespace kphi::netbox::probe_test {

using namespace std::chrono_literals;
using namespace test;
using testing::Contains;
using testing::HasSubstr;

ProbeSettings quick() {
  ProbeSettings settings;
  settings.stream = 300ms;
  settings.tcp_timeout = 100ms;
  settings.tcp_port = 1;
  return settings;
}

TEST(BoxProbe, TellsWhoAnswersAndHowWellItStreams) {
  BenchBox bench;
  const Probe found = probe(bench.address, bench.clock, quick());
  EXPECT_TRUE(found.answers());
  EXPECT_GT(found.counters.received, 1000u);
  EXPECT_EQ(found.counters.lost_network + found.counters.lost_host, 0u);
  for (const Finding& finding : found.findings) {
    const bool frozen = finding.what.find("repeats one value") != std::string::npos;  // this box has no noise
    EXPECT_EQ(finding.severity, frozen ? Severity::fault : Severity::note) << finding.what;
  }
  const std::vector<std::string> lines = found.lines();
  EXPECT_THAT(lines, Contains(HasSubstr("firmware 2.2.59")));
  EXPECT_THAT(lines, Contains(HasSubstr("ranges 330 330 990 N, 30 30 30 N m")));
  EXPECT_THAT(lines, Contains(HasSubstr("RDT enabled, 7000 Hz, 40 records per datagram, no filter")));
  EXPECT_THAT(lines, Contains(HasSubstr("0 lost, 0 late, 0 duplicates")));
  EXPECT_THAT(found.findings, Contains(testing::Field(&Finding::what, HasSubstr("could not cross-check the scale"))));
  EXPECT_THAT(found.in_short(), HasSubstr("330 330 990 N, 7000 Hz, no filter, 0 of "));
  EXPECT_EQ(bench.box.settings_written() + bench.box.biases(), 0) << "a probe changes nothing";
}

TEST(BoxProbe, SaysThatRdtIsDisabledInsteadOfWaiting) {
  BenchBox bench({}, FakeWeb::page(with(streaming_xml(), "comrdte", "Disabled")));
  const Probe found = probe(bench.address, bench.clock, quick());
  EXPECT_FALSE(found.answers());
  ASSERT_FALSE(found.findings.empty());
  EXPECT_EQ(found.findings[0].severity, Severity::fault);
  EXPECT_THAT(found.findings[0].what, HasSubstr("RDT is disabled"));
  EXPECT_EQ(bench.box.starts(), 0);
}

TEST(BoxProbe, CountsWhatTheNetworkLoses) {
  BenchBox bench({.skip_every = 10});
  const Probe found = probe(bench.address, bench.clock, quick());
  EXPECT_TRUE(found.answers());
  EXPECT_THAT(found.findings,
              Contains(testing::AllOf(testing::Field(&Finding::severity, Severity::warning),
                                      testing::Field(&Finding::what, HasSubstr("lost in the network")))));
}

TEST(BoxProbe, ABoxThatDoesNotAnswerIsAFindingAndNoException) {
  const std::uint16_t closed = closed_port(SOCK_STREAM);
  const SteadyClock clock;
  const Probe found = probe({"127.0.0.1", 1, closed}, clock, quick());
  EXPECT_FALSE(found.answers());
  ASSERT_EQ(found.findings.size(), 1u);
  EXPECT_THAT(found.findings[0].what, HasSubstr("check the address"));
}

}  // namespace kphi::netbox::probe_test
