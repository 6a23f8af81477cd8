#include "compensation/file/coefficient_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <system_error>

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

/// "path:line: what; next_move"; `line` from 0.
[[noreturn]] void refuse(const std::string& path, int line, const std::string& what, const std::string& next_move) {
  throw CoefficientError(path + ":" + std::to_string(line + 1) + ": " + what + "; " + next_move);
}

/// What `kphi fit` writes is flat; an alias can make a tree without end of a few bytes.
void refuse_repeated_keys(const YAML::Node& node, const std::string& path, int depth, int& values) {
  constexpr int kMostDepth = 16, kMostValues = 100'000;
  if (depth > kMostDepth || ++values > kMostValues)
    refuse(path, node.Mark().line, "nested too deep or too long for coefficients", kFitAgain);
  std::set<std::string> seen;
  for (const auto& entry : node) {
    if (node.IsMap() && entry.first.IsScalar() && !seen.insert(entry.first.Scalar()).second)
      refuse(path, entry.first.Mark().line, "`" + entry.first.Scalar() + "` is given twice", "keep one of the two");
    refuse_repeated_keys(node.IsMap() ? entry.second : entry, path, depth + 1, values);
  }
}

/// A value of the file, and where it stands. Every member throws CoefficientError, with file and line, if the value is
/// not what the member's name says. `unknown` and null count as not given.
class Value {
 public:
  Value(const YAML::Node& node, std::string name, const std::string& path)
      : node_(node), name_(std::move(name)), path_(&path) {}

  /// nullopt if the key is not given.
  [[nodiscard]] std::optional<Value> find(const std::string& key) const {
    const YAML::Node value = node_[key];
    return is_unknown(value) ? std::nullopt : std::optional(Value(value, key, *path_));
  }
  /// Refuses the file with these words if the key is not given.
  [[nodiscard]] Value at(const std::string& key, const std::string& what, const std::string& next_move) const {
    if (const auto value = find(key)) return *value;
    refuse(what, next_move);
  }
  [[nodiscard]] Value at(const std::string& key) const { return at(key, "`" + key + "` is missing here", kFitAgain); }
  [[nodiscard]] Value map_at(const std::string& key) const {
    const Value value = at(key);
    if (!value.node().IsMap()) value.refuse("`" + key + "` must hold keys of its own", kFitAgain);
    return value;
  }
  [[nodiscard]] const YAML::Node& node() const { return node_; }
  /// Key and value of each entry.
  [[nodiscard]] std::vector<std::pair<std::string, Value>> entries() const {
    std::vector<std::pair<std::string, Value>> all;
    for (const auto& entry : node_)
      all.emplace_back(entry.first.Scalar(), Value(entry.second, entry.first.Scalar(), *path_));
    return all;
  }
  /// Empty if the key is not given.
  [[nodiscard]] std::vector<Value> list(const std::string& key) const {
    const auto value = find(key);
    return value ? value->items() : std::vector<Value>();
  }
  [[nodiscard]] std::vector<Value> items() const {
    if (!node_.IsSequence()) refuse("`" + name_ + "` must be a list", "write it as [ … ]");
    std::vector<Value> all;
    for (const auto& item : node_) all.emplace_back(item, name_, *path_);
    return all;
  }
  /// Maps; `what` says what is wrong with an entry that is not one. Empty if the key is not given.
  [[nodiscard]] std::vector<Value> rows(const std::string& key, const std::string& what) const {
    std::vector<Value> all = list(key);
    for (const Value& row : all)
      if (!row.node().IsMap()) row.refuse(what, kFitAgain);
    return all;
  }
  [[nodiscard]] double number() const {
    const std::string text = node_.IsScalar() ? node_.Scalar() : std::string();
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc() && end == text.data() + text.size() && std::isfinite(value)) return value;
    refuse("`" + name_ + "` is " + (node_.IsScalar() ? "`" + text + "`, " : "") + "not a finite number",
           "write one finite number");
  }
  [[nodiscard]] std::optional<double> number_at(const std::string& key) const {
    const auto value = find(key);
    return value ? std::optional(value->number()) : std::nullopt;
  }
  [[nodiscard]] std::optional<int> count_at(const std::string& key) const {
    const auto value = number_at(key);
    if (!value) return std::nullopt;
    if (*value < 0 || *value > 1e9 || *value != std::floor(*value))
      at(key).refuse("`" + key + "` is not a count", "write a whole number, 0 or more");
    return static_cast<int>(*value);
  }
  [[nodiscard]] bool truth() const {
    if (node_.IsScalar() && (node_.Scalar() == "true" || node_.Scalar() == "false")) return node_.Scalar() == "true";
    refuse("`" + name_ + "` is neither true nor false", "write true or false");
  }
  [[nodiscard]] std::string text() const {
    if (!node_.IsScalar()) refuse("`" + name_ + "` must be one word or text", kFitAgain);
    return node_.Scalar();
  }
  /// Empty if the key is not given.
  [[nodiscard]] std::string text_at(const std::string& key) const {
    const auto value = find(key);
    return value ? value->text() : std::string();
  }

  /// "path:line: what; next_move".
  [[noreturn]] void refuse(const std::string& what, const std::string& next_move) const {
    kphi::compensation::refuse(*path_, node_.Mark().line, what, next_move);
  }

 private:
  YAML::Node node_;
  std::string name_;
  const std::string* path_;
};

