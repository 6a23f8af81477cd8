#include "drivers/netbox/configuration/configuration.hpp"

#include <gmock/gmock.h>

#include <clocale>
#include <cstdlib>
#include <random>

#include "base/error.hpp"
#include "test/drivers/netbox/record_bytes.hpp"
#include "test/refusal.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::netbox::configuration_test {

using namespace test;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

std::string refused(const std::string& xml) {
  return refusal([&] { return parse_configuration(xml, "Net Box 192.168.1.11"); });
}
/// Of the captured box with another content of one element.
std::string refused(const char* element, const char* content) {
  return refused(with(captured_xml(), element, content));
}
Configuration configured(const char* element, const char* content) {
  return parse_configuration(with(captured_xml(), element, content));
}

struct Edit {
  const char* element;
  const char* content;
  const char* words;
};

TEST(Configuration, ReadsACapturedBox) {
  const Configuration configuration = parse_configuration(captured_xml());
  EXPECT_EQ(configuration.product, "");
  EXPECT_EQ(configuration.firmware, "2.2.59");
  EXPECT_EQ(configuration.serial, "LOTxxxx");
  EXPECT_EQ(configuration.calibration_serial, "FTxxxxx");
  EXPECT_EQ(configuration.slot, 0);
  EXPECT_EQ(configuration.slot_name, "empty");
  EXPECT_EQ(configuration.force_unit, "N");
  EXPECT_EQ(configuration.torque_unit, "Nm");
  EXPECT_EQ(configuration.counts_per_newton, 1e6);
  EXPECT_EQ(configuration.counts_per_newton_metre, 1e6);
  EXPECT_THAT(configuration.range, ElementsAre(330, 330, 990, 30, 30, 30));
  EXPECT_EQ(configuration.device_rate_hz, 7000);
  EXPECT_EQ(configuration.divisor, 70u);
  EXPECT_EQ(configuration.rdt_rate_hz, 100);
  EXPECT_EQ(configuration.records_per_datagram, 1);
  EXPECT_TRUE(configuration.rdt_enabled);
  EXPECT_EQ(configuration.filter_code, 0);
  EXPECT_THAT(configuration.tool_transform, ElementsAre(0, 0, 132.71, 0, 0, 0));
  EXPECT_EQ(configuration.tool_distance_unit, "mm");
  EXPECT_EQ(configuration.tool_angle_unit, "degrees");
  EXPECT_THAT(configuration.gage_bias, ElementsAre(745, 17, 447, 184, -596, -253));
  EXPECT_EQ(configuration.xml, captured_xml());
}

TEST(Configuration, TellsTheMonitorConditionsThatAreOn) {
  const Configuration captured = parse_configuration(captured_xml());
  EXPECT_FALSE(captured.monitoring);
  ASSERT_TRUE(captured.monitor_conditions);
  ASSERT_EQ(captured.monitor_conditions->size(), 2u);
  const MonitorCondition& first = captured.monitor_conditions->front();
  EXPECT_EQ(first.axis, 3);
  EXPECT_FALSE(first.above);
  EXPECT_EQ(first.threshold, 0.1);
  EXPECT_EQ(captured.monitor_conditions->back().threshold, -0.01);
  EXPECT_TRUE(configured("setmce", "1").monitoring);
}

TEST(Configuration, MonitorConditionsThatItDoesNotUnderstandAreUnknownAndNoReasonToRefuse) {
  for (const char* content :
       {"", "1;1", "1;1;0;0;0;0;0;0;0;0;0;0;0;0;0;x", "99999999999;1;0;0;0;0;0;0;0;0;0;0;0;0;0;0"})
    EXPECT_FALSE(configured("mcv", content).monitor_conditions) << content;
  EXPECT_FALSE(configured("mce", nullptr).monitor_conditions);
}

