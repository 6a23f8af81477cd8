// Writes one run to `<name>.h5.part` while the motor turns and turns it into the final, read-only `<name>.h5`.
// A writer that dies leaves a .part that is readable up to the last sync. The first error ends the recording: every
// member but the destructor throws RecordError with file and cause, and the writer is of no use afterwards.
// One thread at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "base/error.hpp"
#include "results/file_layer.hpp"
#include "results/records.hpp"

namespace kphi::results {

class RunWriter {
 public:
  /// Refuses when `final_path` exists. A .part left there by a killed writer is set aside under a new name.
  /// `files` must outlive the writer.
  RunWriter(std::filesystem::path final_path, const RunHeader& header, FileLayer& files = disk());
  RunWriter(const RunWriter&) = delete;
  RunWriter& operator=(const RunWriter&) = delete;
  /// Closes; without finish() the .part stays.
  ~RunWriter();

  void append(std::span<const LoadCellRecord> records);
  void append(std::span<const MotorReading> readings);
  void append(std::span<const SupplyReading> readings);
  void mark(const PhaseMark& mark);
  void note(const StreamEvent& event);

  /// Everything appended so far is on disk when this returns (H5Fflush and fdatasync). Twice a second of wall time.
  void sync();

  /// Closes and syncs, reopens and verifies, makes read-only, renames `.part` to `.h5` (aborted: `.aborted.h5`, or
  /// `.aborted-2.h5` …), and syncs the folder. Returns the file's SHA-256. Throws when a complete run does not pass:
  /// the .part stays for a look.
  [[nodiscard]] std::string finish(const RunEnding& ending);

  /// Where the record lies now: the .part, after finish() its final name.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Samples appended so far.
  [[nodiscard]] std::uint64_t samples() const;

  /// Bytes that a run of so many samples and readings takes, with a margin: for require_room.
  [[nodiscard]] static std::uint64_t bytes_needed(std::uint64_t samples, std::uint64_t readings);

 private:
  struct File;
  template <class Action>
  void guarded(Action&& action);
  void secure();
  void close();
  std::filesystem::path final_path_;
  std::filesystem::path path_;
  RunHeader header_;
  FileLayer& files_;
  std::unique_ptr<File> file_;
  std::uint64_t reserved_ = 0;  ///< bytes of the file that surely have their place on disk
};

}  // namespace kphi::results
