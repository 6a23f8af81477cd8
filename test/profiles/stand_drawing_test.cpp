#include "profiles/stand_drawing.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <pugixml.hpp>
#include <string>

namespace kphi::profiles {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const StandSketch kThreeBlades{3, +1};

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

TEST(StandDrawing, IsWellFormedWithoutScriptsAndLinks) {
  for (const std::string& svg : {draw_stand(kThreeBlades, {0, 45, 90, 180, 270}), draw_plates(kThreeBlades, {90})}) {
    pugi::xml_document document;
    EXPECT_TRUE(document.load_string(svg.c_str()));
    EXPECT_THAT(svg, Not(HasSubstr("<script")));
    EXPECT_THAT(svg, Not(HasSubstr("href")));
  }
}

TEST(StandDrawing, NamesWhatTheLoadCellCarries) {
  EXPECT_THAT(draw_stand(kThreeBlades, {90}), HasSubstr("load cell: carries plate, motor and propeller"));
}

TEST(StandDrawing, HasAPlateForEachOcclusionAndNoneAtZero) {
  const std::string svg = draw_plates(kThreeBlades, {0, 45, 350});
  EXPECT_EQ(count(svg, "class=\"plate\""), 2u);
  EXPECT_THAT(svg, HasSubstr("φ = 0°: no plate"));
  EXPECT_THAT(svg, HasSubstr("φ = 45°"));
  EXPECT_EQ(count(svg, "<ellipse"), 9u) << "three blades each";
}

/// Where the sector's rim ends, seen from its middle: degrees clockwise from the top.
double drawn_angle(double deg) {
  const std::string svg = draw_plates(kThreeBlades, {deg});
  const auto arc = svg.find("A84,84 0 ");
  double x = 0, y = 0;
  int large = 0;
  EXPECT_EQ(std::sscanf(svg.c_str() + arc, "A84,84 0 %d 1 %lf,%lf", &large, &x, &y), 3);
  EXPECT_EQ(large, deg > 180);
  const double angle = std::atan2(x, -y) * 180 / M_PI;
  return angle < 0 ? angle + 360 : angle;
}

TEST(StandDrawing, DrawsTheAngleThatIsAskedFor) {
  for (const double deg : {1.0, 45.0, 90.0, 179.0, 181.0, 270.0, 359.0}) EXPECT_NEAR(drawn_angle(deg), deg, 0.02);
}

TEST(StandDrawing, ShowsTheSenseOnlyWhereItIsKnown) {
  EXPECT_EQ(count(draw_plates({2, 0}, {90}), "marker-end"), 0u);
  EXPECT_NE(draw_plates({2, +1}, {90}), draw_plates({2, -1}, {90}));
}

TEST(PlateInCharacters, CoversTheShareOfTheDiskThatThePlateDoes) {
  for (double deg = 0; deg <= 360; deg += 15) {
    double covered = 0, free = 0;
    for (const std::string& line : plate_in_characters(deg)) {
      covered += static_cast<double>(std::ranges::count(line, '#'));
      free += static_cast<double>(std::ranges::count(line, '.'));
    }
    EXPECT_NEAR(covered / (covered + free), deg / 360, 0.04) << deg;
  }
}

TEST(PlateInCharacters, FitsATerminalOfEightyColumns) {
  for (const std::string& line : plate_in_characters(200)) EXPECT_LE(line.size(), 60u);
}

}  // namespace
}  // namespace kphi::profiles
