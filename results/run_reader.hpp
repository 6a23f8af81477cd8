// Reads and verifies run files. Every function throws RecordError for an unreadable file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "results/load_cell_columns.hpp"
#include "results/records.hpp"

namespace kphi::results {

/// The whole run; of a .part the rows valid at its last sync, as aborted. Does not check checksums; see verify_run().
[[nodiscard]] RunRecording read_run(const std::filesystem::path& path);

/// As read_run(), but quicker, with the load-cell records as columns in `cell`, whose memory is used again;
/// `run.load_cell` stays empty. Sets contents_xxh128: XXH128 of the lines "<group>/<column> <XXH128 of its rows>" of
/// all columns that it reads, in this order (motor, command, events, supply, load_cell without rdt_sequence), and of a
/// last line "attributes <XXH128 of their names and values>".
[[nodiscard]] RunRecording read_run(const std::filesystem::path& path, LoadCellColumns& cell);

/// Gaps and restarts in a stream of records, by its sequence numbers.
struct SequenceCheck {
  std::uint64_t lost = 0;        ///< records missing between the first and the last
  std::uint64_t reboots = 0;     ///< ft_sequence jumped back
  std::uint64_t restarts = 0;    ///< rdt_sequence jumped back while ft_sequence continued
  std::uint64_t repeated = 0;    ///< neither number moved: a duplicate that should have been discarded
  std::uint64_t off_stride = 0;  ///< ft_sequence did not advance by a multiple of the stride
};
[[nodiscard]] SequenceCheck check_sequence(const std::vector<LoadCellRecord>& records, std::uint32_t ft_stride);

/// `problem` with the file's name in front, unless it names the file already.
[[nodiscard]] std::string with_file(const std::filesystem::path& path, const std::string& problem);

struct Verification {
  Outcome outcome = Outcome::aborted;
  std::uint64_t samples = 0;
  std::uint64_t lost = 0;
  std::vector<std::string> problems;  ///< one line each, without the file's name
  [[nodiscard]] bool whole() const { return problems.empty(); }
};

/// Checksums of columns and attributes, numbers of rows, sequences, losses against the account, the scale, the end. An
/// unreadable file is a problem, not an exception. An aborted run can be undamaged.
[[nodiscard]] Verification verify_run(const std::filesystem::path& path);

}  // namespace kphi::results
