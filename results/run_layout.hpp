// Names in a run file (format kphi-run/1), told once: the writer, the reader and the digest of the header use this
// table.
#pragma once

#include <cstdint>
#include <string>

#include "results/records.hpp"

namespace kphi::results {

inline constexpr const char* kRunFormat = "kphi-run/1";

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
}

/// Calls visit(name, member) for every root attribute that counts samples.
template <class Account, class Visit>
void for_each_count(Account& account, Visit&& visit) {
  visit("n_expected", account.expected);
  visit("n_received", account.received);
  visit("n_lost_network", account.lost_network);
  visit("n_lost_host", account.lost_host);
  visit("n_duplicates", account.duplicates);
  visit("n_late", account.late);
  visit("n_malformed", account.malformed);
  visit("n_restarts", account.restarts);
}

/// SHA-256 over names and values of all of these, with the outcome: what the attribute `attributes_sha256` holds.
[[nodiscard]] std::string attributes_digest(const RunHeader& header, const SampleAccount& account, Outcome outcome,
                                            const std::string& reason);

[[nodiscard]] const char* outcome_name(Outcome outcome);

}  // namespace kphi::results
