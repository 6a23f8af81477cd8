#include "compensation/file/coefficient_file.hpp"

#include <yaml-cpp/yaml.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include "compensation/file/coefficient_keys.hpp"

namespace kphi::compensation {
namespace {

constexpr const char* kFitAgain = "write the file again with `kphi fit`";
constexpr double kPerDegreeToPerRad = 180.0 / kPi;

/// The fit's own rounding; beyond it an anchored line contradicts its K_T.
constexpr double kAnchorTolerance = 1e-6;

/// In quotes "unknown" is a text like any other.
bool is_unknown(const YAML::Node& node) {
  return !node.IsDefined() || node.IsNull() || (node.IsScalar() && node.Scalar() == "unknown" && node.Tag() != "!");
}

/// Values of a YAML map. Every member throws CoefficientError, with file and line, if the value is not what the
/// member's name says. `unknown` and null count as not given.
class YamlReader {
 public:
  /// The top of `text` must be a map without a key given twice anywhere below it.
  YamlReader(const std::string& text, std::string path) : path_(std::move(path)) {
    try {
      top_ = YAML::Load(text);
    } catch (const YAML::Exception& error) {
      refuse_line(error.mark.line, "not YAML: " + error.msg, "restore the file as `kphi fit` wrote it");
    }
    if (!top_.IsMap()) refuse_line(0, "not a coefficient file", "give the coefficients.yaml that `kphi fit` wrote");
    refuse_repeated_keys(top_);
  }

  [[nodiscard]] const YAML::Node& top() const { return top_; }

  /// Undefined if the key is not given.
  [[nodiscard]] YAML::Node optional(const YAML::Node& map, const std::string& key) const {
    const YAML::Node value = map[key];
    return is_unknown(value) ? YAML::Node(YAML::NodeType::Undefined) : value;
  }
  [[nodiscard]] YAML::Node required(const YAML::Node& map, const std::string& key) const {
    const YAML::Node value = optional(map, key);
    if (!value.IsDefined()) refuse(map, "`" + key + "` is missing here", kFitAgain);
    return value;
  }
  [[nodiscard]] YAML::Node required_map(const YAML::Node& map, const std::string& key) const {
    const YAML::Node value = required(map, key);
    if (!value.IsMap()) refuse(value, "`" + key + "` must hold keys of its own", kFitAgain);
    return value;
  }
  /// Empty if the key is not given.
  [[nodiscard]] std::vector<YAML::Node> list(const YAML::Node& map, const std::string& key) const {
    const YAML::Node value = optional(map, key);
    if (!value.IsDefined()) return {};
    if (!value.IsSequence()) refuse(value, "`" + key + "` must be a list", "write it as [ … ]");
    return {value.begin(), value.end()};
  }
  [[nodiscard]] double number(const YAML::Node& node, const std::string& name) const {
    const std::string text = node.IsScalar() ? node.Scalar() : std::string();
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc() && end == text.data() + text.size() && std::isfinite(value)) return value;
    refuse(node, "`" + name + "` is " + (node.IsScalar() ? "`" + text + "`, " : "") + "not a finite number",
           "write one finite number");
  }
  [[nodiscard]] double number_at(const YAML::Node& map, const std::string& key) const {
    return number(required(map, key), key);
  }
  [[nodiscard]] std::optional<double> optional_number_at(const YAML::Node& map, const std::string& key) const {
    const YAML::Node value = optional(map, key);
    return value.IsDefined() ? std::optional<double>(number(value, key)) : std::nullopt;
  }
  [[nodiscard]] std::optional<int> optional_count_at(const YAML::Node& map, const std::string& key) const {
    const std::optional<double> value = optional_number_at(map, key);
    if (!value) return std::nullopt;
    if (*value < 0 || *value > 1e9 || *value != std::floor(*value))
      refuse(optional(map, key), "`" + key + "` is not a count", "write a whole number, 0 or more");
    return static_cast<int>(*value);
  }
  [[nodiscard]] bool truth_at(const YAML::Node& map, const std::string& key) const {
    const YAML::Node value = required(map, key);
    if (value.IsScalar() && (value.Scalar() == "true" || value.Scalar() == "false")) return value.Scalar() == "true";
    refuse(value, "`" + key + "` is neither true nor false", "write true or false");
  }
  [[nodiscard]] std::string text_at(const YAML::Node& map, const std::string& key) const {
    const YAML::Node value = required(map, key);
    if (!value.IsScalar()) refuse(value, "`" + key + "` must be one word or text", kFitAgain);
    return value.Scalar();
  }
  [[nodiscard]] std::string optional_text_at(const YAML::Node& map, const std::string& key) const {
    return optional(map, key).IsDefined() ? text_at(map, key) : std::string();
  }

