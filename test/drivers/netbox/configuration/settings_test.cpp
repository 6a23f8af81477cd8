#include "drivers/netbox/configuration/settings.hpp"

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <fstream>
#include <utility>

#include "base/error.hpp"
#include "drivers/netbox/configuration/http.hpp"
#include "test/drivers/netbox/box_process.hpp"
#include "test/drivers/netbox/settable_web.hpp"
#include "test/refusal.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::netbox::settings_test {

using test::SettableWeb;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// A program that is killed while it holds the settings: a process made before any thread of the test, for a child of
/// threads may find the heap locked for ever.
class Mortal {
 public:
  Mortal() : child_(fork()) {
    if (child_ < 0) throw std::runtime_error("no process");
    if (child_ != 0) return;
    orders_.close_writing();
    Order order;
    if (!orders_.get(order)) _exit(0);
    const SettingsKeeper keeper({"127.0.0.1", 1, order.http_port}, order.wanted, order.journal.data());
    raise(SIGKILL);
  }
  ~Mortal() {
    orders_.close_writing();
    if (child_ > 0) waitpid(child_, nullptr, 0);
  }
  Mortal(const Mortal&) = delete;
  Mortal& operator=(const Mortal&) = delete;
  void die_holding(std::uint16_t http_port, const WantedSettings& wanted, const std::string& journal) {
    Order order{http_port, wanted, {}};
    ASSERT_LT(journal.size(), order.journal.size());
    std::copy(journal.begin(), journal.end(), order.journal.begin());
    ASSERT_TRUE(orders_.put(order));
    const pid_t child = std::exchange(child_, -1);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
  }

 private:
  struct Order {
    std::uint16_t http_port = 0;
    WantedSettings wanted;
    std::array<char, 256> journal{};
  };
  test::Pipe orders_;
  pid_t child_;
};

class SettingsTest : public testing::Test {
 protected:
  std::string failure(const WantedSettings& wanted) {
    return refusal([&] { return SettingsKeeper(web.address(), wanted, journal).notes(); });
  }
  [[nodiscard]] bool journal_exists() const { return std::filesystem::exists(journal); }
  /// Rate, records per datagram, filter, slot.
  std::string values() const {
    return web.value("comrdtrate") + " " + web.value("comrdtbsiz") + " " + web.value("setuserfilter") + " " +
           web.value("setcfgsel");
  }
  void die_holding(const WantedSettings& wanted) { mortal.die_holding(web.port(), wanted, journal.string()); }

  Mortal mortal;  // before all that has threads
  SettableWeb web;
  const kphi::test::TemporaryFolder folder;
  const std::filesystem::path journal = folder / "journal";
};

TEST_F(SettingsTest, WritesNothingWhenNothingIsWantedOrTheBoxIsSoAlready) {
  const WantedSettings as_it_is{.rate_hz = 7000, .records_per_datagram = 40, .filter = 0, .configuration = 0};
  for (const WantedSettings& wanted : {WantedSettings{}, as_it_is}) {
    const SettingsKeeper keeper(web.address(), wanted, journal);
    EXPECT_THAT(web.writes(), IsEmpty());
    EXPECT_FALSE(journal_exists());
  }
}

TEST_F(SettingsTest, WritesOneUrlPerPageAndReadsBackWhatTheBoxRuns) {
  {
    const SettingsKeeper keeper(
        web.address(), {.rate_hz = 1000, .records_per_datagram = 10, .filter = 4, .configuration = 3}, journal);
    EXPECT_THAT(web.writes(),
                ElementsAre("/setting.cgi?setcfgsel=3&setuserfilter=4", "/comm.cgi?comrdtrate=1000&comrdtbsiz=10"));
    EXPECT_EQ(values(), "1000 10 4 3");
    EXPECT_THAT(keeper.notes(), IsEmpty());
    EXPECT_TRUE(journal_exists());
  }
  EXPECT_EQ(values(), "7000 40 0 0");
  EXPECT_THAT(web.writes(), SizeIs(4));
  EXPECT_FALSE(journal_exists());
}

TEST_F(SettingsTest, ARateIsQuantisedLikeTheBoxAndToldSo) {
  const SettingsKeeper keeper(web.address(), {.rate_hz = 150}, journal);
  EXPECT_EQ(web.value("comrdtrate"), "152");
  ASSERT_THAT(keeper.notes(), SizeIs(1));
  EXPECT_EQ(keeper.notes()[0].severity, Severity::note);
  EXPECT_THAT(keeper.notes()[0].what, AllOf(HasSubstr("rate_hz 150"), HasSubstr("runs 152")));
}

