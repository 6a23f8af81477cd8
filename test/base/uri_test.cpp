#include "base/uri.hpp"

#include <gmock/gmock.h>

#include <random>
#include <stdexcept>

namespace kphi::uri_test {

using namespace testing;

Uri uri(const std::string& text) { return Uri(text, "supply", "write supply:HOST"); }

template <class Call>
std::string refusal(Call&& call) {
  try {
    (void)call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Uri, IsSchemeLocationAndOptions) {
  const Uri whole = uri("modbus-rtu:/dev/ttyUSB1?baud=9600&model=RD6006&note=a=b");
  EXPECT_EQ(whole.scheme(), "modbus-rtu");
  EXPECT_EQ(whole.location(), "/dev/ttyUSB1");
  EXPECT_THAT(whole.options(), ElementsAre(Pair("baud", "9600"), Pair("model", "RD6006"), Pair("note", "a=b")));
  EXPECT_TRUE(uri("a:").location().empty());
  EXPECT_TRUE(uri("a:b").options().empty());
}

TEST(Uri, NamesDeviceTextCauseAndNextMove) {
  EXPECT_EQ(refusal([] { return uri("host"); }), "supply \"host\": no scheme; write supply:HOST");
  EXPECT_EQ(refusal([] { return uri("a:b?c=1&c=1"); }), "supply \"a:b?c=1&c=1\": \"c\" is given twice; keep one");
  for (const char* text : {"", ":", ":b", "?a:b", "a:b?", "a:b?c", "a:b?c=1&", "a: b", "a:b\n", "a:\xc3\xa4"})
    EXPECT_NE(refusal([&] { return uri(text); }), "accepted") << text;
}

TEST(Uri, HasAHostAndAPort) {
  EXPECT_EQ(uri("a:psu.lab").host_and_port(502).text(), "psu.lab:502");
  EXPECT_EQ(uri("a:192.168.1.20:1502?x=1").host_and_port(502).text(), "192.168.1.20:1502");
  EXPECT_EQ(uri("a:[fe80::1]:65535").host_and_port(502).host, "fe80::1");
  EXPECT_EQ(uri("a:[fe80::1]").host_and_port(502).text(), "[fe80::1]:502");
  for (const char* text : {"a:", "a::502", "a:h:", "a:h:0", "a:h:65536", "a:h:-1", "a:h:+1", "a:h:50x", "a:[::1",
                           "a:[]:1", "a:[::1]502", "a:h:1:2"})
    EXPECT_NE(refusal([&] { return uri(text).host_and_port(502); }), "accepted") << text;
}

TEST(UsbAddress, IsVendorAndProductThenSerialAndPort) {
  EXPECT_EQ(UsbAddress::parse("usb:04d8:00dd"), (UsbAddress{0x04d8, 0x00dd, "", ""}));
  EXPECT_EQ(UsbAddress::parse("usb:04D8:00DD:0001AB"), (UsbAddress{0x04d8, 0x00dd, "0001AB", ""}));
  EXPECT_EQ(UsbAddress::parse("usb:1a86:7523@1-1.4"), (UsbAddress{0x1a86, 0x7523, "", "1-1.4"}));
  EXPECT_EQ(UsbAddress::parse("usb:1ab1:0588:DS:1@2-3:1.0"), (UsbAddress{0x1ab1, 0x0588, "DS:1", "2-3:1.0"}));
  EXPECT_EQ(UsbAddress::parse("usb:*:*:A@B"), (UsbAddress{{}, {}, "A@B", ""}));
}

TEST(UsbAddress, RefusesAnythingElseAndShowsTheForm) {
  for (const char* text :
       {"", "usb:", "usb:4d8:dd", "usb:04d8", "usb:04d8:00dg", "usb:04d8:00dd:", "usb:04d8:00dd@", "usb:04d8:00dd@one",
        "usb:04d8:00ddX", "04d8:00dd", "usb:-4d8:00dd", "usb:**:00dd", "usb::6001", "usb:04d8:00dd@1-1-2",
        "usb:04d8:00dd@1-", "usb:04d8:00dd@1-1:1:0", "usb:04d8:00dd::1"}) {
    EXPECT_THAT(refusal([&] { return UsbAddress::parse(text); }), testing::HasSubstr("usb:VENDOR:PRODUCT")) << text;
    EXPECT_FALSE(UsbAddress::read(text)) << text;
  }
}

TEST(UsbAddress, FitsWhatItNames) {
  EXPECT_TRUE(UsbAddress::parse("usb:04d8:00dd").fits(0x04d8, 0x00dd, "1"));
  EXPECT_TRUE(UsbAddress::parse("usb:*:00dd:1").fits(0x1234, 0x00dd, "1"));
  EXPECT_FALSE(UsbAddress::parse("usb:*:00dd:1").fits(0x1234, 0x00dd, ""));
  EXPECT_FALSE(UsbAddress::parse("usb:*:00dd:1").fits(0x1234, 0x00dd, "12"));
  EXPECT_FALSE(UsbAddress::parse("usb:04d8:*").fits(0x04d9, 0x00dd, "1"));
}

/// Texts made of what addresses are made of, mostly malformed.
std::string drawn(std::mt19937& random) {
  static const std::vector<std::string> pieces{"usb", ":", "@",   "?", "&",    "=",    "*", "[",     "]", "-",
                                               ".",   "/", "1-2", "0", "04d8", "00DD", "h", "65536", " ", "\xff"};
  std::string text = random() % 2 == 0 ? "usb:04d8:00dd" : "a:h";
  for (std::size_t n = random() % 9; n > 0; --n)
    text.insert(random() % (text.size() + 1), pieces[random() % pieces.size()]);
  return text;
}

TEST(Addresses, AreRefusedOrReadBackAsTheyWereWritten) {
  std::mt19937 random(1);
  int usb = 0, hosts = 0, refused = 0;
  for (int i = 0; i < 50'000; ++i) {
    const std::string text = drawn(random);
    if (const auto address = UsbAddress::read(text)) {
      ++usb;
      ASSERT_EQ(UsbAddress::read(address->text()), address) << text;
    }
    try {
      const Uri read = uri(text);
      std::string again = read.scheme() + ":" + read.location();
      for (const auto& [key, value] : read.options())
        again += (&value == &read.options().front().second ? "?" : "&") + key + "=" + value;
      ASSERT_EQ(again, text);
      const HostPort place = read.host_and_port(502);
      ASSERT_FALSE(place.host.empty()) << text;
      ASSERT_GT(place.port, 0) << text;
      ++hosts;
    } catch (const std::invalid_argument&) {
      ++refused;
    }
  }
  EXPECT_GT(usb, 1000);
  EXPECT_GT(hosts, 1000);
  EXPECT_GT(refused, 1000);
}

}  // namespace kphi::uri_test