  /// "path:line: what; next_move".
  [[noreturn]] void refuse(const YAML::Node& at, const std::string& what, const std::string& next_move) const {
    refuse_line(at.Mark().line, what, next_move);
  }

 private:
  void refuse_repeated_keys(const YAML::Node& node) const {
    std::set<std::string> seen;
    for (const auto& entry : node) {
      if (node.IsMap() && entry.first.IsScalar() && !seen.insert(entry.first.Scalar()).second)
        refuse(entry.first, "`" + entry.first.Scalar() + "` is given twice", "keep one of the two");
      refuse_repeated_keys(node.IsMap() ? entry.second : entry);
    }
  }
  [[noreturn]] void refuse_line(int line, const std::string& what, const std::string& next_move) const {
    throw CoefficientError(path_ + ":" + std::to_string(line + 1) + ": " + what + "; " + next_move);
  }

  std::string path_;
  YAML::Node top_;
};

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
  const auto value = reader.optional_number_at(map, key);
  return value ? std::optional(ThrustCoefficient(*value * scale)) : std::nullopt;
}

std::optional<LineUncertainty> read_uncertainty(const YamlReader& reader, const YAML::Node& map, double scale,
                                                const std::optional<ThrustCoefficient>& error) {
  const std::vector<YAML::Node> rows = reader.list(map, "covariance");
  if (rows.empty()) return std::nullopt;
  const double units[2] = {scale, scale * kPerDegreeToPerRad};
  double covariance[2][2] = {};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows.size() != 2 || !rows[i].IsSequence() || rows[i].size() != 2)
      reader.refuse(rows[i], "covariance is not two rows of two numbers", kFitAgain);
    for (std::size_t j = 0; j < 2; ++j)
      covariance[i][j] = reader.number(rows[i][j], "covariance") * units[i] * units[j];
    if (covariance[i][i] < 0.0) reader.refuse(rows[i], "a variance is below 0", kFitAgain);
  }
  if (!error) return std::nullopt;
  return LineUncertainty{error->value(), covariance[0][0], covariance[0][1], covariance[1][1]};
}

ThrustCoefficient read_thrust_coefficient(const YamlReader& reader, const YAML::Node& map, double scale) {
  const ThrustCoefficient k(reader.number_at(map, "value") * scale);
  constexpr const char* kMeasureAtZero = "fit again from a campaign with a run at 0 degrees";
  if (!(k.value() > 0.0)) reader.refuse(reader.required(map, "value"), "K_T must be positive", kMeasureAtZero);
  if (reader.optional_number_at(map, "phi_deg").value_or(0.0) != 0.0) {
    reader.refuse(reader.required(map, "phi_deg"), "K_T is the coefficient without occlusion, but phi_deg is not 0",
                  kMeasureAtZero);
  }
  return k;
}

std::optional<ThrustCoefficient> read_error(const YamlReader& reader, const YAML::Node& map, double scale) {
  const auto error = optional_coefficient(reader, map, "standard_error", scale);
  if (error && error->value() < 0.0)
    reader.refuse(reader.required(map, "standard_error"), "a standard error is below 0", kFitAgain);
  return error;
}

