// The known answers of test/golden/geometry_vectors.csv; test/golden/README.md says what its columns are.
#pragma once

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
  double theta = 0;
  double arm_length = 0;
  double half_side = 0;
  double radius = 0;
  double hub_x = 0;
  double hub_y = 0;
  double phi_arc = 0;
  double phi_area = 0;
  double phi_load = 0;
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
    GeometryVector vector;
    vector.kind = cells.at(0);
    if (!cells.at(1).empty()) {
      vector.arm = static_cast<std::size_t>(exact_number(cells[1]));
      vector.theta = exact_number(cells.at(2));
      vector.arm_length = exact_number(cells.at(4));
    }
    vector.half_side = exact_number(cells.at(3));
    vector.radius = exact_number(cells.at(5));
    vector.hub_x = exact_number(cells.at(6));
    vector.hub_y = exact_number(cells.at(7));
    vector.phi_arc = exact_number(cells.at(8));
    vector.phi_area = exact_number(cells.at(10));
    vector.phi_load = exact_number(cells.at(11));
    vectors.push_back(vector);
  }
  return vectors;
}

}  // namespace kphi::compensation