TEST(Configuration, KnowsEverySpellingOfTheUnits) {
  const std::pair<const char*, double> forces[] = {
      {"N", 1},         {"kN", 1000},      {"lbf", 4.4482216152605}, {"klbf", 4448.2216152605},
      {"kgf", 9.80665}, {"gf", 0.00980665}};
  for (const auto& [name, newtons] : forces) {
    const Configuration configuration = configured("scfgfu", name);
    EXPECT_EQ(configuration.force_unit, name);
    EXPECT_NEAR(configuration.counts_per_newton * newtons, 1e6, 1e-8) << name;
    EXPECT_NEAR(configuration.range[2], 990 * newtons, 1e-9 * 990 * newtons) << name;
  }
  const std::pair<const char*, double> torques[] = {{"Nm", 1},
                                                    {"N-m", 1},
                                                    {"Nmm", 0.001},
                                                    {"N-mm", 0.001},
                                                    {"kg-cm", 0.0980665},
                                                    {"kgf-cm", 0.0980665},
                                                    {"kNm", 1000},
                                                    {"kN-m", 1000},
                                                    {"lbf-in", 0.1129848290276167},
                                                    {"lbf-ft", 1.3558179483314004}};
  for (const auto& [name, newton_metres] : torques) {
    const Configuration configuration = configured("scfgtu", name);
    EXPECT_EQ(configuration.torque_unit, name);
    EXPECT_NEAR(configuration.counts_per_newton_metre * newton_metres, 1e6, 1e-8) << name;
    EXPECT_NEAR(configuration.range[5], 30 * newton_metres, 1e-9 * 30 * newton_metres) << name;
  }
}

TEST(Configuration, OneCountPerPoundForceIsAScaleLikeAnother) {
  const std::string xml = with(with(captured_xml(), "scfgfu", "lbf"), "cfgcpf", "1");
  EXPECT_DOUBLE_EQ(parse_configuration(xml).counts_per_newton, 1 / 4.4482216152605);
}

TEST(Configuration, FallsBackToTheUnitsCodes) {
  std::string xml = with(with(captured_xml(), "scfgfu", nullptr), "cfgfu", "4");
  xml = with(with(xml, "scfgtu", nullptr), "cfgtu", "6");
  const Configuration configuration = parse_configuration(xml);
  EXPECT_EQ(configuration.counts_per_newton, 1000);
  EXPECT_EQ(configuration.counts_per_newton_metre, 1000);
}

TEST(Configuration, RefusesUnitsItDoesNotKnow) {
  EXPECT_THAT(refused("scfgfu", "pond"),
              AllOf(HasSubstr("Net Box 192.168.1.11"), HasSubstr("unknown unit \"pond\""), HasSubstr("choose N")));
  EXPECT_THAT(refused("scfgfu", "n"), HasSubstr("unknown unit"));
  EXPECT_THAT(refused("scfgtu", "N"), HasSubstr("unknown unit"));
  EXPECT_THAT(refused(with(with(captured_xml(), "scfgfu", nullptr), "cfgfu", "7")), HasSubstr("unknown unit \"7\""));
}

TEST(Configuration, ReadsArraysHoweverTheyAreSeparated) {
  for (const char* ranges : {"20;20;60;1;1;1", "20,20,60,1,1,1", "20 20 60 1 1 1", " 20; 20; 60; 1; 1; 1 "})
    EXPECT_THAT(configured("cfgmr", ranges).range, ElementsAre(20, 20, 60, 1, 1, 1));
}

TEST(Configuration, ReadsFlagsHoweverTheyAreSpelt) {
  for (const char* on : {"Enabled", "enabled", "1"}) EXPECT_TRUE(configured("comrdte", on).rdt_enabled) << on;
  for (const char* off : {"Disabled", "0"}) EXPECT_FALSE(configured("comrdte", off).rdt_enabled) << off;
  EXPECT_THAT(refused("comrdte", "maybe"), HasSubstr("neither Enabled nor Disabled"));
}

