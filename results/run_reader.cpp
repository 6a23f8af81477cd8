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

int format_of(const Handle& root, const std::filesystem::path& path) {
  std::string format = "none";
  if (hdf5::has_attribute(root, "format")) hdf5::read_attribute(root, "format", format);
  for (int known = 1; known <= kRunFormat; ++known) {
    if (format == format_name(known)) return known;
  }
  throw RecordError(fmt::format("{}: is no run file: format \"{}\" where \"{}\" was expected", path.string(), format,
                                format_name(kRunFormat)));
}

RunHeader header_of(const Handle& root, const std::filesystem::path& path) {
  RunHeader header;
  header.format = format_of(root, path);
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
    if (codes[i] > static_cast<std::uint8_t>(kLastPhase)) {
      throw RecordError(fmt::format("{}: commands row {} has the unknown phase {}", file, i, codes[i]));
    }
    marks.push_back({static_cast<Phase>(codes[i]), steps[i], times[i], speeds[i]});
  }
  return marks;
}

std::vector<StreamEvent> events_of(const Handle& root, const std::string& file) {
  const Handle group = hdf5::open_group(root, "events");
  const Handle type = hdf5::fixed_text_type(kEventTextBytes);
  ColumnReader kind(group, "kind", H5T_NATIVE_UINT8, 1, file);
  ColumnReader time(group, "t_ns", H5T_NATIVE_INT64, 8, file);
  ColumnReader records(group, "records", H5T_NATIVE_UINT64, 8, file);
  ColumnReader text(group, "text", type.get(), kEventTextBytes, file);
  const std::uint64_t rows = valid_rows(group, {&kind, &time, &records, &text});
  std::vector<StreamEvent> events;
  for (std::uint64_t i = 0; i < rows; ++i) {
    std::uint8_t code = 0;
    std::array<char, kEventTextBytes + 1> line{};
    StreamEvent event;
    kind.read(i, 1, &code);
    time.read(i, 1, &event.time_ns);
    records.read(i, 1, &event.records);
    text.read(i, 1, line.data());
    if (code >= kEventNames.size()) {
      throw RecordError(fmt::format("{}: events row {} has the unknown kind {}", file, i, code));
    }
    event.kind = static_cast<EventKind>(code);
    event.text = line.data();
    events.push_back(std::move(event));
  }
  return events;
}

std::vector<SupplyReading> supply_of(const Handle& root, const std::string& file) {
  const Handle group = hdf5::open_group(root, "supply");
  ColumnReader time(group, "t_ns", H5T_NATIVE_INT64, 8, file);
  ColumnReader uncertainty(group, "t_uncertainty_ns", H5T_NATIVE_INT64, 8, file);
  ColumnReader voltage(group, "voltage", H5T_NATIVE_DOUBLE, 8, file);
  ColumnReader current(group, "current", H5T_NATIVE_DOUBLE, 8, file);
  ColumnReader set_voltage(group, "set_voltage", H5T_NATIVE_DOUBLE, 8, file);
  ColumnReader current_limit(group, "current_limit", H5T_NATIVE_DOUBLE, 8, file);
  ColumnReader regulation(group, "regulation", H5T_NATIVE_UINT8, 1, file);
  ColumnReader protection(group, "protection", H5T_NATIVE_UINT8, 1, file);
  ColumnReader output(group, "output", H5T_NATIVE_UINT8, 1, file);
  const std::uint64_t rows = valid_rows(group, {&time, &uncertainty, &voltage, &current, &set_voltage, &current_limit,
                                                &regulation, &protection, &output});
  std::vector<SupplyReading> readings(rows);
  for (std::uint64_t i = 0; i < rows; ++i) {
    SupplyReading& reading = readings[i];
    std::uint8_t codes[3] = {};
    time.read(i, 1, &reading.time_ns);
    uncertainty.read(i, 1, &reading.uncertainty_ns);
    voltage.read(i, 1, &reading.voltage_v);
    current.read(i, 1, &reading.current_a);
    set_voltage.read(i, 1, &reading.set_voltage_v);
    current_limit.read(i, 1, &reading.current_limit_a);
    regulation.read(i, 1, &codes[0]);
    protection.read(i, 1, &codes[1]);
    output.read(i, 1, &codes[2]);
    if (codes[0] > static_cast<std::uint8_t>(SupplyRegulation::unknown) ||
        codes[1] > static_cast<std::uint8_t>(SupplyProtection::unknown)) {
      throw RecordError(fmt::format("{}: supply row {} has an unknown code", file, i));
    }
    reading.regulation = static_cast<SupplyRegulation>(codes[0]);
    reading.protection = static_cast<SupplyProtection>(codes[1]);
    reading.output = codes[2];
  }
  return readings;
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
  for_each_figure(run, run.header.format,
                  [&](const char* name, auto& value) { hdf5::read_attribute(root, name, value); });
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
    const Handle root = hdf5::open_file(path);
    RunRecording run;
    run.header = header_of(root, path);
    run.load_cell = load_cell_of(root, path.string());
    const Handle motor = hdf5::open_group(root, "motor");
    for (const MotorChannelInfo& info : kMotorChannels) {
      if (info.since <= run.header.format) append_channel(motor, info, path.string(), run.motor);
    }
    run.phases = phases_of(root, path.string());
    if (run.header.format >= 2) run.events = events_of(root, path.string());
    if (run.header.format >= 4) run.supply = supply_of(root, path.string());
    read_outcome(root, run);
    return run;
  });
}

RunHeader read_header(const std::filesystem::path& path) {
  return naming(path, [&] { return header_of(hdf5::open_file(path), path); });
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
      found.lost +=
          std::max(1u, (static_cast<std::uint32_t>(ft) + ft_stride / 2) / static_cast<std::uint32_t>(stride)) - 1;
      found.restarts += rdt <= 0;
      found.off_stride += rdt > 0 && ft % stride != 0;  // a stream begins anew at any sample of the box
    }
  }
  return found;
}

}  // namespace kphi::results