TEST_F(SettingsTest, AValueThatTheBoxClampsIsAWarningAndIsSetBackToo) {
  web.behave({.at_most = {{"comrdtbsiz", 20}}});
  web.set("comrdtbsiz", "10");
  {
    const SettingsKeeper keeper(web.address(), {.records_per_datagram = 40}, journal);
    EXPECT_EQ(web.value("comrdtbsiz"), "20");
    ASSERT_THAT(keeper.notes(), SizeIs(1));
    EXPECT_EQ(keeper.notes()[0].severity, Severity::warning);
    EXPECT_EQ(read_journal(journal)->changed.at(0).applied, 20);
  }
  EXPECT_EQ(web.value("comrdtbsiz"), "10");
}

TEST_F(SettingsTest, AWriteThatTheBoxIgnoresIsRepeated) {
  web.behave({.writes_ignored = 2});
  {
    const SettingsKeeper keeper(web.address(), {.rate_hz = 1000}, journal);
    EXPECT_EQ(web.value("comrdtrate"), "1000");
    EXPECT_THAT(web.writes(), SizeIs(3));
  }
  EXPECT_EQ(web.value("comrdtrate"), "7000");
}

TEST_F(SettingsTest, ABoxThatNeverTakesAValueIsAnErrorAndLeavesNoJournal) {
  web.behave({.writes_ignored = 1000});
  EXPECT_THAT(failure({.rate_hz = 1000}), AllOf(HasSubstr("keeps rate_hz at 7000"), HasSubstr("not take 1000")));
  EXPECT_THAT(web.writes(), SizeIs(4));
  EXPECT_FALSE(journal_exists());
}

TEST_F(SettingsTest, AnyOtherAnswerThan302IsAnErrorAndWhatWasDoneIsSetBack) {
  web.behave({.write_status = "200 OK"});
  EXPECT_THAT(failure({.rate_hz = 1000}), HasSubstr("HTTP status 200"));
  EXPECT_EQ(web.value("comrdtrate"), "7000");
  EXPECT_TRUE(journal_exists()) << "this box's word is worth nothing: its settings are to be looked at";
  web.behave({});
  EXPECT_THAT(SettingsKeeper::recover(web.address(), journal), IsEmpty());
  EXPECT_FALSE(journal_exists());
}

TEST_F(SettingsTest, RefusesWhatIsOutOfRangeWithoutARequest) {
  const std::vector<WantedSettings> wrong = {
      {.rate_hz = 0}, {.rate_hz = 7001},     {.records_per_datagram = 41}, {.filter = 13},
      {.filter = -1}, {.configuration = 16}, {.configuration = -1},        {.records_per_datagram = 0}};
  for (const WantedSettings& wanted : wrong) EXPECT_THAT(failure(wanted), HasSubstr("nothing was written"));
  EXPECT_THAT(web.writes(), IsEmpty());
}

TEST_F(SettingsTest, AsksForNoPageThatItDoesNotNeed) {
  (void)SettingsKeeper(web.address(), {}, journal);
  EXPECT_EQ(web.requests(), 0);
  { const SettingsKeeper keeper(web.address(), {.rate_hz = 1000, .filter = 4}, journal); }
  EXPECT_EQ(web.requests(), 9) << "read, write two pages, read back; compare and read, write two, read back";
}

TEST_F(SettingsTest, RefusesASlotThatMeasuresNothingBeforeWriting) {
  EXPECT_THAT(failure({.rate_hz = 1000, .configuration = 5}), AllOf(HasSubstr("slot 5"), HasSubstr("FT0000")));
  EXPECT_THAT(web.writes(), IsEmpty());
  EXPECT_FALSE(journal_exists());
}

TEST_F(SettingsTest, TheJournalHoldsThePageOfBeforeVerbatim) {
  const std::string page = http_get("127.0.0.1", web.port(), "/netftapi2.xml", std::chrono::seconds(10));
  const SettingsKeeper keeper(web.address(), {.filter = 1}, journal);
  const std::optional<SettingsJournal> kept = read_journal(journal);
  ASSERT_TRUE(kept.has_value());
  EXPECT_EQ(kept->page, page);
  EXPECT_EQ(kept->box, "LOT0001");
  EXPECT_THAT(kept->changed, ElementsAre(ChangedSetting{"setuserfilter", 0, 1}));
}

TEST_F(SettingsTest, RestoreReportsAndIsDoneOnce) {
  SettingsKeeper keeper(web.address(), {.rate_hz = 1000}, journal);
  keeper.restore();
  EXPECT_EQ(web.value("comrdtrate"), "7000");
  keeper.restore();
  EXPECT_THAT(web.writes(), SizeIs(2));
}

