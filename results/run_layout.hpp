// Names in a run file (format kphi-run/4; older ones lack some), told once: the writer, the reader and the digest of
// the attributes use this table.
#pragma once

#include <cstdint>
#include <string>

#include "results/records.hpp"

namespace kphi::results {

inline constexpr int kRunFormat = 4;
/// "kphi-run/4".
[[nodiscard]] std::string format_name(int format);

/// Calls visit(name, member) for every root attribute that describes the run. `Header` is RunHeader or const RunHeader.
template <class Header, class Visit>
void for_each_attribute(Header& header, Visit&& visit) {
  visit("uuid", header.uuid);
  visit("started_utc", header.started_utc);
  visit("tool_version", header.tool_version);
  visit("campaign_name", header.campaign_name);
  visit("campaign_text", header.campaign_text);
  visit("bench_text", header.bench_text);
  visit("operator", header.operator_name);
  visit("propeller_id", header.propeller_id);
  visit("propeller_name", header.propeller_name);
  visit("diameter_in", header.diameter_in);
  visit("blades", header.blades);
  visit("occlusion_deg", header.occlusion_deg);
  visit("repetition", header.repetition);
  visit("thrust_axis", header.thrust_axis);
  visit("thrust_sign", header.thrust_sign);
  visit("spin", header.spin);
  visit("minimum_discard_s", header.minimum_discard_s);
  visit("counts_per_newton", header.load_cell.counts_per_newton);
  visit("counts_per_newton_metre", header.load_cell.counts_per_newton_metre);
  visit("sample_rate_hz", header.load_cell.sample_rate_hz);
  visit("ft_stride", header.load_cell.ft_stride);
  visit("device_rate_hz", header.load_cell.device_rate_hz);
  visit("range", header.load_cell.range);
  visit("calibration_serial", header.load_cell.serial);
  visit("configuration_xml", header.load_cell.configuration_xml);
  visit("motor_identity", header.motor_identity);
  if (header.format >= 2) visit("slots_json", header.load_cell.slots_json);
  if (header.format >= 3) visit("motor_parameters", header.motor_parameters);
  if (header.format < 4) return;
  visit("supply_identity", header.supply_identity);
  visit("air_density_kg_m3", header.air_density_kg_m3);
  visit("air_density_u_kg_m3", header.air_density_u_kg_m3);
}

/// Calls visit(name, member) for every root attribute that is written at the end, but for the outcome. `Ending` is
/// RunEnding or const RunEnding; `format` that of the header.
template <class Ending, class Visit>
void for_each_figure(Ending& ending, int format, Visit&& visit) {
  auto& account = ending.account;
  visit("n_expected", account.expected);
  visit("n_received", account.received);
  visit("n_lost_network", account.lost_network);
  visit("n_lost_host", account.lost_host);
  visit("n_duplicates", account.duplicates);
  visit("n_late", account.late);
  visit("n_malformed", account.malformed);
  visit("n_restarts", account.restarts);
  if (format < 2) return;
  visit("n_reboots", account.reboots);
  visit("n_reordered", account.reordered);
  visit("n_stalled", account.stalled);
  visit("n_irregular", account.irregular);
  auto& health = ending.health;
  visit("health_records_per_second", health.records_per_second);
  visit("health_datagrams_per_second", health.datagrams_per_second);
  visit("health_jitter_p50_s", health.jitter_p50_s);
  visit("health_jitter_p99_s", health.jitter_p99_s);
  visit("health_skew_ppm", health.skew_ppm);
  visit("health_clock_uncertainty_s", health.clock_uncertainty_s);
  visit("health_queue_high_water", health.queue_high_water);
  visit("health_events_dropped", health.events_dropped);
  auto& bias = ending.box_bias;
  visit("box_bias_records", bias.records);
  visit("box_bias_before", bias.before);
  visit("box_bias_before_sd", bias.before_sd);
  visit("box_bias_after", bias.after);
  visit("box_bias_after_sd", bias.after_sd);
}

/// SHA-256 over names and values of all of these, with the outcome: what the attribute `attributes_sha256` holds.
[[nodiscard]] std::string attributes_digest(const RunHeader& header, const RunEnding& ending);

[[nodiscard]] const char* outcome_name(Outcome outcome);

}  // namespace kphi::results
