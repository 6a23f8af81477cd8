#include "compensation/file/coefficient_file.hpp"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include "compensation/file/yaml_reader.hpp"

namespace kphi::compensation {
namespace {

constexpr const char* kFormat = "kphi-coefficients/1";
constexpr double kPerDegreeToPerRad = 180.0 / kPi;

/// The fit's own rounding; beyond it an anchored line contradicts its K_T.
constexpr double kAnchorTolerance = 1e-6;

/// N/(rad/s)² per unit of the file.
double scale_of_unit(const YamlReader& reader) {
  const YAML::Node node = reader.optional(reader.top(), "k_unit");
  if (!node.IsDefined()) {
    reader.refuse(reader.top(), "the file does not say the unit of its coefficients",
                  "add `k_unit: N/(rad/s)^2` or `k_unit: N/RPM^2`, whichever the numbers are in");
  }
  const std::string unit = reader.text_at(reader.top(), "k_unit");
  if (unit == "N/(rad/s)^2") return 1.0;
  if (unit == "N/RPM^2") return from_newtons_per_rpm2(1.0).value();
  reader.refuse(node, "k_unit `" + unit + "` is not known", "use N/(rad/s)^2 or N/RPM^2");
}

OverlapMeasure overlap_of(const YamlReader& reader) {
  const YAML::Node node = reader.optional(reader.top(), "overlap");
  if (!node.IsDefined()) {
    reader.refuse(reader.top(), "the file does not say how its occlusion angles are defined",
                  "add `overlap: rim_arc` if they are rim arcs");
  }
  const std::string overlap = reader.text_at(reader.top(), "overlap");
  if (const auto measure = overlap_measure_named(overlap)) return *measure;
  reader.refuse(node, "overlap `" + overlap + "` is not known", "use rim_arc, area_share or load_share");
}

std::optional<ThrustCoefficient> optional_coefficient(const YamlReader& reader, const YAML::Node& map,
                                                      const std::string& key, double scale) {
  const std::optional<double> value = reader.optional_number_at(map, key);
  if (!value) return std::nullopt;
  return ThrustCoefficient(*value * scale);
}

void read_thrust_coefficient(const YamlReader& reader, double scale, Coefficients& into) {
  const YAML::Node map = reader.required_map(reader.top(), "K_T");
  into.thrust_coefficient = ThrustCoefficient(reader.number_at(map, "value") * scale);
  if (!(into.thrust_coefficient.value() > 0.0)) {
    reader.refuse(reader.required(map, "value"), "K_T must be positive",
                  "fit again from a campaign with a run at 0 degrees");
  }
  if (reader.optional_number_at(map, "phi_deg").value_or(0.0) != 0.0) {
    reader.refuse(reader.required(map, "phi_deg"), "K_T is the coefficient without occlusion, but phi_deg is not 0",
                  "fit again from a campaign with a run at 0 degrees");
  }
  into.thrust_coefficient_error = optional_coefficient(reader, map, "standard_error", scale);
  if (into.thrust_coefficient_error && into.thrust_coefficient_error->value() < 0.0) {
    reader.refuse(reader.required(map, "standard_error"), "a standard error is below 0",
                  "write the file again with `kphi fit`");
  }
}

void read_covariance(const YamlReader& reader, const YAML::Node& map, double scale, Coefficients::Line& line) {
  const std::vector<YAML::Node> rows = reader.list(map, "covariance");
  if (rows.empty()) return;
  const double units[2] = {scale, scale * kPerDegreeToPerRad};
  std::array<std::array<double, 2>, 2> covariance{};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows.size() != 2 || !rows[i].IsSequence() || rows[i].size() != 2) {
      reader.refuse(rows[i], "covariance is not two rows of two numbers", "write the file again with `kphi fit`");
    }
    for (std::size_t j = 0; j < 2; ++j) {
      covariance[i][j] = reader.number(rows[i][j], "covariance") * units[i] * units[j];
    }
    if (covariance[i][i] < 0.0) reader.refuse(rows[i], "a variance is below 0", "write the file again with `kphi fit`");
  }
  line.covariance = covariance;
}

void read_line(const YamlReader& reader, double scale, Coefficients& into) {
  const YAML::Node map = reader.required_map(reader.top(), "line");
  Coefficients::Line& line = into.line;
  line.anchored = reader.truth_at(map, "anchored");
  line.intercept = ThrustCoefficient(reader.number_at(map, "intercept") * scale);
  line.slope_per_rad = reader.number_at(map, "slope_per_deg") * scale * kPerDegreeToPerRad;
  read_covariance(reader, map, scale, line);
  for (const YAML::Node& point : reader.list(map, "points_deg")) {
    line.points.push_back(from_degrees(reader.number(point, "points_deg")));
  }
  if (!(line.intercept.value() > 0.0)) {
    reader.refuse(reader.required(map, "intercept"), "the intercept must be positive",
                  "check sign and unit of the fit");
  }
  if (line.anchored && std::fabs(line.intercept / into.thrust_coefficient - 1.0) > kAnchorTolerance) {
    reader.refuse(reader.required(map, "intercept"), "the line is called anchored, yet its intercept is not K_T",
                  "write the file again with `kphi fit`");
  }
}

std::optional<std::pair<double, double>> read_range(const YamlReader& reader, const YAML::Node& map,
                                                    const std::string& key) {
  const std::vector<YAML::Node> ends = reader.list(map, key);
  if (ends.empty()) return std::nullopt;
  const auto refuse = [&] {
    reader.refuse(reader.required(map, key), "`" + key + "` is not a range", "write [smallest, largest]");
  };
  if (ends.size() != 2) refuse();
  const std::pair<double, double> range(reader.number(ends[0], key), reader.number(ends[1], key));
  if (!(range.first >= 0.0) || !(range.second > range.first)) refuse();
  return range;
}

