#include "results/run_writer.hpp"

#include <fmt/format.h>

#include <array>
#include <system_error>
#include <utility>
#include <vector>

#include "results/hdf5.hpp"
#include "results/run_layout.hpp"
#include "results/run_reader.hpp"
#include "results/sha256.hpp"

namespace kphi::results {
namespace {

using hdf5::Column;
using hdf5::Handle;

constexpr hsize_t kSampleChunk = 8192;  // rows; a little over a second of the Net Box
constexpr hsize_t kMotorChunk = 1024;
constexpr hsize_t kMarkChunk = 64;
constexpr hsize_t kEventChunk = 16;

/// A group of columns that grow together; `n_valid` says how many rows were whole at the last sync.
struct Series {
  Series(const Handle& parent, const char* name, const char* long_name) : group(hdf5::create_group(parent, name)) {
    hdf5::write_attribute(group, "long_name", std::string(long_name));
    hdf5::write_attribute(group, "n_valid", std::uint64_t{0});
  }
  Column& add(const hdf5::ColumnShape& shape, FileLayer& files, const std::string& file_name) {
    columns.push_back(std::make_unique<Column>(group, shape, files, file_name));
    return *columns.back();
  }
  void flush() {
    for (const auto& column : columns) column->flush();
    for (const auto& column : columns) column->write_crc();
    hdf5::write_attribute(group, "n_valid", columns.front()->rows());
  }
  Handle group;
  std::vector<std::unique_ptr<Column>> columns;
};

/// `from[i].*member` of all rows, side by side, appended to the column.
template <class Row, class Value>
void append_member(Column& column, std::span<const Row> rows, Value Row::*member) {
  std::array<Value, 512> block;
  for (std::size_t at = 0; at < rows.size(); at += block.size()) {
    const std::size_t n = std::min(block.size(), rows.size() - at);
    for (std::size_t i = 0; i < n; ++i) block[i] = rows[at + i].*member;
    column.append(block.data(), n);
  }
}

struct LoadCellSeries : Series {
  LoadCellSeries(const Handle& root, FileLayer& files, const std::string& name)
      : Series(root, "load_cell", "Net Box records as received"),
        counts(add({"counts", H5T_STD_I32LE, 24, 6, kSampleChunk, "count", "force and torque, Fx Fy Fz Tx Ty Tz"},
                   files, name)),
        rdt(add({"rdt_sequence", H5T_STD_U32LE, 4, 0, kSampleChunk, "1", "RDT sequence number"}, files, name)),
        ft(add({"ft_sequence", H5T_STD_U32LE, 4, 0, kSampleChunk, "1", "internal sample number of the box"}, files,
               name)),
        status(add({"status", H5T_STD_U32LE, 4, 0, kSampleChunk, "1", "status word of the box"}, files, name)),
        arrival(
            add({"t_arrival_ns", H5T_STD_I64LE, 8, 0, kSampleChunk, "ns", "receive stamp of the datagram, bench time"},
                files, name)),
        component(group, {"component", H5T_STD_I32LE, 4, 0, 6, "1", "0 to 5: Fx Fy Fz Tx Ty Tz"}, files, name) {
    constexpr std::array<std::int32_t, 6> kComponents{0, 1, 2, 3, 4, 5};
    component.append(kComponents.data(), kComponents.size());
    component.write_crc();
    const Handle& time = arrival.dataset();
    hdf5::make_scale(time, "t_arrival_ns",
                     {{&counts.dataset(), 0}, {&rdt.dataset(), 0}, {&ft.dataset(), 0}, {&status.dataset(), 0}});
    hdf5::make_scale(component.dataset(), "component", {{&counts.dataset(), 1}});
    hdf5::attach_scales(counts.dataset(), {&time, &component.dataset()});
    for (const Column* column : {&rdt, &ft, &status}) hdf5::attach_scales(column->dataset(), {&time});
  }
  void append(std::span<const LoadCellRecord> rows) {
    append_member(counts, rows, &LoadCellRecord::counts);
    append_member(rdt, rows, &LoadCellRecord::rdt_sequence);
    append_member(ft, rows, &LoadCellRecord::ft_sequence);
    append_member(status, rows, &LoadCellRecord::status);
    append_member(arrival, rows, &LoadCellRecord::arrival_ns);
  }
  Column &counts, &rdt, &ft, &status, &arrival;
  Column component;
};

struct ChannelSeries : Series {
  ChannelSeries(const Handle& motor, const MotorChannelInfo& info, FileLayer& files, const std::string& name)
      : Series(motor, info.name, info.long_name),
        value(add({"value", H5T_IEEE_F64LE, 8, 0, kMotorChunk, info.unit, info.long_name}, files, name)),
        time(add({"t_ns", H5T_STD_I64LE, 8, 0, kMotorChunk, "ns", "midpoint of request and reply, bench time"}, files,
                 name)),
        uncertainty(
            add({"t_uncertainty_ns", H5T_STD_I64LE, 8, 0, kMotorChunk, "ns", "half the round trip"}, files, name)) {
    hdf5::make_scale(time.dataset(), "t_ns", {{&value.dataset(), 0}, {&uncertainty.dataset(), 0}});
    for (const Column* column : {&value, &uncertainty}) hdf5::attach_scales(column->dataset(), {&time.dataset()});
  }
  void append(const MotorReading& reading) {
    value.append(&reading.value, 1);
    time.append(&reading.time_ns, 1);
    uncertainty.append(&reading.uncertainty_ns, 1);
  }
  Column &value, &time, &uncertainty;
};

struct SupplySeries : Series {
  SupplySeries(const Handle& root, FileLayer& files, const std::string& name)
      : Series(root, "supply", "what the bench supply showed; no rows without one"),
        time(add({"t_ns", H5T_STD_I64LE, 8, 0, kMotorChunk, "ns", "midpoint of request and answer, bench time"}, files,
                 name)),
        uncertainty(
            add({"t_uncertainty_ns", H5T_STD_I64LE, 8, 0, kMotorChunk, "ns", "half the round trip"}, files, name)),
        voltage(number("voltage", "V", "voltage at the supply's terminals", files, name)),
        current(number("current", "A", "current out of the supply", files, name)),
        set_voltage(number("set_voltage", "V", "set voltage, as read back", files, name)),
        current_limit(number("current_limit", "A", "limit of the current, as read back", files, name)),
        regulation(code("regulation", "0 constant voltage, 1 constant current, 2 unknown", files, name)),
        protection(code("protection",
                        "0 none, 1 over-voltage, 2 over-current, 3 over-power, 4 over-temperature, 5 short circuit, "
                        "6 unknown",
                        files, name)),
        output(code("output", "1: on", files, name)) {
    const std::array all{&uncertainty,   &voltage,    &current,    &set_voltage,
                         &current_limit, &regulation, &protection, &output};
    hdf5::make_scale(time.dataset(), "t_ns",
                     {{&uncertainty.dataset(), 0},
                      {&voltage.dataset(), 0},
                      {&current.dataset(), 0},
                      {&set_voltage.dataset(), 0},
                      {&current_limit.dataset(), 0},
                      {&regulation.dataset(), 0},
                      {&protection.dataset(), 0},
                      {&output.dataset(), 0}});
    for (const Column* column : all) hdf5::attach_scales(column->dataset(), {&time.dataset()});
  }
  void append(const SupplyReading& reading) {
    const std::array<std::uint8_t, 3> codes{static_cast<std::uint8_t>(reading.regulation),
                                            static_cast<std::uint8_t>(reading.protection),
                                            static_cast<std::uint8_t>(reading.output)};
    time.append(&reading.time_ns, 1);
    uncertainty.append(&reading.uncertainty_ns, 1);
    voltage.append(&reading.voltage_v, 1);
    current.append(&reading.current_a, 1);
    set_voltage.append(&reading.set_voltage_v, 1);
    current_limit.append(&reading.current_limit_a, 1);
    regulation.append(&codes[0], 1);
    protection.append(&codes[1], 1);
    output.append(&codes[2], 1);
  }
  Column& number(const char* column, const char* unit, const char* words, FileLayer& files, const std::string& name) {
    return add({column, H5T_IEEE_F64LE, 8, 0, kMotorChunk, unit, words}, files, name);
  }
  Column& code(const char* column, const char* words, FileLayer& files, const std::string& name) {
    return add({column, H5T_STD_U8LE, 1, 0, kMotorChunk, "1", words}, files, name);
  }
  Column &time, &uncertainty, &voltage, &current, &set_voltage, &current_limit, &regulation, &protection, &output;
};

struct CommandSeries : Series {
  CommandSeries(const Handle& root, FileLayer& files, const std::string& name)
      : Series(root, "commands", "what the runner asked for"),
        phase(add(
            {"phase", H5T_STD_U8LE, 1, 0, kMarkChunk, "1",
             "0 zero before, 1 step, 2 spin down, 3 zero after, 4 end, 5 bias before, 6 bias settling, 7 bias after"},
            files, name)),
        step(add({"step", H5T_STD_I32LE, 4, 0, kMarkChunk, "1", "number of the step from 0, -1 outside steps"}, files,
                 name)),
        time(add({"t_ns", H5T_STD_I64LE, 8, 0, kMarkChunk, "ns", "begin of the phase, bench time"}, files, name)),
        speed(add({"speed_rad_s", H5T_IEEE_F64LE, 8, 0, kMarkChunk, "rad s-1", "commanded speed, unsigned"}, files,
                  name)) {
    hdf5::make_scale(time.dataset(), "t_ns", {{&phase.dataset(), 0}, {&step.dataset(), 0}, {&speed.dataset(), 0}});
    for (const Column* column : {&phase, &step, &speed}) hdf5::attach_scales(column->dataset(), {&time.dataset()});
  }
  void append(const PhaseMark& mark) {
    const auto code = static_cast<std::uint8_t>(mark.phase);
    phase.append(&code, 1);
    step.append(&mark.step, 1);
    time.append(&mark.time_ns, 1);
    speed.append(&mark.speed_rad_s, 1);
  }
  Column &phase, &step, &time, &speed;
};

/// "0 restarted, 1 rebooted, …"
std::string listed_kinds() {
  std::string list;
  for (std::size_t i = 0; i < kEventNames.size(); ++i)
    list += fmt::format("{}{} {}", i == 0 ? "" : ", ", i, kEventNames[i]);
  return list;
}

struct EventSeries : Series {
  EventSeries(const Handle& root, FileLayer& files, const std::string& name)
      : Series(root, "events", "what happened to the load cell, its stream and the motor module"),
        kinds(listed_kinds()),
        text_type(hdf5::fixed_text_type(kEventTextBytes)),
        kind(add({"kind", H5T_STD_U8LE, 1, 0, kEventChunk, "1", kinds.c_str()}, files, name)),
        time(add({"t_ns", H5T_STD_I64LE, 8, 0, kEventChunk, "ns", "when it was noticed, bench time"}, files, name)),
        records(add({"records", H5T_STD_U64LE, 8, 0, kEventChunk, "1", "missing before it, or repeated"}, files, name)),
        text(add({"text", text_type.get(), kEventTextBytes, 0, kEventChunk, "1", "for a person"}, files, name)) {
    hdf5::make_scale(time.dataset(), "t_ns", {{&kind.dataset(), 0}, {&records.dataset(), 0}, {&text.dataset(), 0}});
    for (const Column* column : {&kind, &records, &text}) hdf5::attach_scales(column->dataset(), {&time.dataset()});
  }
  void append(const StreamEvent& event) {
    const auto code = static_cast<std::uint8_t>(event.kind);
    std::array<char, kEventTextBytes> line{};
    event.text.copy(line.data(), line.size());
    kind.append(&code, 1);
    time.append(&event.time_ns, 1);
    records.append(&event.records, 1);
    text.append(line.data(), 1);
  }
  const std::string kinds;
  Handle text_type;
  Column &kind, &time, &records, &text;
};

std::string without_ending(const std::filesystem::path& path) { return (path.parent_path() / path.stem()).string(); }

/// Runs `action`; what the file layer refuses becomes a RecordError.
template <class Action>
void on_disk(const std::filesystem::path& path, Action&& action) {
  try {
    action();
  } catch (const std::system_error& error) {
    throw RecordError(failure_text(path.string(), error.code().value()));
  }
}

std::filesystem::path prepared_part(const std::filesystem::path& final_path, FileLayer& files) {
  if (std::filesystem::exists(final_path)) {
    throw RecordError(final_path.string() + ": exists already and is not overwritten; choose another name");
  }
  const std::filesystem::path part = final_path.string() + ".part";
  if (std::filesystem::exists(part)) {
    on_disk(part, [&] { files.rename(part, free_name(without_ending(final_path) + ".interrupted", ".h5.part")); });
  }
  return part;
}

}  // namespace

struct RunWriter::File {
  File(const std::filesystem::path& path, const RunHeader& header, FileLayer& files)
      : root(hdf5::create_file(path)),
        load_cell(root, files, path.string()),
        motor(hdf5::create_group(root, "motor")),
        commands(root, files, path.string()),
        events(root, files, path.string()),
        supply(root, files, path.string()) {
    for (const MotorChannelInfo& info : kMotorChannels) {
      channels.push_back(std::make_unique<ChannelSeries>(motor, info, files, path.string()));
    }
    hdf5::write_attribute(root, "format", format_name(header.format));
    hdf5::write_attribute(root, "complete", std::int32_t{0});
    for_each_attribute(header, [&](const char* name, const auto& value) { hdf5::write_attribute(root, name, value); });
    hdf5::write_attribute(root, "configuration_sha256", sha256(header.load_cell.configuration_xml));
  }
  void flush() {
    load_cell.flush();
    load_cell.component.flush();
    for (const auto& channel : channels) channel->flush();
    commands.flush();
    events.flush();
    supply.flush();
  }