TEST_F(SettingsTest, ARestoreThatFailsIsAnErrorAndKeepsTheJournal) {
  SettingsKeeper keeper(web.address(), {.rate_hz = 1000}, journal);
  web.behave({.writes_ignored = 1000});
  EXPECT_THAT([&] { keeper.restore(); },
              testing::ThrowsMessage<DeviceError>(HasSubstr("set comrdtrate to 7000 on the box's web pages")));
  EXPECT_TRUE(journal_exists());
  web.behave({});
  keeper.restore();
  EXPECT_EQ(web.value("comrdtrate"), "7000");
  EXPECT_FALSE(journal_exists());
}

TEST_F(SettingsTest, LeavesAloneWhatSomebodyElseHasChangedSince) {
  SettingsKeeper keeper(web.address(), {.rate_hz = 1000, .filter = 2}, journal);
  web.set("setuserfilter", "5");
  keeper.restore();
  EXPECT_EQ(web.value("setuserfilter"), "5");
  EXPECT_EQ(web.value("comrdtrate"), "7000");
  ASSERT_THAT(keeper.notes(), SizeIs(1));
  EXPECT_THAT(keeper.notes()[0].what, HasSubstr("changed to 5 by somebody else"));
}

TEST_F(SettingsTest, AKilledProgramIsRecoveredFromAtTheNextStart) {
  die_holding({.rate_hz = 500, .filter = 3});
  EXPECT_EQ(web.value("comrdtrate"), "500");
  ASSERT_TRUE(journal_exists());
  EXPECT_THAT(SettingsKeeper::recover(web.address(), journal), SizeIs(2));
  EXPECT_EQ(web.value("comrdtrate"), "7000");
  EXPECT_EQ(web.value("setuserfilter"), "0");
  EXPECT_FALSE(journal_exists());
  EXPECT_THAT(SettingsKeeper::recover(web.address(), journal), IsEmpty());
}

TEST_F(SettingsTest, ANewKeeperRecoversFirstSoThatBeforeIsTheTruth) {
  die_holding({.rate_hz = 500});
  {
    const SettingsKeeper keeper(web.address(), {.rate_hz = 1000}, journal);
    EXPECT_EQ(read_journal(journal)->changed.at(0).before, 7000);
    ASSERT_THAT(keeper.notes(), SizeIs(1));
    EXPECT_THAT(keeper.notes()[0].what, HasSubstr("restored from 500 to 7000"));
  }
  EXPECT_EQ(web.value("comrdtrate"), "7000");
}

TEST_F(SettingsTest, AJournalOfAnotherBoxIsRefusedAndKept) {
  die_holding({.rate_hz = 500});
  web.behave({.serial = "LOT0002"});
  EXPECT_THAT(failure({}), AllOf(HasSubstr("LOT0001"), HasSubstr("LOT0002")));
  EXPECT_TRUE(journal_exists());
}

TEST_F(SettingsTest, AFileThatIsNoJournalIsRefusedAndKept) {
  std::ofstream(journal) << "rate: 7000\n";
  EXPECT_THAT(failure({}), HasSubstr("not a journal"));
  EXPECT_TRUE(journal_exists());
  EXPECT_THAT(web.writes(), IsEmpty());
}

TEST_F(SettingsTest, AJournalCannotReachTheNetworkSettings) {
  write_journal(journal, {"LOT0001", {{"comnetip", 1, 2}, {"comrdtrate", 3500, 7000}}, {}});
  (void)SettingsKeeper::recover(web.address(), journal);
  EXPECT_THAT(web.writes(), ElementsAre("/comm.cgi?comrdtrate=3500"));
}

TEST_F(SettingsTest, AnUnreachableJournalPreventsTheWrite) {
  const std::filesystem::path nowhere = "/proc/kphi/journal";
  EXPECT_THROW(SettingsKeeper(web.address(), {.rate_hz = 1000}, nowhere), DeviceError);
  EXPECT_THAT(web.writes(), IsEmpty());
}

TEST_F(SettingsTest, RateAndFilterOfAnAxiaAreRefused) {
  web.set("prodname", "Ethernet Axia");
  EXPECT_THAT(failure({.rate_hz = 976}), HasSubstr("Ethernet Axia cannot be written"));
  EXPECT_THAT(failure({.filter = 1}), HasSubstr("nothing was written"));
  EXPECT_THAT(web.writes(), IsEmpty());
}

}  // namespace kphi::netbox::settings_test
