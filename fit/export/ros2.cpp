// A parameter file for any node. Arrays are of one type, and a double must look like one (45.0, not 45).
#include <fmt/format.h>

#include "fit/export/wording.hpp"
#include "results/number.hpp"

namespace kphi::fit {
namespace {

using results::yaml_number;

class Parameters {
 public:
  void add(const std::string& key, const std::string& value) { text_ += "      " + key + ": " + value + "\n"; }
  void number(const std::string& key, std::optional<double> value) {
    if (value) add(key, yaml_number(*value));
    if (!value) unknown_ += (unknown_.empty() ? "" : ", ") + key;
  }
  void list(const std::string& key, const std::vector<double>& values) {
    std::string joined;
    for (const double value : values) joined += (joined.empty() ? "" : ", ") + yaml_number(value);
    add(key, "[" + joined + "]");
  }
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] const std::string& unknown() const { return unknown_; }

 private:
  std::string text_, unknown_;
};

template <class Unit>
std::optional<double> value_of(const std::optional<Quantity<Unit>>& quantity) {
  return quantity ? std::optional(quantity->value()) : std::nullopt;
}

void add_table(const compensation::Coefficients& file, Parameters& parameters) {
  std::vector<double> angles, coefficients, errors;
  for (const auto& row : file.table) {
    angles.push_back(to_degrees(row.occlusion));
    coefficients.push_back(row.k.value());
    if (row.standard_error) errors.push_back(row.standard_error->value());
  }
  if (angles.empty()) return;
  parameters.list("phi_deg", angles);
  parameters.list("k_n_s2_per_rad2", coefficients);
  if (errors.size() == angles.size()) parameters.list("k_standard_error_n_s2_per_rad2", errors);
}

}  // namespace

Export to_ros2(const compensation::Coefficients& file, const ExportOptions&) {
  Parameters parameters;
  parameters.add("propeller", json_text(file.propeller.id));
  parameters.add("overlap", fmt::format("\"{}\"", compensation::name_of(file.overlap)));
  parameters.number("thrust_coefficient_n_s2_per_rad2", file.thrust_coefficient.value());
  parameters.number("thrust_coefficient_standard_error_n_s2_per_rad2", value_of(file.thrust_coefficient_error));
  parameters.number("line_intercept_n_s2_per_rad2", file.line.intercept.value());
  parameters.number("line_slope_n_s2_per_rad3", file.line.slope_per_rad);
  if (const auto& c = file.line.covariance)
    parameters.list("line_covariance", {(*c)[0][0], (*c)[0][1], (*c)[1][0], (*c)[1][1]});
  parameters.number("phi_max_rad", file.largest_occlusion.value());
  parameters.number("speed_min_rad_s", value_of(file.slowest_speed));
  parameters.number("speed_max_rad_s", value_of(file.fastest_speed));
  parameters.number("air_density_kg_m3", file.air_density_kg_m3);
  add_table(file, parameters);
  Export result;
  result.text = comment(file, "# ") + "/**:\n  ros__parameters:\n    kphi:\n" + parameters.text();
  result.lost = {"hashes of the runs: parameters are for the flight; they stay in the coefficient file",
                 "the covariance's shape: parameters have no matrices; row by row of (intercept, slope per rad)"};
  if (!parameters.unknown().empty())
    result.lost.push_back("what is not known: parameters have no null; left out: " + parameters.unknown());
  return result;
}

}  // namespace kphi::fit