  Handle root;
  LoadCellSeries load_cell;
  Handle motor;
  std::vector<std::unique_ptr<ChannelSeries>> channels;
  CommandSeries commands;
  EventSeries events;
  SupplySeries supply;
};

/// Everything that touches the open file goes through here. After the first failure nothing more may reach the disk:
/// what HDF5 would write on closing, half of it refused, can spoil what the last sync left.
template <class Action>
void RunWriter::guarded(Action&& action) {
  if (!file_) throw RecordError(path_.string() + ": is closed: the recording has ended, see the first error");
  hdf5::be_quiet();
  try {
    on_disk(path_, action);
  } catch (...) {
    hdf5::sever(file_->root);
    file_.reset();
    throw;
  }
}

RunWriter::RunWriter(std::filesystem::path final_path, const RunHeader& header, FileLayer& files)
    : final_path_(std::move(final_path)), path_(prepared_part(final_path_, files)), header_(header), files_(files) {
  header_.format = kRunFormat;
  file_ = std::make_unique<File>(path_, header_, files);
  sync();
  on_disk(path_, [&] { files_.sync_folder(path_.parent_path()); });
}

RunWriter::~RunWriter() = default;

void RunWriter::append(std::span<const LoadCellRecord> records) {
  guarded([&] { file_->load_cell.append(records); });
}

void RunWriter::append(std::span<const MotorReading> readings) {
  guarded([&] {
    for (const MotorReading& reading : readings) {
      file_->channels.at(static_cast<std::size_t>(reading.channel))->append(reading);
    }
  });
}

void RunWriter::append(std::span<const SupplyReading> readings) {
  guarded([&] {
    for (const SupplyReading& reading : readings) file_->supply.append(reading);
  });
}

void RunWriter::mark(const PhaseMark& mark) {
  guarded([&] { file_->commands.append(mark); });
}

void RunWriter::note(const StreamEvent& event) {
  guarded([&] { file_->events.append(event); });
}

void RunWriter::sync() {
  guarded([&] { secure(); });
}

void RunWriter::secure() {
  constexpr std::uint64_t kMetadata = 256u << 10;  // more than one flush adds
  file_->flush();
  // With room reserved the flush of the metadata, which must not stop halfway, cannot meet a full disk.
  const int descriptor = hdf5::descriptor_of(file_->root);
  const std::uint64_t size = hdf5::size_of(file_->root);
  files_.reserve(descriptor, reserved_, size + kMetadata - reserved_);
  hdf5::check(H5Fflush(file_->root.get(), H5F_SCOPE_GLOBAL), path_.string() + ": flush");
  files_.sync_data(descriptor);
  reserved_ = size;
}

std::uint64_t RunWriter::samples() const { return file_ ? file_->load_cell.rdt.rows() : 0; }

void RunWriter::close() {
  hid_t root = H5I_INVALID_HID;
  {
    // The groups and columns go first, the file last: its close is the one that can tell of a failure.
    const std::unique_ptr<File> file = std::move(file_);
    root = file->root.get();
    hdf5::check(H5Iinc_ref(root) < 0 ? -1 : 0, path_.string() + ": close");
  }
  hdf5::check(H5Fclose(root), path_.string() + ": close");
}

std::string RunWriter::finish(const RunEnding& ending) {
  const Outcome outcome = ending.outcome;
  guarded([&] {
    const Handle& root = file_->root;
    for_each_figure(ending, header_.format,
                    [&](const char* name, const auto& value) { hdf5::write_attribute(root, name, value); });
    hdf5::write_attribute(root, "outcome", std::string(outcome_name(outcome)));
    hdf5::write_attribute(root, "outcome_reason", ending.outcome_reason);
    hdf5::write_attribute(root, "attributes_sha256", attributes_digest(header_, ending));
    hdf5::write_attribute(root, "complete", std::int32_t{outcome == Outcome::complete});
    secure();
  });
  close();
  on_disk(path_, [&] { sync_file(path_, files_); });  // what closing wrote

  const Verification verification = verify_run(path_);
  if (outcome == Outcome::complete && !verification.whole()) {
    throw RecordError(fmt::format("{}: the finished run is not whole: {}; repeat the run", path_.string(),
                                  fmt::join(verification.problems, "; ")));
  }
  const std::string digest = sha256_of_file(path_);
  const std::filesystem::path target =
      outcome == Outcome::complete ? final_path_ : free_name(without_ending(final_path_) + ".aborted", ".h5");
  on_disk(target, [&] {
    using std::filesystem::perms;
    std::filesystem::permissions(path_, perms::owner_write | perms::group_write | perms::others_write,
                                 std::filesystem::perm_options::remove);
    files_.rename(path_, target);
    path_ = target;
    files_.sync_folder(target.parent_path());
  });
  return digest;
}

std::uint64_t RunWriter::bytes_needed(std::uint64_t samples, std::uint64_t readings) {
  constexpr std::uint64_t kFixed = 4u << 20;  // chunks begun, header, attributes
  return kFixed + (samples * 44 + readings * 24) * 21 / 20;
}

}  // namespace kphi::results
