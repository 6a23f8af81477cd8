// The load cell against the simulator's server, both on their true transports: what a virtual wire cannot show, because
// HTTP has a part in it.
#include <gmock/gmock.h>

#include <algorithm>
#include <optional>

#include "drivers/netbox/configuration/http.hpp"
#include "drivers/netbox/configuration/settings.hpp"
#include "drivers/netbox/receive/probe.hpp"
#include "test/drivers/netbox_faults/live_box.hpp"

namespace kphi::netbox::test::live_test {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

class Live : public testing::Test {
 protected:
  void start(const std::vector<std::string>& faults, const sim::NetBoxQuirks& quirks = {}) {
    box.emplace(LiveBox::Manner{.faults = faults, .quirks = quirks});
  }
  [[nodiscard]] Address address() const { return box->address(); }
  /// Takes records and events until `enough` or the patience is over.
  template <class Enough>
  bool follow(LoadCell& cell, Enough enough) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    std::vector<LoadCellRecord> batch(4096);
    while (std::chrono::steady_clock::now() < deadline) {
      (void)cell.wait(20ms);
      taken += cell.take(batch);
      for (const Event& event : cell.take_events()) events.push_back(event);
      if (enough()) return true;
    }
    return false;
  }
  [[nodiscard]] bool seen(EventKind kind) const {
    return std::any_of(events.begin(), events.end(), [&](const Event& event) { return event.kind == kind; });
  }
  [[nodiscard]] std::vector<EventKind> kinds() const {
    std::vector<EventKind> kinds;
    for (const Event& event : events) kinds.push_back(event.kind);
    return kinds;
  }
  static void expect_closed(const Counters& c) { EXPECT_EQ(c.expected, c.received + c.lost_network + c.lost_host); }

  const SteadyClock clock;
  std::optional<LiveBox> box;
  std::uint64_t taken = 0;
  std::vector<Event> events;
};

TEST_F(Live, ABoxThatBootsAndDoesNotStreamIsStartedAgainAndItsConfigurationReadAgain) {
  start({"reboot at_s=1.5 down_s=1.2", "http_refused at_s=1.5 for_s=1.2"});
  LoadCell cell(address(), clock);
  cell.start();
  ASSERT_TRUE(follow(cell, [&] { return seen(EventKind::reconnected) && cell.state() == State::streaming; }))
      << testing::PrintToString(kinds());
  EXPECT_THAT(kinds(), testing::ElementsAre(EventKind::silent, EventKind::unreachable, EventKind::rebooted,
                                            EventKind::reconnected));
  const std::uint64_t before = taken;
  EXPECT_TRUE(follow(cell, [&] { return taken > before + 700; }));
  cell.stop();
  EXPECT_EQ(cell.counters().reboots, 1u);
  EXPECT_EQ(cell.counters().reconnects, 1u);
  expect_closed(cell.counters());
}

TEST_F(Live, AStreamTakenOverIsReportedAndNotFoughtFor) {
  start({"taken_over at_s=1"});
  LoadCell cell(address(), clock);
  cell.start();
  ASSERT_TRUE(follow(cell, [&] { return seen(EventKind::taken_over); }));
  // Longer than all that a reconnection would wait for at first.
  const auto until = std::chrono::steady_clock::now() + 1s;
  EXPECT_TRUE(follow(cell, [&] { return std::chrono::steady_clock::now() > until; }));
  EXPECT_EQ(cell.state(), State::silent);
  EXPECT_THAT(kinds(), testing::ElementsAre(EventKind::silent, EventKind::taken_over));
  EXPECT_EQ(box->stop().starts, 1u);
}

TEST_F(Live, UnitsThatChangeWithABootAreNamedAlthoughTheStreamGoesOn) {
  start({"units at_s=1 force_unit=1 torque_unit=3", "reboot at_s=1 down_s=0.1 resume=1"});
  LoadCell cell(address(), clock);
  cell.start();
  ASSERT_TRUE(follow(cell, [&] { return seen(EventKind::configuration_changed); })) << testing::PrintToString(kinds());
  EXPECT_TRUE(seen(EventKind::rebooted));
  const Event& changed = events.back();
  EXPECT_TRUE(has(changed.changes, Change::units));
  EXPECT_THAT(to_string(changed), HasSubstr("configuration has changed: units, counts per unit"));
  EXPECT_EQ(cell.configuration().force_unit, "N");
  EXPECT_EQ(cell.state(), State::streaming);
}

