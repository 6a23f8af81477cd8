// journal.jsonl: what happened in a campaign, one JSON object per line, appended and synced one by one. Each line ends
// with a checksum over itself and the line before it, so that a changed, lost or moved line shows.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "results/file_layer.hpp"
#include "results/records.hpp"

namespace kphi::results {

/// Data of this event: {"file": "runs/….h5", "sha256": "…"}. verify compares every entry that holds both keys.
inline constexpr const char* kRunAccepted = "run_accepted";
inline constexpr const char* kRunAborted = "run_aborted";
/// Data: tool, files and devices of the campaign. The bench time of what follows begins anew with each of them.
inline constexpr const char* kCampaignStarted = "campaign_started";
inline constexpr const char* kCampaignResumed = "campaign_resumed";
inline constexpr const char* kCampaignFinished = "campaign_finished";

struct JournalEntry {
  std::uint64_t n = 0;      ///< 1, 2, 3 …
  Nanoseconds time_ns = 0;  ///< bench time
  std::string utc;          ///< ISO 8601, Z
  std::string event;
  nlohmann::json data;
};

struct JournalReading {
  std::vector<JournalEntry> entries;  ///< those whose checksum is right, up to the first that is not
  bool torn_last_line = false;        ///< the last line has no end: its writer died, or the power was cut (zeros
                                      ///< where nothing was written); it was never promised to anybody
  std::vector<std::string> problems;  ///< "journal.jsonl:3: …"
};

/// Throws RecordError when the file cannot be read.
[[nodiscard]] JournalReading read_journal(const std::filesystem::path& path);

/// Appends to a journal. One thread. Failures throw RecordError.
class Journal {
 public:
  /// Begins the file or goes on after its last whole line; a torn last line is cut off. Refuses a journal with
  /// problems.
  explicit Journal(std::filesystem::path path, FileLayer& files = disk());
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;
  ~Journal();

  /// On disk when this returns. `data` is null or an object. What a failure left of the line is cut off; where even
  /// that fails, every later one fails, too.
  void append(const std::string& event, const nlohmann::json& data, Nanoseconds time_ns, const std::string& utc);

  /// What the file held when it was opened.
  [[nodiscard]] const JournalReading& found() const { return found_; }

 private:
  std::filesystem::path path_;
  FileLayer& files_;
  JournalReading found_;
  std::uint64_t next_ = 1;
  std::string check_;              ///< of the last line
  std::uint64_t whole_bytes_ = 0;  ///< up to its end
  bool spoilt_ = false;            ///< part of a line lies behind them
  int descriptor_ = -1;
};

}  // namespace kphi::results