ThrustCurve read_curve(const YamlReader& reader, double scale, Radians largest) {
  const OverlapMeasure overlap = overlap_of(reader);
  const YAML::Node reference = reader.required_map(reader.top(), "K_T");
  const ThrustCoefficient k_t = read_thrust_coefficient(reader, reference, scale);
  const YAML::Node map = reader.required_map(reader.top(), "line");
  const ThrustCoefficient intercept(reader.number_at(map, "intercept") * scale);
  const double slope = reader.number_at(map, "slope_per_deg") * scale * kPerDegreeToPerRad;
  const auto uncertainty = read_uncertainty(reader, map, scale, read_error(reader, reference, scale));
  if (!(intercept.value() > 0.0)) {
    reader.refuse(reader.required(map, "intercept"), "the intercept must be positive",
                  "check sign and unit of the fit");
  }
  if (reader.truth_at(map, "anchored") && std::fabs(intercept / k_t - 1.0) > kAnchorTolerance) {
    reader.refuse(reader.required(map, "intercept"), "the line is called anchored, but its intercept is not K_T",
                  kFitAgain);
  }
  const auto curve = ThrustCurve::from_line(k_t, intercept, slope, largest, overlap, uncertainty);
  if (!curve) reader.refuse(map, "the numbers of K_T, line and valid are too large to fly", kFitAgain);
  return *curve;
}

std::optional<std::pair<double, double>> read_range(const YamlReader& reader, const YAML::Node& map,
                                                    const std::string& key) {
  const std::vector<YAML::Node> ends = reader.list(map, key);
  if (ends.empty()) return std::nullopt;
  if (ends.size() == 2) {
    const std::pair<double, double> range(reader.number(ends[0], key), reader.number(ends[1], key));
    if (range.first >= 0.0 && range.second > range.first) return range;
  }
  reader.refuse(reader.required(map, key), "`" + key + "` is not a range", "write [smallest, largest]");
}

std::pair<double, double> read_occlusions(const YamlReader& reader) {
  const YAML::Node map = reader.required_map(reader.top(), "valid");
  const YAML::Node node = reader.required(map, "phi_deg");
  const auto range = read_range(reader, map, "phi_deg");
  if (!range || range->second > 360.0)
    reader.refuse(node, "`phi_deg` is not a range of occlusions", "write [smallest, largest], at most 360");
  return *range;
}

