#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "drivers/serial/port.hpp"
#include "test/drivers/serial/fake_sysfs.hpp"

namespace kphi::serial {
namespace discovery_test {

using fake::Sysfs;
using fake::UsbAdapter;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

const UsbAdapter kFtdi{"ttyUSB0", "0403", "6001", "A10K0000",        "1-1",
                       0,         "16",   "FTDI", "FT232R USB UART", "usb-FTDI_A10K"};
const UsbAdapter kOtherFtdi{"ttyUSB1", "0403", "6001", "B20L1111", "1-2", 0, "1", "FTDI", "FT232R USB UART", ""};
const UsbAdapter kCh340{"ttyUSB2", "1a86", "7523", "", "1-4.1", 0, "", "", "USB Serial", ""};
const UsbAdapter kOtherCh340{"ttyUSB3", "1a86", "7523", "", "1-4.2", 0, "", "", "USB Serial", ""};
const UsbAdapter kFirstOfTwo{"ttyUSB4", "0403", "6010", "FT2232", "1-5", 0, "16", "FTDI", "Dual RS232", ""};
const UsbAdapter kSecondOfTwo{"ttyUSB5", "0403", "6010", "FT2232", "1-5", 1, "16", "FTDI", "Dual RS232", ""};

class Discovery : public testing::Test {
 protected:
  void plug_all() {
    for (const auto& adapter : {kFtdi, kOtherFtdi, kCh340, kOtherCh340, kFirstOfTwo, kSecondOfTwo}) bus.plug(adapter);
  }
  /// The terminal's name.
  std::string found(const std::string& specification) {
    return std::filesystem::path(path_of(specification, bus.roots())).filename();
  }
  std::string refusal(const std::string& specification) {
    try {
      return "found " + path_of(specification, bus.roots());
    } catch (const DeviceError& error) {
      return error.what();
    }
  }
  Sysfs bus;
};

TEST_F(Discovery, TellsEverythingAboutAnAdapter) {
  bus.plug(kFtdi);
  bus.add_terminal(bus.sys() / "devices/platform/serial8250/tty/ttyS0");
  const std::vector<Adapter> all = adapters(bus.roots());
  ASSERT_EQ(all.size(), 1u) << "a port of the mainboard is no adapter";
  EXPECT_EQ(all[0].device, bus.dev() / "ttyUSB0");
  EXPECT_EQ(all[0].vendor, 0x0403);
  EXPECT_EQ(all[0].product, 0x6001);
  EXPECT_EQ(all[0].serial, "A10K0000");
  EXPECT_EQ(all[0].words, "FTDI FT232R USB UART");
  EXPECT_EQ(all[0].port, "1-1");
  EXPECT_EQ(all[0].interface, "1-1:1.0");
  EXPECT_EQ(all[0].latency_timer_ms, 16);
  EXPECT_EQ(all[0].specification(), "usb:0403:6001:A10K0000");
}

TEST_F(Discovery, FindsByIdentitySerialNumberOrSocket) {
  plug_all();
  EXPECT_EQ(found("usb:0403:6001:A10K0000"), "ttyUSB0");
  EXPECT_EQ(found("usb:0403:6001:B20L1111"), "ttyUSB1");
  EXPECT_EQ(found("usb:*:*:B20L1111"), "ttyUSB1");
  EXPECT_EQ(found("usb:0403:6001@1-2"), "ttyUSB1");
  EXPECT_EQ(found("usb:0403:6001:B20L1111@1-2"), "ttyUSB1");
  EXPECT_EQ(found("usb:1A86:7523@1-4.2"), "ttyUSB3") << "hexadecimal digits of either case";
  EXPECT_EQ(found("usb:0403:6010:FT2232@1-5:1.1"), "ttyUSB5");
  EXPECT_EQ(found("usb:*:6010@1-5:1.0"), "ttyUSB4");
}

TEST_F(Discovery, EveryAdapterIsFoundByTheNameItIsListedWith) {
  for (const auto& adapter : {kFtdi, kOtherFtdi, kCh340, kOtherCh340, kFirstOfTwo}) bus.plug(adapter);
  for (const Adapter& adapter : adapters(bus.roots())) {
    EXPECT_EQ(path_of(adapter.specification(), bus.roots()), adapter.device) << adapter.specification();
  }
}

TEST_F(Discovery, TakesAPathAsItIs) {
  EXPECT_EQ(path_of("/dev/serial/by-id/whatever", bus.roots()), "/dev/serial/by-id/whatever");
  EXPECT_EQ(path_of("/tmp/pty", bus.roots()), "/tmp/pty");
}

TEST_F(Discovery, FindsAnAdapterAgainUnderAnotherName) {
  bus.plug(kFtdi);
  EXPECT_EQ(found("usb:*:*:A10K0000"), "ttyUSB0");
  bus.unplug("ttyUSB0");
  EXPECT_THAT(refusal("usb:*:*:A10K0000"), HasSubstr("no USB serial adapter is plugged in"));
  UsbAdapter again = kFtdi;
  again.terminal = "ttyUSB7";
  again.port = "2-3";
  again.by_id = "";
  bus.plug(again);
  EXPECT_EQ(found("usb:*:*:A10K0000"), "ttyUSB7");
}

TEST_F(Discovery, RefusesAnAmbiguousNameAndListsTheCandidates) {
  plug_all();
  EXPECT_THAT(refusal("usb:0403:6001"), AllOf(HasSubstr("2 adapters fit"), HasSubstr("usb:0403:6001:A10K0000"),
                                              HasSubstr("usb:0403:6001:B20L1111")));
  EXPECT_THAT(refusal("usb:1a86:7523"),
              AllOf(HasSubstr("2 adapters fit"), HasSubstr("ttyUSB2 is usb:1a86:7523@1-4.1:1.0 (USB Serial)"),
                    HasSubstr("as in usb:1a86:7523@1-4.1:1.0")));
  EXPECT_THAT(refusal("usb:0403:6010:FT2232"), HasSubstr("as in usb:0403:6010:FT2232@1-5:1.0"));
  EXPECT_EQ(found("usb:0403:6010:FT2232@1-5:1.0"), "ttyUSB4") << "the advice holds";
}

TEST_F(Discovery, SaysWhatIsThereWhenNothingFits) {
  bus.plug(kFtdi);
  EXPECT_THAT(refusal("usb:0403:6001:A10K9999"),
              AllOf(HasSubstr("no adapter fits"), HasSubstr("usb:0403:6001:A10K0000"), HasSubstr("use one of these")));
}

TEST_F(Discovery, RefusesWhatIsNoSpecification) {
  bus.plug(kFtdi);
  for (const char* malformed : {"usb:", "usb:0403", "usb:403:6001", "usb:0403:6001:", "usb:0403:600g", "usb:0403:6001@",
                                "usb:0403:6001@one", "usb::6001"}) {
    EXPECT_THAT(refusal(malformed), HasSubstr("usb:VID:PID[:SERIAL][@PORT]")) << malformed;
  }
}

TEST_F(Discovery, KnowsTheAdapterBehindALink) {
  bus.plug(kFtdi);
  const auto adapter = adapter_of(bus.dev() / "serial/by-id/usb-FTDI_A10K", bus.roots());
  ASSERT_TRUE(adapter);
  EXPECT_EQ(adapter->serial, "A10K0000");
  EXPECT_FALSE(adapter_of("/dev/pts/0", bus.roots()));
}

TEST_F(Discovery, SurvivesASysfsWithoutAnything) {
  EXPECT_THAT(adapters({"/nowhere/sys", "/nowhere/dev"}), IsEmpty());
  UsbAdapter broken = kFtdi;
  broken.vendor = "zz";
  bus.plug(broken);
  EXPECT_THAT(adapters(bus.roots()), IsEmpty());
}

TEST_F(Discovery, WarnsOfALongLatencyTimerAndNamesTheRemedy) {
  plug_all();
  const auto finding = [&](const char* name) {
    return judge_latency_timer(*adapter_of(bus.dev() / name, bus.roots()));
  };
  ASSERT_TRUE(finding("ttyUSB0"));
  EXPECT_EQ(finding("ttyUSB0")->severity, Severity::warning);
  EXPECT_THAT(finding("ttyUSB0")->what, AllOf(HasSubstr("up to 16 ms"), HasSubstr("about 62 queries per second")));
  EXPECT_THAT(finding("ttyUSB0")->next_move,
              AllOf(HasSubstr("echo 1 > /sys/bus/usb-serial/devices/ttyUSB0/latency_timer"), HasSubstr("udev rule")));
  EXPECT_FALSE(finding("ttyUSB1")) << "1 ms";
  EXPECT_FALSE(finding("ttyUSB2")) << "has no such timer";
}

}  // namespace discovery_test
}  // namespace kphi::serial
