// CSV and MCAP: the numbers of a campaign for people and their programs.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/device_data.hpp"
#include "base/number.hpp"
#include "fit/export/facts.hpp"
#include "fit/export/mcap_writer.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

std::string error_at(const compensation::ThrustCurve& curve, Radians phi) {
  const double error = curve.standard_error_at(phi);
  return std::isfinite(error) ? shortest(error) : "";
}

constexpr const char* kCoefficientSchema =
    R"({"type":"object","properties":{"phi_deg":{"type":"number"},"k":{"type":"number"},"u":{"type":"number"},"expanded_95":{"type":"number"},)"
    R"("curve_k":{"type":"number"},"scaling_factor":{"type":"number"}}})";

std::map<std::string, std::string> provenance(const compensation::Coefficients& file) {
  std::map<std::string, std::string> values{{"propeller", file.propeller.id},
                                            {"k_unit", "N/(rad/s)^2"},
                                            {"K_T", Json(file.curve.thrust_coefficient().value()).dump()},
                                            {"origin", name_of(origin_named(file.origin))},
                                            {"verdict", file.verdict},
                                            {"measured_utc", file.measured_utc},
                                            {"tool_version", file.tool_version}};
  for (const auto& parameter : file.parameters) values[parameter.key] = Json(parameter.value).dump();
  for (const auto& run : file.provenance.runs) values["sha256 " + run.file] = run.sha256;
  return values;
}

}  // namespace

/// The table per occlusion with the curve beside it. phi_deg, k and u come first: `kphi fit` reads them; u are standard
/// uncertainties.
Export to_csv(const compensation::Coefficients& file, const ExportOptions&) {
  const compensation::ThrustCurve& curve = file.curve;
  Export result;
  result.text =
      "phi_deg,k_n_s2_per_rad2,u_k_n_s2_per_rad2,expanded_95_k_n_s2_per_rad2,curve_k_n_s2_per_rad2,"
      "u_curve_k_n_s2_per_rad2,scaling_factor,origin,verdict\n";
  for (const auto& row : file.table) {
    result.text += fmt::format(
        "{},{},{},{},{},{},{},{},{}\n", shortest(std::round(to_degrees(row.occlusion) * 1e9) / 1e9),
        shortest(row.k.value()), row.uncertainty ? shortest(row.uncertainty->u) : "",
        row.uncertainty ? shortest(row.uncertainty->expanded_95) : "", shortest(curve.at(row.occlusion).value()),
        error_at(curve, row.occlusion), shortest(curve.scaling_factor(row.occlusion)),
        name_of(origin_named(file.origin)), file.verdict.empty() ? "unknown" : file.verdict);
  }
  result.lost = {"the curve's parameters, covariance, validity, hashes of the runs: only in the coefficient file"};
  return result;
}

/// One message per occlusion, a second apart: Foxglove and PlotJuggler plot over time only.
Export to_mcap(const compensation::Coefficients& file, const ExportOptions&) {
  std::ostringstream bytes;
  McapWriter writer(bytes, "kphi " + file.tool_version);
  const auto channel =
      writer.add_channel("/kphi/coefficient", "kphi.Coefficient", kCoefficientSchema, {{"k_unit", "N/(rad/s)^2"}});
  std::uint64_t time_ns = 0;
  for (const auto& row : file.table) {
    Json message{{"phi_deg", to_degrees(row.occlusion)}, {"k", row.k.value()}};
    if (row.uncertainty) message.update({{"u", row.uncertainty->u}, {"expanded_95", row.uncertainty->expanded_95}});
    message["curve_k"] = file.curve.at(row.occlusion).value();
    message["scaling_factor"] = file.curve.scaling_factor(row.occlusion);
    writer.write(channel, time_ns, message.dump());
    time_ns += 1'000'000'000;
  }
  writer.add_metadata("kphi-coefficients", provenance(file));
  writer.close();
  return {std::move(bytes).str(), {"phi as an axis: the format only has time; the occlusions are a second apart"}};
}

}  // namespace kphi::fit
