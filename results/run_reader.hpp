// Reads runs back and says whether they are whole. Every function throws RecordError for a file that cannot be read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "results/load_cell_columns.hpp"
#include "results/records.hpp"

namespace kphi::results {

/// The whole run; of a .part what was valid at its last sync, as aborted. Checks no checksums: that is verify_run's.
[[nodiscard]] RunRecording read_run(const std::filesystem::path& path);

/// A run whose load-cell records are still in its file: for who passes over them once and needs no record of each.
struct RunFile {
  RunRecording run;  ///< without load_cell; of a .part without the account, which the records would tell
  std::unique_ptr<LoadCellColumns> load_cell;
};
[[nodiscard]] RunFile open_run(const std::filesystem::path& path);

/// What was known before the motor turned.
[[nodiscard]] RunHeader read_header(const std::filesystem::path& path);

/// What sequence numbers tell about a stream of records.
struct SequenceCheck {
  std::uint64_t lost = 0;        ///< records that ft_sequence says are missing between the first and the last
  std::uint64_t reboots = 0;     ///< ft_sequence jumped back
  std::uint64_t restarts = 0;    ///< rdt_sequence jumped back while ft_sequence went on
  std::uint64_t repeated = 0;    ///< neither number moved: a duplicate that should have been discarded
  std::uint64_t off_stride = 0;  ///< ft_sequence advanced by no multiple of the stride
};
[[nodiscard]] SequenceCheck check_sequence(const std::vector<LoadCellRecord>& records, std::uint32_t ft_stride);

struct Verification {
  std::filesystem::path path;
  RunHeader header;
  SampleAccount account;
  Outcome outcome = Outcome::aborted;
  std::uint64_t samples = 0;
  std::uint64_t lost = 0;
  std::vector<std::string> problems;  ///< one line each, without the file's name
  [[nodiscard]] bool whole() const { return problems.empty(); }
};

/// Checksums of columns and attributes, numbers of rows, sequences, losses against the account, the scale, the end. An
/// unreadable file is a problem, not an exception. An aborted run can be whole: nothing but its outcome tells.
[[nodiscard]] Verification verify_run(const std::filesystem::path& path);

}  // namespace kphi::results
