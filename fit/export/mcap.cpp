// One message per occlusion, a second apart: Foxglove and PlotJuggler know no other axis than time.
#include <nlohmann/json.hpp>
#include <sstream>

#include "fit/export/mcap_writer.hpp"
#include "fit/export/wording.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema =
    R"({"type":"object","properties":{"phi_deg":{"type":"number"},"k":{"type":"number"},"standard_error":{"type":"number"},)"
    R"("line_k":{"type":"number"},"scaling_factor":{"type":"number"}}})";

std::map<std::string, std::string> provenance(const compensation::Coefficients& file) {
  std::map<std::string, std::string> values{{"propeller", file.propeller.id},
                                            {"k_unit", "N/(rad/s)^2"},
                                            {"K_T", Json(file.thrust_coefficient.value()).dump()},
                                            {"intercept", Json(file.line.intercept.value()).dump()},
                                            {"slope_per_rad", Json(file.line.slope_per_rad).dump()},
                                            {"measured_utc", file.measured_utc},
                                            {"tool_version", file.tool_version}};
  for (const auto& run : file.provenance.runs) values["sha256 " + run.file] = run.sha256;
  return values;
}

}  // namespace

Export to_mcap(const compensation::Coefficients& file, const ExportOptions&) {
  const compensation::ThrustLine line = compensation::thrust_line(file);
  std::ostringstream bytes;
  McapWriter writer(bytes, "kphi " + file.tool_version);
  const auto channel =
      writer.add_channel("/kphi/coefficient", "kphi.Coefficient", kSchema, {{"k_unit", "N/(rad/s)^2"}});
  std::uint64_t time_ns = 0;
  for (const auto& row : file.table) {
    Json message{{"phi_deg", to_degrees(row.occlusion)}, {"k", row.k.value()}};
    if (row.standard_error) message["standard_error"] = row.standard_error->value();
    message["line_k"] = line.at(row.occlusion).value();
    message["scaling_factor"] = line.scaling_factor(row.occlusion);
    writer.write(channel, time_ns, message.dump());
    time_ns += 1'000'000'000;
  }
  writer.add_metadata("kphi-coefficients", provenance(file));
  writer.close();
  return {std::move(bytes).str(),
          {"phi as an axis: the format knows time only; the occlusions follow one another a second apart"}};
}

}  // namespace kphi::fit
