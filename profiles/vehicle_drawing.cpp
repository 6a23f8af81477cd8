#include "profiles/vehicle_drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/occlusion.hpp"

namespace kphi::profiles {
namespace {

using compensation::Airframe;
using compensation::ConvexPolygon;
using compensation::HubPosition;

/// Metres, x forward, y left.
struct Place {
  double x = 0, y = 0;
};
Place place_of(const HubPosition& position) { return {position.x.value(), position.y.value()}; }
double distance(Place a, Place b) { return std::hypot(a.x - b.x, a.y - b.y); }

using Outline = std::vector<Place>;

Outline outline_of(const ConvexPolygon& polygon) {
  Outline corners;
  for (std::size_t i = 0; i < polygon.size(); ++i) corners.push_back(place_of(polygon.corner(i)));
  return corners;
}

/// Of corners in their order, counter-clockwise.
bool holds(const Outline& outline, Place point) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Place a = outline[i], b = outline[(i + 1) % outline.size()];
    if ((b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x) < 0) return false;
  }
  return true;
}

/// What all shapes share.
struct Frame {
  std::vector<Outline> body;
  std::vector<Place> hinges;  ///< of rotor i, if there are any
  double radius = 0, reach = 0;

  [[nodiscard]] bool covers(Place point) const {
    return std::ranges::any_of(body, [&](const Outline& part) { return holds(part, point); });
  }
};

Frame frame_of(const Vehicle& vehicle) {
  const Airframe airframe = airframe_of(vehicle);
  Frame frame;
  frame.radius = vehicle.propeller_radius.value();
  if (airframe.polygon) {
    frame.body.push_back(outline_of(airframe.polygon->outline));
    for (const auto& part : airframe.polygon->more)
      if (part) frame.body.push_back(outline_of(*part));
  } else {
    frame.body.push_back(outline_of(ConvexPolygon::square(airframe.half_side)));
  }
  if (vehicle.hubs.empty() && airframe.polygon) {
    for (const compensation::Hinge& hinge : airframe.polygon->hinges) frame.hinges.push_back(place_of(hinge.at));
  } else if (vehicle.hubs.empty()) {
    const double a = airframe.half_side.value();
    const std::array<Place, 4> corners{{{a, a}, {-a, a}, {-a, -a}, {a, -a}}};
    for (const int turn : airframe.hinge_turns) frame.hinges.push_back(corners[static_cast<std::size_t>(turn)]);
  }
  for (const std::string& shape : shapes_of(vehicle))
    for (const HubPosition& hub : hubs_of(vehicle, shape))
      frame.reach = std::max({frame.reach, std::abs(hub.x.value()), std::abs(hub.y.value())});
  frame.reach += frame.radius;
  return frame;
}

constexpr int kSide = 230, kNose = 16, kCaption = 34, kRow = kNose + kSide + kCaption;

/// One shape in a square of kSide, the caption below it; units of the picture, x to the right, y down.
class ShapePicture {
 public:
  /// `id` keeps its clip paths apart from those of other shapes.
  ShapePicture(const Vehicle& vehicle, const Frame& frame, std::string shape, std::size_t id)
      : vehicle_(vehicle), frame_(frame), shape_(std::move(shape)), id_(id), scale_(0.45 * kSide / frame.reach) {}

  [[nodiscard]] std::string drawn() const {
    std::string drawn;
    for (const Outline& part : frame_.body)
      drawn += fmt::format("<polygon points=\"{}\" fill-opacity=\".18\" stroke=\"currentColor\"/>\n", points(part));
    const auto hubs = hubs_of(vehicle_, shape_);
    const auto occlusions = occlusions_of(vehicle_, shape_);
    for (std::size_t i = 0; i < hubs.size(); ++i) drawn += rotor(i, place_of(hubs[i]), occlusions[i]);
    for (std::size_t i = 0; i < hubs.size(); ++i) drawn += label(i, place_of(hubs[i]), occlusions[i]);
    drawn += fmt::format("<path d=\"M0,{:.1f} l-6,12 h12 Z\"/>\n", -0.5 * kSide - kNose + 1);
    return drawn + fmt::format("<text y=\"{:g}\" text-anchor=\"middle\" font-size=\"18\">{}</text>\n",
                               0.5 * kSide + 0.6 * kCaption, shape_);
  }

 private:
  [[nodiscard]] Place on_paper(Place at) const { return {-scale_ * at.y, -scale_ * at.x}; }
  [[nodiscard]] std::string points(const Outline& part) const {
    std::string text;
    for (const Place& corner : part) {
      const Place at = on_paper(corner);
      text += fmt::format("{:.2f},{:.2f} ", at.x, at.y);
    }
    text.pop_back();
    return text;
  }

  [[nodiscard]] std::string rotor(std::size_t i, Place hub, Radians phi) const {
    const Place at = on_paper(hub);
    const std::string disk =
        fmt::format("cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\"", at.x, at.y, scale_ * frame_.radius);
    const std::string clip = fmt::format("kphi-shape{}-disk{}", id_, i + 1);
    std::string drawn;
    if (i < frame_.hinges.size()) {
      const Place hinge = on_paper(frame_.hinges[i]);
      drawn += fmt::format("<path d=\"M{:.2f},{:.2f} L{:.2f},{:.2f}\" stroke=\"currentColor\" stroke-width=\"3\"/>\n",
                           hinge.x, hinge.y, at.x, at.y);
    }
    if (phi.value() > 0) {
      drawn += fmt::format("<clipPath id=\"{}\"><circle {}/></clipPath>\n", clip, disk);
      for (const Outline& part : frame_.body)
        drawn += fmt::format(
            "<polygon class=\"plate\" points=\"{}\" clip-path=\"url(#{})\" fill=\"#c65a00\" fill-opacity=\".45\"/>\n",
            points(part), clip);
    }
    drawn += fmt::format(
        "<circle class=\"disk\" {} fill=\"none\" stroke=\"#0b62c4\" stroke-width=\"2\" stroke-dasharray=\"5 4\"/>\n",
        disk);
    return drawn;
  }

