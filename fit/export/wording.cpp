#include "fit/export/wording.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "profiles/configuration_error.hpp"
#include "results/number.hpp"

namespace kphi::fit {

double coefficient_at(const compensation::Coefficients& file, double phi_deg) {
  if (!(phi_deg >= 0) || phi_deg > to_degrees(file.largest_occlusion) + 1e-9) {
    throw ConfigurationError(fmt::format("{}: --phi-deg {} lies outside the occlusions that were measured, 0 to {:g}",
                                         file.path, phi_deg, to_degrees(file.largest_occlusion)));
  }
  return file.thrust_coefficient.value() * compensation::thrust_line(file).scaling_factor(from_degrees(phi_deg));
}

double speed_max_of(const compensation::Coefficients& file, const ExportOptions& options) {
  if (options.speed_max_rpm) return from_rpm(*options.speed_max_rpm).value();
  if (file.fastest_speed) return file.fastest_speed->value();
  throw ConfigurationError(file.path + ": holds no range of speeds; give the speed at full output, --speed-max-rpm");
}

std::string one_line(const std::string& text) {
  std::string result = text;
  for (char& c : result)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  return result;
}

std::vector<std::string> provenance_lines(const compensation::Coefficients& file) {
  const auto known = [](const std::string& text) { return text.empty() ? std::string("unknown") : one_line(text); };
  std::vector<std::string> lines;
  lines.push_back(fmt::format("propeller {}, {}", known(file.propeller.id), known(file.propeller.name)));
  lines.push_back(fmt::format(
      "K_T {} N/(rad/s)^2, standard error {}", results::yaml_number(file.thrust_coefficient.value()),
      file.thrust_coefficient_error ? results::yaml_number(file.thrust_coefficient_error->value()) : "unknown"));
  lines.push_back(fmt::format("phi is meant as the {} of the overlap", compensation::name_of(file.overlap)));
  lines.push_back(fmt::format("measured {}, campaign {}, {} runs, fitted by kphi {}", known(file.measured_utc),
                              known(file.provenance.campaign), file.provenance.runs.size(), known(file.tool_version)));
  lines.push_back(file.air_density_kg_m3
                      ? fmt::format("in air of {:.4g} kg/m3; k scales with density", *file.air_density_kg_m3)
                      : std::string("air density unknown; k holds for the air of that day"));
  return lines;
}

std::string comment(const compensation::Coefficients& file, const std::string& mark) {
  std::string text;
  for (const std::string& line : provenance_lines(file)) text += mark + line + "\n";
  return text;
}

std::string json_text(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string no_phi(const char* target, double phi_deg) {
  return fmt::format(
      "k(phi): {} has one constant per motor and cannot change it in flight; this is phi = {:g} deg, for the others "
      "fly "
      "the compensation library",
      target, phi_deg);
}

}  // namespace kphi::fit