/// The top of `text`: a map without a key given twice anywhere below it.
Value top_of(const std::string& text, const std::string& path) {
  YAML::Node node;
  try {
    node = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    refuse(path, error.mark.line, "not YAML: " + error.msg, "restore the file as `kphi fit` wrote it");
  }
  if (!node.IsMap()) refuse(path, 0, "not a coefficient file", "give the coefficients.yaml that `kphi fit` wrote");
  int values = 0;
  refuse_repeated_keys(node, path, 0, values);
  return {node, "", path};
}

void refuse_other_format(const Value& top) {
  const Value format = top.at("format", "no `format`, so this is not a coefficient file",
                              "give the coefficients.yaml that `kphi fit` wrote");
  if (format.text() == kCoefficientFormat) return;
  format.refuse("format `" + format.text() + "` is not " + kCoefficientFormat,
                "fit again with this version of kphi, or update it");
}

/// N/(rad/s)² per unit of the file.
double scale_of_unit(const Value& top) {
  const Value unit = top.at("k_unit", "the file does not say the unit of its coefficients",
                            "add `k_unit: N/(rad/s)^2` or `k_unit: N/RPM^2`, whichever the numbers are in");
  if (unit.text() == "N/(rad/s)^2") return 1.0;
  if (unit.text() == "N/RPM^2") return from_newtons_per_rpm2(1.0).value();
  unit.refuse("k_unit `" + unit.text() + "` is not known", "use N/(rad/s)^2 or N/RPM^2");
}

OverlapMeasure overlap_of(const Value& top) {
  const Value overlap = top.at("overlap", "the file does not say how its occlusion angles are defined",
                               "add `overlap: rim_arc` if they are rim arcs");
  if (const auto measure = overlap_measure_named(overlap.text())) return *measure;
  overlap.refuse("overlap `" + overlap.text() + "` is not known", "use rim_arc, area_share or load_share");
}

/// nullopt if the file does not give it.
std::optional<Coefficients::Uncertainty> read_uncertainty(const Value& map, double scale) {
  const auto u = map.number_at("u");
  if (!u) return std::nullopt;
  Coefficients::Uncertainty one{*u * scale, map.number_at("expanded_95").value_or(0) * scale};
  if (*u < 0 || one.expanded_95 < 0) map.at("u").refuse("an uncertainty is below 0", kFitAgain);
  if (map.text_at("freedom") != ".inf") one.freedom = map.number_at("freedom").value_or(one.freedom);
  return one;
}

/// Of K_T and the parameters of the curve, each times its unit; empty without a covariance.
std::vector<std::vector<double>> read_covariance(const Value& top, const std::vector<double>& units) {
  const std::vector<Value> rows =
      top.find("uncertainty") ? top.map_at("uncertainty").list("covariance") : std::vector<Value>();
  const std::size_t n = units.size();
  std::vector<std::vector<double>> covariance(rows.size(), std::vector<double>(n));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows.size() != n || !rows[i].node().IsSequence() || rows[i].items().size() != n)
      rows[i].refuse("covariance is not " + std::to_string(n) + " rows of " + std::to_string(n) + " numbers",
                     kFitAgain);
    for (std::size_t j = 0; j < n; ++j) covariance[i][j] = rows[i].items()[j].number() * units[i] * units[j];
    if (covariance[i][i] < 0.0) rows[i].refuse("a variance is below 0", kFitAgain);
  }
  return covariance;
}

