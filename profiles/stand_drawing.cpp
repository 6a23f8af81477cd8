#include "profiles/stand_drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kphi::profiles {
namespace {

constexpr double kDisk = 62, kPlate = 84;  // radii in units of the picture; plates are larger than the disk
constexpr int kWidth = 220, kHeight = 226;

constexpr const char* kPlateFill = "fill=\"#c65a00\" fill-opacity=\".45\" stroke=\"#c65a00\"";
constexpr const char* kDiskLine = "fill=\"none\" stroke=\"#0b62c4\" stroke-width=\"2\" stroke-dasharray=\"5 4\"";
constexpr const char* kBlade = "fill=\"#0b62c4\" fill-opacity=\".8\"";

struct Point {
  double x, y;
};

/// On a circle about the middle of a plate's picture; degrees clockwise from the top.
Point on_circle(double radius, double deg) {
  const double angle = deg * std::numbers::pi / 180;
  return {radius * std::sin(angle), -radius * std::cos(angle)};
}

/// From the top clockwise; 360° would be a path without length.
std::string sector(double radius, double deg) {
  const Point end = on_circle(radius, std::min(deg, 359.99));
  return fmt::format("M0,0 L0,{:g} A{:g},{:g} 0 {} 1 {:.2f},{:.2f} Z", -radius, radius, radius, deg > 180 ? 1 : 0,
                     end.x, end.y);
}

std::string text(double x, double y, const std::string& words, const char* anchor = "middle", int size = 14) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" font-size=\"{}\">{}</text>\n", x, y, anchor,
                     size, words);
}

std::string blades(const StandSketch& sketch) {
  std::string drawn;
  for (int i = 0; i < sketch.blades; ++i)
    drawn += fmt::format("<ellipse class=\"disk\" {} rx=\"4.5\" ry=\"{:g}\" cy=\"{:g}\" transform=\"rotate({:g})\"/>\n",
                         kBlade, kDisk / 2, -kDisk / 2, 20 + 360.0 * i / sketch.blades);
  return drawn + "<circle r=\"7\" fill=\"currentColor\"/>\n";
}

/// A quarter of a turn around the disk, outside the plate.
std::string sense(int spin) {
  if (spin == 0) return "";
  const double radius = kPlate + 11, from = spin > 0 ? -20 : -100, to = spin > 0 ? -100 : -20;
  const Point a = on_circle(radius, from), b = on_circle(radius, to);
  return fmt::format(
      "<path d=\"M{:.1f},{:.1f} A{:g},{:g} 0 0 {} {:.1f},{:.1f}\" fill=\"none\" stroke=\"currentColor\" "
      "stroke-width=\"1.5\" marker-end=\"url(#kphi-arrow)\"/>\n",
      a.x, a.y, radius, radius, spin > 0 ? 0 : 1, b.x, b.y);
}

std::string plate(const StandSketch& sketch, double deg) {
  std::string drawn;
  if (deg > 0) {
    drawn += fmt::format("<path class=\"plate\" d=\"{}\" {}/>\n", sector(kPlate, deg), kPlateFill);
    const Point end = on_circle(34, std::min(deg, 359.99)), label = on_circle((kDisk + kPlate) / 2, deg / 2);
    drawn += fmt::format("<path d=\"M0,-34 A34,34 0 {} 1 {:.2f},{:.2f}\" fill=\"none\" stroke=\"currentColor\"/>\n",
                         deg > 180 ? 1 : 0, end.x, end.y);
    drawn += text(label.x, label.y + 5, "φ");
  }
  drawn += fmt::format("<circle class=\"disk\" r=\"{:g}\" {}/>\n", kDisk, kDiskLine);
  return drawn + blades(sketch) + sense(sketch.spin);
}

std::string picture(int width, int height, const std::string& title, const std::string& inside) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" role=\"img\" "
      "aria-label=\"{}\" fill=\"currentColor\" font-family=\"sans-serif\">\n<title>{}</title>\n"
      "<defs><marker id=\"kphi-arrow\" viewBox=\"0 0 10 10\" refX=\"8\" refY=\"5\" markerWidth=\"6\" "
      "markerHeight=\"6\" "
      "orient=\"auto-start-reverse\"><path d=\"M0,0 L10,5 L0,10 Z\" "
      "fill=\"currentColor\"/></marker></defs>\n{}</svg>\n",
      width, height, width, height, title, title, inside);
}