void read_validity(const YamlReader& reader, Coefficients& into) {
  const YAML::Node map = reader.required_map(reader.top(), "valid");
  const YAML::Node phi_node = reader.required(map, "phi_deg");
  const auto phi = read_range(reader, map, "phi_deg");
  if (!phi || phi->second > 360.0) {
    reader.refuse(phi_node, "`phi_deg` is not a range of occlusions", "write [smallest, largest], at most 360");
  }
  into.smallest_occlusion = from_degrees(phi->first);
  into.largest_occlusion = from_degrees(phi->second);
  if (const auto speed = read_range(reader, map, "speed_rpm")) {
    into.slowest_speed = from_rpm(speed->first);
    into.fastest_speed = from_rpm(speed->second);
  }
}

void read_table(const YamlReader& reader, double scale, Coefficients& into) {
  for (const YAML::Node& node : reader.list(reader.top(), "table")) {
    if (!node.IsMap()) reader.refuse(node, "a row of the table has no keys", "write the file again with `kphi fit`");
    Coefficients::Row row;
    row.occlusion = from_degrees(reader.number_at(node, "phi_deg"));
    row.k = ThrustCoefficient(reader.number_at(node, "k") * scale);
    row.standard_error = optional_coefficient(reader, node, "standard_error", scale);
    row.k_at_speed = optional_coefficient(reader, node, "k_at_speed", scale);
    if (const auto rpm = reader.optional_number_at(node, "at_speed_rpm")) row.at_speed = from_rpm(*rpm);
    row.steps = reader.optional_count_at(node, "steps");
    row.repetitions = reader.optional_count_at(node, "repetitions");
    into.table.push_back(row);
  }
}

void read_propeller(const YamlReader& reader, Coefficients& into) {
  const YAML::Node map = reader.required_map(reader.top(), "propeller");
  into.propeller.id = reader.text_at(map, "id");
  into.propeller.name = reader.optional_text_at(map, "name");
  into.propeller.diameter_in = reader.optional_number_at(map, "diameter_in").value_or(0.0);
  into.propeller.blades = reader.optional_count_at(map, "blades").value_or(0);
}

void read_provenance(const YamlReader& reader, Coefficients& into) {
  const YAML::Node map = reader.optional(reader.top(), "provenance");
  if (!map.IsDefined() || !map.IsMap()) return;
  into.provenance.campaign = reader.optional_text_at(map, "campaign");
  const YAML::Node fit = reader.optional(map, "fit");
  if (fit.IsDefined() && fit.IsMap()) {
    into.provenance.model = reader.optional_text_at(fit, "model");
    into.provenance.estimator = reader.optional_text_at(fit, "estimator");
  }
  for (const YAML::Node& run : reader.list(map, "runs")) {
    if (!run.IsMap()) reader.refuse(run, "a run has no keys", "write the file again with `kphi fit`");
    into.provenance.runs.push_back({reader.text_at(run, "file"), reader.optional_text_at(run, "sha256")});
  }
}

void refuse_other_format(const YamlReader& reader) {
  const YAML::Node node = reader.optional(reader.top(), "format");
  if (!node.IsDefined()) {
    reader.refuse(reader.top(), "no `format`, so this is no coefficient file",
                  "give the coefficients.yaml that `kphi fit` wrote");
  }
  const std::string format = reader.text_at(reader.top(), "format");
  if (format != kFormat) {
    reader.refuse(node, "format `" + format + "` is not " + kFormat,
                  "fit again with this version of kphi, or update it");
  }
}

}  // namespace

Coefficients parse_coefficients(const std::string& text, const std::string& path) {
  const YamlReader reader(text, path);
  refuse_other_format(reader);
  Coefficients coefficients;
  coefficients.path = path;
  const double scale = scale_of_unit(reader);
  coefficients.overlap = overlap_of(reader);
  coefficients.measured_utc = reader.optional_text_at(reader.top(), "measured_utc");
  coefficients.tool_version = reader.optional_text_at(reader.top(), "tool_version");
  read_propeller(reader, coefficients);
  read_thrust_coefficient(reader, scale, coefficients);
  read_line(reader, scale, coefficients);
  read_validity(reader, coefficients);
  read_table(reader, scale, coefficients);
  coefficients.air_density_kg_m3 = reader.optional_number_at(reader.top(), "air_density_kg_m3");
  if (const auto volts = reader.optional_number_at(reader.top(), "supply_v")) coefficients.supply = Volts(*volts);
  read_provenance(reader, coefficients);
  return coefficients;
}

Coefficients load_coefficients(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (file) text << file.rdbuf();
  if (!file || text.bad()) {
    throw CoefficientError(path + ": cannot be read (" + std::strerror(errno) +
                           "); give the coefficients.yaml that `kphi fit` wrote");
  }
  return parse_coefficients(text.str(), path);
}

ThrustLine thrust_line(const Coefficients& coefficients) {
  std::optional<LineUncertainty> uncertainty;
  if (const auto& covariance = coefficients.line.covariance; covariance && coefficients.thrust_coefficient_error) {
    uncertainty = LineUncertainty{coefficients.thrust_coefficient_error->value(), (*covariance)[0][0],
                                  (*covariance)[0][1], (*covariance)[1][1]};
  }
  const auto line =
      ThrustLine::from(coefficients.thrust_coefficient, coefficients.line.intercept, coefficients.line.slope_per_rad,
                       coefficients.largest_occlusion, coefficients.overlap, uncertainty);
  if (!line) throw CoefficientError(coefficients.path + ": not a line that can fly; read the file again");
  return *line;
}

}  // namespace kphi::compensation
