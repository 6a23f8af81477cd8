// Writes one run to `<name>.h5.part` while the motor turns and turns it into the final, read-only `<name>.h5`.
// After a kill the .part is readable up to the last sync. The first error ends the recording: from then on every member
// but the destructor throws RecordError with file and cause.
// One thread at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "results/file_layer.hpp"
#include "results/load_cell_columns.hpp"
#include "results/records.hpp"

namespace kphi::results {

class RunWriter {
 public:
  /// Refuses if `final_path` exists. Renames a .part left by a killed writer.
  /// `files` must outlive the writer.
  RunWriter(std::filesystem::path final_path, const RunHeader& header, FileLayer& files = disk());
  /// Closes the file; without finish() the .part stays.
  ~RunWriter();

  void append(std::span<const LoadCellRecord> records);
  void append(std::span<const MotorReading> readings);
  void append(std::span<const SupplyReading> readings);
  void mark(const PhaseMark& mark);
  void note(const StreamEvent& event);

  /// Returns once everything appended is on disk (H5Fflush and fdatasync). Call twice a second of wall time.
  void sync();

  /// Closes and syncs, reopens and verifies, makes read-only, renames `.part` to `.h5` (aborted: `.aborted.h5`, or
  /// `.aborted-2.h5` …), and syncs the folder. Returns the file's digests. Throws if a complete run fails the
  /// verification; its .part stays. `views` is asked first, for what of the whole run goes into the file, too.
  using Views = std::function<RunViews(const RunRecording&, const LoadCellColumns&)>;
  [[nodiscard]] RunDigests finish(const RunEnding& ending, const Views& views = {});

  /// Current file: the .part, after finish() the final one.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Samples appended so far.
  [[nodiscard]] std::uint64_t samples() const;

  /// Bytes of so many runs with this many samples and readings in all, with a margin: for require_room().
  [[nodiscard]] static std::uint64_t bytes_needed(std::uint64_t runs, std::uint64_t samples, std::uint64_t readings);

 private:
  struct File;
  template <class Action>
  void guarded(Action&& action);
  template <class Declare>
  void secure(Declare&& declare);
  void add(const RunViews& views);
  void close();
  std::filesystem::path final_path_;
  std::filesystem::path path_;
  RunHeader header_;
  FileLayer& files_;
  std::unique_ptr<File> file_;
  std::uint64_t reserved_ = 0;  ///< bytes of the file with reserved disk blocks
};

}  // namespace kphi::results
