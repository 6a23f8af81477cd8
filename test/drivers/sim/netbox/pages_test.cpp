
#include <gtest/gtest.h>

#include <pugixml.hpp>
#include <string>
#include <vector>

#include "drivers/sim/netbox/device.hpp"

namespace kphi::sim::pages_test {

struct Answer {
  std::string status;
  std::string body;
  pugi::xml_document xml;
};

Answer get(NetBoxDevice& box, const std::string& target) {
  Answer answer;
  const std::string text = box.http("GET " + target + " HTTP/1.0\r\nHost: box");
  answer.status = text.substr(0, text.find("\r\n"));
  answer.body = text.substr(text.find("\r\n\r\n") + 4);
  EXPECT_NE(text.find("Content-Length: " + std::to_string(answer.body.size()) + "\r\n"), std::string::npos);
  EXPECT_TRUE(answer.xml.load_string(answer.body.c_str())) << answer.body;
  return answer;
}

TEST(NetBoxPages, ConfigurationHasTheCapturedElementsInOrder) {
  const std::vector<std::string> captured{
      "runstat",   "runrate",    "runpkmx", "runpkmn",    "runmcb",     "runmco",        "runmcl",    "cfgnam",
      "cfgcalsel", "cfgcalsn",   "scfgfu",  "scfgtu",     "cfgtfx",     "scfgtdu",       "scfgtau",   "cfgcpf",
      "cfgcpt",    "cfgmr",      "cfgusra", "cfgusrb",    "setcfgsel",  "setpke",        "setmce",    "setbias",
      "mce",       "mcx",        "mcc",     "mcv",        "mco",        "setuserfilter", "nethwaddr", "netip",
      "comnetip",  "comnetdhcp", "comrdte", "comrdtrate", "comrdtbsiz", "mfgdigsn",      "mfgdigver"};
  NetBoxDevice box{NetBoxSettings{}};
  const Answer answer = get(box, "/netftapi2.xml");
  EXPECT_EQ(answer.status, "HTTP/1.0 200 OK");
  std::vector<std::string> found;
  for (const auto& element : answer.xml.child("netft")) found.emplace_back(element.name());
  ASSERT_GE(found.size(), captured.size());
  EXPECT_EQ(std::vector<std::string>(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(captured.size())),
            captured);
}

TEST(NetBoxPages, DefaultsAreAMini40InNewtons) {
  NetBoxDevice box{NetBoxSettings{}};
  const Answer answer = get(box, "/netftapi2.xml?index=0");
  constexpr std::pair<const char*, const char*> kDefaults[] = {
      {"cfgmr", "20;20;60;1;1;1"},
      {"cfgcpf", "1000000"},
      {"cfgcpt", "1000000"},
      {"scfgfu", "N"},
      {"scfgtu", "Nm"},
      {"comrdte", "Enabled"},
      {"comrdtrate", "7000"},
      {"comrdtbsiz", "40"},
      {"runrate", "7000"},
      {"runstat", "0x00000000"},
      {"mcx", "-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1"}};
  for (const auto& [name, content] : kDefaults) EXPECT_STREQ(answer.xml.child("netft").child_value(name), content);
}

TEST(NetBoxPages, ShowTheQuantisedRateAndThePeaks) {
  NetBoxSettings settings;
  settings.rate_hz = 150;
  NetBoxDevice box(settings);
  box.sample({Instant{0}, {1, 0, -2, 0, 0, 0}});
  const Answer answer = get(box, "/netftapi2.xml");
  EXPECT_STREQ(answer.xml.child("netft").child_value("comrdtrate"), "152");
  EXPECT_STREQ(answer.xml.child("netft").child_value("runpkmx"), "1000000;0;0;0;0;0");
  EXPECT_STREQ(answer.xml.child("netft").child_value("runpkmn"), "0;0;-2000000;0;0;0");
}

TEST(NetBoxPages, EmptyCalibrationSlotsShowIt) {
  NetBoxDevice box{NetBoxSettings{}};
  const Answer slot = get(box, "/netftapi2.xml?index=15");
  EXPECT_STREQ(slot.xml.child("netft").child_value("cfgcalsn"), "FT0000");
  EXPECT_STREQ(slot.xml.child("netft").child_value("cfgmr"), "0;0;0;0;0;0");
  EXPECT_STREQ(get(box, "/netftcalapi.xml?index=3").xml.child("netftCalibration").child_value("calsn"), "FT0000");
}

TEST(NetBoxPages, CalibrationAgreesWithTheConfiguration) {
  NetBoxDevice box{NetBoxSettings{}};
  const Answer calibration = get(box, "/netftcalapi.xml");
  const Answer configuration = get(box, "/netftapi2.xml");
  EXPECT_STREQ(calibration.xml.child("netftCalibration").child_value("calsn"),
               configuration.xml.child("netft").child_value("cfgcalsn"));
  EXPECT_STREQ(calibration.xml.child("netftCalibration").child_value("calcpf"), "1000000");
}

TEST(NetBoxPages, EverythingElseIsNotFound) {
  NetBoxDevice box{NetBoxSettings{}};
  for (const char* request :
       {"GET /other.cgi?comrdtrate=100 HTTP/1.0", "GET / HTTP/1.0", "POST /netftapi2.xml HTTP/1.0", "GET", "",
        "GET /netftapi2.xml?index=16 HTTP/1.0", "GET /netftapi2.xml?index=x HTTP/1.0",
        "GET /netftapi2.xml?index= HTTP/1.0", "GET /netftapi2.xml?slot=1 HTTP/1.0"}) {
    EXPECT_EQ(box.http(request).substr(0, 22), "HTTP/1.0 404 Not Found") << request;
  }
}

}  // namespace kphi::sim::pages_test
