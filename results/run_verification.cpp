#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "results/file_layer.hpp"
#include "results/hdf5.hpp"
#include "results/run_layout.hpp"
#include "results/run_reader.hpp"

namespace kphi::results {
namespace {

using hdf5::Handle;
using Problems = std::vector<std::string>;

template <class Row>
void check_columns(const Handle& parent, const RunGroup<Row>& layout, Problems& problems) {
  const Handle group = hdf5::open_group(parent, layout.name);
  std::uint64_t n_valid = 0;
  hdf5::read_attribute(group, "n_valid", n_valid);
  for (const RunColumn<Row>& described : layout.columns) {
    hdf5::ColumnReader column(group, described.name, described.stored, layout.name);
    if (column.rows() != n_valid) {
      problems.push_back(
          fmt::format("{}/{} has {} rows where n_valid is {}", layout.name, described.name, column.rows(), n_valid));
      continue;
    }
    std::uint32_t crc = 0;
    hdf5::read_attribute(column.dataset(), "crc32", crc);
    if (column.crc(n_valid) != crc)
      problems.push_back(fmt::format("{}/{} does not match its checksum", layout.name, described.name));
  }
}

void check_all_columns(const std::filesystem::path& path, Problems& problems) {
  const Handle root = hdf5::open_file(path);
  check_columns(root, kLoadCellGroup, problems);
  const Handle motor = hdf5::open_group(root, "motor");
  for (const MotorChannelInfo& info : kMotorChannels) check_columns(motor, motor_group(info), problems);
  check_columns(root, kCommandGroup, problems);
  check_columns(root, kEventGroup, problems);
  check_columns(root, kSupplyGroup, problems);
}

void check_end(const std::filesystem::path& path, const RunRecording& run, Problems& problems) {
  const Handle root = hdf5::open_file(path);
  if (!hdf5::has_attribute(root, "attributes_sha256")) {
    problems.push_back("the writer was stopped before the end");
    return;
  }
  std::string digest;
  std::string outcome;
  hdf5::read_attribute(root, "attributes_sha256", digest);
  hdf5::read_attribute(root, "outcome", outcome);
  if (digest != attributes_digest(run.header, run)) problems.push_back("the attributes do not match their checksum");
  if (outcome != outcome_name(run.outcome))
    problems.push_back(fmt::format("outcome \"{}\" contradicts the flag complete", outcome));
}

void check_account(const RunRecording& run, const SequenceCheck& sequence, Problems& problems) {
  const SampleAccount& account = run.account;
  const std::uint64_t counted = account.lost_network + account.lost_host;
  if (account.received != run.load_cell.size()) {
    problems.push_back(fmt::format("{} samples where {} were received", run.load_cell.size(), account.received));
  }
  if (account.received + counted != account.expected) {
    problems.push_back(
        fmt::format("{} received and {} lost are not the {} expected", account.received, counted, account.expected));
  }
  if (sequence.lost != counted && sequence.reboots == 0) {
    problems.push_back(
        fmt::format("ft_sequence shows {} missing samples where {} were counted", sequence.lost, counted));
  }
}

void check_order(const RunRecording& run, const SequenceCheck& sequence, Problems& problems) {
  if (sequence.repeated > 0) problems.push_back(fmt::format("{} samples are there twice", sequence.repeated));
  if (sequence.off_stride > run.account.irregular) {
    problems.push_back(fmt::format("ft_sequence left its stride of {} at {} places", run.header.load_cell.ft_stride,
                                   sequence.off_stride));
  }
  if (sequence.reboots > run.account.reboots) {
    problems.push_back(fmt::format("ft_sequence jumped back {} times: the box restarted, {} restarts were counted",
                                   sequence.reboots, run.account.reboots));
  }
  if (sequence.restarts > run.account.restarts) {
    problems.push_back(fmt::format("rdt_sequence began again {} times where {} restarts were counted",
                                   sequence.restarts, run.account.restarts));
  }
  for (std::size_t i = 1; i < run.phases.size(); ++i) {
    if (run.phases[i].time_ns < run.phases[i - 1].time_ns)
      problems.push_back(fmt::format("command {} lies before command {}", i, i - 1));
  }
}

void check_scale(const RunHeader& header, Problems& problems) {
  const LoadCellScale& scale = header.load_cell;
  const std::map<std::string, double> positive{{"counts_per_newton", scale.counts_per_newton},
                                               {"counts_per_newton_metre", scale.counts_per_newton_metre},
                                               {"sample_rate_hz", scale.sample_rate_hz},
                                               {"device_rate_hz", scale.device_rate_hz},
                                               {"ft_stride", scale.ft_stride},
                                               {"clock_gain", header.clock_gain}};
  for (const auto& [name, value] : positive) {
    if (!(std::isfinite(value) && value > 0)) problems.push_back(fmt::format("{} is {}", name, value));
  }
  if (std::abs(scale.sample_rate_hz * scale.ft_stride / scale.device_rate_hz - 1) > 0.01) {
    problems.push_back(fmt::format("{} Hz with a stride of {} do not make the box's {} Hz", scale.sample_rate_hz,
                                   scale.ft_stride, scale.device_rate_hz));
  }
  if (header.thrust_axis < 0 || header.thrust_axis > 2)
    problems.push_back(fmt::format("thrust_axis is {}", header.thrust_axis));
  if (std::abs(header.thrust_sign) != 1) problems.push_back(fmt::format("thrust_sign is {}", header.thrust_sign));
  if (std::abs(header.spin) != 1) problems.push_back(fmt::format("spin is {}", header.spin));
}

}  // namespace

std::string attributes_digest(const RunHeader& header, const RunEnding& ending) {
  nlohmann::json all;
  const auto add = [&](const char* name, const auto& value) { all[name] = value; };
  for_each_attribute(header, add);
  for_each_figure(ending, add);
  add("outcome", outcome_name(ending.outcome));
  add("outcome_reason", ending.outcome_reason);
  return sha256(all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

const char* outcome_name(Outcome outcome) { return outcome == Outcome::complete ? "complete" : "aborted"; }

Verification verify_run(const std::filesystem::path& path) {
  Verification found;
  found.path = path;
  try {
    const RunRecording run = read_run(path);
    found.header = run.header;
    found.account = run.account;
    found.outcome = run.outcome;
    found.samples = run.load_cell.size();
    check_end(path, run, found.problems);
    check_all_columns(path, found.problems);
    const SequenceCheck sequence = check_sequence(run.load_cell, run.header.load_cell.ft_stride);
    found.lost = sequence.lost;
    check_account(run, sequence, found.problems);
    check_order(run, sequence, found.problems);
    check_scale(run.header, found.problems);
    if (run.outcome == Outcome::complete && run.load_cell.empty()) found.problems.push_back("no samples");
  } catch (const RecordError& error) {
    found.problems.push_back(error.what());
  }
  return found;
}

}  // namespace kphi::results