TEST(Configuration, RefusesASlotThatMeasuresNothing) {
  for (const auto& [element, content] :
       {std::pair("cfgcpf", "0"), {"cfgcpt", "0"}, {"cfgcpf", "-1000000"}, {"cfgmr", "0;0;0;0;0;0"}})
    EXPECT_THAT(refused(element, content), HasSubstr("not usable")) << element;
  EXPECT_THAT(refused("cfgcalsn", "FT0000"), HasSubstr("empty calibration"));
}

TEST(Configuration, TellsTheProductByItsName) {
  const std::pair<const char*, Product> known[] = {{"Net F/T", Product::net_box},
                                                   {"NetFT", Product::net_box},
                                                   {"Net Box", Product::net_box},
                                                   {"Ethernet Axia", Product::axia},
                                                   {"ETHERNET AXIA80-M20", Product::axia}};
  for (const auto& [name, kind] : known) {
    const Configuration box = configured("prodname", name);
    EXPECT_EQ(box.kind, kind) << name;
    EXPECT_EQ(box.product, name);
  }
}

TEST(Configuration, TellsTheProductByItsFirmwareWhereItHasNoName) {
  EXPECT_EQ(parse_configuration(captured_xml()).kind, Product::net_box);
  EXPECT_EQ(configured("mfgdigver", "1.0.3").kind, Product::net_box);
  EXPECT_EQ(configured("setrate", "7812").kind, Product::axia);
  EXPECT_THAT(refused("mfgdigver", "7.1"), HasSubstr("neither a Net Box nor an Ethernet Axia"));
}

TEST(Configuration, RefusesAProductItDoesNotKnow) {
  EXPECT_THAT(refused("prodname", "Wireless F/T"), HasSubstr("\"Wireless F/T\" with firmware 2.2.59 is neither"));
}

TEST(Configuration, TheFiveRatesOfAnAxiaAreRoundedDownFrom7812AndAHalf) {
  const std::string axia = with(with(captured_xml(), "prodname", "Ethernet Axia"), "comrdtrate", "488");
  const std::pair<const char*, double> rates[] = {
      {"488", 488.28125}, {"976", 976.5625}, {"1953", 1953.125}, {"3906", 3906.25}, {"7812", 7812.5}};
  for (const auto& [shown, true_hz] : rates) {
    const Configuration box = parse_configuration(with(axia, "setrate", shown));
    EXPECT_EQ(box.device_rate_hz, true_hz);
    EXPECT_EQ(parse_configuration(with(with(axia, "setrate", shown), "comrdtrate", shown)).divisor, 1u);
  }
  EXPECT_EQ(parse_configuration(with(axia, "setrate", "7812")).divisor, 16u);
  EXPECT_THAT(refused(with(axia, "setrate", "7000")), HasSubstr("488, 976, 1953, 3906 and 7812"));
}

TEST(Configuration, DoesNotPretendToKnowAnAxiasFilters) {
  const std::string axia = with(captured_xml(), "prodname", "Ethernet Axia");
  EXPECT_EQ(filter_cutoff_hz(parse_configuration(axia)), 0.0);
  EXPECT_EQ(filter_cutoff_hz(parse_configuration(with(axia, "setuserfilter", "3"))), std::nullopt);
  EXPECT_EQ(filter_cutoff_hz(configured("setuserfilter", "3")), 152.0);
}

TEST(Configuration, KnowsThePeaksWhereTheBoxKeepsThem) {
  const Configuration box = parse_configuration(captured_xml());
  ASSERT_TRUE(box.peaks.has_value());
  EXPECT_EQ(box.peaks->high[2], 20557075);
  EXPECT_EQ(box.peaks->low[5], -729991);
  EXPECT_FALSE(configured("setpke", "0").peaks.has_value());
}

TEST(Configuration, RefusesWhenAnElementItNeedsIsMissingOrTwice) {
  for (const char* element :
       {"runrate", "cfgcalsn", "scfgfu", "scfgtu", "cfgcpf", "cfgcpt", "cfgmr", "setcfgsel", "setuserfilter", "comrdte",
        "comrdtrate", "comrdtbsiz", "mfgdigver", "cfgtfx", "setbias"}) {
    EXPECT_THAT(refused(element, nullptr), HasSubstr("missing")) << element;
    std::string twice = captured_xml();
    twice.insert(twice.find("</netft>"), std::string("<") + element + ">1</" + element + ">");
    EXPECT_THAT(refused(twice), HasSubstr("more than once")) << element;
  }
}

