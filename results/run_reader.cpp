#include "results/run_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include "results/hdf5.hpp"
#include "results/run_layout.hpp"

namespace kphi::results {
namespace {

using hdf5::ColumnReader;
using hdf5::Handle;

constexpr std::uint64_t kBlock = 8192;  // rows: the blocks of five columns stay in the second-level cache

void require_format(const Handle& root, const std::filesystem::path& path) {
  std::string format;
  if (hdf5::has_attribute(root, "format")) hdf5::read_attribute(root, "format", format);
  if (format == kRunFormat) return;
  if (format.empty()) throw RecordError(path.string() + ": not a run file: it has no format attribute");
  throw RecordError(fmt::format("{}: format \"{}\" cannot be read, only \"{}\"; use the version of kphi that wrote it",
                                path.string(), format, kRunFormat));
}

RunHeader header_of(const Handle& root, const std::filesystem::path& path) {
  require_format(root, path);
  RunHeader header;
  for_each_attribute(header, [&](const char* name, auto& value) { hdf5::read_attribute(root, name, value); });
  return header;
}

/// The columns of one group, and how many of their rows are valid.
template <class Row>
struct GroupReader {
  GroupReader(const Handle& parent, const RunGroup<Row>& described, const std::string& file) : layout(described) {
    const Handle group = hdf5::open_group(parent, layout.name);
    hdf5::read_attribute(group, "n_valid", rows);
    for (const RunColumn<Row>& column : layout.columns) {
      columns.emplace_back(group, column.name, column.stored, file);
      rows = std::min(rows, columns.back().rows());
    }
  }
  RunGroup<Row> layout;
  std::vector<ColumnReader> columns;
  std::uint64_t rows = 0;
};

/// Throws RecordError for a code that has no meaning.
template <class Row>
void check_codes(const RunGroup<Row>& layout, const RunColumn<Row>& column, std::span<const std::byte> codes,
                 std::uint64_t first, const std::string& file) {
  for (std::size_t i = 0; !column.codes.empty() && i < codes.size(); ++i) {
    const auto code = std::to_integer<unsigned>(codes[i]);
    if (code >= column.codes.size()) {
      throw RecordError(
          fmt::format("{}: {} row {} has the unknown {} {}", file, layout.name, first + i, column.name, code));
    }
  }
}

template <class Row>
std::vector<Row> rows_of(GroupReader<Row>& group, const std::string& file) {
  std::vector<Row> rows(group.rows);
  std::vector<std::byte> bytes;
  for (std::uint64_t at = 0; at < group.rows; at += kBlock) {
    const std::uint64_t n = std::min(kBlock, group.rows - at);
    for (std::size_t i = 0; i < group.columns.size(); ++i) {
      const RunColumn<Row>& column = group.layout.columns[i];
      bytes.resize(n * bytes_of(column.stored));
      group.columns[i].read(at, n, bytes.data());
      check_codes(group.layout, column, bytes, at, file);
      column.unpack(bytes.data(), std::span(rows).subspan(at, n));
    }
  }
  return rows;
}

template <class Row>
std::vector<Row> rows_of(const Handle& parent, const RunGroup<Row>& layout, const std::string& file) {
  GroupReader<Row> group(parent, layout, file);
  return rows_of(group, file);
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
  GroupReader<LoadCellRecord> cell(root, kLoadCellGroup, path.string());
  const auto raw = [&](std::string_view name) {
    std::size_t i = 0;
    while (cell.layout.columns[i].name != name) ++i;
    return cell.columns[i].raw();
  };
  const auto counts = raw("counts"), ft = raw("ft_sequence"), status = raw("status"), arrival = raw("t_arrival_ns");
  if (counts && ft && status && arrival) {
    return std::make_unique<FileColumns>(path, cell.rows, FileColumns::Places{*counts, *ft, *status, *arrival});
  }
  return std::make_unique<ConvertedColumns>(
      std::make_unique<const std::vector<LoadCellRecord>>(rows_of(cell, path.string())));
}

std::vector<MotorReading> motor_of(const Handle& root, const std::string& file) {
  const Handle motor = hdf5::open_group(root, "motor");
  std::vector<MotorReading> readings;
  for (const MotorChannelInfo& info : kMotorChannels) {
    auto rows = rows_of(motor, motor_group(info), file);
    const auto earlier = [](const MotorReading& a, const MotorReading& b) { return a.time_ns < b.time_ns; };
    if (!std::is_sorted(rows.begin(), rows.end(), earlier)) std::stable_sort(rows.begin(), rows.end(), earlier);
    for (MotorReading& row : rows) row.channel = info.channel;
    readings.insert(readings.end(), rows.begin(), rows.end());
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
  for_each_figure(run, [&](const char* name, auto& value) { hdf5::read_attribute(root, name, value); });
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
  run.motor = motor_of(root, file);
  run.phases = rows_of(root, kCommandGroup, file);
  run.events = rows_of(root, kEventGroup, file);
  run.supply = rows_of(root, kSupplyGroup, file);
  read_outcome(root, run);
  return run;
}

}  // namespace

RunRecording read_run(const std::filesystem::path& path) {
  return naming(path, [&] {
    const Handle root = hdf5::open_file(path);
    RunRecording run = without_load_cell(root, path);
    run.load_cell = rows_of(root, kLoadCellGroup, path.string());
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
