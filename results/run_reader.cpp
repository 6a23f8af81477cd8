#include "results/run_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

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

/// The five columns of the load cell, and how many of their rows are valid.
struct LoadCellReader {
  LoadCellReader(const Handle& root, const std::string& file)
      : group(hdf5::open_group(root, "load_cell")),
        counts(group, "counts", H5T_NATIVE_INT32, 24, file),
        rdt(group, "rdt_sequence", H5T_NATIVE_UINT32, 4, file),
        ft(group, "ft_sequence", H5T_NATIVE_UINT32, 4, file),
        status(group, "status", H5T_NATIVE_UINT32, 4, file),
        arrival(group, "t_arrival_ns", H5T_NATIVE_INT64, 8, file),
        rows(valid_rows(group, {&counts, &rdt, &ft, &status, &arrival})) {}
  Handle group;
  ColumnReader counts, rdt, ft, status, arrival;
  std::uint64_t rows;
};

std::vector<LoadCellRecord> records_of(LoadCellReader& cell) {
  struct Block {
    std::array<std::array<std::int32_t, 6>, kBlock> counts;
    std::array<std::uint32_t, kBlock> rdt, ft, status;
    std::array<std::int64_t, kBlock> arrival;
  };
  const auto block = std::make_unique<Block>();
  std::vector<LoadCellRecord> records;
  records.reserve(cell.rows);
  for (std::uint64_t at = 0; at < cell.rows; at += kBlock) {
    const std::uint64_t n = std::min(kBlock, cell.rows - at);
    cell.counts.read(at, n, block->counts.data());
    cell.rdt.read(at, n, block->rdt.data());
    cell.ft.read(at, n, block->ft.data());
    cell.status.read(at, n, block->status.data());
    cell.arrival.read(at, n, block->arrival.data());
    for (std::uint64_t i = 0; i < n; ++i) {
      records.push_back({block->counts[i], block->rdt[i], block->ft[i], block->status[i], block->arrival[i]});
    }
  }
  return records;
}

/// Of a file that others compressed or converted.
class ConvertedColumns : public RecordedColumns {
 public:
  explicit ConvertedColumns(std::unique_ptr<const std::vector<LoadCellRecord>> records)
      : RecordedColumns(*records), records_(std::move(records)) {}

 private:
  std::unique_ptr<const std::vector<LoadCellRecord>> records_;
};

/// Straight from the file where it is as our writer leaves it; else by HDF5, whole.
std::unique_ptr<LoadCellColumns> columns_of(const Handle& root, const std::filesystem::path& path) {
  LoadCellReader cell(root, path.string());
  const auto counts = cell.counts.raw(), ft = cell.ft.raw(), status = cell.status.raw(), arrival = cell.arrival.raw();
  if (counts && ft && status && arrival) {
    return std::make_unique<FileColumns>(OpenFile(path), cell.rows,
                                         FileColumns::Places{*counts, *ft, *status, *arrival});
  }
  return std::make_unique<ConvertedColumns>(std::make_unique<const std::vector<LoadCellRecord>>(records_of(cell)));
}

template <class Row>
std::vector<Row> rows_of(ColumnReader& column, std::uint64_t n) {
  std::vector<Row> rows(n);
  column.read(0, n, rows.data());
  return rows;
}

void append_channel(const Handle& motor, const MotorChannelInfo& info, const std::string& file,
                    std::vector<MotorReading>& out) {
  const Handle group = hdf5::open_group(motor, info.name);
  ColumnReader value(group, "value", H5T_NATIVE_DOUBLE, 8, file);
  ColumnReader time(group, "t_ns", H5T_NATIVE_INT64, 8, file);
  ColumnReader uncertainty(group, "t_uncertainty_ns", H5T_NATIVE_INT64, 8, file);
  const std::uint64_t rows = valid_rows(group, {&value, &time, &uncertainty});
  const auto values = rows_of<double>(value, rows);
  const auto times = rows_of<Nanoseconds>(time, rows), uncertainties = rows_of<Nanoseconds>(uncertainty, rows);
  const auto first = static_cast<std::ptrdiff_t>(out.size());
  for (std::uint64_t i = 0; i < rows; ++i) out.push_back({info.channel, times[i], uncertainties[i], values[i]});
  const auto earlier = [](const MotorReading& a, const MotorReading& b) { return a.time_ns < b.time_ns; };
  if (!std::is_sorted(out.begin() + first, out.end(), earlier)) {
    std::stable_sort(out.begin() + first, out.end(), earlier);
  }
}

std::vector<MotorReading> motor_of(const Handle& root, int format, const std::string& file) {
  const Handle motor = hdf5::open_group(root, "motor");
  std::vector<MotorReading> readings;
  for (const MotorChannelInfo& info : kMotorChannels) {
    if (info.since <= format) append_channel(motor, info, file, readings);
  }
  return readings;
}

