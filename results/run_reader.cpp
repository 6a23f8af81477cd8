#include "results/run_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <span>

#include "results/digest.hpp"
#include "results/hdf5.hpp"
#include "results/run_layout.hpp"

namespace kphi::results {
namespace {

using hdf5::ColumnReader;
using hdf5::Handle;

constexpr std::uint64_t kBlock = 8192;  // rows: the blocks of five columns stay in the second-level cache

/// What a reduction reads of the samples: all but rdt_sequence.
constexpr std::array kReduced{layout::kLoadCell[0], layout::kLoadCell[2], layout::kLoadCell[3], layout::kLoadCell[4]};
constexpr RunGroup<LoadCellRecord> kReducedGroup{kLoadCellGroup.name, kLoadCellGroup.long_name,
                                                 kLoadCellGroup.chunk_rows, kLoadCellGroup.time, kReduced};

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
  if (hdf5::has_attribute(root, "origin")) hdf5::read_attribute(root, "origin", header.origin);
  for_each_attribute(header, [&](const char* name, auto& value) { hdf5::read_attribute(root, name, value); });
  return header;
}

/// The columns of one group, and how many of their rows are valid.
template <class Row>
struct GroupReader {
  GroupReader(const Handle& parent, const RunGroup<Row>& described, const std::string& file) : layout(described) {
    const Handle group = hdf5::open_group(parent, layout.name);
    hdf5::read_attribute(group, "n_valid", n_valid);
    rows = n_valid;
    for (const RunColumn<Row>& column : layout.columns) {
      columns.emplace_back(group, column.name, column.stored, file);
      rows = std::min(rows, columns.back().rows());
    }
  }
  RunGroup<Row> layout;
  std::vector<ColumnReader> columns;
  std::uint64_t n_valid = 0;
  std::uint64_t rows = 0;  ///< that all columns have
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

std::string_view bytes_of_value(const std::string& text) { return text; }
template <class Number>
std::string_view bytes_of_value(const Number& numbers) {
  return {reinterpret_cast<const char*>(&numbers), sizeof numbers};
}

/// Digests of the columns that were read, if anybody asks for them.
class Contents {
 public:
  template <class Row>
  void begin(GroupReader<Row>& group) {
    for (ColumnReader& column : group.columns) column.begin_digest();
  }
  template <class Row>
  void add(const GroupReader<Row>& group) {
    for (std::size_t i = 0; i < group.columns.size(); ++i)
      lines_ += fmt::format("{}/{} {}\n", group.layout.name, group.layout.columns[i].name, group.columns[i].digest());
  }
  /// With the attributes of a run that has ended.
  [[nodiscard]] std::string xxh128(const RunRecording& run) const {
    Xxh128 attributes;
    const auto add = [&](const char* name, const auto& value) {
      attributes.update(name);
      attributes.update(bytes_of_value(value));
    };
    for_each_attribute(run.header, add);
    for_each_figure(run, add);
    add("outcome", std::string(outcome_name(run.outcome)));
    add("outcome_reason", run.outcome_reason);
    return results::xxh128(lines_ + "attributes " + attributes.hex() + "\n");
  }

