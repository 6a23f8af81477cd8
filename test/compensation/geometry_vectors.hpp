// The known answers of test/golden/geometry_vectors.csv; test/golden/README.md says what its columns are.
#pragma once

#include <gtest/gtest.h>

#include <charconv>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "test/source_dir.hpp"

namespace kphi::compensation {

struct GeometryVector {
  std::string kind;
  std::optional<std::size_t> arm;  ///< as the next two, random rows only
  double theta = 0, arm_length = 0;
  double half_side = 0, radius = 0, hub_x = 0, hub_y = 0;
  double phi_arc = 0, phi_area = 0, phi_load = 0;
};

inline double exact_number(const std::string& text) {
  double value = 0;
  const auto end = text.data() + text.size();
  if (std::from_chars(text.data(), end, value).ptr != end) throw std::runtime_error("no number: " + text);
  return value;
}

inline std::vector<GeometryVector> geometry_vectors() {
  std::ifstream file(kphi::test::source_dir() + "/test/golden/geometry_vectors.csv");
  if (!file) throw std::runtime_error("test/golden/geometry_vectors.csv cannot be read");
  std::vector<GeometryVector> vectors;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    const auto number = [&](std::size_t column) { return exact_number(cells.at(column)); };
    const bool has_arm = !cells.at(1).empty();
    vectors.push_back({cells[0], has_arm ? std::optional(static_cast<std::size_t>(number(1))) : std::nullopt,
                       has_arm ? number(2) : 0, has_arm ? number(4) : 0, number(3), number(5), number(6), number(7),
                       number(8), number(10), number(11)});
  }
  return vectors;
}

inline void expect_known_arc(double phi, const GeometryVector& v) {
  const bool outside = v.kind == "tangent_edge_outside",
             near = v.kind == "tangent_edge_1um_in" || v.kind == "corner_touch" || v.kind == "corner_poke_1mm";
  EXPECT_GE(phi, 0.0);
  EXPECT_NEAR(phi, outside ? 0 : v.phi_arc,
              outside ? 1e-7
              : near  ? 1e-9
                      : 1e-12)
      << v.kind << " at (" << v.hub_x << ", " << v.hub_y << ")";
}

}  // namespace kphi::compensation