std::vector<PhaseMark> phases_of(const Handle& root, const std::string& file) {
  const Handle group = hdf5::open_group(root, "commands");
  ColumnReader phase(group, "phase", H5T_NATIVE_UINT8, 1, file);
  ColumnReader step(group, "step", H5T_NATIVE_INT32, 4, file);
  ColumnReader time(group, "t_ns", H5T_NATIVE_INT64, 8, file);
  ColumnReader speed(group, "speed_rad_s", H5T_NATIVE_DOUBLE, 8, file);
  const std::uint64_t rows = valid_rows(group, {&phase, &step, &time, &speed});
  const auto codes = rows_of<std::uint8_t>(phase, rows);
  const auto steps = rows_of<std::int32_t>(step, rows);
  const auto times = rows_of<Nanoseconds>(time, rows);
  const auto speeds = rows_of<double>(speed, rows);
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
  using Text = std::array<char, kEventTextBytes>;
  const Handle group = hdf5::open_group(root, "events");
  const Handle type = hdf5::fixed_text_type(kEventTextBytes);
  ColumnReader kind(group, "kind", H5T_NATIVE_UINT8, 1, file);
  ColumnReader time(group, "t_ns", H5T_NATIVE_INT64, 8, file);
  ColumnReader records(group, "records", H5T_NATIVE_UINT64, 8, file);
  ColumnReader text(group, "text", type.get(), kEventTextBytes, file);
  const std::uint64_t rows = valid_rows(group, {&kind, &time, &records, &text});
  const auto codes = rows_of<std::uint8_t>(kind, rows);
  const auto times = rows_of<Nanoseconds>(time, rows);
  const auto counts = rows_of<std::uint64_t>(records, rows);
  const auto texts = rows_of<Text>(text, rows);
  std::vector<StreamEvent> events;
  for (std::uint64_t i = 0; i < rows; ++i) {
    if (codes[i] >= kEventNames.size()) {
      throw RecordError(fmt::format("{}: events row {} has the unknown kind {}", file, i, codes[i]));
    }
    const Text& line = texts[i];
    events.push_back({static_cast<EventKind>(codes[i]), times[i], counts[i],
                      std::string(line.begin(), std::find(line.begin(), line.end(), '\0'))});
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
  const auto take = [&]<class Value>(ColumnReader& column, Value SupplyReading::*member) {
    const auto values = rows_of<Value>(column, rows);
    for (std::uint64_t i = 0; i < rows; ++i) readings[i].*member = values[i];
  };
  take(time, &SupplyReading::time_ns);
  take(uncertainty, &SupplyReading::uncertainty_ns);
  take(voltage, &SupplyReading::voltage_v);
  take(current, &SupplyReading::current_a);
  take(set_voltage, &SupplyReading::set_voltage_v);
  take(current_limit, &SupplyReading::current_limit_a);
  const auto regulations = rows_of<std::uint8_t>(regulation, rows),
             protections = rows_of<std::uint8_t>(protection, rows), outputs = rows_of<std::uint8_t>(output, rows);
  for (std::uint64_t i = 0; i < rows; ++i) {
    if (regulations[i] > static_cast<std::uint8_t>(SupplyRegulation::unknown) ||
        protections[i] > static_cast<std::uint8_t>(SupplyProtection::unknown)) {
      throw RecordError(fmt::format("{}: supply row {} has an unknown code", file, i));
    }
    readings[i].regulation = static_cast<SupplyRegulation>(regulations[i]);
    readings[i].protection = static_cast<SupplyProtection>(protections[i]);
    readings[i].output = outputs[i];
  }
  return readings;
}

bool has_ending(const Handle& root) { return hdf5::has_attribute(root, "outcome_reason"); }

void read_outcome(const Handle& root, RunRecording& run) {
  std::int32_t complete = 0;
  hdf5::read_attribute(root, "complete", complete);
  if (!has_ending(root)) {
    run.outcome_reason = "the writer was stopped before the end";
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

RunRecording without_load_cell(const Handle& root, const std::filesystem::path& path) {
  const std::string file = path.string();
  RunRecording run;
  run.header = header_of(root, path);
  run.motor = motor_of(root, run.header.format, file);
  run.phases = phases_of(root, file);
  if (run.header.format >= 2) run.events = events_of(root, file);
  if (run.header.format >= 4) run.supply = supply_of(root, file);
  read_outcome(root, run);
  return run;
}

}  // namespace

RunRecording read_run(const std::filesystem::path& path) {
  return naming(path, [&] {
    const Handle root = hdf5::open_file(path);
    RunRecording run = without_load_cell(root, path);
    LoadCellReader cell(root, path.string());
    run.load_cell = records_of(cell);
    if (has_ending(root)) return run;
    run.account.received = run.load_cell.size();
    run.account.lost_network = check_sequence(run.load_cell, run.header.load_cell.ft_stride).lost;
    run.account.expected = run.account.received + run.account.lost_network;
    return run;
  });
}

RunFile open_run(const std::filesystem::path& path) {
  return naming(path, [&] {
    const Handle root = hdf5::open_file(path);
    return RunFile{without_load_cell(root, path), columns_of(root, path)};
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
