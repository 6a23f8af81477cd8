#include "drivers/netbox/configuration/changes.hpp"

#include <gtest/gtest.h>

#include "test/drivers/netbox/record_bytes.hpp"

namespace kphi::netbox {
namespace {

using test::captured_xml;
using test::with;

struct Edit {
  const char* element;
  const char* content;
  const char* words;
};

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
    const Configuration after = parse_configuration(with(captured_xml(), edit.element, edit.content));
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

}  // namespace
}  // namespace kphi::netbox
