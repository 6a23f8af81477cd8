#include "drivers/netbox/receive/probe.hpp"

#include <fmt/format.h>

#include <cmath>

#include "base/error.hpp"
#include "drivers/netbox/configuration/calinfo.hpp"
#include "drivers/netbox/wire/status.hpp"

namespace kphi::netbox {
namespace {

void judge_stream(Probe& probe, std::uint32_t status, bool known_skew) {
  const Counters& counters = probe.counters;
  const auto find = [&](Severity severity, std::string what, std::string next_move) {
    probe.findings.push_back({severity, std::move(what), std::move(next_move)});
  };
  if (counters.lost_network > 0)
    find(Severity::warning,
         fmt::format("{} of {} records were lost in the network", counters.lost_network, counters.expected),
         "connect the box directly, or through a switch of its own");
  if (counters.lost_host > 0)
    find(Severity::warning,
         fmt::format("{} of {} records were lost in this computer", counters.lost_host, counters.expected),
         "raise net.core.rmem_max to 4194304");
  if (counters.malformed > 0)
    find(Severity::warning, fmt::format("{} datagrams have a wrong size", counters.malformed),
         "check that no other device uses this address");
  if (!healthy(status))
    find(Severity::fault, fmt::format("the box reports: {}", fmt::join(names(status, probe.configuration->kind), ", ")),
         "power-cycle the box; unload the cell if saturated");
  if (known_skew && std::abs(probe.health.skew_ppm) > ClockEstimate::kBelievableSkewPpm)
    find(Severity::fault,
         fmt::format("the box's clock deviates by {:.0f} ppm: its rate is not the configured one",
                     probe.health.skew_ppm),
         "read the RDT output rate on the box's Communications page again");
  for (std::size_t axis = 0; axis < kAxisNames.size(); ++axis)
    if (probe.noise.records > 1 && probe.configuration->range[axis] > 0 && probe.noise.standard_deviation[axis] == 0)
      find(Severity::fault,
           fmt::format("{} repeats one value in all {} records: it is frozen", kAxisNames[axis], probe.noise.records),
           "switch the load cell off and on, check its cable");
  for (const Event& event : probe.events) find(Severity::warning, to_string(event), "");
}

void look_at_stream(Probe& probe, LoadCell& cell, const Clock& clock, std::chrono::nanoseconds duration) {
  cell.start();
  const auto end = std::chrono::steady_clock::now() + duration;
  std::vector<LoadCellRecord> batch(4096);
  std::uint32_t status = 0;
  ZeroEstimate noise;
  for (auto now = std::chrono::steady_clock::now(); now < end; now = std::chrono::steady_clock::now()) {
    if (!cell.wait(end - now)) break;
    const std::size_t count = cell.take(batch);
    for (std::size_t i = 0; i < count; ++i) {
      if (!healthy(batch[i].status)) status |= batch[i].status;
      noise.add(batch[i].counts, batch[i].status);
    }
  }
  cell.stop();
  probe.streamed = true;
  probe.counters = cell.counters();
  probe.health = cell.health();
  probe.receive_buffer = cell.receive_buffer().note();
  probe.noise = noise.result(*probe.configuration);
  probe.events = cell.take_events();
  judge_stream(probe, status, clock.shrunk(std::chrono::seconds(1)) == std::chrono::seconds(1));
}

std::string filter_words(const Configuration& box) {
  if (!filter_cutoff_hz(box)) return fmt::format("filter code {}", box.filter_code);
  const double cutoff = *filter_cutoff_hz(box);
  return cutoff > 0 ? fmt::format("filter {:g} Hz", cutoff) : "no filter";
}

}  // namespace

std::vector<std::string> Probe::lines() const {
  std::vector<std::string> text;
  if (configuration) {
    const Configuration& box = *configuration;
    text.push_back(fmt::format("{}, serial {}, firmware {}", box.product.empty() ? "Net Box" : box.product,
                               box.serial.empty() ? "unknown" : box.serial, box.firmware));
    text.push_back(fmt::format("calibration {} in slot {} \"{}\", {:.0f} counts per N, {:.0f} per N m",
                               box.calibration_serial, box.slot, box.slot_name, box.counts_per_newton,
                               box.counts_per_newton_metre));
    const std::span range(box.range);
    text.push_back(
        fmt::format("ranges {:g} N, {:g} N m", fmt::join(range.first(3), " "), fmt::join(range.last(3), " ")));
    text.push_back(fmt::format("RDT {}, {:.4g} Hz, {} records per datagram, {}",
                               box.rdt_enabled ? "enabled" : "disabled", box.rdt_rate_hz, box.records_per_datagram,
                               filter_words(box)));
    text.push_back(fmt::format("gage bias {:g}", fmt::join(box.gage_bias, " ")));
  }
  if (streamed) {
    text.push_back(fmt::format("{} records, {:.1f} per second, {} lost, {} late, {} duplicates, {} overtaken",
                               counters.received, health.records_per_second, counters.lost_network + counters.lost_host,
                               counters.late, counters.duplicates, counters.reordered));
    text.push_back(fmt::format("clock {:+.1f} ppm, jitter p50 {:.0f} us, p99 {:.0f} us", health.skew_ppm,
                               1e6 * health.jitter_p50_s, 1e6 * health.jitter_p99_s));
    text.push_back("receive buffer " + receive_buffer);
    const std::span deviation(noise.standard_deviation);
    text.push_back(fmt::format("noise {:.2g} N, {:.2g} N m (standard deviation of a record, where nothing moves)",
                               fmt::join(deviation.first(3), " "), fmt::join(deviation.last(3), " ")));
  }
  return text;
}

std::string Probe::in_short() const {
  if (!configuration) return "";
  const Configuration& box = *configuration;
  std::string text =
      fmt::format("{} {}, {:g} N, {:.4g} Hz, {}", box.product.empty() ? "Net Box" : box.product, box.calibration_serial,
                  fmt::join(std::span(box.range).first(3), " "), box.rdt_rate_hz, filter_words(box));
  if (streamed)
    text += fmt::format(", {} of {} records lost, noise {:.2g} N", counters.lost_network + counters.lost_host,
                        counters.expected, fmt::join(std::span(noise.standard_deviation).first(3), " "));
  return text;
}

Probe probe(const Address& address, const Clock& clock, const ProbeSettings& settings) {
  Probe found;
  try {
    LoadCell cell(address, clock);
    found.configuration = cell.configuration();
    found.findings = audit(*found.configuration, settings.intention);
    if (auto finding = cell.receive_buffer().finding()) found.findings.push_back(std::move(*finding));
    if (auto finding = cross_check(address.where(), settings.tcp_port, *found.configuration, settings.tcp_timeout))
      found.findings.push_back(std::move(*finding));
    look_at_stream(found, cell, clock, settings.stream);
  } catch (const DeviceError& error) {
    found.findings.push_back({Severity::fault, error.what(), ""});
  }
  put_worst_first(found.findings);
  return found;
}

}  // namespace kphi::netbox
