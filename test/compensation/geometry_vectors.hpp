// The known answers of geometry_vectors.csv (folder KPHI_TEST_DATA).
#pragma once

#include <charconv>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

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

/// Empty when the data are not at hand.
inline std::vector<GeometryVector> geometry_vectors() {
  const char* folder = std::getenv("KPHI_TEST_DATA");
  std::ifstream file(std::string(folder == nullptr ? "/nonexistent" : folder) + "/geometry_vectors.csv");
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

inline constexpr const char* kNoVectors =
    "geometry_vectors.csv not found: set KPHI_TEST_DATA to the folder that holds it";

}  // namespace kphi::compensation