 private:
  std::string lines_;
};

/// Behind those that are there.
template <class Row>
void append_rows(std::vector<Row>& rows, const Handle& parent, const RunGroup<Row>& layout, const std::string& file,
                 Contents* contents) {
  GroupReader<Row> group(parent, layout, file);
  if (contents != nullptr) contents->begin(group);
  const std::size_t first = rows.size();
  rows.resize(first + group.rows);
  std::vector<std::byte> bytes;
  for (std::uint64_t at = 0; at < group.rows; at += kBlock) {
    const std::uint64_t n = std::min(kBlock, group.rows - at);
    for (std::size_t i = 0; i < group.columns.size(); ++i) {
      const RunColumn<Row>& column = group.layout.columns[i];
      bytes.resize(n * bytes_of(column.stored));
      group.columns[i].read(at, n, bytes.data());
      check_codes(group.layout, column, bytes, at, file);
      column.unpack(bytes.data(), std::span(rows).subspan(first + at, n));
    }
  }
  if (contents != nullptr) contents->add(group);
}

template <class Row>
std::vector<Row> rows_of(const Handle& parent, const RunGroup<Row>& layout, const std::string& file,
                         Contents* contents = nullptr) {
  std::vector<Row> rows;
  append_rows(rows, parent, layout, file, contents);
  return rows;
}

std::vector<MotorReading> motor_of(const Handle& root, const std::string& file, Contents* contents) {
  const Handle motor = hdf5::open_group(root, "motor");
  std::vector<MotorReading> readings;
  for (const MotorChannelInfo& info : kMotorChannels) {
    const std::size_t before = readings.size();
    append_rows(readings, motor, motor_group(info), file, contents);
    const auto rows = std::span(readings).subspan(before);
    const auto earlier = [](const MotorReading& a, const MotorReading& b) { return a.time_ns < b.time_ns; };
    if (!std::ranges::is_sorted(rows, earlier)) std::ranges::stable_sort(rows, earlier);
    for (MotorReading& row : rows) row.channel = info.channel;
    if (before == 0) readings.reserve(readings.size() * std::size(kMotorChannels));  // as many of each, as a rule
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

RunRecording all_but_samples(const Handle& root, const std::filesystem::path& path, Contents* contents = nullptr) {
  const std::string file = path.string();
  RunRecording run;
  run.header = header_of(root, path);
  run.motor = motor_of(root, file, contents);
  run.phases = rows_of(root, kCommandGroup, file, contents);
  run.events = rows_of(root, kEventGroup, file, contents);
  run.supply = rows_of(root, kSupplyGroup, file, contents);
  read_outcome(root, run);
  return run;
}

/// One error text per file, however deep it arose.
auto naming(const std::filesystem::path& path, auto&& read) {
  try {
    return read();
  } catch (const RecordError& error) {
    throw RecordError(with_file(path, error.what()));
  }
}

using Problems = std::vector<std::string>;

template <class Row>
void check_columns(const Handle& parent, const RunGroup<Row>& layout, Problems& problems) {
  GroupReader<Row> group(parent, layout, layout.name);
  for (std::size_t i = 0; i < group.columns.size(); ++i) {
    ColumnReader& column = group.columns[i];
    const char* name = layout.columns[i].name;
    if (column.rows() != group.n_valid) {
      problems.push_back(
          fmt::format("{}/{} has {} rows, n_valid is {}", layout.name, name, column.rows(), group.n_valid));
      continue;
    }
    std::uint32_t crc = 0;
    hdf5::read_attribute(column.dataset(), "crc32", crc);
    if (column.crc() != crc) problems.push_back(fmt::format("{}/{} does not match its checksum", layout.name, name));
  }
}

/// Of the samples, if they were written: as many as valid rows, intact, and increasing.
void check_sample_times(const Handle& root, Problems& problems) {
  const Handle group = hdf5::open_group(root, kLoadCellGroup.name);
  if (!hdf5::has_dataset(group, layout::kSampleTime.name)) return;
  ColumnReader column(group, layout::kSampleTime.name, layout::kSampleTime.stored, kLoadCellGroup.name);
  if (column.rows() == 0) return;
  std::uint64_t n_valid = 0;
  std::uint32_t crc = 0;
  hdf5::read_attribute(group, "n_valid", n_valid);
  hdf5::read_attribute(column.dataset(), "crc32", crc);
  std::vector<Nanoseconds> times(column.rows());
  column.read(0, times.size(), times.data());
  if (times.size() != n_valid)
    problems.push_back(fmt::format("load_cell/t_ns has {} rows, n_valid is {}", times.size(), n_valid));
  if (column.crc() != crc) problems.emplace_back("load_cell/t_ns does not match its checksum");
  if (std::ranges::adjacent_find(times, std::greater_equal()) != times.end())
    problems.emplace_back("load_cell/t_ns does not increase");
}

void check_all_columns(const Handle& root, Problems& problems) {
  check_columns(root, kLoadCellGroup, problems);
  check_sample_times(root, problems);
  if (hdf5::has_attribute(root, "default")) check_columns(root, kPlotGroup, problems);
  const Handle motor = hdf5::open_group(root, "motor");
  for (const MotorChannelInfo& info : kMotorChannels) check_columns(motor, motor_group(info), problems);
  check_columns(root, kCommandGroup, problems);
  check_columns(root, kEventGroup, problems);
  check_columns(root, kSupplyGroup, problems);
}

void check_end(const Handle& root, const RunRecording& run, Problems& problems) {
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

/// Otherwise nobody can tell from the records how many are missing, and which are irregular.
bool has_one_stride(const RunRecording& run) {
  return std::ranges::find(run.events, EventKind::configuration_changed, &StreamEvent::kind) == run.events.end();
}

void check_account(const RunRecording& run, const SequenceCheck& sequence, Problems& problems) {
  const SampleAccount& account = run.account;
  const std::uint64_t counted = account.lost_network + account.lost_host;
  if (account.received != run.load_cell.size()) {
    problems.push_back(fmt::format("{} samples, {} were received", run.load_cell.size(), account.received));
  }
  if (account.received + counted != account.expected) {
    problems.push_back(
        fmt::format("{} received and {} lost are not the {} expected", account.received, counted, account.expected));
  }
  if (sequence.lost != counted && sequence.reboots == 0 && has_one_stride(run)) {
    problems.push_back(fmt::format("ft_sequence shows {} missing samples, {} were counted", sequence.lost, counted));
  }
}

void check_order(const RunRecording& run, const SequenceCheck& sequence, Problems& problems) {
  if (sequence.repeated > 0) problems.push_back(fmt::format("{} samples occur twice", sequence.repeated));
  if (sequence.off_stride > run.account.irregular && has_one_stride(run)) {
    problems.push_back(fmt::format("ft_sequence left its stride of {} at {} places", run.header.load_cell.ft_stride,
                                   sequence.off_stride));
  }
  if (sequence.reboots > run.account.reboots) {
    problems.push_back(fmt::format("ft_sequence jumped back {} times: the box restarted, {} restarts were counted",
                                   sequence.reboots, run.account.reboots));
  }
  // Before the wrap of its counter a restart of the box looks like one of the stream.
  if (sequence.restarts + sequence.reboots > run.account.restarts + run.account.reboots) {
    problems.push_back(fmt::format("rdt_sequence restarted {} times, {} restarts were counted", sequence.restarts,
                                   run.account.restarts));
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
    problems.push_back(fmt::format("rate mismatch: {} Hz times stride {} is not the box's {} Hz", scale.sample_rate_hz,
                                   scale.ft_stride, scale.device_rate_hz));
  }
  if (header.thrust_axis < 0 || header.thrust_axis > 2)
    problems.push_back(fmt::format("thrust_axis is {}", header.thrust_axis));
  if (std::abs(header.thrust_sign) != 1) problems.push_back(fmt::format("thrust_sign is {}", header.thrust_sign));
  if (std::abs(header.spin) != 1) problems.push_back(fmt::format("spin is {}", header.spin));
}

/// Records that are missing between two.
std::uint64_t lost_between(std::uint32_t earlier, std::uint32_t later, std::uint32_t ft_stride) {
  const auto ahead = static_cast<std::int32_t>(later - earlier);
  const std::uint32_t stride = std::max(ft_stride, 1u);
  return ahead <= 0 ? 0 : std::max(1u, (static_cast<std::uint32_t>(ahead) + stride / 2) / stride) - 1;
}

/// Of a run without its ending, by the ft_sequence of its `rows`.
SampleAccount account_of(const auto& rows, std::uint32_t ft_stride, auto ft_sequence) {
  SampleAccount account;
  account.received = rows.size();
  for (std::size_t i = 1; i < rows.size(); ++i)
    account.lost_network +=
        lost_between(std::invoke(ft_sequence, rows[i - 1]), std::invoke(ft_sequence, rows[i]), ft_stride);
  account.expected = account.received + account.lost_network;
  return account;
}

}  // namespace

RunRecording read_run(const std::filesystem::path& path, LoadCellColumns& cell) {
  return naming(path, [&] {
    static std::mutex asking;  // threads that all ask HDF5 wake each other at each of its calls
    std::unique_lock one_at_a_time(asking);
    const Handle root = hdf5::open_file(path);
    Contents contents;
    RunRecording run = all_but_samples(root, path, &contents);
    GroupReader<LoadCellRecord> group(root, kReducedGroup, path.string());
    contents.begin(group);
    const bool ended = has_ending(root);
    one_at_a_time.unlock();
    cell.reset(group.rows);
    std::vector<LoadCellColumns::Counts> counts;
    std::vector<std::uint32_t> status;
    std::vector<Nanoseconds> arrival_ns;
    for (std::uint64_t at = 0; at < group.rows; at += kBlock) {
      counts.resize(std::min(kBlock, group.rows - at));
      status.resize(counts.size());
      arrival_ns.resize(counts.size());
      group.columns[0].read(at, counts.size(), counts.data());
      group.columns[1].read(at, counts.size(), cell.ft_sequence.data() + at);
      group.columns[2].read(at, counts.size(), status.data());
      group.columns[3].read(at, counts.size(), arrival_ns.data());
      cell.take(at, counts, status, arrival_ns, run.header);
    }
    contents.add(group);
    if (ended) run.contents_xxh128 = contents.xxh128(run);
    if (!ended) run.account = account_of(cell.ft_sequence, run.header.load_cell.ft_stride, std::identity());
    one_at_a_time.lock();  // closing asks HDF5, too
    return run;
  });
}

RunRecording read_run(const std::filesystem::path& path) {
  return naming(path, [&] {
    const Handle root = hdf5::open_file(path);
    RunRecording run = all_but_samples(root, path);
    run.load_cell = rows_of(root, kLoadCellGroup, path.string());
    if (!has_ending(root))
      run.account = account_of(run.load_cell, run.header.load_cell.ft_stride, &LoadCellRecord::ft_sequence);
    return run;
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
      found.lost += lost_between(records[i - 1].ft_sequence, records[i].ft_sequence, ft_stride);
      found.restarts += rdt <= 0;
      found.off_stride += rdt > 0 && ft % stride != 0;  // a stream begins anew at any sample of the box
    }
  }
  return found;
}

std::string attributes_digest(const RunHeader& header, const RunEnding& ending) {
  nlohmann::json all;
  const auto add = [&](const char* name, const auto& value) { all[name] = value; };
  for_each_attribute(header, add);
  for_each_figure(ending, add);
  add("outcome", outcome_name(ending.outcome));
  add("outcome_reason", ending.outcome_reason);
  return sha256(all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

std::string with_file(const std::filesystem::path& path, const std::string& problem) {
  return problem.find(path.string()) == std::string::npos ? path.string() + ": " + problem : problem;
}

const char* outcome_name(Outcome outcome) { return outcome == Outcome::complete ? "complete" : "aborted"; }

Verification verify_run(const std::filesystem::path& path) {
  Verification found;
  try {
    const Handle root = hdf5::open_file(path);
    const RunRecording run = read_run(path);
    found.outcome = run.outcome;
    found.samples = run.load_cell.size();
    check_end(root, run, found.problems);
    check_all_columns(root, found.problems);
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