  /// Beside the hub, on the side that points away from the body, over all lines.
  [[nodiscard]] std::string label(std::size_t i, Place hub, Radians phi) const {
    const Place at = on_paper(hub);
    const double away = std::max(distance({}, hub), 1e-9), out = 0.45 * scale_ * frame_.radius / away;
    return fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" font-size=\"15\" paint-order=\"stroke\" "
        "stroke=\"#fff\" stroke-width=\"4\">{}{} {:.3g}°</text>\n",
        at.x - out * hub.y, at.y - out * hub.x + 5, i + 1, sense(i), to_degrees(phi));
  }

  /// A drag torque that points up is of a rotor that turns clockwise.
  [[nodiscard]] std::string sense(std::size_t i) const {
    return vehicle_.dynamics ? (vehicle_.dynamics->spin[i] > 0 ? "↻" : "↺") : "";
  }

  const Vehicle& vehicle_;
  const Frame& frame_;
  std::string shape_;
  std::size_t id_;
  double scale_;
};

constexpr int kColumns = 37;  // of one shape; a character is about twice as high as wide

std::vector<std::string> in_characters(const Vehicle& vehicle, const Frame& frame, const std::string& shape) {
  const auto hubs = hubs_of(vehicle, shape);
  const double cell = 2 * frame.reach / kColumns;
  const int rows = (kColumns + 1) / 2;
  std::vector<std::string> lines(static_cast<std::size_t>(rows), std::string(kColumns, ' '));
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Place at{(0.5 * (rows - 1) - row) * 2 * cell, (0.5 * (kColumns - 1) - column) * cell};
      const bool body = frame.covers(at);
      const bool disk = std::ranges::any_of(
          hubs, [&](const HubPosition& hub) { return distance(at, place_of(hub)) <= frame.radius; });
      lines[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] = disk   ? (body ? '#' : '.')
                                                                               : body ? ':'
                                                                                      : ' ';
    }
  }
  for (std::size_t i = 0; i < hubs.size(); ++i) {
    const Place hub = place_of(hubs[i]);
    const auto row = static_cast<std::size_t>(std::lround(0.5 * (rows - 1) - 0.5 * hub.x / cell));
    const auto column = static_cast<std::size_t>(std::lround(0.5 * (kColumns - 1) - hub.y / cell));
    lines.at(row).at(column) = static_cast<char>('1' + i);
  }
  lines.push_back(fmt::format("{:^{}}", shape, kColumns));
  return lines;
}

}  // namespace

std::vector<Radians> occlusions_of(const Vehicle& vehicle, const std::string& shape) {
  const Airframe airframe = airframe_of(vehicle);
  std::vector<Radians> found;
  for (std::size_t i = 0; i < rotors_of(vehicle); ++i)
    found.push_back(vehicle.hubs.empty() ? compensation::occlusion_of_arm(airframe, i, vehicle.shapes.at(shape)[i])
                                         : compensation::occlusion_beside_body(airframe, i, vehicle.hubs.at(shape)[i]));
  return found;
}

std::string draw_shapes(const Vehicle& vehicle) {
  const Frame frame = frame_of(vehicle);
  const auto shapes = shapes_of(vehicle);
  std::string drawn;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const std::size_t row = i / 2;
    drawn += fmt::format("<g transform=\"translate({:g},{:g})\">\n{}</g>\n", kSide * (static_cast<double>(i % 2) + 0.5),
                         kRow * static_cast<double>(row) + kNose + 0.5 * kSide,
                         ShapePicture(vehicle, frame, shapes[i], i).drawn());
  }
  const std::string title =
      "The vehicle from above in its shapes: body, arms, disks dashed, what the body covers of them";
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" "
      "aria-label=\"{2}\" fill=\"currentColor\" font-family=\"sans-serif\">\n<title>{2}</title>\n{3}</svg>\n",
      2 * kSide, kRow * ((static_cast<int>(shapes.size()) + 1) / 2), title, drawn);
}

std::vector<std::string> shapes_in_characters(const Vehicle& vehicle) {
  const Frame frame = frame_of(vehicle);
  const auto shapes = shapes_of(vehicle);
  std::vector<std::string> lines{"from above, the nose up; '#' of a disk is covered by the body ':'"};
  for (std::size_t i = 0; i < shapes.size(); i += 2) {
    auto left = in_characters(vehicle, frame, shapes[i]);
    if (i + 1 < shapes.size()) {
      const auto right = in_characters(vehicle, frame, shapes[i + 1]);
      for (std::size_t row = 0; row < left.size(); ++row) left[row] += "    " + right[row];
    }
    for (std::string& line : left) {
      line.erase(line.find_last_not_of(' ') + 1);
      lines.push_back(std::move(line));
    }
  }
  return lines;
}

}  // namespace kphi::profiles
