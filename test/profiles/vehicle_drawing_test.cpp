#include "profiles/vehicle_drawing.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <pugixml.hpp>
#include <string>

#include "test/source_dir.hpp"

namespace kphi::profiles {
namespace vehicle_drawing_test {

using testing::Each;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

Vehicle shipped(const char* name) { return load_vehicle(test::source_dir() + "/profiles/" + name); }

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

TEST(VehicleDrawing, IsWellFormedWithoutScriptsAndLinks) {
  for (const char* file : {"foldable_drone.yaml", "foldable_hexa.yaml", "telescoping_quad.yaml"}) {
    const std::string svg = draw_shapes(shipped(file));
    pugi::xml_document document;
    EXPECT_TRUE(document.load_string(svg.c_str())) << file;
    EXPECT_THAT(svg, Not(HasSubstr("<script")));
    EXPECT_THAT(svg, Not(HasSubstr("href")));
  }
}

TEST(VehicleDrawing, HasADiskForEachRotorOfEachShapeAndACoveredPartWherePhiIsAboveZero) {
  const Vehicle drone = shipped("foldable_drone.yaml");
  const std::string svg = draw_shapes(drone);
  EXPECT_EQ(count(svg, "class=\"disk\""), 4 * drone.shapes.size());
  EXPECT_EQ(count(svg, "class=\"plate\""), 4u) << "O alone covers";
  EXPECT_THAT(svg, HasSubstr("41.3°"));
  EXPECT_THAT(svg, HasSubstr("2↺ 0°"));
  EXPECT_THAT(occlusions_of(drone, "X"), Each(Radians(0)));
}

TEST(VehicleDrawing, HasTwoShapesInARowAndWordsThatATelephoneShowsAtTenPixels) {
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(draw_shapes(shipped("foldable_drone.yaml")).c_str()));
  const double shrunk = 358 / document.child("svg").attribute("width").as_double();
  for (const auto& words : document.select_nodes("//text"))
    EXPECT_GE(shrunk * words.node().attribute("font-size").as_double(), 10);
}

TEST(VehicleDrawing, ClipsEachCoveredPartByADiskOfItsOwn) {
  const std::string svg = draw_shapes(shipped("foldable_drone.yaml"));
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(svg.c_str()));
  for (const auto& part : document.select_nodes("//polygon[@clip-path]")) {
    const std::string path = part.node().attribute("clip-path").value();
    const std::string id = path.substr(5, path.size() - 6);
    EXPECT_THAT(document.select_nodes(("//clipPath[@id='" + id + "']").c_str()), SizeIs(1)) << path;
  }
}

std::string joined(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return all;
}

TEST(VehicleDrawing, InCharactersMarksEachHubOnceAShapeAndCoversInOAlone) {
  const auto lines = shapes_in_characters(shipped("foldable_drone.yaml"));  // H and O, below them T and X
  for (const std::string& line : lines) EXPECT_LE(line.size(), 78u);
  for (const char hub : {'1', '2', '3', '4'}) EXPECT_EQ(std::ranges::count(joined(lines), hub), 4) << hub;
  const auto half = lines.begin() + static_cast<std::ptrdiff_t>(lines.size() / 2);
  EXPECT_GT(std::ranges::count(joined({lines.begin(), half}), '#'), 5);
  EXPECT_EQ(std::ranges::count(joined({half, lines.end()}), '#'), 0);
  for (const char hub : {'5', '6'})
    EXPECT_EQ(std::ranges::count(joined(shapes_in_characters(shipped("foldable_hexa.yaml"))), hub), 3) << hub;
}

TEST(VehicleDrawing, PutsTheNoseUpAndTheLeftToTheLeft) {
  const auto lines = shapes_in_characters(shipped("telescoping_quad.yaml"));  // hub 1 is ahead and on the left
  const auto row_of = [&](char hub) {
    return std::ranges::find_if(lines, [hub](const std::string& line) { return line.find(hub) != std::string::npos; }) -
           lines.begin();
  };
  const auto column_of = [&](char hub) { return lines.at(static_cast<std::size_t>(row_of(hub))).find(hub); };
  EXPECT_LT(row_of('1'), row_of('2'));
  EXPECT_LT(column_of('1'), column_of('4'));
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(draw_shapes(shipped("telescoping_quad.yaml")).c_str()));
  const auto hub = document.select_node("//circle[@class='disk']").node();
  EXPECT_LT(hub.attribute("cx").as_double(), 0);
  EXPECT_LT(hub.attribute("cy").as_double(), 0);
}

}  // namespace vehicle_drawing_test
}  // namespace kphi::profiles
