// Faults that exist on real sockets only: what the driver says and counts, and what it tells a person to do.
#include <gmock/gmock.h>

#include "drivers/netbox/configuration/calinfo.hpp"
#include "drivers/netbox/configuration/http.hpp"
#include "test/drivers/netbox_faults/live_box.hpp"
#include "test/refusal.hpp"

namespace kphi::netbox::test::over_sockets_test {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

const std::string kAlways = " at_s=0 for_s=1000";

/// What a fault of the pages makes of reading the configuration.
std::string reading_with(const std::string& fault) {
  LiveBox box({.faults = {fault + kAlways}});
  const SteadyClock clock;
  return refusal([&] { return LoadCell(box.address(), clock).state(); });
}

TEST(PagesOverSockets, ASlowAnswerIsWaitedForAndATooSlowOneIsNamed) {
  LiveBox box({.faults = {"http_slow delay_s=0.2" + kAlways}});
  const auto get = [&](std::chrono::nanoseconds timeout) {
    return http_get("127.0.0.1", box.addresses().http_port, "/netftapi2.xml", timeout);
  };
  EXPECT_THAT(refusal([&] { return get(50ms); }), AllOf(HasSubstr("no answer within 0.1 s (could not read the answer)"),
                                                        HasSubstr("one connection at a time")));
  EXPECT_THAT(get(5s), HasSubstr("</netft>"));
  EXPECT_GE(box.stop().done.at(sim::FaultKind::http_slow), 2u);
}

TEST(PagesOverSockets, ATruncatedPageIsNamed) {
  EXPECT_THAT(reading_with("http_truncated size=0"), HasSubstr("the connection ended early, 5 times in 1."));
  for (const char* size : {"20", "100", "1000"}) {
    EXPECT_THAT(reading_with(std::string("http_truncated size=") + size),
                HasSubstr("the connection ended early; try again"))
        << size;
  }
}

TEST(PagesOverSockets, AnotherStatusIsNamed) {
  EXPECT_THAT(reading_with("http_status code=404"),
              AllOf(HasSubstr("HTTP status 404"), HasSubstr("open the address in a browser")));
  EXPECT_THAT(reading_with("http_status code=500"), HasSubstr("HTTP status 500"));
}

TEST(PagesOverSockets, AnOversizedPageIsRefused) {
  EXPECT_THAT(reading_with("http_oversized size=65536"), HasSubstr("the XML is broken at byte"));
  EXPECT_THAT(reading_with("http_oversized size=2000000"), HasSubstr("not a Net Box"));
}

TEST(PagesOverSockets, ARefusedConnectionIsNamed) {
  EXPECT_THAT(reading_with("http_refused"),
              AllOf(HasSubstr("Connection refused"), HasSubstr("check the address and http_port")));
}

TEST(PagesOverSockets, ALatin1LetterSpoilsNoNumber) {
  LiveBox box({.faults = {"http_charset utf16=0" + kAlways}});
  const SteadyClock clock;
  LoadCell cell(box.address(), clock);
  EXPECT_EQ(cell.configuration().counts_per_newton, 1e6);
  EXPECT_EQ(cell.configuration().records_per_datagram, 40);
  EXPECT_EQ(cell.configuration().slot_name, "Pr\uFFFDfstand");
  EXPECT_EQ(box.stop().done.at(sim::FaultKind::http_charset), 1u);
}

TEST(PagesOverSockets, APageInUtf16IsRefusedBecauseNoRunFileCouldKeepItVerbatim) {
  EXPECT_THAT(reading_with("http_charset utf16=1"), HasSubstr("NUL byte"));
}

TEST(PagesOverSockets, AMissingOrDoubledElementIsNamed) {
  for (const char* tag : {"cfgcpf", "cfgcpt", "cfgmr", "cfgcalsn", "comrdtrate", "comrdtbsiz", "comrdte", "runrate",
                          "setuserfilter", "setbias", "cfgtfx", "setcfgsel", "mfgdigver"}) {
    const std::string element = std::string("element <") + tag + ">";
    EXPECT_THAT(reading_with(std::string("http_missing_tag tag=") + tag), HasSubstr(element + " is missing"));
    EXPECT_THAT(reading_with(std::string("http_duplicate_tag tag=") + tag),
                HasSubstr(element + " appears more than once"));
  }
  EXPECT_EQ(reading_with("http_missing_tag tag=prodname"), "") << "some boxes do not say it";
  EXPECT_EQ(reading_with("http_missing_tag tag=scfgfu"), "") << "the code says it too";
  EXPECT_EQ(reading_with("http_duplicate_tag tag=cfgusra"), "") << "nobody needs it";
}

TEST(PagesOverSockets, OtherSpellingsReadTheSame) {
  for (const char separator : {',', ' '}) {
    LiveBox box({.quirks = {.torque_text_with_hyphen = true, .flags_as_digits = true, .array_separator = separator}});
    const SteadyClock clock;
    const LoadCell cell(box.address(), clock);
    EXPECT_TRUE(cell.configuration().rdt_enabled);
    EXPECT_EQ(cell.configuration().range[2], 60);
    EXPECT_EQ(cell.configuration().counts_per_newton_metre, 1e6);
  }
}

Calinfo calinfo_with(const std::string& fault) {
  LiveBox box({.faults = {fault}});
  return read_calinfo("127.0.0.1", box.addresses().tcp_port, 5s);
}

TEST(TcpOverSockets, SplitAndLateAnswersAreWhole) {
  const Calinfo whole = calinfo_with("tcp_merged at_s=0 count=1 delay_s=0");
  EXPECT_EQ(whole.counts_per_force, 1'000'000u);
  for (const char* size : {"1", "5", "23"})
    EXPECT_EQ(calinfo_with(std::string("tcp_split at_s=0 count=1 size=") + size), whole) << size;
  EXPECT_EQ(calinfo_with("tcp_merged at_s=0 count=1 delay_s=0.1"), whole);
}

TEST(TcpOverSockets, AShortReplyIsAnErrorAndInACrossCheckANote) {
  for (const char* size : {"0", "1", "23"}) {
    LiveBox box({.faults = {std::string("tcp_short size=") + size + kAlways}});
    EXPECT_THAT(refusal([&] { return read_calinfo("127.0.0.1", box.addresses().tcp_port, 5s); }),
                AllOf(HasSubstr("read the calibration over TCP"), HasSubstr("check that this is a Net Box")))
        << size;
    const SteadyClock clock;
    const LoadCell cell(box.address(), clock);
    const auto finding = cross_check("127.0.0.1", box.addresses().tcp_port, cell.configuration(), 5s);
    ASSERT_TRUE(finding);
    EXPECT_EQ(finding->severity, Severity::note);
    EXPECT_EQ(box.stop().done.at(sim::FaultKind::tcp_short), 2u);
  }
}

/// At four times the speed, with one fault.
struct Stream : LiveStream {
  explicit Stream(const std::string& fault, int records_per_datagram = 40)
      : LiveStream({.records_per_datagram = records_per_datagram, .time_scale = 4, .faults = {fault}}) {}
};

TEST(StreamOverSockets, ForeignDatagramsAreNotHeard) {
  Stream s("foreign_source at_s=0 for_s=1000 p=0.5");
  ASSERT_TRUE(s.start_and_take(7000));
  s.cell.stop();
  s.consumer.take_what_waits();
  EXPECT_EQ(s.consumer.samples_missing() + s.consumer.out_of_order(), 0u);
  EXPECT_EQ(s.cell.counters().duplicates + s.cell.counters().malformed + s.cell.counters().reboots, 0u);
  EXPECT_GT(s.box.stop().foreign, 50u);
}

TEST(StreamOverSockets, ADoubledStartIsOneRestart) {
  Stream s("doubled_start at_s=0 count=1 delay_s=0.9");
  ASSERT_TRUE(s.start_and_take(14'000));
  EXPECT_EQ(s.cell.counters().restarts, 1u);
  // A buffered box forgets the block that it was filling.
  EXPECT_LT(s.cell.counters().lost_network, 40u);
  EXPECT_EQ(s.cell.counters().lost_network, s.consumer.samples_missing());
}

TEST(StreamOverSockets, ADelayedStartIsWaitedFor) {
  Stream s("delayed_start at_s=0 count=1 delay_s=0.3");
  ASSERT_TRUE(s.start_and_take(1000));
  EXPECT_EQ(s.cell.counters().lost_network, 0u);
  EXPECT_EQ(s.box.stop().starts, 1u);
}

TEST(StreamOverSockets, LostStartsAreRepeated) {
  Stream s("lost_start at_s=0 count=2");
  ASSERT_TRUE(s.start_and_take(1000));
  EXPECT_EQ(s.box.stop().starts, 3u);
}

TEST(StreamOverSockets, AStreamTakenOverIsNamedAndNotFoughtFor) {
  Stream s("taken_over at_s=4");
  s.cell.start();
  EXPECT_THAT(events_until(s.cell, EventKind::taken_over), ElementsAre(EventKind::silent, EventKind::taken_over));
  EXPECT_EQ(s.cell.state(), State::silent);
  EXPECT_EQ(s.box.stop().starts, 1u);
}

TEST(StreamOverSockets, AJitteringWireLosesNothing) {
  Stream s("jitter at_s=0 for_s=1000 mean_s=0.0005 p=0.02 spike_s=0.02", 1);
  ASSERT_TRUE(s.start_and_take(14'000));
  s.cell.stop();
  EXPECT_EQ(s.cell.counters().expected, s.cell.counters().received);
}

/// The box has another address from second 4 on; nobody listens where it was.
TEST(StreamOverSockets, AnAddressGivenAnewIsUnreachableAndThenFoundThere) {
  Stream s("address at_s=4 address=127.0.0.2");
  s.cell.start();
  EXPECT_THAT(events_until(s.cell, EventKind::unreachable), ElementsAre(EventKind::silent, EventKind::unreachable));
  s.cell.stop();
  EXPECT_THAT(refusal([&] { return s.cell.start(), 0; }),
              AllOf(HasSubstr("refuses the RDT port"), HasSubstr("check rdt_port")));
  Address there = s.box.address();
  there.host = "127.0.0.2";
  LoadCell found(there, s.clock);
  EXPECT_THAT(found.configuration().xml, HasSubstr("<netip>127.0.0.2</netip>"));
  Consumer consumer(found);
  found.start();
  EXPECT_TRUE(consumer.take_until(1000));
  EXPECT_EQ(consumer.samples_missing(), 0u);
}

TEST(StreamOverSockets, EveryLostRecordIsCounted) {
  Stream s("gilbert at_s=0 for_s=1000 p_good_bad=0.05 p_bad_good=0.3");
  ASSERT_TRUE(s.start_and_take(14'000));
  s.cell.stop();
  s.consumer.take_what_waits();
  const Counters counters = s.cell.counters();
  EXPECT_GT(counters.lost_network, 0u);
  EXPECT_EQ(counters.lost_network + counters.lost_host, s.consumer.samples_missing());
  EXPECT_EQ(counters.expected, counters.received + counters.lost_network + counters.lost_host);
  EXPECT_LE(counters.lost_network, s.box.stop().records_dropped);
}

}  // namespace kphi::netbox::test::over_sockets_test