ThrustCoefficient read_thrust_coefficient(const Value& map, double scale) {
  const ThrustCoefficient k(map.at("value").number() * scale);
  constexpr const char* kMeasureAtZero = "fit again from a campaign with a run at 0 degrees";
  if (!(k.value() > 0.0)) map.at("value").refuse("K_T must be positive", kMeasureAtZero);
  if (map.number_at("phi_deg").value_or(0.0) != 0.0)
    map.at("phi_deg").refuse("K_T is the coefficient without occlusion, but phi_deg is not 0", kMeasureAtZero);
  return k;
}

std::optional<ThrustCurve> read_line(const Value& top, ThrustCoefficient k_t, double scale, Radians largest) {
  const Value line = top.map_at("curve");
  const ThrustCoefficient intercept(line.map_at("intercept").at("value").number() * scale);
  const double slope = line.map_at("slope_per_deg").at("value").number() * scale * kPerDegreeToPerRad;
  const auto c = read_covariance(top, {scale, scale, scale * kPerDegreeToPerRad});
  std::optional<LineUncertainty> uncertainty;
  const auto real = [](double number) { return static_cast<Real>(number); };
  if (!c.empty()) uncertainty = LineUncertainty{real(std::sqrt(c[0][0])), real(c[1][1]), real(c[1][2]), real(c[2][2])};
  if (!(intercept.value() > 0.0))
    line.at("intercept").refuse("the intercept must be positive", "check sign and unit of the fit");
  return ThrustCurve::from_line(k_t, intercept, slope, largest, overlap_of(top), uncertainty);
}

constexpr const char* kKnotHasNoKeys = "a knot has no keys";

std::optional<ThrustCurve> read_table(const Value& top, ThrustCoefficient k_t, double scale, Radians largest) {
  std::vector<Knot> knots;
  double least = 0;
  const Value block = top.map_at("curve");
  for (const Value& row : block.rows("knots", kKnotHasNoKeys)) {
    const Radians at = from_degrees(row.at("phi_deg").number());
    const double k = row.at("value").number() * scale;
    if (!(k > 0)) row.at("value").refuse("a k of the table is not positive", kFitAgain);
    if (!knots.empty() && !(at > knots.back().occlusion))
      row.at("phi_deg").refuse("the knots do not ascend", kFitAgain);
    if (!knots.empty() && k > least) row.at("value").refuse("k of the table rises with phi_deg", kFitAgain);
    least = k;
    const auto u = read_uncertainty(row, scale);
    knots.push_back({at, static_cast<Real>(k), u ? static_cast<Real>(u->u) : std::numeric_limits<Real>::infinity()});
  }
  if (knots.size() < 2 || knots.size() > kMostKnots)
    block.refuse("a table needs 2 to " + std::to_string(kMostKnots) + " knots", kFitAgain);
  if (knots.front().occlusion.value() != 0.0 || std::fabs(knots.front().value / k_t.value() - 1.0) > kAnchorTolerance)
    block.at("knots").refuse("the first knot is not K_T at phi_deg 0", kFitAgain);
  knots.front().value = k_t.value();
  const auto k = OcclusionTable::from(knots.data(), knots.size());
  return k ? ThrustCurve::from_table(*k, largest, overlap_of(top)) : std::nullopt;
}

/// K_T at φ = 0; the smallest range that a curve can have.
std::optional<ThrustCurve> read_no_curve(const Value& top, ThrustCoefficient k_t, double /*scale*/, Radians /*none*/) {
  return ThrustCurve::from_line(k_t, k_t, 0, Radians(std::numeric_limits<Real>::min()), overlap_of(top));
}

/// A form of `curve.form` with what reads it.
struct FormReader {
  const char* name;
  std::optional<ThrustCurve> (*read)(const Value& top, ThrustCoefficient k_t, double scale, Radians largest);
};
constexpr FormReader kForms[] = {{"line", read_line}, {"table", read_table}, {Coefficients::kNoCurve, read_no_curve}};

ThrustCurve read_curve(const Value& top, double scale, Radians largest) {
  const ThrustCoefficient k_t = read_thrust_coefficient(top.map_at("K_T"), scale);
  const Value block = top.map_at("curve"), form = block.at("form");
  for (const auto& [name, read] : kForms) {
    if (form.text() != name) continue;
    const auto curve = read(top, k_t, scale, largest);
    if (!curve) block.refuse("the numbers of K_T, curve and valid are too large to fly", kFitAgain);
    if (block.at("anchored").truth() && std::fabs(curve->at(Radians(0)) / k_t - 1.0) > kAnchorTolerance)
      block.at("anchored").refuse("the curve is called anchored, but its k(0) is not K_T", kFitAgain);
    return *curve;
  }
  form.refuse("form `" + form.text() + "` of the curve is not known", "use a newer kphi, or fit again with this one");
}

