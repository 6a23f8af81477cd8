#include "results/run_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "results/hdf5.hpp"
#include "results/run_layout.hpp"
#include "results/run_reader.hpp"

namespace kphi::results {

using hdf5::Handle;

/// A group of columns that grow together; `n_valid` says how many rows were complete at the last sync.
template <class Row>
class Series {
 public:
  /// `late`: a column that late() fills at the end.
  Series(const Handle& parent, const RunGroup<Row>& layout, FileLayer& files, const std::string& file,
         const ColumnLayout* late = nullptr)
      : layout_(layout), group_(hdf5::create_group(parent, layout.name)) {
    hdf5::write_attribute(group_, "long_name", std::string(layout.long_name));
    hdf5::write_attribute(group_, "n_valid", std::uint64_t{0});
    for (ColumnLayout column : layout.columns) {
      if (column.unit == nullptr) std::tie(column.unit, column.long_name) = std::tie(layout.unit, layout.long_name);
      columns_.emplace_back(group_, column, layout.chunk_rows, files, file);
      if (column.stored == Stored::counts) add_components(files, file);
    }
    if (late != nullptr) late_.emplace(group_, *late, layout.chunk_rows, files, file);
    add_scales();
  }
  void append(std::span<const Row> rows) {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const std::size_t bytes = bytes_of(layout_.columns[i].stored), block = block_.size() / bytes;
      for (std::size_t at = 0; at < rows.size(); at += block) {
        const auto some = rows.subspan(at, std::min(block, rows.size() - at));
        layout_.columns[i].pack(some, block_.data());
        columns_[i].append(block_.data(), some.size());
      }
    }
  }
  void flush() {
    for (hdf5::Column& column : columns_) column.flush();
    for (hdf5::Column& column : columns_) column.write_crc();
    if (components_) components_->flush();
    if (!late_ || late_->rows() == 0) return;
    late_->flush();
    late_->write_crc();
  }
  [[nodiscard]] hdf5::Column& late() { return *late_; }
  [[nodiscard]] const Handle& group() const { return group_; }
  /// Only when what flush() wrote is on disk: HDF5 writes its metadata in any order.
  void declare_valid() { hdf5::write_attribute(group_, "n_valid", rows()); }
  [[nodiscard]] std::uint64_t rows() const { return columns_.front().rows(); }

 private:
  /// Names the second dimension of counts.
  void add_components(FileLayer& files, const std::string& file) {
    constexpr std::array<std::int32_t, 6> kComponents{0, 1, 2, 3, 4, 5};
    const ColumnLayout layout{"component", "1", "0 to 5: Fx Fy Fz Tx Ty Tz", Stored::i32};
    components_.emplace(group_, layout, kComponents.size(), files, file);
    components_->append(kComponents.data(), kComponents.size());
    components_->write_crc();
  }
  void add_scales() {
    const Handle* time = nullptr;
    std::vector<hdf5::ScaleUse> uses, second;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const Handle& dataset = columns_[i].dataset();
      const bool is_time = std::string_view(layout_.columns[i].name) == layout_.time;
      if (is_time) time = &dataset;
      if (!is_time) uses.push_back({&dataset, 0});
      if (layout_.columns[i].stored == Stored::counts) second.push_back({&dataset, 1});
    }
    if (late_) uses.push_back({&late_->dataset(), 0});
    hdf5::make_scale(*time, layout_.time, uses);
    if (components_) hdf5::make_scale(components_->dataset(), "component", second);
    for (const hdf5::ScaleUse& use : uses) {
      const bool two = !second.empty() && use.dataset == second.front().dataset;
      hdf5::attach_scales(*use.dataset, two ? std::vector{time, &components_->dataset()} : std::vector{time});
    }
  }

  RunGroup<Row> layout_;
  Handle group_;
  std::deque<hdf5::Column> columns_;
  std::optional<hdf5::Column> components_, late_;
  std::array<std::byte, 12288> block_;
};

