#include "fit/recorded_fit.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "compensation/file/coefficient_file.hpp"
#include "compensation/units.hpp"
#include "fit/coefficients.hpp"
#include "profiles/configuration_error.hpp"
#include "results/number.hpp"

namespace kphi::fit {
namespace {

using results::yaml_number;

/// The value of `key` among the names of `values`; the first when the file does not tell.
template <class Enum>
Enum named(const YAML::Node& fit, const char* key, const std::string& path, std::initializer_list<Enum> values) {
  if (!fit[key].IsDefined()) return *values.begin();
  const auto name = fit[key].as<std::string>("");
  for (const Enum value : values)
    if (name == name_of(value)) return value;
  throw ConfigurationError(fmt::format("{}: {} `{}` is not known to this version; fit again", path, key, name));
}

/// The speeds that carried the fit. The file prints them to a thousandth RPM; that much more on either side takes the
/// same steps again.
SpeedRange fitted_range(const YAML::Node& fit, SpeedRange range) {
  const YAML::Node ends = fit["speed_range_rpm"];
  if (!ends.IsDefined() || ends.size() != 2) return range;
  const double slack = 1e-3;
  return {from_rpm(ends[0].as<double>() - slack).value(), from_rpm(ends[1].as<double>() + slack).value()};
}

std::optional<BenchUncertainty> bench_of(const YAML::Node& u, const std::string& path) {
  if (!u.IsDefined()) return std::nullopt;
  BenchUncertainty bench;
  if (!u.IsMap()) throw ConfigurationError(path + ": provenance.fit.u is no list of NAME: VALUE; fit again");
  for (const auto& entry : u)
    set_uncertainty(bench, entry.first.as<std::string>("") + "=" + entry.second.as<std::string>(""));
  return bench;
}

}  // namespace

std::string format_fit_options(const Identification& identification, const std::optional<BenchUncertainty>& bench) {
  std::string text = fmt::format("k_by: {}, weights: {}, loss: {}", name_of(identification.estimator),
                                 name_of(identification.weighting), name_of(identification.loss));
  if (speeds_known(identification)) {
    text += fmt::format(", speed_range_rpm: [{}, {}]", yaml_number(printed_rpm(identification.fitted.min_rad_s)),
                        yaml_number(printed_rpm(identification.fitted.max_rad_s)));
  }
  std::string left_out;
  for (const LeftOutRun& run : identification.left_out)
    left_out += fmt::format("{}{}", left_out.empty() ? "" : ", ",
                            quoted(fmt::format("{}:{}:{}", results::shortest(run.phi_deg), run.repetition, run.cause)));
  if (!left_out.empty()) text += ", leave_out: [" + left_out + "]";
  if (!bench) return text;
  std::string known;
  for (const auto& [name, value] : known_uncertainties(*bench))
    known += fmt::format("{}{}: {}", known.empty() ? "" : ", ", name, yaml_number(value));
  return text + ", u: {" + known + "}";
}

RecordedFit read_recorded_fit(const std::string& path) {
  const auto file = compensation::load_coefficients(path);
  RecordedFit record;
  record.propeller = file.propeller.id;
  record.diameter_in = file.propeller.diameter_in;
  record.blades = file.propeller.blades;
  record.overlap = file.overlap;
  record.options.line.anchored = file.line.anchored;
  for (const Radians& point : file.line.points) record.options.line.points_deg.push_back(to_degrees(point));
  if (!file.table.empty() && file.table.front().at_speed)
    record.options.at_speed_rad_s = file.table.front().at_speed->value();
  const YAML::Node fit = YAML::LoadFile(path)["provenance"]["fit"];
  if (!fit.IsDefined() || !fit.IsMap()) return record;
  record.options.speed_range = fitted_range(fit, record.options.speed_range);
  record.options.estimator =
      named(fit, "k_by", path,
            {Estimator::through_origin, Estimator::with_offset, Estimator::polynomial, Estimator::at_speed});
  record.options.weighting =
      named(fit, "weights", path, {Weighting::equal, Weighting::thrust, Weighting::effective_variance});
  record.options.loss = named(fit, "loss", path, {Loss::none, Loss::huber, Loss::cauchy, Loss::tukey});
  for (const YAML::Node& run : fit["leave_out"])
    record.options.left_out.push_back(parse_left_out_run(run.as<std::string>("")));
  record.bench = bench_of(fit["u"], path);
  return record;
}

Identification identify_again(std::span<const results::StepMean> steps, const RecordedFit& record) {
  Identification result = identify(steps, record.options);
  result.propeller = record.propeller;
  result.diameter_in = record.diameter_in;
  result.blades = record.blades;
  result.overlap = record.overlap;
  return result;
}

}  // namespace kphi::fit