/// Each map in the block of the curve that has a value.
std::vector<Coefficients::Parameter> read_parameters(const Value& block, double scale) {
  std::vector<Coefficients::Parameter> parameters;
  for (const auto& [key, value] : block.entries())
    if (value.node().IsMap() && value.find("value"))
      parameters.push_back({key, value.at("value").number() * scale, read_uncertainty(value, scale)});
  for (const Value& knot : block.rows("knots", kKnotHasNoKeys))
    parameters.push_back(
        {"k(" + knot.at("phi_deg").text() + ")", knot.at("value").number() * scale, read_uncertainty(knot, scale)});
  return parameters;
}

std::optional<std::pair<double, double>> read_range(const Value& map, const std::string& key) {
  const std::vector<Value> ends = map.list(key);
  if (ends.empty()) return std::nullopt;
  if (ends.size() == 2) {
    const std::pair<double, double> range(ends[0].number(), ends[1].number());
    if (range.first >= 0.0 && range.second > range.first) return range;
  }
  map.at(key).refuse("`" + key + "` is not a range", "write [smallest, largest]");
}

std::pair<double, double> read_occlusions(const Value& top) {
  const Value map = top.map_at("valid"), node = map.at("phi_deg");
  const auto range = read_range(map, "phi_deg");
  if (range && range->second <= 360.0) return *range;
  node.refuse("`phi_deg` is not a range of occlusions", "write [smallest, largest], at most 360");
}

/// Of a file with a curve; K_T alone holds at φ = 0.
std::pair<double, double> occlusions_of(const Value& top, Need need) {
  const Value form = top.map_at("curve").at("form");
  if (form.text() != Coefficients::kNoCurve) return read_occlusions(top);
  if (need == Need::curve)
    form.refuse("K_T alone, no k(φ): no occlusion was measured", "measure occlusions with `kphi run`, then `kphi fit`");
  return {0, 0};
}

Coefficients::ThrottleLaw read_throttle_law(const Value& map) {
  Coefficients::ThrottleLaw law{map.at("law").text(), map.at("rms_n").number(), {}, {}};
  for (const Value& number : map.rows("numbers", "a number of a throttle law has no keys"))
    law.numbers.push_back({number.at("name").text(), number.at("value").number(), number.at("half_95").number()});
  for (const Value& other : map.list("not_told_from")) law.not_told_from.push_back(other.text());
  return law;
}

Coefficients::Row read_row(const Value& map, double scale) {
  Coefficients::Row row;
  row.occlusion = from_degrees(map.at("phi_deg").number());
  row.k = ThrustCoefficient(map.at("k").number() * scale);
  row.uncertainty = read_uncertainty(map, scale);
  if (const auto rpm = map.number_at("at_speed_rpm")) row.at_speed = from_rpm(*rpm);
  return row;
}

Coefficients::Torque read_torque(const Value& map) {
  const Coefficients::Torque row{from_degrees(map.at("phi_deg").number()), map.at("k_q").number(),
                                 read_uncertainty(map, 1), map.number_at("drag_per_thrust_m"),
                                 map.number_at("drag_per_thrust_expanded_95_m")};
  if (!(row.k_q > 0)) map.at("k_q").refuse("a drag torque must be positive", kFitAgain);
  return row;
}

/// Of rows that all have a share, not below 0, for each column; ascending.
Coefficients::ThrustErrorWithin read_error_within(const Value& map) {
  Coefficients::ThrustErrorWithin within;
  within.reference_rad_s = from_rpm(map.at("reference_rpm").number()).value();
  for (const Value& off : map.list("speed_off_rpm")) within.off_rad_s.push_back(from_rpm(off.number()).value());
  for (const Value& line : map.list("rows")) {
    const std::vector<Value> numbers = line.items();
    if (numbers.size() != within.off_rad_s.size() + 1 || numbers.size() < 2)
      line.refuse("a row needs phi_deg and a share for each speed_off_rpm", kFitAgain);
    Coefficients::ThrustErrorWithin::Row row{numbers.front().number(), {}};
    for (std::size_t i = 1; i < numbers.size(); ++i) row.shares.push_back(numbers[i].number());
    if (!within.rows.empty() && !(row.phi_deg > within.rows.back().phi_deg))
      line.refuse("the rows do not ascend", kFitAgain);
    within.rows.push_back(std::move(row));
  }
  if (!std::is_sorted(within.off_rad_s.begin(), within.off_rad_s.end()))
    map.at("speed_off_rpm").refuse("`speed_off_rpm` does not ascend", kFitAgain);
  return within;
}

