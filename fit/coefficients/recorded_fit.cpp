#include "fit/coefficients/recorded_fit.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "base/number.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

/// The value with this name; the first if the file has none.
template <class Enum>
Enum named(const std::string& name, const char* key, const std::string& path, std::initializer_list<Enum> values) {
  if (name.empty()) return *values.begin();
  for (const Enum value : values)
    if (name == name_of(value)) return value;
  throw ConfigurationError(fmt::format("{}: unknown {} `{}`; fit again with this version of kphi", path, key, name));
}

}  // namespace

RecordedFit read_recorded_fit(const std::string& path) {
  const auto file = compensation::load_coefficients(path);
  const auto& fit = file.provenance.fit;
  RecordedFit record;
  record.propeller = file.propeller.id;
  record.diameter_in = file.propeller.diameter_in;
  record.blades = file.propeller.blades;
  record.overlap = file.curve.overlap();
  IdentificationOptions& options = record.options;
  options.line.anchored = file.anchored;
  for (const Radians& point : file.points) options.line.points_deg.push_back(to_degrees(point));
  if (!file.table.empty() && file.table.front().at_speed) options.at_speed_rad_s = file.table.front().at_speed->value();
  if (fit.speed_range_rpm) {
    const double slack = 1e-3;  // the file has RPM to a thousandth; that much more takes the same steps again
    options.speed_range = {from_rpm(fit.speed_range_rpm->first - slack).value(),
                           from_rpm(fit.speed_range_rpm->second + slack).value()};
  }
  options.estimator =
      named(fit.k_by, "k_by", path,
            {Estimator::through_origin, Estimator::with_offset, Estimator::polynomial, Estimator::at_speed});
  options.weighting =
      named(fit.weights, "weights", path, {Weighting::equal, Weighting::thrust, Weighting::effective_variance});
  options.loss = named(fit.loss, "loss", path, {Loss::none, Loss::huber, Loss::cauchy, Loss::tukey});
  for (const std::string& run : fit.leave_out) options.left_out.push_back(parse_left_out_run(run));
  if (!fit.bench) return record;
  record.bench.emplace();
  for (const auto& [name, value] : *fit.bench) set_uncertainty(*record.bench, name + "=" + shortest(value));
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