TEST(Configuration, RefusesNumbersThatAreNone) {
  for (const char* nonsense : {"abc", "1e6x", "1 000 000", "nan", "inf", "1e999", "0x10"})
    EXPECT_THAT(refused("cfgcpf", nonsense), HasSubstr("not a number")) << nonsense;
  for (const Edit& wrong : {Edit{"cfgmr", "1;2;3;4;5", "not six numbers"},
                            {"comrdtbsiz", "41", "from 1 to 40"},
                            {"comrdtbsiz", "1.5", "from 1 to 40"},
                            {"comrdtrate", "0", "from 1 to 7000"},
                            {"setuserfilter", "13", "from 0 to 12"}})
    EXPECT_THAT(refused(wrong.element, wrong.content), HasSubstr(wrong.words));
}

TEST(Configuration, RefusesWhatIsNoNetBox) {
  EXPECT_THAT(refused("<html><body>404</body></html>"), HasSubstr("no element <netft>"));
  EXPECT_THAT(refused(""), HasSubstr("broken"));
  EXPECT_THAT(refused(captured_xml().substr(0, 900)), HasSubstr("broken"));
}

TEST(Configuration, RefusesAPageWithNulBytesWhichNoFileCouldKeepVerbatim) {
  std::string utf16 = "\xff\xfe";
  for (const char c : captured_xml()) (utf16 += c) += '\0';
  EXPECT_THAT(refused(utf16), HasSubstr("NUL byte at 3: it is not in UTF-8"));
  EXPECT_THAT(refused(captured_xml() + '\0'), HasSubstr("NUL byte"));
}

TEST(Configuration, ShowsNamesThatAreNoUtf8WithoutTheirRawBytes) {
  const Configuration box = parse_configuration(with(captured_xml(), "cfgnam",
                                                     "Pr\xFC"
                                                     "fstand \x1B[2J"));
  EXPECT_EQ(box.slot_name, "Pr\uFFFDfstand \uFFFD[2J");
  EXPECT_THAT(box.xml, HasSubstr("Pr\xFC"
                                 "fstand"))
      << "verbatim";
}

TEST(Configuration, AnyCutOfTheXmlIsRefusedNeverMisread) {
  const std::string xml = captured_xml();
  for (std::size_t length = 0; length < xml.size(); ++length) ASSERT_NE(refused(xml.substr(0, length)), "") << length;
}

TEST(Configuration, RandomDamageIsRefusedOrReadNeverWorse) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 3000; ++trial) {
    std::string xml = captured_xml();
    for (int damage = 0; damage < 3; ++damage) xml[random() % xml.size()] = static_cast<char>(random());
    try {
      const Configuration configuration = parse_configuration(xml);
      EXPECT_GT(configuration.counts_per_newton, 0);
      EXPECT_GE(configuration.divisor, 1u);
    } catch (const DeviceError&) {
    }
  }
}

TEST(Configuration, DoesNotDependOnTheLocale) {
  const kphi::test::TemporaryFolder locales;
  const std::string made = "localedef -i de_DE -f UTF-8 " + (locales / "de_DE.UTF-8").string();
  if (std::system(made.c_str()) != 0) GTEST_SKIP() << "apt install locales";
  setenv("LOCPATH", locales.path().c_str(), 1);
  const std::string before = std::setlocale(LC_ALL, nullptr);
  ASSERT_TRUE(std::setlocale(LC_ALL, "de_DE.UTF-8"));
  ASSERT_STREQ(std::localeconv()->decimal_point, ",");
  const Configuration configuration = parse_configuration(captured_xml());
  std::setlocale(LC_ALL, before.c_str());
  unsetenv("LOCPATH");
  EXPECT_EQ(configuration.tool_transform[2], 132.71);
}