void read_propeller(const Value& map, Coefficients::Propeller& into) {
  into.id = map.at("id").text();
  into.name = map.text_at("name");
  into.diameter_in = map.number_at("diameter_in").value_or(0.0);
  into.blades = map.count_at("blades").value_or(0);
}

void read_fit(const Value& map, Coefficients::Fit& into) {
  into.k_by = map.text_at("k_by");
  into.weights = map.text_at("weights");
  into.loss = map.text_at("loss");
  into.curve_loss = map.text_at("curve_loss");
  into.speed_range_rpm = read_range(map, "speed_range_rpm");
  for (const Value& run : map.list("leave_out")) {
    if (!run.node().IsScalar()) run.refuse("a run in `leave_out` is not a text", kFitAgain);
    into.leave_out.push_back(run.text());
  }
  if (const auto once = map.find("mounted_once")) into.mounted_once = once->truth();
  if (!map.find("u")) return;
  into.bench.emplace();
  for (const auto& [name, value] : map.map_at("u").entries()) into.bench->emplace_back(name, value.number());
}

void read_provenance(const Value& map, Coefficients::Provenance& into) {
  into.campaign = map.text_at("campaign");
  into.flight = map.text_at("flight");
  if (const auto fit = map.find("fit"); fit && fit->node().IsMap()) read_fit(*fit, into.fit);
  for (const Value& run : map.rows("runs", "a run has no keys"))
    into.runs.push_back({run.at("file").text(), run.text_at("sha256")});
}

/// How k changes with the speed, and φ the torque.
void read_more_of_curve(const Value& top, const std::vector<Coefficients::Torque>& torque, ThrustCurve& curve) {
  if (top.find("speed_trend")) {
    const Value trend = top.map_at("speed_trend");
    const double share = trend.at("share_per_1000_rpm").number() / from_rpm(1000).value();
    if (!curve.set_speed_trend({static_cast<Real>(share), from_rpm(trend.at("reference_rpm").number())}))
      trend.refuse("k changes by more than 0.3 from rest to the reference speed, or that is not positive", kFitAgain);
  }
  if (torque.size() < 2 || torque.size() > kMostKnots) return;
  std::vector<Knot> shares;
  for (const Coefficients::Torque& one : torque)
    shares.push_back({one.occlusion, static_cast<Real>(one.k_q / torque.front().k_q)});
  const auto table = OcclusionTable::from(shares.data(), shares.size());
  if (!table || !curve.set_torque_share(*table))
    top.at("torque").refuse("the torques do not ascend from phi_deg 0, or one is ten times the first", kFitAgain);
}

/// K_T is the k of the table at φ = 0, to the rounding of a hand that wrote it.
void refuse_other_k_t(const Value& top, const Coefficients& coefficients) {
  constexpr double kRounding = 1e-3;
  const double k_t = coefficients.curve.thrust_coefficient().value();
  for (const Coefficients::Row& row : coefficients.table)
    if (row.occlusion.value() == 0.0 && !(std::fabs(row.k.value() / k_t - 1.0) < kRounding))
      top.map_at("K_T").refuse("K_T is not the k of the table at phi_deg 0", kFitAgain);
}

}  // namespace

const Coefficients::ThrottleLaw::Number* Coefficients::ThrottleLaw::find(const std::string& number) const {
  for (const Number& one : numbers)
    if (one.name == number) return &one;
  return nullptr;
}

const Coefficients::ThrottleLaw* Coefficients::throttle_law(const std::string& name) const {
  for (const ThrottleLaw& law : throttle)
    if (law.name == name) return &law;
  return nullptr;
}

