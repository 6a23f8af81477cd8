#include "fit/import_table.hpp"

#include <fmt/format.h>

#include "fit/report.hpp"

namespace kphi::fit {

ImportedTable import_table(std::string_view text, const std::string& path, const ImportOptions& options) {
  const Table header = read_blank_separated(text.substr(0, text.find('\n')), path);
  const bool uiuc = header.find_column("RPM") && header.find_column("CT");
  ImportedTable imported = uiuc ? read_uiuc(text, path, {.diameter_in = options.diameter_in})
                                : select_rows(read_rcbenchmark(text, path), options.rows);
  for (results::StepMean& step : imported.steps) {
    if (!options.propeller.empty()) step.propeller = options.propeller;
    if (options.diameter_in) step.diameter_in = *options.diameter_in;
    step.blades = options.blades;
  }
  return imported;
}

std::string summary_of(const ImportedTable& imported) {
  const ThrustFit fit = fit_thrust(points_of(imported.steps));
  std::string text = fmt::format("{} of {} rows, thrust in {}, {} speed", imported.steps.size(), imported.rows_total,
                                 imported.unit, imported.speed_source);
  if (imported.tare_n != 0) text += fmt::format(", tare {:.4f} N", imported.tare_n);
  return text + fmt::format(", k = {} N/(rad/s)^2, rms {:.4f} N", with_error(fit.parameters.k, fit.standard_error.k),
                            fit.rms_n);
}

}  // namespace kphi::fit