TEST(Configuration, FindsTheTrueRateBehindEachOfThe166ThatTheBoxShows) {
  int distinct = 0;
  int before = 0;
  for (int requested = 7000; requested >= 1; --requested) {
    const int divisor = 7000 / requested;
    const int shown = 7000 / divisor;
    if (shown == before) continue;
    before = shown;
    ++distinct;
    const Configuration configuration = configured("comrdtrate", std::to_string(shown).c_str());
    ASSERT_EQ(configuration.divisor, static_cast<unsigned>(divisor)) << shown;
    ASSERT_DOUBLE_EQ(configuration.rdt_rate_hz, 7000.0 / divisor) << shown;
  }
  EXPECT_EQ(distinct, 166);
}

TEST(Filter, CutoffsAreNotMonotonicInTheCode) {
  constexpr std::optional<double> kNone;
  for (const auto& [code, cutoff_hz] :
       {std::pair(0, std::optional(0.0)), {1, 838}, {8, 5}, {9, 1500}, {12, 3000}, {13, kNone}, {-1, kNone}})
    EXPECT_EQ(filter_cutoff_hz(code), cutoff_hz) << code;
}

TEST(Changes, NameWhatGivesTheCountsAnotherMeaning) {
  const Configuration before = parse_configuration(captured_xml());
  EXPECT_EQ(to_words(compare(before, before)), "");
  for (const Edit& edit :
       {Edit{"cfgcalsn", "FT12345", "calibration"}, Edit{"mfgdigver", "2.3.0", "firmware"},
        Edit{"prodname", "Ethernet Axia", "product"}, Edit{"mfgdigsn", "LOT2", "product"},
        Edit{"setcfgsel", "1", "configuration slot"}, Edit{"scfgfu", "kN", "units, counts per unit, ranges"},
        Edit{"cfgcpt", "500000", "counts per unit"}, Edit{"cfgmr", "330;330;990;30;30;60", "ranges"},
        Edit{"comrdtrate", "1000", "rate"}, Edit{"comrdtbsiz", "40", "records per datagram"},
        Edit{"setuserfilter", "4", "filter"}, Edit{"cfgtfx", "0;0;0;0;0;0", "tool transform"},
        Edit{"scfgtdu", "in", "tool transform"}, Edit{"setbias", "0;0;0;0;0;0", "gage bias"}}) {
    const Configuration after = configured(edit.element, edit.content);
    EXPECT_EQ(to_words(compare(before, after)), edit.words) << edit.element;
  }
}

TEST(Changes, WhatMovesByItselfIsNoChange) {
  const Configuration before = parse_configuration(captured_xml());
  std::string later = with(captured_xml(), "runstat", "0x80010000");
  later = with(later, "runpkmx", "15186841;15450145;20557075;1367250;2491043;1854244");
  EXPECT_EQ(compare(before, parse_configuration(later)), 0u);
}

TEST(Changes, ABoxWithNarrowerPeaksHasForgottenThem) {
  const auto with_peaks = [](const char* high, const char* low) {
    return parse_configuration(with(with(captured_xml(), "runpkmx", high), "runpkmn", low));
  };
  const Configuration before = with_peaks("9;9;9;9;9;9", "-9;-9;-9;-9;-9;-9");
  EXPECT_FALSE(forgot_peaks(before, before));
  EXPECT_FALSE(forgot_peaks(before, with_peaks("9;9;10;9;9;9", "-9;-9;-9;-9;-9;-11")));
  EXPECT_TRUE(forgot_peaks(before, with_peaks("9;9;8;9;9;9", "-9;-9;-9;-9;-9;-9")));
  EXPECT_TRUE(forgot_peaks(before, with_peaks("20;20;20;20;20;20", "-9;-9;-9;-9;-9;-8")));
  Configuration unknown = before;
  unknown.peaks.reset();
  EXPECT_FALSE(forgot_peaks(before, unknown));
  EXPECT_FALSE(forgot_peaks(unknown, before));
}

}  // namespace kphi::netbox::configuration_test