Coefficients parse_coefficients(const std::string& text, const std::string& path, Need need) {
  const Value top = top_of(text, path);
  refuse_other_format(top);
  const double scale = scale_of_unit(top);
  const auto [smallest, largest] = occlusions_of(top, need);
  Coefficients coefficients(read_curve(top, scale, from_degrees(largest)));
  coefficients.path = path;
  coefficients.smallest_occlusion = from_degrees(smallest);
  coefficients.thrust_coefficient = read_uncertainty(top.at("K_T"), scale);
  const Value curve = top.map_at("curve");
  coefficients.form = curve.at("form").text();
  coefficients.anchored = curve.at("anchored").truth();
  coefficients.parameters = read_parameters(curve, scale);
  if (coefficients.form == "line")
    coefficients.covariance = read_covariance(top, {scale, scale, scale * kPerDegreeToPerRad});
  for (const Value& point : curve.list("points_deg")) coefficients.points.push_back(from_degrees(point.number()));
  if (const auto speed = read_range(top.at("valid"), "speed_rpm")) {
    coefficients.slowest_speed = from_rpm(speed->first);
    coefficients.fastest_speed = from_rpm(speed->second);
  }
  coefficients.origin = top.text_at("origin");
  coefficients.measured_utc = top.text_at("measured_utc");
  coefficients.tool_version = top.text_at("tool_version");
  read_propeller(top.map_at("propeller"), coefficients.propeller);
  for (const Value& row : top.rows("table", "a row of the table has no keys"))
    coefficients.table.push_back(read_row(row, scale));
  refuse_other_k_t(top, coefficients);
  if (top.find("torque"))
    for (const Value& row : top.rows("torque", "a row of the torques has no keys"))
      coefficients.torque.push_back(read_torque(row));
  read_more_of_curve(top, coefficients.torque, coefficients.curve);
  for (const Value& law : top.rows("throttle", "a throttle law has no keys"))
    coefficients.throttle.push_back(read_throttle_law(law));
  coefficients.air_density_kg_m3 = top.number_at("air_density_kg_m3");
  coefficients.air_density_u_kg_m3 = top.number_at("air_density_u_kg_m3");
  if (const auto map = top.find("provenance"); map && map->node().IsMap())
    read_provenance(*map, coefficients.provenance);
  if (top.find("uncertainty")) {
    const Value uncertainty = top.map_at("uncertainty");
    for (const Value& source : uncertainty.list("not_known")) coefficients.not_known.push_back(source.text());
    if (uncertainty.find("assumed"))
      for (const Value& source : uncertainty.list("assumed")) coefficients.assumed.push_back(source.text());
    coefficients.verdict = uncertainty.text_at("verdict");
    if (uncertainty.find("thrust_error")) {
      const Value error = uncertainty.map_at("thrust_error");
      coefficients.thrust_error = {error.number_at("share_95"), error.number_at("phi_deg"),
                                   error.number_at("fit_to_fly"), error.number_at("with_care")};
    }
    coefficients.doubts_allow = uncertainty.text_at("doubts_allow");
    if (uncertainty.find("thrust_error_within"))
      coefficients.thrust_error_within = read_error_within(uncertainty.map_at("thrust_error_within"));
  }
  return coefficients;
}

Coefficients load_coefficients(const std::string& path, Need need) {
  constexpr std::size_t kLargest = 1 << 20;
  const std::string next_move = "; give the coefficients.yaml that `kphi fit` wrote";
  std::error_code error;
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error))
    throw CoefficientError(path + ": is a folder, a pipe or a device" + next_move);
  std::ifstream file(path, std::ios::binary);
  std::string text(kLargest + 1, '\0');
  if (file) file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file.is_open() || file.bad())
    throw CoefficientError(path + ": cannot be read (" + std::strerror(errno) + ")" + next_move);
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kLargest) throw CoefficientError(path + ": is larger than 1 MiB" + next_move);
  return parse_coefficients(text, path, need);
}

std::string words_of(const ThrustCurve& curve) {
  char words[64];
  return curve.visit(
      [&](const Line& line) {
        std::snprintf(words, sizeof words, "%.6g %c %.6g phi/rad", line.intercept.value(),
                      line.slope_per_rad < 0 ? '-' : '+', std::fabs(line.slope_per_rad));
        return std::string(words);
      },
      [&](const OcclusionTable& table) {
        std::string text;
        for (const Knot& knot : table) {
          std::snprintf(words, sizeof words, "%s%.6g at %.4g", text.empty() ? "" : ", ", knot.value,
                        to_degrees(knot.occlusion));
          text += words;
        }
        return text + " deg";
      });
}

std::optional<std::string> overlap_mismatch(OverlapMeasure fitted, const std::string& coefficients,
                                            OverlapMeasure flown, const std::string& vehicle) {
  if (fitted == flown) return std::nullopt;
  const std::string as_fitted(name_of(fitted)), as_flown(name_of(flown));
  return coefficients + ": fitted with overlap " + as_fitted + ", but " + vehicle + " flies with " + as_flown +
         "; write `overlap: " + as_fitted + "` in the vehicle file, or fit again with " + as_flown;
}

}  // namespace kphi::compensation