namespace {

std::string without_ending(const std::filesystem::path& path) { return (path.parent_path() / path.stem()).string(); }

std::filesystem::path prepared_part(const std::filesystem::path& final_path, FileLayer& files) {
  if (std::filesystem::exists(final_path)) {
    throw RecordError(final_path.string() + ": exists already; choose another name");
  }
  const std::filesystem::path part = final_path.string() + ".part";
  if (std::filesystem::exists(part)) {
    on_disk(part.string(),
            [&] { files.rename(part, free_name(without_ending(final_path) + ".interrupted", ".h5.part")); });
  }
  return part;
}

}  // namespace

struct RunWriter::File {
  File(const std::filesystem::path& path, const RunHeader& header, FileLayer& files)
      : root(hdf5::create_file(path)),
        load_cell(root, kLoadCellGroup, files, path.string(), &layout::kSampleTime),
        motor(hdf5::create_group(root, "motor")),
        commands(root, kCommandGroup, files, path.string()),
        events(root, kEventGroup, files, path.string()),
        supply(root, kSupplyGroup, files, path.string()) {
    for (const MotorChannelInfo& info : kMotorChannels)
      channels.emplace_back(motor, motor_group(info), files, path.string());
    hdf5::write_attribute(root, "format", std::string(kRunFormat));
    hdf5::write_attribute(root, "complete", std::int32_t{0});
    for_each_attribute(header, [&](const char* name, const auto& value) { hdf5::write_attribute(root, name, value); });
    hdf5::write_attribute(root, "configuration_sha256", sha256(header.load_cell.configuration_xml));
  }
  void for_each_series(auto&& each) {
    each(load_cell);
    for (auto& channel : channels) each(channel);
    each(commands);
    each(events);
    each(supply);
    if (plot) each(*plot);
  }

  Handle root;
  Series<LoadCellRecord> load_cell;
  Handle motor;
  std::deque<Series<MotorReading>> channels;
  Series<PhaseMark> commands;
  Series<StreamEvent> events;
  Series<SupplyReading> supply;
  std::optional<Series<PlotRow>> plot;
};

/// Runs every operation on the open file. After the first failure nothing more may reach the disk: partial writes of
/// HDF5 on closing could damage what the last sync secured.
template <class Action>
void RunWriter::guarded(Action&& action) {
  if (!file_) throw RecordError(path_.string() + ": closed, the recording has ended; see the first error");
  hdf5::be_quiet();
  try {
    on_disk(path_.string(), action);
  } catch (...) {
    hdf5::sever(file_->root);
    file_.reset();
    throw;
  }
}

RunWriter::RunWriter(std::filesystem::path final_path, const RunHeader& header, FileLayer& files)
    : final_path_(std::move(final_path)), path_(prepared_part(final_path_, files)), header_(header), files_(files) {
  file_ = std::make_unique<File>(path_, header_, files);
  sync();
  on_disk(path_.string(), [&] { files_.sync_folder(path_.parent_path()); });
}

RunWriter::~RunWriter() = default;

void RunWriter::append(std::span<const LoadCellRecord> records) {
  guarded([&] { file_->load_cell.append(records); });
}

void RunWriter::append(std::span<const MotorReading> readings) {
  guarded([&] {
    for (const MotorReading& reading : readings) {
      file_->channels.at(static_cast<std::size_t>(reading.channel)).append({&reading, 1});
    }
  });
}

void RunWriter::append(std::span<const SupplyReading> readings) {
  guarded([&] { file_->supply.append(readings); });
}

void RunWriter::mark(const PhaseMark& mark) {
  guarded([&] { file_->commands.append({&mark, 1}); });
}

void RunWriter::note(const StreamEvent& event) {
  guarded([&] { file_->events.append({&event, 1}); });
}

void RunWriter::sync() {
  guarded([&] { secure([] {}); });
}

