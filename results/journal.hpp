// journal.jsonl: the events of a campaign, one JSON object per line, each synced when appended. Each line ends with a
// checksum over itself and the line before it, which reveals a changed, missing or moved line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/descriptor.hpp"
#include "base/device_data.hpp"
#include "results/file_layer.hpp"

namespace kphi::results {

/// Data of this event: {"file": "runs/….h5", "sha256": "…"}. verify compares every entry that holds both keys.
inline constexpr const char* kRunAccepted = "run_accepted";
inline constexpr const char* kRunAborted = "run_aborted";
/// Data: tool, files and devices of the campaign. Bench time restarts with each of them.
inline constexpr const char* kCampaignStarted = "campaign_started";
inline constexpr const char* kCampaignResumed = "campaign_resumed";
inline constexpr const char* kCampaignFinished = "campaign_finished";
/// Data: {"files": {"steps.csv": "SHA-256", …}}, after each run that is accepted.
inline constexpr const char* kTablesWritten = "tables_written";

struct JournalEntry {
  std::uint64_t n = 0;      ///< 1, 2, 3 …
  Nanoseconds time_ns = 0;  ///< bench time
  std::string utc;          ///< ISO 8601, Z
  std::string event;
  nlohmann::json data;
};

struct JournalReading {
  std::vector<JournalEntry> entries;  ///< up to the first line with a wrong checksum
  /// The last line has no end, or zeros in it: the writer died, or the power was cut. It was never reported as written.
  bool torn_last_line = false;
  std::vector<std::string> problems;  ///< "journal.jsonl:3: …"
  std::string check;                  ///< of the last of the entries
  std::size_t whole_bytes = 0;        ///< of the file, up to the end of that line
};

/// Throws RecordError when the file cannot be read.
[[nodiscard]] JournalReading read_journal(const std::filesystem::path& path);
/// The same of its text; `path` only names it in messages.
[[nodiscard]] JournalReading parse_journal(std::string_view text, const std::string& path);

/// A line of the journal, with its end: `object`, an object of JSON without its last brace, and the check that follows
/// from it and the `check` of the line before.
[[nodiscard]] std::string chained_line(const std::string& check, std::string_view object);

/// Appends to a journal. One thread. Failures throw RecordError.
class Journal {
 public:
  /// Starts the file or continues after its last complete line, cutting off a torn one. Refuses a journal with
  /// problems.
  explicit Journal(std::filesystem::path path, FileLayer& files = disk());

  /// Returns once the line is on disk. `data` is null or an object. After a failure the partial line is cut off; if
  /// that fails too, every later call fails.
  void append(const std::string& event, const nlohmann::json& data, Nanoseconds time_ns, const std::string& utc);

  /// The entries that the file had when it was opened.
  [[nodiscard]] const JournalReading& found() const { return found_; }

 private:
  std::filesystem::path path_;
  FileLayer& files_;
  JournalReading found_;  ///< its check and its bytes follow what is appended
  std::uint64_t next_ = 1;
  bool spoilt_ = false;  ///< part of a line follows
  Descriptor file_;
};

}  // namespace kphi::results
