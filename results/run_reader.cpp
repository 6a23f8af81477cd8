#include "results/run_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "results/hdf5.hpp"
#include "results/run_layout.hpp"

namespace kphi::results {
namespace {

using hdf5::ColumnReader;
using hdf5::Handle;

constexpr std::uint64_t kBlock = 8192;  // rows: the blocks of five columns stay in the second-level cache

Handle open_run(const std::filesystem::path& path) {
  Handle root = hdf5::open_file(path);
  std::string format = "none";
  if (hdf5::has_attribute(root, "format")) hdf5::read_attribute(root, "format", format);
  if (format == kRunFormat) return root;
  throw RecordError(
      fmt::format("{}: is no run file: format \"{}\" where \"{}\" was expected", path.string(), format, kRunFormat));
}

RunHeader header_of(const Handle& root) {
  RunHeader header;
  for_each_attribute(header, [&](const char* name, auto& value) { hdf5::read_attribute(root, name, value); });
  return header;
}

std::uint64_t valid_rows(const Handle& group, std::initializer_list<const ColumnReader*> columns) {
  std::uint64_t n = 0;
  hdf5::read_attribute(group, "n_valid", n);
  for (const ColumnReader* column : columns) n = std::min(n, column->rows());
  return n;
}

std::vector<LoadCellRecord> load_cell_of(const Handle& root, const std::string& file) {
  const Handle group = hdf5::open_group(root, "load_cell");
  ColumnReader counts(group, "counts", H5T_NATIVE_INT32, 24, file);
  ColumnReader rdt(group, "rdt_sequence", H5T_NATIVE_UINT32, 4, file);
  ColumnReader ft(group, "ft_sequence", H5T_NATIVE_UINT32, 4, file);
  ColumnReader status(group, "status", H5T_NATIVE_UINT32, 4, file);
  ColumnReader arrival(group, "t_arrival_ns", H5T_NATIVE_INT64, 8, file);
  const std::uint64_t rows = valid_rows(group, {&counts, &rdt, &ft, &status, &arrival});

  struct Block {
    std::array<std::array<std::int32_t, 6>, kBlock> counts;
    std::array<std::uint32_t, kBlock> rdt, ft, status;
    std::array<std::int64_t, kBlock> arrival;
  };
  const auto block = std::make_unique<Block>();
  std::vector<LoadCellRecord> records;
  records.reserve(rows);
  for (std::uint64_t at = 0; at < rows; at += kBlock) {
    const std::uint64_t n = std::min(kBlock, rows - at);
    counts.read(at, n, block->counts.data());
    rdt.read(at, n, block->rdt.data());
    ft.read(at, n, block->ft.data());
    status.read(at, n, block->status.data());
    arrival.read(at, n, block->arrival.data());
    for (std::uint64_t i = 0; i < n; ++i) {
      records.push_back({block->counts[i], block->rdt[i], block->ft[i], block->status[i], block->arrival[i]});
    }
  }
  return records;
}

void append_channel(const Handle& motor, const MotorChannelInfo& info, const std::string& file,
                    std::vector<MotorReading>& out) {
  const Handle group = hdf5::open_group(motor, info.name);
  ColumnReader value(group, "value", H5T_NATIVE_DOUBLE, 8, file);
  ColumnReader time(group, "t_ns", H5T_NATIVE_INT64, 8, file);
  ColumnReader uncertainty(group, "t_uncertainty_ns", H5T_NATIVE_INT64, 8, file);
  const std::uint64_t rows = valid_rows(group, {&value, &time, &uncertainty});
  std::vector<double> values(rows);
  std::vector<Nanoseconds> times(rows), uncertainties(rows);
  value.read(0, rows, values.data());
  time.read(0, rows, times.data());
  uncertainty.read(0, rows, uncertainties.data());
  const auto first = static_cast<std::ptrdiff_t>(out.size());
  for (std::uint64_t i = 0; i < rows; ++i) out.push_back({info.channel, times[i], uncertainties[i], values[i]});
  std::stable_sort(out.begin() + first, out.end(),
                   [](const MotorReading& a, const MotorReading& b) { return a.time_ns < b.time_ns; });
}

std::vector<PhaseMark> phases_of(const Handle& root, const std::string& file) {
  const Handle group = hdf5::open_group(root, "commands");
  ColumnReader phase(group, "phase", H5T_NATIVE_UINT8, 1, file);
  ColumnReader step(group, "step", H5T_NATIVE_INT32, 4, file);
  ColumnReader time(group, "t_ns", H5T_NATIVE_INT64, 8, file);
  ColumnReader speed(group, "speed_rad_s", H5T_NATIVE_DOUBLE, 8, file);
  const std::uint64_t rows = valid_rows(group, {&phase, &step, &time, &speed});
  std::vector<std::uint8_t> codes(rows);
  std::vector<std::int32_t> steps(rows);
  std::vector<Nanoseconds> times(rows);
  std::vector<double> speeds(rows);
  phase.read(0, rows, codes.data());
  step.read(0, rows, steps.data());
  time.read(0, rows, times.data());
  speed.read(0, rows, speeds.data());
  std::vector<PhaseMark> marks;
  for (std::uint64_t i = 0; i < rows; ++i) {
    if (codes[i] > static_cast<std::uint8_t>(Phase::end)) {
      throw RecordError(fmt::format("{}: commands row {} has the unknown phase {}", file, i, codes[i]));
    }
    marks.push_back({static_cast<Phase>(codes[i]), steps[i], times[i], speeds[i]});
  }
  return marks;
}

void read_outcome(const Handle& root, RunRecording& run) {
  std::int32_t complete = 0;
  hdf5::read_attribute(root, "complete", complete);
  if (!hdf5::has_attribute(root, "outcome_reason")) {
    run.outcome_reason = "the writer was stopped before the end";
    run.account.received = run.load_cell.size();
    run.account.lost_network = check_sequence(run.load_cell, run.header.load_cell.ft_stride).lost;
    run.account.expected = run.account.received + run.account.lost_network;
    return;
  }
  for_each_count(run.account, [&](const char* name, auto& value) { hdf5::read_attribute(root, name, value); });
  hdf5::read_attribute(root, "outcome_reason", run.outcome_reason);
  run.outcome = complete == 1 ? Outcome::complete : Outcome::aborted;
}

/// One error text per file, however deep it arose.
template <class Read>
auto naming(const std::filesystem::path& path, Read&& read) {
  try {
    return read();
  } catch (const RecordError& error) {
    const std::string text = error.what();
    throw RecordError(text.find(path.string()) != std::string::npos ? text : path.string() + ": " + text);
  }
}

}  // namespace

RunRecording read_run(const std::filesystem::path& path) {
  return naming(path, [&] {
    const Handle root = open_run(path);
    RunRecording run;
    run.header = header_of(root);
    run.load_cell = load_cell_of(root, path.string());
    const Handle motor = hdf5::open_group(root, "motor");
    for (const MotorChannelInfo& info : kMotorChannels) append_channel(motor, info, path.string(), run.motor);
    run.phases = phases_of(root, path.string());
    read_outcome(root, run);
    return run;
  });
}

RunHeader read_header(const std::filesystem::path& path) {
  return naming(path, [&] { return header_of(open_run(path)); });
}

SequenceCheck check_sequence(const std::vector<LoadCellRecord>& records, std::uint32_t ft_stride) {
  SequenceCheck found;
  const auto stride = static_cast<std::int32_t>(std::max(ft_stride, 1u));
  for (std::size_t i = 1; i < records.size(); ++i) {
    const auto ft = static_cast<std::int32_t>(records[i].ft_sequence - records[i - 1].ft_sequence);
    const auto rdt = static_cast<std::int32_t>(records[i].rdt_sequence - records[i - 1].rdt_sequence);
    if (ft == stride && rdt == 1) continue;
    if (ft == 0) {
      ++found.repeated;
    } else if (ft < 0) {
      ++found.reboots;
    } else {
      found.lost += static_cast<std::uint64_t>(ft / stride) - (ft >= stride ? 1 : 0);
      found.off_stride += ft % stride != 0;
      found.restarts += rdt <= 0;
    }
  }
  return found;
}

}  // namespace kphi::results