TEST_F(Live, AnotherRateAfterABootIsStreamedByItsOwnCount) {
  start({"reboot at_s=2 down_s=1", "http_refused at_s=2 for_s=1.2"},
        {.rate_write = sim::NetBoxQuirks::RateWrite::continues});
  LoadCell cell(address(), clock);
  cell.start();
  ASSERT_TRUE(follow(cell, [&] { return taken > 350; }));
  (void)http_get(address().host, address().http_port, "/comm.cgi?comrdtrate=1000", 2s, kFound);
  ASSERT_TRUE(follow(cell, [&] { return seen(EventKind::reconnected); })) << testing::PrintToString(kinds());
  EXPECT_TRUE(seen(EventKind::configuration_changed));
  const Counters before = cell.counters();
  EXPECT_GT(before.irregular, 0u) << "rdt and ft disagree while the rate is not what was read";
  ASSERT_TRUE(follow(cell, [&] { return cell.counters().received > before.received + 200; }));
  cell.stop();
  EXPECT_EQ(cell.counters().irregular, before.irregular);
  EXPECT_EQ(cell.counters().lost_network, before.lost_network);
  expect_closed(cell.counters());
}

TEST_F(Live, AnAxiaStreams) {
  start({}, {.axia = true});
  LoadCell cell(address(), clock);
  EXPECT_EQ(cell.configuration().kind, Product::axia);
  cell.start();
  ASSERT_TRUE(follow(cell, [&] { return cell.counters().received >= 2000; }));
  cell.stop();
  const Counters c = cell.counters();
  EXPECT_NEAR(static_cast<double>(c.received) / static_cast<double>(c.datagrams), 40, 8);
  expect_closed(c);
}

TEST_F(Live, TheProbeNamesAnAxiasFaultByItsOwnMap) {
  start({"status at_s=0 for_s=60 bits=0xC0000000"}, {.axia = true});
  ProbeSettings settings;
  settings.tcp_port = box->addresses().tcp_port;
  settings.stream = 300ms;
  const Probe found = probe(address(), clock, settings);
  std::string all;
  for (const Finding& finding : found.findings) all += finding.line() + "\n";
  EXPECT_THAT(all, HasSubstr("the box reports: force or torque out of range"));
  EXPECT_THAT(all, Not(HasSubstr("CPU or RAM")));
}

class SlowWeb : public Live {
 protected:
  void write_and_set_back(const sim::NetBoxQuirks& quirks);
};

void SlowWeb::write_and_set_back(const sim::NetBoxQuirks& quirks) {
  start({}, quirks);
  const kphi::test::TemporaryFolder folder;
  const std::filesystem::path journal = folder / "journal";
  for (int round = 0; round < 3; ++round) {
    SettingsKeeper keeper(address(), {.rate_hz = 150, .records_per_datagram = 4, .filter = 5}, journal);
    const Configuration written = LoadCell(address(), clock).configuration();
    EXPECT_EQ(written.divisor, 46u);
    EXPECT_EQ(written.records_per_datagram, 4);
    EXPECT_EQ(written.filter_code, 5);
    keeper.restore();
  }
  const LoadCell cell(address(), clock);
  EXPECT_EQ(cell.configuration().divisor, 1u);
  EXPECT_EQ(cell.configuration().records_per_datagram, 40);
  EXPECT_EQ(cell.configuration().filter_code, 0);
  EXPECT_FALSE(std::filesystem::exists(journal));
}

TEST_F(SlowWeb, SettingsAreWrittenAndSetBackOnABoxThatServesThreeWritesASecond) {
  write_and_set_back({.only_three_writes = true});
}

TEST_F(SlowWeb, SettingsAreWrittenAndSetBackOnABoxThatServesThreeRequestsASecond) {
  using Served = sim::NetBoxQuirks::Served;
  for (const Served served : {Served::three_then_closed, Served::three_then_503})
    write_and_set_back({.served = served});
}

}  // namespace kphi::netbox::test::live_test
