// The rules against the sources: a device that a driver names must be one that a person may open.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "test/source_dir.hpp"

namespace kphi {
namespace rules_test {

namespace fs = std::filesystem;
using Ids = std::set<std::string>;  // "04d8:00dd"

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::string rules() { return text_of(fs::path(kphi::test::source_dir()) / "drivers/udev/60-kphi.rules"); }

Ids matches(const std::string& text, const std::regex& pattern) {
  Ids found;
  for (std::sregex_iterator at(text.begin(), text.end(), pattern), end; at != end; ++at)
    found.insert(at->str(1) + ":" + at->str(2));
  return found;
}

/// kVendor = 0x04d8, kProduct = 0x00dd; and "usb:1a86:7523" in texts.
Ids named_by(const std::string& source) {
  static const std::regex kConstants(R"(kVendor\s*=\s*0x([0-9a-f]{4})\s*,\s*kProduct\s*=\s*0x([0-9a-f]{4}))");
  static const std::regex kTexts(R"(usb:([0-9a-f]{4}):([0-9a-f]{4}))");
  Ids ids = matches(source, kConstants);
  ids.merge(matches(source, kTexts));
  return ids;
}

Ids allowed() {
  static const std::regex kRule("ATTRS?\\{idVendor\\}==\"([0-9a-f]{4})\", ATTRS?\\{idProduct\\}==\"([0-9a-f]{4})\"");
  return matches(rules(), kRule);
}

TEST(UdevRules, KnowEveryDeviceThatADriverNames) {
  Ids named;
  for (const auto& file : fs::recursive_directory_iterator(fs::path(kphi::test::source_dir()) / "drivers")) {
    const std::string path = file.path().string();
    if (!file.is_regular_file() || path.find("/sim/") != std::string::npos || path.find("/udev/") != std::string::npos)
      continue;
    named.merge(named_by(text_of(file.path())));
  }
  EXPECT_TRUE(named.contains("04d8:00dd")) << "or this test finds nothing";
  for (const std::string& id : named) EXPECT_TRUE(allowed().contains(id)) << id;
}

TEST(UdevRules, FindIdsHoweverTheyAreWritten) {
  EXPECT_THAT(named_by("constexpr x kVendor = 0x1209,\n  kProduct = 0x0001;"), testing::ElementsAre("1209:0001"));
  EXPECT_THAT(named_by("write usb:0403:6001:SERIAL"), testing::ElementsAre("0403:6001"));
}

TEST(UdevRules, LetPeopleOpenInstrumentsByTheirClass) {
  EXPECT_THAT(rules(), testing::HasSubstr("ENV{ID_USB_INTERFACES}==\"*:fe03??:*\""));
}

TEST(UdevRules, LetEachMatchedDeviceBeOpened) {
  std::istringstream lines(rules());
  int matched = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#') || line.find("MODE=") == std::string::npos) continue;
    ++matched;
    EXPECT_THAT(line, testing::AllOf(testing::HasSubstr("MODE=\"0660\""), testing::HasSubstr("GROUP=\""),
                                     testing::HasSubstr("TAG+=\"uaccess\"")));
  }
  EXPECT_EQ(matched, 6);
}

TEST(UdevRules, MakeTheMotorsAdapterAnswerAtOnce) {
  EXPECT_THAT(rules(), testing::HasSubstr("DRIVER==\"ftdi_sio\", ATTR{latency_timer}=\"1\""));
}

}  // namespace rules_test
}  // namespace kphi