/// "φ = 90°".
std::string caption(double deg) { return deg > 0 ? fmt::format("φ = {:g}°", deg) : "φ = 0°: no plate"; }

std::string row_of_plates(const StandSketch& sketch, const std::vector<double>& occlusions_deg, int top) {
  std::string drawn;
  for (std::size_t i = 0; i < occlusions_deg.size(); ++i)
    drawn += fmt::format("<g transform=\"translate({:g},{})\">\n{}{}</g>\n", kWidth * (static_cast<double>(i) + 0.5),
                         top + 104, plate(sketch, occlusions_deg[i]),
                         text(0, 117, caption(occlusions_deg[i]), "middle", 16));
  return drawn;
}

int width_of(const std::vector<double>& occlusions_deg) { return kWidth * static_cast<int>(occlusions_deg.size()); }

}  // namespace

StandSketch sketch_of(const Propeller& propeller, int spin) { return {std::max(propeller.blades, 2), spin}; }

std::string draw_stand(const StandSketch& sketch, const std::vector<double>& occlusions_deg) {
  const auto box = [](int x, int y, int width, int height, const char* style) {
    return fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" {}/>\n", x, y, width, height, style);
  };
  const auto arrow = [](int x, int from, int to, const char* colour) {
    return fmt::format("<path d=\"M{},{} L{},{}\" stroke=\"{}\" stroke-width=\"2\" marker-end=\"url(#kphi-arrow)\"/>\n",
                       x, from, x, to, colour);
  };
  constexpr const char* kSolid = "fill=\"currentColor\" fill-opacity=\".18\" stroke=\"currentColor\"";
  std::string drawn = box(20, 208, 260, 6, "fill=\"currentColor\"") + box(140, 168, 20, 40, kSolid);
  drawn += box(120, 140, 60, 28, "class=\"cell\" fill=\"#0a7d55\" fill-opacity=\".45\" stroke=\"#0a7d55\"");
  drawn += box(150, 122, 84, 7, fmt::format("class=\"plate\" {}", kPlateFill).c_str());
  drawn += box(146, 122, 8, 18, kSolid) + box(134, 84, 32, 38, kSolid);
  drawn += fmt::format("<ellipse class=\"disk\" cx=\"150\" cy=\"78\" rx=\"{:g}\" ry=\"5\" {}/>\n", kDisk, kBlade);
  drawn += arrow(150, 66, 22, "currentColor") + text(158, 34, "thrust T", "start");
  for (const int x : {100, 118}) drawn += arrow(x, 92, 134, "currentColor");
  drawn += text(92, 116, "air", "end", 13);
  drawn += text(222, 82, fmt::format("propeller, {} blades", sketch.blades), "start", 13);
  drawn += text(176, 106, "motor", "start", 13) + text(242, 130, "occlusion (plate)", "start", 13);
  drawn += text(190, 158, "load cell: carries plate, motor and propeller", "start", 13);
  drawn += text(290, 214, "stand", "start", 13);
  return picture(std::max(500, width_of(occlusions_deg)), 2 * kHeight,
                 "The stand from the side, and its plates from above with the propeller's disk dashed",
                 drawn + row_of_plates(sketch, occlusions_deg, kHeight));
}

std::string draw_plates(const StandSketch& sketch, const std::vector<double>& occlusions_deg) {
  return picture(width_of(occlusions_deg), kHeight, "Plates from above, the propeller's disk dashed",
                 row_of_plates(sketch, occlusions_deg, 0));
}

std::vector<std::string> plate_in_characters(double occlusion_deg) {
  constexpr int kRows = 5, kColumns = 11;  // from the middle; a character is about twice as high as wide
  std::vector<std::string> lines;
  for (int row = -kRows; row <= kRows; ++row) {
    std::string line;
    for (int column = -kColumns; column <= kColumns; ++column) {
      const double x = static_cast<double>(column) / kColumns, y = static_cast<double>(row) / kRows;
      double deg = std::atan2(x, -y) * 180 / std::numbers::pi;
      if (deg < 0) deg += 360;
      const bool hub = row == 0 && column == 0;
      line += x * x + y * y > 1.02 ? ' ' : hub ? 'o' : deg < occlusion_deg ? '#' : '.';
    }
    line.erase(line.find_last_not_of(' ') + 1);
    lines.push_back(line);
  }
  return lines;
}

}  // namespace kphi::profiles