void read_table(const YamlReader& reader, double scale, Coefficients& into) {
  for (const YAML::Node& node : reader.list(reader.top(), "table")) {
    if (!node.IsMap()) reader.refuse(node, "a row of the table has no keys", kFitAgain);
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

void read_fit(const YamlReader& reader, const YAML::Node& map, Coefficients::Fit& into) {
  into.model = reader.optional_text_at(map, "model");
  into.estimator = reader.optional_text_at(map, "estimator");
  into.k_by = reader.optional_text_at(map, "k_by");
  into.weights = reader.optional_text_at(map, "weights");
  into.loss = reader.optional_text_at(map, "loss");
  into.speed_range_rpm = read_range(reader, map, "speed_range_rpm");
  for (const YAML::Node& run : reader.list(map, "leave_out")) {
    if (!run.IsScalar()) reader.refuse(run, "a run in `leave_out` is not a text", kFitAgain);
    into.leave_out.push_back(run.Scalar());
  }
  if (!reader.optional(map, "u").IsDefined()) return;
  into.bench.emplace();
  for (const auto& entry : reader.required_map(map, "u"))
    into.bench->emplace_back(entry.first.Scalar(), reader.number(entry.second, entry.first.Scalar()));
}

void read_provenance(const YamlReader& reader, Coefficients& into) {
  const YAML::Node map = reader.optional(reader.top(), "provenance");
  if (!map.IsDefined() || !map.IsMap()) return;
  into.provenance.campaign = reader.optional_text_at(map, "campaign");
  const YAML::Node fit = reader.optional(map, "fit");
  if (fit.IsDefined() && fit.IsMap()) read_fit(reader, fit, into.provenance.fit);
  for (const YAML::Node& run : reader.list(map, "runs")) {
    if (!run.IsMap()) reader.refuse(run, "a run has no keys", kFitAgain);
    into.provenance.runs.push_back({reader.text_at(run, "file"), reader.optional_text_at(run, "sha256")});
  }
}

void read_budgets(const YamlReader& reader, double scale, Coefficients& into) {
  if (!reader.optional(reader.top(), "uncertainty").IsDefined()) return;
  const YAML::Node map = reader.required_map(reader.top(), "uncertainty");
  const auto u_of = [&](const YAML::Node& budget) {
    const auto u = reader.optional_number_at(budget, "u");
    return u ? std::optional<double>(*u * scale) : std::nullopt;
  };
  into.uncertainty = Coefficients::Uncertainty{};
  Coefficients::Uncertainty& budgets = *into.uncertainty;
  const YAML::Node k_t = reader.required_map(map, "K_T");
  budgets.thrust_coefficient = u_of(k_t);
  budgets.intercept = u_of(reader.required_map(map, "intercept"));
  budgets.slope_per_deg = u_of(reader.required_map(map, "slope_per_deg"));
  if (reader.optional_text_at(k_t, "freedom") != ".inf")
    budgets.freedom = reader.optional_number_at(k_t, "freedom").value_or(budgets.freedom);
  for (const YAML::Node& row : reader.list(map, "table")) {
    if (!row.IsMap()) reader.refuse(row, "a row of the budgets has no keys", kFitAgain);
    budgets.table.push_back(u_of(row));
  }
}

void refuse_other_format(const YamlReader& reader) {
  const YAML::Node node = reader.optional(reader.top(), "format");
  if (!node.IsDefined()) {
    reader.refuse(reader.top(), "no `format`, so this is not a coefficient file",
                  "give the coefficients.yaml that `kphi fit` wrote");
  }
  const std::string format = reader.text_at(reader.top(), "format");
  if (format != kCoefficientFormat) {
    reader.refuse(node, "format `" + format + "` is not " + kCoefficientFormat,
                  "fit again with this version of kphi, or update it");
  }
}

}  // namespace

Coefficients parse_coefficients(const std::string& text, const std::string& path) {
  const YamlReader reader(text, path);
  refuse_other_format(reader);
  const double scale = scale_of_unit(reader);
  const auto [smallest, largest] = read_occlusions(reader);
  Coefficients coefficients(read_curve(reader, scale, from_degrees(largest)));
  coefficients.path = path;
  coefficients.smallest_occlusion = from_degrees(smallest);
  coefficients.thrust_coefficient_error = read_error(reader, reader.required_map(reader.top(), "K_T"), scale);
  const YAML::Node line = reader.required_map(reader.top(), "line");
  coefficients.anchored = reader.truth_at(line, "anchored");
  for (const YAML::Node& point : reader.list(line, "points_deg"))
    coefficients.points.push_back(from_degrees(reader.number(point, "points_deg")));
  if (const auto speed = read_range(reader, reader.required_map(reader.top(), "valid"), "speed_rpm")) {
    coefficients.slowest_speed = from_rpm(speed->first);
    coefficients.fastest_speed = from_rpm(speed->second);
  }
  coefficients.measured_utc = reader.optional_text_at(reader.top(), "measured_utc");
  coefficients.tool_version = reader.optional_text_at(reader.top(), "tool_version");
  read_propeller(reader, coefficients);
  read_table(reader, scale, coefficients);
  coefficients.air_density_kg_m3 = reader.optional_number_at(reader.top(), "air_density_kg_m3");
  if (const auto volts = reader.optional_number_at(reader.top(), "supply_v")) coefficients.supply = Volts(*volts);
  read_provenance(reader, coefficients);
  read_budgets(reader, scale, coefficients);
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

std::string words_of(const ThrustCurve& curve) {
  char words[64];
  const double slope = curve.line().slope_per_rad;
  std::snprintf(words, sizeof words, "%.6g %c %.6g phi/rad", curve.line().intercept.value(), slope < 0 ? '-' : '+',
                std::fabs(slope));
  return words;
}

std::optional<std::string> overlap_mismatch(OverlapMeasure fitted, const std::string& coefficients,
                                            OverlapMeasure flown, const std::string& vehicle) {
  if (fitted == flown) return std::nullopt;
  const std::string as_fitted(name_of(fitted)), as_flown(name_of(flown));
  return coefficients + ": fitted with overlap " + as_fitted + ", but " + vehicle + " flies with " + as_flown +
         "; write `overlap: " + as_fitted + "` in the vehicle file, or fit again with " + as_flown;
}

}  // namespace kphi::compensation
