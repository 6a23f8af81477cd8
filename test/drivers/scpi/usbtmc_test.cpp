#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/scpi/line.hpp"
#include "test/drivers/scpi/fake_instrument.hpp"
#include "test/refusal.hpp"

namespace kphi::scpi {
namespace usbtmc_test {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class UsbtmcTest : public testing::Test {
 protected:
  FakeInstrument usb;

  std::string refusal(Usbtmc& line, const char* query) {
    return kphi::refusal([&] { return line.query(query); });
  }
};

TEST_F(UsbtmcTest, ClearsTheInstrumentAndTakesRemoteControl) {
  Usbtmc line(usb);
  EXPECT_THAT(usb.class_requests, ElementsAre(7, 5, 6, 160));
}

TEST_F(UsbtmcTest, SendsNoRemoteControlToWhomItChokes) {
  const auto requests = [&](std::uint16_t vendor, std::uint16_t product) {
    usb.class_requests.clear();
    usb.vendor_id = vendor, usb.product_id = product;
    Usbtmc line(usb);
    return usb.class_requests;
  };
  EXPECT_THAT(requests(0xf4ec, 0x5678), Not(Contains(160))) << "Siglent";
  EXPECT_THAT(requests(0x1ab1, 0x0588), Not(Contains(160))) << "Rigol";
  EXPECT_THAT(requests(0x1ab1, 0x0e11), Contains(160)) << "another Rigol";
}

TEST_F(UsbtmcTest, AsksAndAnswers) {
  Usbtmc line(usb);
  EXPECT_EQ(line.query("*IDN?"), "KPHI,FAKE,1,0");
  line.write("OUTP OFF");
  EXPECT_THAT(usb.commands, ElementsAre("*IDN?", "OUTP OFF"));
}

TEST_F(UsbtmcTest, SurvivesTheEmptyFirstPacketOfSome) {
  Usbtmc line(usb);
  usb.empty_first = 1;
  EXPECT_EQ(line.query("*IDN?"), "KPHI,FAKE,1,0");
}

TEST_F(UsbtmcTest, GathersAnAnswerInManyPacketsAndParts) {
  std::string longest;
  for (int i = 0; i < 3000; ++i) longest += static_cast<char>('a' + i % 26);
  usb.apply = [&](const std::string&) { return longest; };
  for (const std::size_t part : {4096u, 1000u, 57u}) {
    usb.part = part;
    for (const std::size_t packet : {512u, 64u}) {
      usb.packet = packet;
      Usbtmc line(usb);
      ASSERT_EQ(line.query("CURV?"), longest) << part << " " << packet;
    }
  }
}

TEST_F(UsbtmcTest, NeverTakesTheAnswerToAnotherRequest) {
  Usbtmc line(usb);
  usb.wrong_tags = 1;
  EXPECT_THAT(refusal(line, "*IDN?"), HasSubstr("another request"));
  EXPECT_EQ(line.query("*IDN?"), "KPHI,FAKE,1,0") << "and is in order again";
}

TEST_F(UsbtmcTest, AbortsAndClearsAfterSilenceSoThatALateAnswerIsNobodys) {
  Usbtmc line(usb);
  usb.mute = 1;
  usb.apply = [](const std::string& command) { return command == "VOLT?" ? "12.0" : "5.0"; };
  usb.class_requests.clear();
  EXPECT_THAT(refusal(line, "VOLT?"), HasSubstr("no answer in time"));
  EXPECT_THAT(usb.class_requests, ElementsAre(3, 4));
  EXPECT_EQ(line.query("CURR?"), "5.0") << "not the 12.0 that waits";
  EXPECT_THAT(usb.class_requests, ElementsAre(3, 4, 5, 6));
}

TEST_F(UsbtmcTest, WaitsForAPendingAbort) {
  Usbtmc line(usb);
  usb.mute = 1;
  usb.pending = 3;
  usb.class_requests.clear();
  EXPECT_THAT(refusal(line, "*IDN?"), HasSubstr("no answer in time"));
  EXPECT_THAT(usb.class_requests, ElementsAre(3, 4, 4, 4, 4));
}

TEST_F(UsbtmcTest, RecoversFromAStall) {
  Usbtmc line(usb);
  usb.stalls = 1;
  EXPECT_THAT(refusal(line, "*IDN?"), HasSubstr("stalled"));
  EXPECT_EQ(line.query("*IDN?"), "KPHI,FAKE,1,0");
}

TEST_F(UsbtmcTest, SaysWhenItIsUnplugged) {
  Usbtmc line(usb);
  usb.unplugged = true;
  EXPECT_THAT(refusal(line, "*IDN?"), HasSubstr("unplugged"));
}

TEST_F(UsbtmcTest, RefusesAnInstrumentThatCannotBeCleared) {
  usb.clear_fails = true;
  EXPECT_THROW(Usbtmc line(usb), DeviceError);
}

TEST_F(UsbtmcTest, GivesUpAnAnswerThatNeverEnds) {
  Usbtmc line(usb);
  usb.part = 4000;
  usb.apply = [](const std::string&) { return std::string(200000, '7'); };
  EXPECT_THAT(refusal(line, "CURV?"), HasSubstr("does not end"));
  usb.part = 0;
  EXPECT_THAT(refusal(line, "CURV?"), HasSubstr("does not end")) << "one empty part after the other";
}

}  // namespace usbtmc_test
}  // namespace kphi::scpi