/// `declare` writes what is true only of data that is on disk.
template <class Declare>
void RunWriter::secure(Declare&& declare) {
  constexpr std::uint64_t kMetadata = 256u << 10;  // more than one flush adds
  file_->for_each_series([](auto& series) { series.flush(); });
  // With room reserved the flush of the metadata, which must not stop halfway, cannot meet a full disk.
  const int descriptor = hdf5::descriptor_of(file_->root);
  const std::uint64_t size = hdf5::size_of(file_->root);
  files_.reserve(descriptor, reserved_, size + kMetadata - reserved_);
  const auto sync = [&] {
    hdf5::check(H5Fflush(file_->root.get(), H5F_SCOPE_GLOBAL), path_.string() + ": flush");
    files_.sync_data(descriptor);
  };
  sync();
  file_->for_each_series([](auto& series) { series.declare_valid(); });
  declare();
  sync();
  reserved_ = size;
}

std::uint64_t RunWriter::samples() const { return file_ ? file_->load_cell.rows() : 0; }

void RunWriter::close() {
  hid_t root = H5I_INVALID_HID;
  {
    // Closes groups and columns first: then closing the file reports every failure.
    const std::unique_ptr<File> file = std::move(file_);
    root = file->root.get();
    hdf5::check(H5Iinc_ref(root) < 0 ? -1 : 0, path_.string() + ": close");
  }
  hdf5::check(H5Fclose(root), path_.string() + ": close");
}

void RunWriter::add(const RunViews& views) {
  file_->load_cell.late().append(views.sample_times.data(), views.sample_times.size());
  if (views.plot.empty()) return;
  const Series<PlotRow>& plot = file_->plot.emplace(file_->root, kPlotGroup, files_, path_.string());
  file_->plot->append(views.plot);
  // NeXus: what a viewer draws when it opens the file.
  hdf5::write_attribute(file_->root, "default", std::string(kPlotGroup.name));
  hdf5::write_attribute(plot.group(), "NX_class", std::string("NXdata"));
  hdf5::write_attribute(plot.group(), "signal", std::string("thrust"));
  hdf5::write_attribute(plot.group(), "axes", std::string(kPlotGroup.time));
}

RunDigests RunWriter::finish(const RunEnding& ending, const Views& views) {
  guarded([&] {
    if (views) {
      secure([] {});
      LoadCellColumns cell;
      RunRecording run = read_run(path_, cell);
      static_cast<RunEnding&>(run) = ending;
      add(views(run, cell));
    }
    secure([&] {
      const Handle& root = file_->root;
      for_each_figure(ending, [&](const char* name, const auto& value) { hdf5::write_attribute(root, name, value); });
      hdf5::write_attribute(root, "outcome", std::string(outcome_name(ending.outcome)));
      hdf5::write_attribute(root, "outcome_reason", ending.outcome_reason);
      hdf5::write_attribute(root, "attributes_sha256", attributes_digest(header_, ending));
      hdf5::write_attribute(root, "complete", std::int32_t{ending.outcome == Outcome::complete});
    });
  });
  close();
  on_disk(path_.string(), [&] { sync_file(path_, files_); });  // what closing wrote

  const Verification verification = verify_run(path_);
  if (ending.outcome == Outcome::complete && !verification.whole()) {
    throw RecordError(fmt::format("{}: the finished file failed verification: {}; repeat the run", path_.string(),
                                  fmt::join(verification.problems, "; ")));
  }
  LoadCellColumns cell;
  RunDigests digests{sha256_of_file(path_), read_run(path_, cell).contents_xxh128};
  const std::filesystem::path target =
      ending.outcome == Outcome::complete ? final_path_ : free_name(without_ending(final_path_) + ".aborted", ".h5");
  on_disk(target.string(), [&] {
    (void)files_.make_read_only(path_);
    files_.rename(path_, target);
    path_ = target;
    files_.sync_folder(target.parent_path());
  });
  return digests;
}

std::uint64_t RunWriter::bytes_needed(std::uint64_t runs, std::uint64_t samples, std::uint64_t readings) {
  constexpr std::uint64_t kEachRun = 1u << 20;  // chunks begun, header, attributes
  constexpr std::uint64_t kBeside = 2u << 20;   // journal and tables
  return kBeside + runs * kEachRun +
         (samples * 53 + readings * 24) * 21 / 20;  // with the time of each sample, and the plot
}

}  // namespace kphi::results
